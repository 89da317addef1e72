"""The phases of a crawl, with what limits each of them: eight a cycle ([Wang2020], Fig. 4)."""

from __future__ import annotations

import numpy as np

from gaitopt.conventions import LEGS, OTHER_LEGS, FloatArray, rotation_z
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
    """A stance and a swing phase for every step.

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
    count = len(steps.legs)
    ends_of_shift = np.stack([cogs[:-1], cogs[1:]])
    stance_margins = static_stability_margin(steps.feet, ends_of_shift).min(axis=0)
    triangles = np.take_along_axis(steps.feet, OTHER_LEGS[steps.indices][..., None], axis=1)
    swing_margins = static_stability_margin(triangles, cogs[1:])
    to_world = rotation_z(settings.heading).T
    lifted = steps.feet[np.arange(count), steps.indices] @ to_world
    landed, centres = steps.targets @ to_world, cogs @ to_world
    limits = _speed_limits(robot, settings, times, ends, slowest)
    phases = []
    for s, (leg, solution) in enumerate(zip(steps.legs, solutions, strict=True)):
        a, b, c = (float(times[ends[2 * s + k]]) for k in range(3))
        active = tuple(_limit_of(name, solution.duals[name]) for name in solution.active)
        phases.append(
            Phase("stance", leg, s, a, b - a, centres[s], centres[s + 1], LEGS, lifted[s],
                  lifted[s], float(stance_margins[s]), active + limits[2 * s],
                  _evidence(settings, solution))
        )  # fmt: skip
        support = tuple(other for other in LEGS if other != leg)
        phases.append(
            Phase("swing", leg, s, b, c - b, centres[s + 1], centres[s + 1], support, lifted[s],
                  landed[s], float(swing_margins[s]), limits[2 * s + 1])
        )  # fmt: skip
    return tuple(phases)


def _limit_of(constraint: str, multiplier: float) -> Limit:
    """A constraint of the COG problem, such as ``"reach LH"``, as a limit of a phase."""
    kind, name = constraint.split(" ", 1)
    return Limit(kind, name, multiplier)


def _evidence(settings: CrawlSettings, solution: CogSolution) -> CogEvidence:
    """The residuals of a COG target, as a phase stores them."""
    return CogEvidence(
        str(solution.status), settings.objective, solution.duals, solution.primal,
        solution.stationarity, solution.complementarity, solution.error_bound,
        solution.iterations,
    )  # fmt: skip


def _speed_limits(
    robot: Quadruped,
    settings: CrawlSettings,
    times: FloatArray,
    ends: np.ndarray,
    slowest: np.ndarray,
) -> list[tuple[Limit, ...]]:
    """For each phase the joints (or the given speed) that set its time, with the times of each.

    The limit that holds for the longest time comes first. Arguments are those of
    :func:`crawl_phases`.
    """
    changes = np.flatnonzero(np.diff(slowest)) + 1
    cuts = np.union1d(changes, ends)
    found: list[dict[int, list[tuple[float, float]]]] = [{} for _ in ends[1:]]
    owners = np.searchsorted(ends, cuts[:-1], side="right") - 1
    joints, instants = slowest[cuts[:-1]].tolist(), times[cuts].tolist()
    for i, phase in enumerate(owners.tolist()):
        if instants[i + 1] > instants[i]:
            found[phase].setdefault(joints[i], []).append((instants[i], instants[i + 1]))
    out = []
    for spans, a, b in zip(found, times[ends[:-1]], times[ends[1:]], strict=True):
        limits = [
            Limit(
                "speed" if j < 0 else "joint velocity",
                f"{settings.speed} m/s" if j < 0 else robot.joint_names[j],
                sum(e - s for s, e in pieces) / float(b - a),
                tuple(pieces),
            )
            for j, pieces in spans.items()
        ]
        out.append(tuple(sorted(limits, key=lambda limit: -limit.value)))
    return out
