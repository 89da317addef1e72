"""Studies that are stopped, killed, run twice at once, or find their table damaged."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from gaitopt import InputError, StudyError, StudyWarning
from gaitopt.cli import interrupts
from gaitopt.cli import study as study_command
from gaitopt.robots.catalog import own_urdf
from gaitopt.studies import tables
from gaitopt.studies.study import HEADER, Row, Walk, grid, run_study, run_walk
from gaitopt.studies.table_lock import locked
from gaitopt.studies.workers import on_all_cores, process_count

PATIENCE = 600.0
"""Longest wait for what a process does [s]: nothing here depends on how fast the machine is."""
SOON = 120.0
"""Longest wait for workers to be gone [s]. Idle ones that nobody ends stay for five minutes."""
COMMAND = [sys.executable, "-m", "gaitopt", "study", "t.csv"]


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """Walks that need no time; the duration is the mass of the robot."""

    def quick_walk(walk: Walk) -> Row:
        from gaitopt.studies.robots import study_robot

        return Row("ok", duration=study_robot(walk.robot).mass)

    monkeypatch.setattr("gaitopt.studies.study.run_walk", quick_walk)


@pytest.mark.parametrize("jobs", [0, -2, 1.5, "2", None, True])
def test_numbers_of_processes_that_are_none(jobs: object, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="jobs must be -1, for one process on each core, or a who"):
        run_study(grid(range(1)), tmp_path / "t.csv", jobs=jobs)  # type: ignore[arg-type]
    assert list(tmp_path.iterdir()) == []


def test_there_are_never_more_processes_than_cores() -> None:
    assert process_count(1) == 1
    assert process_count(100_000) == process_count(-1) <= (os.cpu_count() or 1)


@pytest.mark.usefixtures("quick")
def test_a_row_belongs_to_the_content_of_the_robots_file(tmp_path: Path) -> None:
    robot, table = tmp_path / "mine.urdf", tmp_path / "t.csv"
    text = own_urdf("wang2020").read_text()
    robot.write_text(text)
    walks = grid(range(2), robots=(str(robot),))
    light = run_study(walks, table, jobs=1)
    assert run_study(walks, table, jobs=1) == light
    robot.write_text(text.replace('mass value="', 'mass value="1'))
    heavy = run_study(walks, table, jobs=1)
    assert float(heavy[0]["duration"]) > 1.5 * float(light[0]["duration"])
    moved = tmp_path / "elsewhere" / "mine.urdf"
    moved.parent.mkdir()
    moved.write_text(text)
    assert run_study(grid(range(2), robots=(str(moved),)), table, jobs=1) == light
    assert len(table.read_text().splitlines()) == 5


@pytest.mark.usefixtures("quick")
def test_a_row_counts_as_kept_from_when_it_is_in_the_table(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Ctrl-C may come while the system is still writing a row down, before it is told."""
    table, written, sync = tmp_path / "t.csv", [], os.fsync
    run_study(grid(range(1)), table, jobs=1)
    monkeypatch.setattr(interrupts, "_kept", [])

    def stop_at_the_second(handle: int) -> None:
        sync(handle)
        written.append(handle)
        if len(written) == 2:
            raise KeyboardInterrupt

    monkeypatch.setattr(tables.os, "fsync", stop_at_the_second)
    with (
        pytest.raises(KeyboardInterrupt),
        study_command._counting(table, 4) as progress,
    ):
        assert "keeps 0 of 4 walks" in interrupts._farewell()
        run_study(grid(range(4)), table, jobs=1, progress=progress)
    assert len(table.read_text().splitlines()) == 1 + 3
    assert "keeps 3 of 4 walks" in interrupts._farewell()


def test_a_robot_that_changes_while_a_study_runs_is_an_error_row(tmp_path: Path) -> None:
    from gaitopt.studies.robots import contents_of, expecting

    robot = tmp_path / "mine.urdf"
    text = own_urdf("wang2020").read_text()
    robot.write_text(text)
    with expecting(contents_of([str(robot)])):
        robot.write_text(text.replace('mass value="', 'mass value="1'))
        row = run_walk(Walk(robot=str(robot), columns=2))
    assert row.status == "error" and "another robot here than where the study began" in row.message


def test_two_studies_never_write_to_one_table(tmp_path: Path) -> None:
    table = tmp_path / "t.csv"
    with locked(table), pytest.raises(InputError) as caught:
        run_study(grid(range(1), columns=2), table)
    assert f"another study writes to {table}: process {os.getpid()} on " in str(caught.value)
    assert list(tmp_path.iterdir()) == []
    (tmp_path / ".t.csv.lock").write_text("process 1 on a machine that lost its power")
    with locked(table):
        pass
    assert list(tmp_path.iterdir()) == []


@pytest.mark.usefixtures("quick")
def test_damaged_lines_are_told_with_their_numbers(tmp_path: Path) -> None:
    table = tmp_path / "t.csv"
    whole = run_study(grid(range(5)), table, jobs=1)
    lines = table.read_bytes().split(b"\n")
    lines[2] = lines[2][:40]  # a row that is too short
    lines[3] = lines[3].replace(b"ok", b'o"k\xff')  # no UTF-8
    lines[4] = lines[4].replace(b",3,17,", b",4,17,")  # a seed that is not that of its key
    lines.insert(1, b'"a quotation mark that never ends')
    table.write_bytes(b"\n".join(lines))
    with pytest.warns(StudyWarning) as told:
        again = run_study(grid(range(5)), table, jobs=1)
    assert again == whole
    texts = [str(each.message) for each in told]
    assert f"{table}: lines 2, 4, 5: damaged, and not counted; what belongs there" in texts[0]
    assert f"{table}: line 6: fields that are not those of the line's key" in texts[1]


@pytest.mark.usefixtures("quick")
def test_a_full_disk_leaves_whole_rows(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    table, written = tmp_path / "t.csv", []

    def full(handle: int) -> None:
        written.append(handle)
        if len(written) > 3:
            raise OSError(28, "No space left on device")

    monkeypatch.setattr(tables.os, "fsync", full)
    with pytest.raises(InputError, match="No space left on device; all rows before this one are"):
        run_study(grid(range(5)), table, jobs=1)
    lines = table.read_text().split("\n")
    assert len(lines) == 5 and lines[-1] == "" and lines[0] == ",".join(HEADER)


@pytest.mark.skipif(process_count(2) < 2, reason="on one core all works in this process")
def test_a_worker_that_is_ended_is_one_line() -> None:
    with pytest.raises(StudyError, match="a worker process was ended from outside"):
        list(on_all_cores(exec, [("import os; os.kill(os.getpid(), 9)",)] * 2, 2))


@pytest.mark.skipif(os.name != "posix", reason="signals are blocked as on POSIX")
def test_workers_are_deaf_to_ctrl_c_before_they_have_imported_anything() -> None:
    """In a new process, which has not started Python's own process that clears up."""
    code = (
        "import signal\n"
        "from gaitopt.studies.workers import on_all_cores\n"
        "def deaf():\n"
        "    return signal.SIGINT in signal.pthread_sigmask(signal.SIG_BLOCK, [])\n"
        "print(set(on_all_cores(deaf, [()] * 3, 2)))\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True,
                          timeout=PATIENCE, check=False)  # fmt: skip
    assert done.stdout == "{True}\n", done.stderr


def test_the_exit_code_tells_when_every_walk_is_an_error(tmp_path: Path) -> None:
    done = subprocess.run([*COMMAND, "--seeds", "1", "--robot", "nope"], cwd=tmp_path, text=True,
                          capture_output=True, timeout=PATIENCE, check=False)  # fmt: skip
    assert done.returncode == 2
    assert done.stderr.startswith("gaitopt: every walk ended in an error; the first: RobotError")
    study_command._exit_where_all_failed([{"status": "error", "message": ""}, {"status": "ok"}])


def _children(pid: int) -> list[int]:
    found = []
    for each in Path("/proc").iterdir():
        if each.name.isdigit():
            try:
                state = (each / "stat").read_text().rsplit(") ", 1)[1].split()
            except OSError:
                continue
            if int(state[1]) == pid and state[0] not in "ZX":
                found += [int(each.name), *_children(int(each.name))]
    return found


def _alive(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rsplit(") ", 1)[1][0] not in "ZX"
    except OSError:
        return False


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="needs /proc to see processes")
@pytest.mark.parametrize(
    ("number", "group"),
    [
        (signal.SIGINT, True), (signal.SIGTERM, False), (signal.SIGHUP, True),
        (signal.SIGKILL, False),
    ],
    ids=["Ctrl-C", "kill", "closed terminal", "kill -9"],
)  # fmt: skip
def test_a_signal_ends_a_study_and_its_workers(
    tmp_path: Path, number: signal.Signals, group: bool
) -> None:
    process = subprocess.Popen(
        [*COMMAND, "--seeds", "500", "--jobs", "2"], cwd=tmp_path, text=True,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, start_new_session=True,
    )  # fmt: skip
    table = tmp_path / "t.csv"
    try:
        until = time.monotonic() + PATIENCE
        while not (table.exists() and table.read_text().count("\n") > 1):
            assert time.monotonic() < until and process.poll() is None
            time.sleep(0.05)
        started, written = _children(process.pid), table.read_text().count("\n") - 1
        (os.killpg if group else os.kill)(process.pid, number)
        _, said = process.communicate(timeout=PATIENCE)
        until = time.monotonic() + SOON
        while any(map(_alive, started)) and time.monotonic() < until:
            time.sleep(0.05)
        assert not any(map(_alive, started))
    finally:
        process.kill()
    rows = table.read_text().split("\n")
    assert rows[-1] == "" and all(row.count(",") >= len(HEADER) - 1 for row in rows[1:-1])
    if number != signal.SIGKILL:
        assert process.returncode == 130
        told = re.fullmatch(r"gaitopt: stopped; t\.csv keeps (\d+) of 500 walks, and the same "
                            r"command goes on there\n", said)  # fmt: skip
        # Rows may have been written before they were counted, and while the words were said.
        assert told and written - 1 <= int(told[1]) <= len(rows) - 2, said


def test_words_in_brackets_are_no_markup_of_tables() -> None:
    """``pip install 'gaitopt[sim]'`` in a caption, and robots that are named ``[bold]``."""
    from rich.table import Table

    table = Table(title="[red]", caption="a[sim] [/]")
    table.add_column("robot [m]")
    table.add_row("[bold]")
    for words in ("[red]", "a[sim] [/]", "robot [m]", "[bold]"):
        assert words in tables.as_text(table)
