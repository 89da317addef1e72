"""Faults that somebody plants into a plan file from outside: found, or listed as not judged."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

import gaitopt
from gaitopt import MotionPath, Plan, Quadruped
from gaitopt.certificate.certificate import Outcome
from gaitopt.errors import GaitoptError
from gaitopt.plan.phase import Limit

Fault = Callable[[Plan], Plan]


@pytest.fixture(scope="module")
def plan() -> Plan:
    robot = gaitopt.load_robot("wang2020")
    return gaitopt.plan_crawl(robot, gaitopt.s_columns(0, columns=2, robot=robot))


def moved(column: int, by: float) -> Fault:
    """One coordinate of the path is another all along."""

    def make(plan: Plan) -> Plan:
        coefficients = plan.path.coefficients.copy()
        coefficients[-1, :, column] += by
        return replace(plan, path=MotionPath(plan.path.times, coefficients))

    return make


def robot(name: str, attribute: str, factor: float) -> Fault:
    """Numbers of the robot's file times a factor, under a name."""

    def make(plan: Plan) -> Plan:
        urdf = re.sub(
            rf'({attribute}=")([^"]+)"',
            lambda found: f'{found[1]}{float(found[2]) * factor!r}"',
            plan.robot.urdf,
        )
        return replace(plan, robot=Quadruped.from_urdf(urdf, name, dict(plan.robot.knees)))

    return make


def setting(**changed: object) -> Fault:
    return lambda plan: replace(plan, settings=replace(plan.settings, **changed))


def phase(**by: float) -> Fault:
    """Numbers of the first phase in which a foot flies are larger by so much."""

    def make(plan: Plan) -> Plan:
        k = next(k for k, phase in enumerate(plan.phases) if phase.flying)
        told = plan.phases[k]
        changed = replace(told, **{name: getattr(told, name) + value for name, value in by.items()})
        return replace(plan, phases=(*plan.phases[:k], changed, *plan.phases[k + 1 :]))

    return make


def of_a_gait(plan: Plan) -> Plan:
    """The settings are those of a trot, which promises no static balance."""
    schedule = gaitopt.trot(0.5)
    made = gaitopt.plan_gait(gaitopt.load_robot("wang2020-fast"), schedule, velocity=(0.1, 0.0),
                             duration=0.5, timing="velocity")  # fmt: skip
    return replace(plan, settings=made.settings)


def stronger_in_memory(plan: Plan) -> Plan:
    other = Quadruped.from_urdf(plan.robot.urdf, plan.robot.name, dict(plan.robot.knees))
    other.model.velocityLimit[6:] *= 10.0
    for inertia in other.model.inertias:
        inertia.mass *= 0.01
    return replace(plan, robot=other)


def tilted(plan: Plan) -> Plan:
    """Normals lean by 0.06 rad, and the columns' tops are level."""
    lean = np.array([np.sin(0.06), 0.0, np.cos(0.06)])
    normals = {leg: np.tile(lean, (n, 1)) for leg, n in plan.footholds.counts.items()}
    return replace(plan, footholds=plan.footholds.with_(normals=normals))


FOUND: dict[str, Fault] = {
    "normals that lean on columns": tilted,
    "raised limits, its own name": robot("wang2020", "velocity", 10.0),
    "light limbs, its own name": robot("Wang2020", '<mass value', 0.01),
    "light limbs, nearly its own name": robot("wang-2020 ", '<mass value', 0.01),
    "raised limits, nearly its own name": robot("WANG_2020", "velocity", 10.0),
    "light limbs, another name": robot("another", '<mass value', 0.01),
    "weaker joints, another name": robot("another", "velocity", 0.9),
    "the body 15 cm lower": moved(2, -0.15),
    "the body pitched by 10 degrees": moved(4, np.radians(10.0)),
    "a knee bent by 2 mrad": moved(8, 2e-3),
    "settings of a gait": of_a_gait,
    "a larger margin": setting(stability_margin=0.05),
    "no margin": setting(stability_margin=0.0),
    "higher swings": setting(swing_height=0.2),
    "swings that slide": setting(swing_height=2e-4),
    "less reach": setting(reach_fraction=0.5),
    "another order": setting(sequence=("LF", "LH", "RF", "RH")),
    "a phase that starts later": phase(start=1e-3),
    "a phase of another step": phase(step=1),
    "a phase that names a foot twice": lambda p: replace(
        p, phases=(replace(p.phases[0], support=(*p.phases[0].support, "LF")), *p.phases[1:])
    ),
    "a limit that is a text": lambda p: replace(
        p, phases=(replace(p.phases[0], limited_by=(Limit("reach", "LF", "x"),)), *p.phases[1:])  # type: ignore[arg-type]
    ),
    "a bound that is a text": lambda p: replace(
        p, record=replace(p.record, cog_error_bound="1")
    ),
    "a phase elsewhere": phase(cog_start=1e-6),
    "a margin of a phase that is none": phase(margin=np.nan),
    "columns of ten metres": lambda p: replace(p, footholds=p.footholds.with_(radius=10.0)),
    "a ZMP margin that is none": lambda p: replace(
        p, record=replace(p.record, zmp_margin=np.nan)
    ),
}  # fmt: skip


def outcome(plan: Plan, fault: Fault) -> Outcome | None:
    """The verdict; ``None`` where the plan is refused."""
    try:
        return gaitopt.verify(fault(plan)).outcome
    except GaitoptError:
        return None


def test_the_plan_itself_is_certified(plan: Plan) -> None:
    assert outcome(plan, lambda same: same) is Outcome.CERTIFIED


@pytest.mark.parametrize("name", FOUND)
def test_a_fault_that_matters_is_never_certified(name: str, plan: Plan) -> None:
    assert outcome(plan, FOUND[name]) is not Outcome.CERTIFIED


@pytest.mark.parametrize(
    ("changed", "word"),
    [
        ({"body_height": 0.25}, "body height"),
        ({"heading": 0.5}, "heading"),
        ({"objective": "margin"}, "objective"),
        ({"speed": 0.01}, "speed"),
        ({"swing": "cycloid"}, "curve of the swings"),
    ],
)
def test_what_promises_nothing_is_listed(changed: dict[str, object], word: str, plan: Plan) -> None:
    certificate = gaitopt.verify(setting(**changed)(plan))
    assert certificate.outcome is Outcome.CERTIFIED
    assert word in str(certificate["not judged"])


def test_a_ground_that_was_taken_away_is_listed(plan: Plan) -> None:
    bare = replace(plan, footholds=plan.footholds.with_(radius=None))
    assert "no columns and no map" in str(gaitopt.verify(bare)["not judged"])
    assert "no columns and no map" not in str(gaitopt.verify(plan)["not judged"])


def test_an_obstacle_that_was_taken_away_is_listed() -> None:
    robot = gaitopt.load_robot("wang2020-fast")
    board = gaitopt.rectangular_obstacle(0.03, 0.03)
    stride = gaitopt.plan_stride(robot, board, approach=1, leave=1, timing="velocity")
    away = replace(stride, settings=replace(stride.settings, obstacles=()))
    told = [str(gaitopt.verify(p, collisions=False)["not judged"]) for p in (stride, away)]
    assert "obstacles, of which the plan knows none" not in told[0]
    assert "obstacles, of which the plan knows none" in told[1]


def test_a_zmp_beside_contact_forces_is_listed(plan: Plan) -> None:
    stated = replace(plan, record=replace(plan.record, zmp_margin=1.0))
    assert "the ZMP's margin" in str(gaitopt.verify(stated, collisions=False)["not judged"])


def test_margins_of_phases_are_listed(plan: Plan) -> None:
    certificate = gaitopt.verify(phase(margin=1.0)(plan))
    assert "margins of single phases" in str(certificate["not judged"])


def test_a_robot_of_no_known_name_is_listed(plan: Plan) -> None:
    certificate = gaitopt.verify(robot("another", "velocity", 10.0)(plan))
    assert "compared with no other" in str(certificate["the robot's own file"])
    # With the robot that it was made for it is refused.
    with pytest.raises(GaitoptError, match=r"wider|fingerprint"):
        gaitopt.verify(robot("another", "velocity", 10.0)(plan), plan.robot)


def test_a_name_that_only_looks_like_a_known_one_is_spelled_out(plan: Plan) -> None:
    """The third letter of this one is Cyrillic."""
    note = str(
        gaitopt.verify(robot("wa\u043fg2020", "velocity", 1.0)(plan))["the robot's own file"]
    )
    assert r"'wa\u043fg2020'" in note


def test_a_model_that_was_changed_in_memory_does_not_count(plan: Plan) -> None:
    changed, own = gaitopt.verify(stronger_in_memory(plan)), gaitopt.verify(plan)
    assert str(changed["contact forces"]) == str(own["contact forces"])
