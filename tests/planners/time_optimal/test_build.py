"""What a problem looks at, and its first guess."""

from __future__ import annotations

import numpy as np
import pytest

from gaitopt import Footholds, Plan, Quadruped, plan_crawl
from gaitopt.optimize.route.legs import BODY, FOOT, ORIENTATION, StackedLegs
from gaitopt.plan.settings.freedoms import VARIANTS
from gaitopt.plan.settings.time_optimal import RouteSettings
from gaitopt.planners.time_optimal.build import MOST_TILT, build_route, with_reach_limits
from gaitopt.planners.time_optimal.walk import prepare_route


@pytest.mark.parametrize("reach_fraction", [0.7, 0.9, 1.0])
def test_a_limit_of_the_knee_is_a_limit_of_reach(wang: Quadruped, reach_fraction: float) -> None:
    """At its limit of bending each leg is as long as the share of its reach."""
    legs = with_reach_limits(StackedLegs.of(wang), reach_fraction)
    for i, leg in enumerate(wang.legs.values()):
        ends = [legs.low[i], legs.high[i]]
        lengths = []
        for knee in ends:
            angles = np.array([[0.0, 0.3, knee[2]]])
            lengths.append(float(np.sqrt(leg.straightness(*leg.forward(angles)[0]))))
        assert max(lengths) == pytest.approx(reach_fraction * leg.reach, rel=1e-9)


def test_the_first_guess_is_the_walk_planned_phase_by_phase(
    wang: Quadruped, short: Footholds
) -> None:
    route = prepare_route(
        wang, short, RouteSettings(free=VARIANTS["route"], stance_knots=2, timing="velocity")
    )
    knots, problem = build_route(route)
    crawl: Plan = plan_crawl(wang, short, body_height=0.40, timing="velocity")
    targets = np.array([phase.cog_end for phase in crawl.phases])
    assert problem.poses[knots.phase_ends[1:], BODY] == pytest.approx(targets, abs=1e-6)
    # The foot is on a vertical or level edge of its box.
    top = np.maximum(short["RH"][0, 2], short["RH"][1, 2]) + route.settings.swing_height
    lift_off, touchdown = knots.flights[0].tolist()
    foot = problem.poses[lift_off + 1 : touchdown, FOOT]
    on_top = np.abs(foot[:, 2] - top) < 1e-12
    above_end = np.linalg.norm(foot[:, None, :2] - short["RH"][:2, :2], axis=2).min(axis=1) < 1e-12
    assert (on_top | above_end).all() and on_top.any() and above_end.any()


@pytest.mark.parametrize("variant", VARIANTS)
def test_what_is_not_free_is_no_unknown(wang: Quadruped, short: Footholds, variant: str) -> None:
    settings = RouteSettings.for_robot(wang, free=variant, timing="velocity")
    knots, problem = build_route(prepare_route(wang, short, settings))
    unknown = problem.unknown >= 0
    assert not unknown[0].any() and unknown[1:, :2].all()
    assert unknown[1:, 2].all() == unknown[:, 2].any() == settings.free.height
    assert unknown[1:, ORIENTATION].all() == unknown[:, ORIENTATION].any() == settings.free.posture
    in_air = knots.in_air.any(axis=1)
    assert np.array_equal(unknown[:, FOOT].all(axis=1), in_air & settings.free.swing)
    during_swing = [slice(a, b + 1) for a, b in knots.flights.tolist()]
    shared = [len(np.unique(problem.unknown[span, 0])) == 1 for span in during_swing]
    assert all(shared) != settings.free.overlap


def test_rows_hold_feet_and_body_where_they_are_to_be(wang: Quadruped, short: Footholds) -> None:
    """A foot above its column, one outside it, one too low; a body that is tilted too far."""
    route = prepare_route(
        wang, short, RouteSettings(free=VARIANTS["posture"], swing_knots=8, timing="velocity")
    )
    knots, problem = build_route(route)
    first = int(knots.flights[0, 0]) + 1
    poses = problem.poses.copy()
    foothold = short["RH"][0]
    radius, clearance = short.landing_radius, route.settings.clearance

    def violated(pose: np.ndarray) -> int:
        poses[first] = pose
        values = problem.rows.values(poses)[problem.rows.knot == first]
        # The body is as near to the sides as it may be, but for the reserve.
        return int((values < -1e-4).sum())

    good = problem.poses[first].copy()
    good[FOOT] = foothold + np.array([0.0, 0.0, clearance + 0.01])
    beside, low, tilted = good.copy(), good.copy(), good.copy()
    beside[FOOT.start] += 1.1 * radius
    low[FOOT.stop - 1] = foothold[2] + 0.5 * clearance
    tilted[ORIENTATION.start] = 1.1 * MOST_TILT
    assert violated(good) == 0
    assert violated(beside) == violated(low) == violated(tilted) == 1
