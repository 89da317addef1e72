"""The phases of a walk that is straight between knots."""

from __future__ import annotations

import numpy as np

from gaitopt.conventions import LEGS, rotation_z
from gaitopt.plan.phase import Limit, Phase
from gaitopt.plan.settings.time_optimal import RouteSettings
from gaitopt.planners.phase_by_phase.steps import CrawlSteps
from gaitopt.planners.time_optimal.balance import dense_com
from gaitopt.planners.time_optimal.dense import Dense
from gaitopt.planners.time_optimal.knots import RouteKnots
from gaitopt.robots.quadruped import Quadruped
from gaitopt.stability.margins import static_stability_margin


def route_phases(
    robot: Quadruped,
    settings: RouteSettings,
    steps: CrawlSteps,
    knots: RouteKnots,
    dense: Dense,
) -> tuple[Phase, ...]:
    """A stance and a swing phase for every step, with the margin of what the settings say."""
    if not steps.legs:
        return ()
    to_world = rotation_z(settings.heading).T
    at = dense.knots[knots.ends]
    world = dense.centre @ to_world
    held = dense_com(robot, settings, dense) if settings.true_com else dense.centre
    phases = []
    for s, leg in enumerate(steps.legs):
        i = int(steps.indices[s])
        lifted, landed = steps.feet[s, i] @ to_world, steps.targets[s] @ to_world
        for kind in ("stance", "swing"):
            a, b = (int(v) for v in at[2 * s + (kind == "swing") :][:2])
            support = LEGS if kind == "stance" else tuple(x for x in LEGS if x != leg)
            chosen = [LEGS.index(x) for x in support]
            margin = static_stability_margin(steps.feet[s, chosen], held[a : b + 1]).min()
            phases.append(Phase(
                "stance" if kind == "stance" else "swing", leg, s, float(dense.times[a]),
                float(dense.times[b] - dense.times[a]), world[a], world[b], support, lifted,
                landed if kind == "swing" else lifted, float(margin),
                _limits(robot, dense, a, b),
            ))  # fmt: skip
    return tuple(phases)


def _limits(robot: Quadruped, dense: Dense, a: int, b: int) -> tuple[Limit, ...]:
    """The joints at their velocity limit between two dense knots, with the times."""
    total = float(dense.times[b] - dense.times[a])
    if total <= 0.0:
        return ()
    spans: dict[int, list[tuple[float, float]]] = {}
    slowest = dense.slowest[a:b]
    cuts = np.concatenate([[0], np.flatnonzero(np.diff(slowest)) + 1, [len(slowest)]]) + a
    for i, j in zip(cuts[:-1].tolist(), cuts[1:].tolist(), strict=True):
        begin, end = float(dense.times[i]), float(dense.times[j])
        if end > begin:
            spans.setdefault(int(dense.slowest[i]), []).append((begin, end))
    limits = [
        Limit("joint velocity", robot.joint_names[j], sum(e - s for s, e in pieces) / total,
              tuple(pieces))
        for j, pieces in spans.items()
    ]  # fmt: skip
    return tuple(sorted(limits, key=lambda limit: -limit.value))
