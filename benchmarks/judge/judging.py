"""The verdict of the second judge: all checks of a plan."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import pinocchio as pin

import gaitopt
from benchmarks.judge import body, feet, forces, ground, sequence
from benchmarks.judge.motion import Finding, Motion
from gaitopt import GaitoptError, Plan, RobotWarning
from gaitopt.robots.catalog import robot_names

INSTANTS = 40
"""Random instants at which contact forces are looked for."""
LARGEST_SHARE = 0.25
"""Feet and landing radii of more than this share of a leg's reach say nothing."""


class Judgement(NamedTuple):
    """What the second judge says.

    Attributes:
        findings: all that was found.
        weak: settings that are so weak that a check means nothing.
        refused: why the plan cannot be judged, or ``""``.
    """

    findings: tuple[Finding, ...]
    weak: tuple[str, ...] = ()
    refused: str = ""

    @property
    def broken(self) -> list[Finding]:
        """The findings that are violations."""
        return [f for f in self.findings if f.violated]

    @property
    def verdict(self) -> str:
        """``"refused"``, ``"violated"``, ``"weak"`` or ``"holds"``."""
        if self.refused:
            return "refused"
        return "violated" if self.broken else "weak" if self.weak else "holds"


def judge(
    plan: Plan,
    seed: int = 0,
    instants: int = INSTANTS,
    closer: int = 1,
    around: Sequence[float] = (),
) -> Judgement:
    """Judge a plan at samples.

    Args:
        plan: any planner's plan.
        seed: of the instants at which contact forces are looked for.
        instants: how many there are.
        closer: how many times as many samples are taken as usual.
        around: instants around which contact forces are looked for as well [s].
    """
    try:
        motion = Motion(plan, closer)
        other = _another_robot(motion)
    except GaitoptError as error:
        return Judgement((), refused=str(error))
    if other:
        return Judgement((), refused=other)
    found = [finding for check in (
        sequence.continuity, sequence.contact_sequence, sequence.phases_agree, feet.standing_feet,
        feet.flying_feet, ground.feet_and_ground, ground.limbs, body.joints, body.reach,
        body.margins, body.zmp, body.accelerations,
    ) for finding in check(motion)]  # fmt: skip
    found += forces.contact_forces(motion, instants, np.random.default_rng(seed), around)
    return Judgement(tuple(found), tuple(_weak(motion)))


def _another_robot(motion: Motion) -> str:
    """Whether a robot with the name of a known one differs from it in mass or limits."""
    robot = motion.robot
    if robot.name not in robot_names():
        return ""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RobotWarning)
        own = gaitopt.load_robot(robot.name)
    if abs(pin.computeTotalMass(motion.model) - own.mass) > 1e-9 * own.mass:
        return f"{robot.name} has another mass"
    wider = (robot.velocity_limits > own.velocity_limits * (1 + 1e-12)).any()
    wider |= (robot.effort_limits > own.effort_limits * (1 + 1e-12)).any()
    given, known = robot.position_limits, own.position_limits
    wider |= bool((given[0] < known[0] - 1e-9).any() or (given[1] > known[1] + 1e-9).any())
    return f"{robot.name} has wider limits" if wider else ""


def _weak(motion: Motion) -> list[str]:
    """The list of ``docs/trust.md``, "What cannot be certified", as far as settings go."""
    settings, footholds = motion.plan.settings, motion.plan.footholds
    reach = min(leg.reach for leg in motion.robot.legs.values())
    limits, out = settings.promised_forces, []
    if limits is not None:
        on_four = limits.reserve / 2 if limits.reserve_on_four is None else limits.reserve_on_four
        out += ["friction"] if limits.friction > 1.5 else []
        out += ["reserve"] if limits.reserve < 0.005 or on_four < 0.0025 else []
    if settings.static and settings.stability_margin < 1e-3:
        out.append("stability margin")
    if settings.swing_height < 1e-3:
        out.append("swing height")
    if max(footholds.landing_radius, motion.robot.foot_radius) > LARGEST_SHARE * reach:
        out.append("landing radius or foot radius")
    told = motion.plan.record.zmp_margin
    states = settings.zmp_margin is None and limits is None and told is not None
    return [*out, *(["ZMP margin"] if states and told <= 0.0 else [])]
