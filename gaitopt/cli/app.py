"""The command line: all commands of ``gaitopt``, and how errors are reported.

An error that the user can correct is printed as one line without a traceback; the exit code is 2.
"""

from __future__ import annotations

import re
import sys
import warnings
from shutil import get_terminal_size
from textwrap import fill
from typing import Annotated, TextIO

import typer

from gaitopt.cli.crawl import compare, walk
from gaitopt.cli.demo import demo
from gaitopt.cli.export import export
from gaitopt.cli.gait import gait, trot
from gaitopt.cli.interrupts import STOPPED, end_stopped, was_stopped
from gaitopt.cli.plans import figures, replay, simulate, verify
from gaitopt.cli.race import race
from gaitopt.cli.robot import robot
from gaitopt.cli.robot_options import in_options
from gaitopt.cli.stride import stride
from gaitopt.cli.study import study
from gaitopt.cli.terrain import terrain
from gaitopt.errors import GaitoptError, RobotWarning, StudyWarning

app = typer.Typer(
    name="gaitopt",
    help="Plan the fastest statically stable walk of a four-legged robot over given footholds.",
    epilog="Start with: gaitopt demo",
    rich_markup_mode="rich",
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)

app.command()(demo)
app.command()(walk)
app.command()(trot)
app.command()(gait)
app.command()(stride)
app.command()(terrain)
app.command()(race)
app.command()(compare)
app.command()(verify)
app.command()(simulate)
app.command()(replay)
app.command()(figures)
app.command()(export)
app.command()(study)
app.command()(robot)


def main() -> None:
    """Run the command that ``sys.argv`` names, and exit.

    The exit code is that of the command; 2 after an error that the user can correct; 130 after
    Ctrl-C.
    """
    warnings.showwarning = _show_warning
    try:
        code = app(standalone_mode=False)
    except (KeyboardInterrupt, typer.Abort) as stopped:
        # Typer takes the end of any file for Ctrl-D. Nothing here asks, so it is a fault.
        if isinstance(stopped.__cause__, EOFError) and not was_stopped():
            raise stopped.__cause__ from None
        sys.exit(end_stopped())
    except Exception as error:
        if was_stopped():
            # A library made it of Ctrl-C, in the middle of an import for instance.
            sys.exit(end_stopped())
        # Errors of Typer's own copy of click have no public class. They have this method.
        click_message = getattr(error, "format_message", None)
        if click_message is None and not isinstance(error, GaitoptError):
            raise
        text = in_options(str(error)) if click_message is None else _plain(click_message())
        _tell(f"gaitopt: {text}")
        sys.exit(2)
    # Typer makes this code of Ctrl-C, without a word.
    sys.exit(end_stopped() if code == STOPPED else code if isinstance(code, int) else 0)


def _plain(text: str) -> str:
    """A message of Typer without the words of pydantic, by which it checks values."""
    return re.sub(r"Value error, |, unable to parse string as \w+ \w+", "", text)


def _show_warning(
    message: Warning | str,
    category: type[Warning],
    filename: str,
    lineno: int,
    file: TextIO | None = None,
    line: str | None = None,
) -> None:
    """Print a warning of gaitopt in one line, and others as Python does."""
    if issubclass(category, (RobotWarning, StudyWarning)):
        _tell(f"gaitopt: warning: {in_options(str(message))}")
    else:
        sys.stderr.write(warnings.formatwarning(message, category, filename, lineno, line))


def _tell(text: str) -> None:
    """Print a message as one line, which in a terminal is broken between words."""
    line = " ".join(text.split())
    if sys.stderr.isatty():
        line = fill(line, get_terminal_size().columns, break_long_words=False,
                    break_on_hyphens=False)  # fmt: skip
    print(line, file=sys.stderr)


def _show_version(wanted: bool) -> None:
    """Print the version and exit, if the option was given."""
    if wanted:
        from gaitopt import __version__

        print(f"gaitopt {__version__}")
        raise typer.Exit()


@app.callback(invoke_without_command=True)
def options(
    context: typer.Context,
    version: Annotated[
        bool,
        typer.Option("--version", help="Show the version.", callback=_show_version, is_eager=True),
    ] = False,
) -> None:
    """Plan the fastest statically stable walk of a four-legged robot over given footholds."""
    if context.invoked_subcommand is None:
        print(context.get_help())
