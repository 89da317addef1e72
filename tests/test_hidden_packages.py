"""Modules that hide those which gaitopt needs are named, with both places."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

CODE = """
import gaitopt
try:
    gaitopt.load_robot("wang2020")
except gaitopt.MissingPackageError as error:
    print(error)
"""


@pytest.mark.parametrize(
    ("module", "package", "text"),
    [("pinocchio", "pin", "x = 1"), ("casadi", "casadi", "1 / 0"), ("mujoco", "mujoco", None)],
)
def test_another_module_of_that_name_is_told_with_both_places(
    tmp_path: Path, module: str, package: str, text: str | None
) -> None:
    hiding = tmp_path / module / "__init__.py"
    hiding.parent.mkdir()
    if text is not None:
        hiding.write_text(text)
    else:
        hiding = tmp_path / f"{module}.py"
        hiding.write_text("")
        (tmp_path / module).rmdir()
    done = subprocess.run(
        [sys.executable, "-c", CODE], capture_output=True, text=True, timeout=600, check=False,
        env={**os.environ, "PYTHONPATH": str(tmp_path)},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith(
        f"the module {module} at {hiding} hides that of the package {package} in "
    )
    assert "take its folder out of PYTHONPATH" in done.stdout


DRAWN = """
import gaitopt
robot = gaitopt.load_robot("wang2020")
plan = gaitopt.plan_crawl(robot, gaitopt.s_columns(0, columns=2), timing="velocity")
try:
    gaitopt.show(plan)
except gaitopt.MissingPackageError as error:
    print(error)
"""


@pytest.mark.parametrize("module", ["meshcat", "yourdfpy"])
def test_modules_that_only_replays_need_are_told_when_one_is_drawn(
    tmp_path: Path, module: str
) -> None:
    (tmp_path / f"{module}.py").write_text("raise ImportError")
    done = subprocess.run(
        [sys.executable, "-c", DRAWN], capture_output=True, text=True, timeout=600, check=False,
        env={**os.environ, "PYTHONPATH": str(tmp_path)},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith(f"the module {module} at {tmp_path / module}.py hides that of")
