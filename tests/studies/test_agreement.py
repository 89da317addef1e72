"""Planner, certificate and physics judge the same walks; where they disagree, it is told."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from benchmarks.physics.force_rows import ROBOTS
from gaitopt.studies.agreement import Disagreement, agreement_table, agreements, disagreements
from gaitopt.studies.result_table import Columns
from gaitopt.studies.study import Row, Walk, grid, run_study
from gaitopt.studies.tables import as_text

HEADER = Columns(Walk, Row).names


def row(**cells: Any) -> dict[str, str]:
    """A row of a study, as text by column."""
    empty = dict.fromkeys(HEADER, "")
    return {**empty, "robot": "go2", "duration": "3.0", **{k: str(v) for k, v in cells.items()}}


@pytest.mark.parametrize(
    ("cells", "found"),
    [
        ({"outcome": "certified", "passed": True}, ()),
        ({"outcome": "certified", "passed": False}, (Disagreement.FAILED,)),
        ({"outcome": "violated", "warned": "a shank", "passed": False}, ()),
        ({"outcome": "violated", "warned": "a shank", "passed": True}, (Disagreement.STRICTER,)),
        ({"outcome": "violated", "passed": False}, (Disagreement.SILENT,)),
        ({"outcome": "violated"}, (Disagreement.SILENT,)),
        # It says nothing of physics.
        ({"outcome": "kinematics only", "passed": False}, ()),
        ({"status": "infeasible", "duration": ""}, ()),
    ],
)
def test_a_planted_disagreement_is_told(cells: dict[str, Any], found: tuple[str, ...]) -> None:
    assert disagreements(row(**cells)) == found


def test_disagreements_are_counted_by_robot_and_named() -> None:
    rows = [
        row(seed=3, outcome="certified", passed=True),
        row(seed=4, outcome="certified", passed=False, message="footholds missed: 2"),
        row(seed=5, robot="hyq", outcome="violated", warned="legs touch", passed=False),
    ]
    go2, hyq = agreements(rows)
    assert dict(go2.counts) == {"walks": 2, "planned": 2, "warned": 0, "certified": 2,
                                "violated": 0, "passed": 1}  # fmt: skip
    assert go2.named == ("go2, seed 4: certified, and fails in physics: footholds missed: 2",)
    assert hyq.counts["violated"] == hyq.counts["warned"] == 1 and hyq.named == ()
    text = as_text(agreement_table(rows))
    assert "go2, seed 4: certified, and fails" in text
    assert "agree on all 1 walks that all three judged" in as_text(agreement_table(rows[:1]))


def test_walks_that_were_not_judged_are_no_agreement() -> None:
    refused = row(status="infeasible", duration="")
    assert "no walk was judged by all three" in as_text(agreement_table([refused]))


@pytest.mark.parametrize(
    "robot", [name if name == "go2" else pytest.param(name, marks=pytest.mark.slow)
              for name in ROBOTS]
)  # fmt: skip
def test_planner_certificate_and_physics_agree(robot: str, tmp_path: Path) -> None:
    """A study of one walk of each robot. Torques of solo12 are unknown, so it is not certified."""
    pytest.importorskip("mujoco")
    walks = grid([1], robots=(robot,), columns=2, timing="forces", collisions=True, simulate=True)
    [found] = run_study(walks, tmp_path / "study.csv", jobs=1)
    assert disagreements(found) == ()
    assert found["passed"] == "True" and found["status"] == "ok", found["message"]
    assert found["outcome"] == ("not all checked" if robot == "solo12" else "certified")
