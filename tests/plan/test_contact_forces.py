"""Contact forces of real plans, held against a linear program over all forces."""

from __future__ import annotations

import numpy as np
import pytest
from stances import largest_reserve, reference

import gaitopt
from gaitopt import Plan, Quadruped
from gaitopt.conventions import GRAVITY
from gaitopt.dynamics.contacts import ForceLimits
from gaitopt.dynamics.force_status import ForceStatus
from gaitopt.dynamics.forces import ForceObjective
from gaitopt.dynamics.whole_body import motion_of_path
from gaitopt.errors import InputError
from gaitopt.stability.zmp import whole_body_zmp

INSTANTS = 25
ROBOTS = ["wang2020", "a1", "go2", "anymal_c"]


@pytest.fixture(scope="module", params=ROBOTS)
def walk(request: pytest.FixtureRequest) -> Plan:
    robot = gaitopt.load_robot(request.param)
    return gaitopt.plan_crawl(
        robot, gaitopt.s_columns(0, columns=3, robot=robot), timing="velocity"
    )


@pytest.mark.parametrize("torque_share", [0.9, 0.45])
def test_random_instants_agree_with_a_linear_program(walk: Plan, torque_share: float) -> None:
    times = np.sort(np.random.default_rng(0).uniform(0.0, walk.duration, INSTANTS))
    limits = ForceLimits(torque_share=torque_share)
    found = {
        o: gaitopt.contact_forces(walk, limits, times=times, objective=o) for o in ForceObjective
    }
    motion = motion_of_path(walk.robot, *(walk.path.evaluate(times, order) for order in range(3)))
    for i in range(INSTANTS):
        standing = found[ForceObjective.SMOOTHEST].standing[i]
        best = largest_reserve(reference(walk.robot, motion, i, standing, limits))
        needed = limits.least_normal_shares(standing).max()
        if best is None or abs(best - needed) > 1e-6:
            feasible = best is not None and best >= needed
            assert all(f.feasible[i] == feasible for f in found.values())
        if best is not None:
            reserve = found[ForceObjective.LARGEST_RESERVE].reserve[i]
            assert reserve == pytest.approx(best, abs=1e-6)


def test_forces_sum_to_mass_times_acceleration(walk: Plan) -> None:
    found = gaitopt.contact_forces(walk, dt=0.05)
    motion = motion_of_path(
        walk.robot, *(walk.path.evaluate(found.times, order) for order in range(3))
    )
    assert (found.residuals.force < 1e-8 * found.weight).all()
    assert (found.residuals.moment < 1e-8 * found.weight).all()
    # Levelled to one height, the moment of all forces vanishes at the ZMP.
    places = walk.at(found.times).feet - np.array([0.0, 0.0, walk.robot.foot_radius])
    total, moment = found.forces.sum(axis=1), np.cross(places, found.forces).sum(axis=1)
    upward = total[:, 2] > 0.1 * found.weight
    pressure = np.stack([-moment[:, 1], moment[:, 0]], axis=1)[upward] / total[upward, 2:]
    zmp = whole_body_zmp(walk.robot.model, *motion)[upward]
    assert len(zmp) > 0.9 * len(found)
    np.testing.assert_allclose(pressure, zmp, atol=1e-8)


def test_the_walk_of_the_paper_has_forces_throughout(plan: Plan) -> None:
    found = gaitopt.contact_forces(plan, dt=0.1)
    assert found.feasible.all() and found.worst() is None
    assert found.unlimited == ()
    assert set(found.status) == {ForceStatus.FEASIBLE}
    # While a foot flies, all others keep what was asked; the plan keeps 20 mm of margin.
    assert found.reserve.min() >= 0.02
    assert repr(found) == f"ContactForces(feasible at 100 % of {len(found)} instants)"
    np.testing.assert_allclose(
        found.forces.sum(axis=1)[:, 2].mean(), plan.robot.mass * GRAVITY, rtol=1e-3
    )


def test_joints_move_along_polylines_so_their_velocity_jumps(plan: Plan) -> None:
    found = gaitopt.contact_forces(plan, times=[0.0, 1.0])
    assert found.velocity_jump == pytest.approx(plan.path.jumps(1).max())
    assert found.velocity_jump > 0.1


def test_a_robot_that_is_too_heavy_for_its_joints_is_found(short_plan: Plan) -> None:
    text = short_plan.robot.urdf.replace('effort="75"', 'effort="15"').replace(
        'effort="50"', 'effort="15"'
    )
    weak = Quadruped.from_urdf(text, "weak")
    found = gaitopt.contact_forces(
        Plan(weak, short_plan.footholds, short_plan.settings, short_plan.phases, short_plan.path),
        dt=0.5,
    )
    assert 0.0 < found.feasible_share < 1.0
    worst = found.worst()
    assert worst is not None and worst.time == found.times[worst.sample]
    conflicts = found.conflicts(worst.sample)
    assert any(name.startswith("torque") for name in conflicts)
    kinds = {v.kind for v in found.violations()}
    assert ForceStatus.TORQUE in kinds


def test_times_outside_the_plan_are_refused(short_plan: Plan) -> None:
    with pytest.raises(InputError, match="times must be"):
        gaitopt.contact_forces(short_plan, times=[-1.0])
    with pytest.raises(InputError, match="dt must be"):
        gaitopt.contact_forces(short_plan, dt=0.0)
