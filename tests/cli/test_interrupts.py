"""Ctrl-C: commands stop, say so, and leave neither files nor workers behind."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.skipif(os.name != "posix", reason="signals are sent as on POSIX")

PATIENCE = 600.0
"""Longest wait for a process [s]: nothing here depends on how fast the machine is."""
SWALLOWS = """
import sys, time
from pathlib import Path
from gaitopt.cli import app, interrupts, start
from gaitopt.cli.results.run_folder import run_folder

def command():
    with run_folder(Path("run"), "run", False).writing() as (made, _):
        (made / "half").write_text("half")
        print("begun", flush=True)
        while True:
            try:
                time.sleep(60.0)
            except KeyboardInterrupt:
                {reaction}

app.main = command
start.main()
"""
"""A command with a library in it that does something else with the exception of Ctrl-C."""


@pytest.mark.parametrize(
    ("number", "reaction"),
    [
        (signal.SIGINT, "pass"),
        (signal.SIGTERM, "pass"),
        (signal.SIGINT, "raise TypeError('of a library') from None"),
        (signal.SIGINT, "raise"),
        (signal.SIGINT, "sys.exit(interrupts.STOPPED)"),
    ],
)
def test_a_command_stops_whatever_libraries_make_of_it(
    tmp_path: Path, number: signal.Signals, reaction: str
) -> None:
    process = subprocess.Popen(
        [sys.executable, "-c", SWALLOWS.format(reaction=reaction)], cwd=tmp_path,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    assert process.stdout is not None and process.stdout.readline() == "begun\n"
    process.send_signal(number)
    _, said = process.communicate(timeout=PATIENCE)
    assert process.returncode == 130
    if "sys.exit" not in reaction:
        assert said == "gaitopt: stopped\n"
    assert list(tmp_path.iterdir()) == []


def test_a_command_that_is_stopped_at_once_says_so(tmp_path: Path) -> None:
    """While it still imports what it needs."""
    code = (
        "import os, signal\n"
        "from gaitopt.cli import start\n"
        "import gaitopt.cli.interrupts as interrupts\n"
        "stop = interrupts.stop_on_signals\n"
        "interrupts.stop_on_signals = lambda: (stop(), os.kill(os.getpid(), signal.SIGINT))\n"
        "start.main()\n"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True,
                          text=True, timeout=PATIENCE, check=False)  # fmt: skip
    assert (done.returncode, done.stderr) == (130, "gaitopt: stopped\n")


def test_ctrl_c_while_the_command_line_is_imported_is_told_in_one_line() -> None:
    code = (
        "import os, signal, sys\n"
        "class Finder:\n"
        "    def find_spec(self, name, *_):\n"
        "        if name == 'gaitopt.files':\n"
        "            os.kill(os.getpid(), signal.SIGINT)\n"
        "from gaitopt.cli import start\n"
        "sys.meta_path.insert(0, Finder())\n"
        "start.main()\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=PATIENCE
    )
    assert done.returncode == 130
    assert done.stderr == "gaitopt: stopped\n"


def test_ctrl_c_in_a_text_that_is_run_has_the_same_exit_code(tmp_path: Path) -> None:
    """Dataclasses and named tuples run texts while they are imported."""
    (tmp_path / "interrupted.py").write_text(
        "import os, signal, time\n"
        "from gaitopt.cli import app, start\n"
        "text = 'os.kill(os.getpid(), signal.SIGINT); time.sleep(60)'\n"
        "app.main = lambda: exec(text)\n"
        "start.main()\n"
    )
    done = subprocess.run([sys.executable, "-m", "interrupted"], cwd=tmp_path, capture_output=True,
                          text=True, timeout=PATIENCE, check=False)  # fmt: skip
    assert (done.returncode, done.stderr) == (130, "gaitopt: stopped\n")


def test_an_error_that_a_library_made_of_ctrl_c_is_not_told() -> None:
    """A module that is interrupted while it is imported looks as if it were missing."""
    code = (
        "import os, signal, time\n"
        "from gaitopt.cli import app, start\n"
        "from gaitopt.errors import MissingPackageError\n"
        "def command(**_):\n"
        "    try:\n"
        "        os.kill(os.getpid(), signal.SIGINT)\n"
        "        time.sleep(60)\n"
        "    except KeyboardInterrupt:\n"
        "        raise MissingPackageError('needs the package mujoco') from None\n"
        "app.app = command\n"
        "start.main()\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=PATIENCE
    )
    assert (done.returncode, done.stderr) == (130, "gaitopt: stopped\n")


def test_a_file_that_ends_too_early_is_not_told_as_ctrl_c() -> None:
    """As bytecode that was written to a full disk."""
    code = (
        "import sys\n"
        "class Finder:\n"
        "    def find_spec(self, name, *_):\n"
        "        if name == 'gaitopt.robots.catalog':\n"
        "            raise EOFError('marshal data too short')\n"
        "from gaitopt.cli import start\n"
        "sys.meta_path.insert(0, Finder())\n"
        "sys.argv = ['gaitopt', 'robot', 'a1']\n"
        "start.main()\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True,
                          timeout=PATIENCE)  # fmt: skip
    assert done.returncode == 1 and "gaitopt: stopped" not in done.stderr
    assert done.stderr.endswith("EOFError: marshal data too short\n")


def test_workers_end_with_the_study_that_used_them() -> None:
    code = (
        "import joblib, time\n"
        "from gaitopt.studies.workers import no_workers_left\n"
        "try:\n"
        "    with no_workers_left():\n"
        "        pids = joblib.Parallel(n_jobs=2)(joblib.delayed(__import__('os').getpid)()"
        " for _ in range(4))\n"
        "        raise KeyboardInterrupt\n"
        "except KeyboardInterrupt:\n"
        "    pass\n"
        "import os\n"
        "def alive(pid):\n"
        "    try:\n"
        "        os.kill(pid, 0)\n"
        "        return open(f'/proc/{pid}/stat').read().split()[2] != 'Z'\n"
        "    except (OSError, IndexError):\n"
        "        return False\n"
        "for _ in range(1200):\n"
        "    if not any(map(alive, set(pids))):\n"
        "        print('gone')\n"
        "        break\n"
        "    time.sleep(0.1)\n"
    )
    if not Path("/proc/self/stat").exists():
        pytest.skip("needs /proc to see processes")
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True,
                          timeout=PATIENCE, check=False)  # fmt: skip
    assert done.stdout == "gone\n", done.stderr


def test_the_command_line_starts_without_what_computes() -> None:
    """So that help, completion and mistakes are quick, and Ctrl-C finds little to interrupt."""
    code = (
        "import sys, gaitopt.cli.app\n"
        "print([m for m in ('numpy', 'scipy', 'pinocchio', 'casadi', 'mujoco', 'matplotlib')"
        " if m in sys.modules])\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True,
                          timeout=PATIENCE, check=True)  # fmt: skip
    assert done.stdout == "[]\n"
