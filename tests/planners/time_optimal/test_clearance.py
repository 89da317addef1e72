"""Feet that fly on free curves keep their clearance between knots, too."""

from __future__ import annotations

import numpy as np
import pytest

import gaitopt
from gaitopt import LEGS, Plan, Quadruped, plan_route


def lowest_outside(plan: Plan) -> float:
    """Least height of a flying foot above the higher column, outside the columns' radius [m].

    Every 2 ms, and more often where a path has short pieces.
    """
    radius, least = plan.footholds.landing_radius, np.inf
    pieces = plan.path.times[:-1] + np.diff(plan.path.times) * np.linspace(0, 1, 5)[:, None]
    motion = plan.at(np.unique(np.append(np.arange(0.0, plan.duration, 0.002), pieces)))
    for phase in plan.phases:
        if phase.kind == "swing":
            inside = (motion.t >= phase.start) & (motion.t <= phase.end)
            foot = motion.feet[inside, LEGS.index(phase.leg)]
            ends = np.stack([phase.foot_start, phase.foot_end])
            away = np.linalg.norm(foot[:, None, :2] - ends[:, :2], axis=2).min(axis=1)
            high = foot[away > radius, 2] - ends[:, 2].max()
            least = min(least, float(high.min(initial=np.inf)))
    return least


@pytest.mark.parametrize("variant", ["swing", "height", "posture", "dynamic"])
def test_free_feet_keep_their_clearance(plans: dict[str, Plan], variant: str) -> None:
    """20 mm above the higher column; what plans tell is no more than what is seen."""
    least = lowest_outside(plans[variant])
    assert 0.02 <= plans[variant].record.clearance <= least < 0.022


@pytest.mark.parametrize(
    ("variant", "limit", "clearance", "jitter"),
    [("swing", None, 0.05, 0.03), ("posture", None, 0.05, 0.03), ("swing", 6.0, 0.02, 0.03),
     ("posture", 6.0, 0.02, 0.03), ("dynamic", None, 0.02, 0.03), ("dynamic", None, 0.05, 0.0)],
)  # fmt: skip
def test_a_large_clearance_and_uneven_columns_are_kept_clear_of(
    wang: Quadruped, variant: str, limit: float | None, clearance: float, jitter: float
) -> None:
    """A foot far below its goal cuts a large corner as a spline; in joint space it flies an arc."""
    footholds = gaitopt.s_columns(0, columns=2, height_jitter=jitter)
    plan = plan_route(
        wang,
        footholds,
        free=variant,
        clearance=clearance,
        acceleration_limit=limit,
        timing="velocity",
    )
    least = lowest_outside(plan)
    assert clearance <= plan.record.clearance <= least
    check = gaitopt.verify(plan, collisions=False)["swing clearance"]
    assert check.status == "ok" and check.worst <= least


def test_windows_keep_the_clearance(wang: Quadruped) -> None:
    footholds = gaitopt.s_columns(1, columns=3, height_jitter=0.03)
    plan = plan_route(wang, footholds, free="dynamic", horizon=4, timing="velocity")
    assert 0.02 <= plan.record.clearance <= lowest_outside(plan)
