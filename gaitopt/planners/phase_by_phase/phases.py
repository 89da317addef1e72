"""The phases of a walk in steps, a stance phase and a swing for each, and what limits them.

[Wang2020], Fig. 4: the eight phases of each cycle of a crawl.
"""

from __future__ import annotations

from collections.abc import Sequence
from types import MappingProxyType

import numpy as np

from gaitopt.conventions import LEGS, OTHER_LEGS, FloatArray, frozen, made, rotation_z
from gaitopt.inputs import check_known
from gaitopt.optimize.cog.solver import CogSolution
from gaitopt.plan.phase import CogEvidence, Limit, Phase
from gaitopt.plan.settings.crawl import CrawlSettings
from gaitopt.planners.phase_by_phase.steps import CrawlSteps
from gaitopt.robots.quadruped import Quadruped
from gaitopt.stability.margins import static_stability_margin


def crawl_phases(
    robot: Quadruped,
    settings: CrawlSettings,
    steps: CrawlSteps,
    cogs: FloatArray,
    solutions: list[CogSolution],
    times: FloatArray,
    ends: np.ndarray,
    slowest: np.ndarray,
) -> tuple[Phase, ...]:
    """The phases of a walk planned phase by phase.

    Args:
        robot, settings, steps: the walk.
        cogs: body centre before and after each stance phase ``(S + 1, 3)`` [m], heading frame.
        solutions: of the COG problems, one for each step.
        times: times of all knots ``(K,)`` [s].
        ends: index of each phase's last knot, after the first knot's ``(2 S + 1,)``.
        slowest: joint that sets the time of each interval, -1 for the speed that was asked for
            ``(K - 1,)``.
    """
    if not steps.legs:
        return ()
    ends_of_shift = np.stack([cogs[:-1], cogs[1:]])
    stance_margins = static_stability_margin(steps.feet, ends_of_shift).min(axis=0)
    triangles = np.take_along_axis(steps.feet, OTHER_LEGS[steps.indices][..., None], axis=1)
    swing_margins = static_stability_margin(triangles, cogs[1:])
    limits = speed_limits(robot, times, ends, slowest, f"{settings.speed} m/s")
    for s, solution in enumerate(solutions):
        active = tuple(_limit_of(name, solution.multipliers[name]) for name in solution.active)
        limits[2 * s] = active + limits[2 * s]
    # The body stands still during swings.
    centres = np.concatenate([cogs[:1], np.repeat(cogs[1:], 2, axis=0)])
    return step_phases(
        steps, settings.heading, times[ends], centres @ rotation_z(settings.heading).T,
        np.stack([stance_margins, swing_margins], axis=1).ravel(), limits,
        [_evidence(settings, solution) for solution in solutions],
    )  # fmt: skip


def step_phases(
    steps: CrawlSteps,
    heading: float,
    times: FloatArray,
    centres: FloatArray,
    margins: FloatArray,
    limits: Sequence[tuple[Limit, ...]] | None = None,
    evidence: Sequence[CogEvidence] | None = None,
) -> tuple[Phase, ...]:
    """A stance phase and a swing for every step.

    Args:
        steps: the steps, in the heading frame.
        heading: of the walk [rad].
        times: the begin of the first phase, then the end of every phase ``(2 S + 1,)`` [s].
        centres: body centre at these times in the world ``(2 S + 1, 3)`` [m].
        margins: least stability margin of each phase ``(2 S,)`` [m].
        limits: what holds each phase back ``(2 S)``; by default nothing is told.
        evidence: of the body centre's target at the end of each stance phase ``(S)``, if any.
    """
    to_world = rotation_z(heading).T
    # What all phases hold is checked at once. Places of phases are parts of these arrays, which
    # nobody can change; so they need not be copied.
    check_known("times and margins of phases", np.concatenate([times, margins]))
    lifted = list(
        frozen(
            check_known("feet", steps.feet[np.arange(len(steps.legs)), steps.indices] @ to_world)
        )
    )
    landed = list(frozen(check_known("footholds", steps.targets @ to_world)))
    centres_of = list(frozen(check_known("body centres", centres)))
    instants, limits = times.tolist(), limits or [()] * len(margins)
    support = {leg: tuple(other for other in LEGS if other != leg) for leg in LEGS}
    phases, least = [], margins.tolist()
    for s, leg in enumerate(steps.legs):
        a, b, c = instants[2 * s : 2 * s + 3]
        before, at_lift_off, after = centres_of[2 * s : 2 * s + 3]
        stance, swing = 2 * s, 2 * s + 1
        phases.append(
            made(
                Phase, kind="stance", leg=leg, step=s, start=a, duration=b - a, cog_start=before,
                cog_end=at_lift_off, support=LEGS, foot_start=lifted[s], foot_end=lifted[s],
                margin=least[stance], limited_by=limits[stance],
                evidence=evidence[s] if evidence else None,
            )
        )  # fmt: skip
        phases.append(
            made(
                Phase, kind="swing", leg=leg, step=s, start=b, duration=c - b,
                cog_start=at_lift_off, cog_end=after, support=support[leg], foot_start=lifted[s],
                foot_end=landed[s], margin=least[swing], limited_by=limits[swing], evidence=None,
            )
        )  # fmt: skip
    return tuple(phases)


def speed_limits(
    robot: Quadruped, times: FloatArray, ends: np.ndarray, slowest: np.ndarray, speed: str = ""
) -> list[tuple[Limit, ...]]:
    """For each phase the joints (or the given speed) that set its time, with the times of each.

    Args:
        robot: whose joints.
        times: times of all knots ``(K,)`` [s].
        ends: index of each phase's last knot, after the first knot's ``(P + 1,)``.
        slowest: joint that sets the time of each interval ``(K - 1,)``; -1 for the speed that was
            asked for.
        speed: how to name this speed.

    Returns:
        For each phase its limits; the one that holds for the longest time comes first.
    """
    changes = np.flatnonzero(np.diff(slowest)) + 1
    cuts = np.array(sorted({*changes.tolist(), *ends.tolist()}))
    found: list[dict[int, list[tuple[float, float]]]] = [{} for _ in ends[1:]]
    owners = np.searchsorted(ends, cuts[:-1], side="right") - 1
    joints, instants = slowest[cuts[:-1]].tolist(), times[cuts].tolist()
    for phase, joint, a, b in zip(
        owners.tolist(), joints, instants[:-1], instants[1:], strict=True
    ):
        if b > a:
            found[phase].setdefault(joint, []).append((a, b))
    out, names = [], robot.joint_names
    for spans, duration in zip(found, np.diff(times[ends]).tolist(), strict=True):
        limits = [
            made(
                Limit,
                kind="speed" if j < 0 else "joint velocity",
                name=speed if j < 0 else names[j],
                value=sum([b - a for a, b in pieces]) / duration,
                spans=tuple(pieces),
            )
            for j, pieces in spans.items()
        ]
        if len(limits) > 1:
            limits.sort(key=lambda limit: -limit.value)
        out.append(tuple(limits))
    return out


def _limit_of(constraint: str, multiplier: float) -> Limit:
    """A constraint of the COG problem, such as ``"reach LH"``, as a limit of a phase."""
    kind, name = constraint.split(" ", 1)
    return made(Limit, kind=kind, name=name, value=multiplier, spans=())


def _evidence(settings: CrawlSettings, solution: CogSolution) -> CogEvidence:
    """The residuals of a COG target, as a phase stores them."""
    return made(
        CogEvidence, status=str(solution.status), objective=settings.objective,
        multipliers=MappingProxyType(dict(solution.multipliers)), primal=solution.primal,
        stationarity=solution.stationarity, complementarity=solution.complementarity,
        error_bound=solution.error_bound, iterations=solution.iterations,
    )  # fmt: skip
