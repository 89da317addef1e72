"""From a plan to its folder: certificate, physics, files, report and verdict."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.markup import escape

from gaitopt.cli.results.beside import Beside
from gaitopt.cli.results.documents import (
    certificate_document,
    plan_document,
    simulation_document,
)
from gaitopt.cli.results.options import Results
from gaitopt.cli.results.report import Report
from gaitopt.cli.results.run_folder import RECORD, RunFolder, record_run
from gaitopt.cli.results.verdict import verdict_code, verdict_line
from gaitopt.cli.support import progress_bar

if TYPE_CHECKING:
    from gaitopt.certificate.certificate import Certificate
    from gaitopt.plan.plan import Plan
    from gaitopt.robots.quadruped import Quadruped
    from gaitopt.simulation.result import SimulationResult
    from gaitopt.viewing.replay.robot_shapes import Parts

PLAN = "plan.npz"
FIGURES = "figures"


@dataclass(frozen=True)
class More:
    """What is worked out while another process draws the figures of a plan.

    Attributes:
        told: more lines for people, before the verdict.
        figures: as in :class:`Delivery`.
    """

    told: tuple[str, ...] = ()
    figures: Callable[[Plan, Path], list[Path]] | None = None


@dataclass(frozen=True)
class Delivery:
    """What belongs to one plan.

    Attributes:
        plan: the plan.
        summary: the plan in one sentence.
        page: name of the replay's file.
        figures: draws the figures of the plan into a folder, and returns their files; ``None`` for
            none.
        others: more files by name: what each is, and a function that writes it.
        told: more lines for people, before the verdict.
        more: works out what else belongs to the plan, once its figures are begun.
        replay_options: more keywords of :func:`gaitopt.replay`.
        collisions: whether the certificate looks for self-collisions.
        strict: whether the exit code is 3 where the plan is not certified.
        shapes: gives the shapes of the robot without meshes, where another process reads them.
    """

    plan: Plan
    summary: str
    page: str
    figures: Callable[[Plan, Path], list[Path]] | None = None
    others: Mapping[str, tuple[str, Callable[[Path], Any]]] = field(default_factory=dict)
    told: tuple[str, ...] = ()
    more: Callable[[], More] = More
    replay_options: Mapping[str, Any] = field(default_factory=dict)
    collisions: bool = True
    strict: bool = False
    shapes: Callable[[], Parts] | None = None


def deliver(
    given: Delivery,
    folder: RunFolder,
    results: Results,
    report: Report,
    beside: Beside | None = None,
) -> int:
    """Judge a plan, write its files, and report; the value is the exit code.

    Args:
        given: what there is to deliver.
        folder, results, report: of the run.
        beside: a process that draws the figures meanwhile; this one does without.
    """
    with folder.writing() as (made, place):
        begun = [_drawn(given.figures, given.plan, made / FIGURES, results, beside)]
        more = given.more()
        begun.append(_drawn(more.figures, given.plan, made / FIGURES, results, beside))
        drawn = [figures for figures in begun if figures is not None]
        certificate, physics = judged(given.plan, given.collisions, results.simulate)
        report.add(
            plan=plan_document(given.plan), certificate=certificate_document(certificate),
            physics=None if physics is None else simulation_document(physics),
        )  # fmt: skip
        files = _write(given, made, results, physics, drawn)
        listed = {place / name: what for name, what in files.items()}
        record_run(made, _record(report, certificate, list(files)))
    report.say(escape(given.summary))
    for line in (*given.told, *more.told):
        report.say(line)
    report.files(listed)
    masses = given.plan.robot.mass > 0.0
    report.say(f"[bold]{escape(verdict_line(certificate, physics, place / PLAN, masses))}[/]")
    report.end()
    if results.show:
        show_page(place / given.page, report)
    return verdict_code(certificate, physics, given.strict)


def read_beside(beside: Beside, robot: Quadruped) -> Callable[[], Parts]:
    """Let a process read the shapes of a robot without meshes; the value waits for them."""
    from gaitopt.viewing.replay.robot_shapes import read_parts

    return beside.begin(read_parts, robot)


def judged(
    plan: Plan, collisions: bool, physics: bool
) -> tuple[Certificate, SimulationResult | None]:
    """The certificate of a plan, and its walk in physics where that is asked for."""
    from gaitopt.certificate.verify import verify

    with progress_bar("certifying") as tick:
        tick(0, 1)
        certificate = verify(plan, collisions=collisions)
    if not physics:
        return certificate, None
    from gaitopt.simulation.simulate import simulate

    with progress_bar("walking in physics") as tick:
        tick(0, 1)
        return certificate, simulate(plan)


def show_page(page: Path, report: Report) -> None:
    """Open a page in the browser, or say that this was not possible."""
    from gaitopt.viewing.replay.browser import open_in_browser

    if not open_in_browser(page):
        report.say("no browser could be started: open the file by hand")


def _drawn(
    figures: Callable[[Plan, Path], list[Path]] | None, plan: Plan, folder: Path, results: Results,
    beside: Beside | None,
) -> Callable[[], list[Path]] | None:  # fmt: skip
    """Begin to draw figures; the value waits for them, and returns their files."""
    if figures is None or results.fast:
        return None
    if beside is None:
        return partial(figures, plan, folder)
    return beside.begin(figures, plan, folder)


def _write(
    given: Delivery,
    made: Path,
    results: Results,
    physics: SimulationResult | None,
    drawn: Sequence[Callable[[], list[Path]]],
) -> dict[str, str]:
    """Write all files into a folder; what each is, by name."""
    from gaitopt.viewing.replay.replay import replay
    from gaitopt.viewing.replay.robot_shapes import remember_parts

    files = {given.page: "the replay: open it in a browser",
             PLAN: "the plan: gaitopt verify, simulate, export"}  # fmt: skip
    total = 3 + len(given.others)
    with progress_bar("writing plan, replay and figures") as tick:
        given.plan.save(made / PLAN)
        tick(1, total)
        if given.shapes is not None:
            remember_parts(given.plan.robot, given.shapes())
        simulated = {} if physics is None else {"simulated": physics}
        options = {"meshes": results.meshes, **simulated, **given.replay_options}
        replay(given.plan, made / given.page, **options)
        tick(2, total)
        for done, (name, (what, write)) in enumerate(given.others.items(), 3):
            write(made / name)
            files[name] = what
            tick(done, total)
        if drawn:
            files[FIGURES] = f"{sum(len(figures()) for figures in drawn)} figures"
        tick(total, total)
    return files


def _record(report: Report, certificate: Certificate, files: list[str]) -> dict[str, Any]:
    """What :data:`RECORD` holds: the report, without the list of the certificate's checks."""
    from gaitopt import __version__

    found = report.document["physics"]
    return {
        "gaitopt": __version__,
        "arguments": sys.argv[1:],
        "files": [*files, RECORD],
        "certificate": str(certificate.outcome),
        "physics": None if found is None else "passed" if found["passed"] else "failed",
        "plan": report.document["plan"],
    }
