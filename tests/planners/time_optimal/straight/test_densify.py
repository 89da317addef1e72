"""The dense path of a straight walk."""

from __future__ import annotations

import numpy as np
import pytest

from gaitopt import Footholds, Quadruped, SolverError
from gaitopt.motion.body_and_feet import slip_between
from gaitopt.plan.settings.freedoms import VARIANTS
from gaitopt.plan.settings.time_optimal import RouteSettings
from gaitopt.planners.phase_by_phase.timing import SLIP_TOLERANCE
from gaitopt.planners.time_optimal.build import build_route
from gaitopt.planners.time_optimal.straight.densify import densify
from gaitopt.planners.time_optimal.walk import prepare_route


@pytest.mark.parametrize("variant", ["route", "overlap", "swing"])
def test_every_piece_takes_what_its_slowest_joint_needs(
    wang: Quadruped, short: Footholds, variant: str
) -> None:
    settings = RouteSettings(free=VARIANTS[variant], timing="velocity")
    knots, problem = build_route(prepare_route(wang, short, settings))
    dense = densify(wang, settings, knots, problem.legs, problem.poses)
    need = np.abs(np.diff(dense.joints, axis=0)) / wang.velocity_limits
    assert np.diff(dense.times) == pytest.approx(need.max(axis=1), abs=1e-9)
    slowest = need[np.arange(len(need)), dense.slowest_joint]
    assert slowest == pytest.approx(need.max(axis=1), abs=1e-9)


def test_standing_feet_slip_no_more_than_the_tolerance(wang: Quadruped, short: Footholds) -> None:
    settings = RouteSettings(free=VARIANTS["swing"], timing="velocity")
    knots, problem = build_route(prepare_route(wang, short, settings))
    dense = densify(wang, settings, knots, problem.legs, problem.poses)
    pieces = np.diff(dense.at_knots)
    interval = np.repeat(np.arange(len(pieces)), pieces)
    stands = knots.flying_on_intervals.at(interval).stands
    slip = slip_between(wang, dense.values, knots.feet[interval], stands)
    assert 0.1 * SLIP_TOLERANCE < slip.max() <= SLIP_TOLERANCE


def test_the_path_passes_through_the_poses(wang: Quadruped, short: Footholds) -> None:
    settings = RouteSettings(free=VARIANTS["posture"], timing="velocity")
    knots, problem = build_route(prepare_route(wang, short, settings))
    dense = densify(wang, settings, knots, problem.legs, problem.poses)
    assert dense.body_centre[dense.at_knots] == pytest.approx(problem.poses[:, :3], abs=1e-12)
    joints = problem.legs.joints(problem.poses, knots.feet, knots.in_air).reshape(-1, 12)
    columns = wang.leg_joint_columns
    assert dense.joints[dense.at_knots][:, columns] == pytest.approx(joints, abs=1e-9)
    path = dense.motion_path()
    assert path.times[-1] == pytest.approx(dense.times[-1])


def test_poses_out_of_reach_are_refused(wang: Quadruped, short: Footholds) -> None:
    settings = RouteSettings(free=VARIANTS["swing"], timing="velocity")
    knots, problem = build_route(prepare_route(wang, short, settings))
    poses = problem.poses.copy()
    poses[5, 2] += 1.0
    with pytest.raises(SolverError, match="standing feet leave their places"):
        densify(wang, settings, knots, problem.legs, poses)
