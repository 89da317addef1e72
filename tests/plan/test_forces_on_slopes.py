"""Contact forces, plans and certificates where the ground is not level or slippery."""

from __future__ import annotations

import numpy as np
import pytest
from turning import nose_up, up_a_ramp

import gaitopt
from gaitopt import LEGS, Footholds, ForceLimits, InfeasibleStepError, Plan, Quadruped, plan_crawl
from gaitopt.plan.contact_ground import foothold_indices

SLOPE = float(np.radians(10.0))
STEEP = float(np.tan(SLOPE))


@pytest.fixture(scope="module")
def climb(wang: Quadruped) -> Plan:
    return plan_crawl(wang, up_a_ramp(wang, SLOPE, 1))


@pytest.fixture(scope="module")
def walk(wang: Quadruped) -> Plan:
    return plan_crawl(wang, gaitopt.s_columns(3, columns=2), body_height=0.4)


def over(plan: Plan, footholds: Footholds) -> Plan:
    """The same motion over other footholds."""
    return Plan(plan.robot, footholds, plan.settings, plan.phases, plan.path, plan.record)


def steepness(forces: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Tangential over normal part of forces ``(N, 4)``."""
    normal = np.einsum("nfi,nfi->nf", forces, normals)
    sliding = np.linalg.norm(forces - normal[..., None] * normals, axis=2)
    return np.divide(sliding, normal, out=np.zeros_like(normal), where=normal > 0.0)


def test_forces_on_a_slope_balance_the_robot_within_cones_about_its_normal(climb: Plan) -> None:
    """Newton's and Euler's law for the momentum by Pinocchio, at contact points on the plane."""
    import pinocchio as pin

    robot, times = climb.robot, np.linspace(0.0, climb.duration, 23)
    found = gaitopt.contact_forces(climb, times=times)
    assert found.feasible.all()
    motion, up = climb.at(times), nose_up(SLOPE)[:, 2]
    points = motion.feet - robot.foot_radius * up
    # The plane goes through the world's origin.
    np.testing.assert_allclose(points[found.standing] @ up, 0.0, atol=1e-5)
    data = robot.model.createData()
    for i, q in enumerate(motion.q):
        a = _accelerations(climb, times[i])
        pin.computeCentroidalMomentumTimeVariation(robot.model, data, q, *a)
        com = pin.centerOfMass(robot.model, data, q)
        force = found.forces[i].sum(axis=0) + robot.mass * robot.model.gravity.linear
        moment = np.cross(points[i] - com, found.forces[i])[found.standing[i]].sum(axis=0)
        np.testing.assert_allclose(force, data.dhg.linear, atol=1e-6)
        np.testing.assert_allclose(moment, data.dhg.angular, atol=1e-6)
    normals = np.tile(up, (len(times), 4, 1))
    assert (steepness(found.forces, normals)[found.standing] <= 0.6 + 1e-9).all()


def _accelerations(plan: Plan, time: float) -> tuple[np.ndarray, np.ndarray]:
    """Velocity and acceleration in Pinocchio's vectors."""
    from gaitopt.dynamics.whole_body import motion_of_path

    rows = (plan.path.evaluate(np.array([time]), k) for k in range(3))
    moved = motion_of_path(plan.robot, *rows)
    return np.asarray(moved.v)[0], np.asarray(moved.a)[0]


def test_the_walk_up_a_slope_is_certified_with_its_normals(climb: Plan) -> None:
    certificate = gaitopt.verify(climb)
    assert certificate.ok, certificate.report()


def test_the_certificate_finds_normals_that_are_false(climb: Plan, wang: Quadruped) -> None:
    false = up_a_ramp(wang, SLOPE, 1, falsify=float(np.radians(18.0)))
    found = gaitopt.verify(over(climb, climb.footholds.with_(normals=false.normals)))
    assert "contact forces" in [check.name for check in found.violations]


def test_the_certificate_finds_friction_that_is_not_there(climb: Plan) -> None:
    slippery = gaitopt.verify(over(climb, climb.footholds.with_(friction=0.9 * STEEP)))
    check = slippery["contact forces"]
    assert check in slippery.violations and "friction" in check.where
    assert f"friction 0.6, down to {0.9 * STEEP:g} on footholds" in check.note


@pytest.mark.parametrize("sides", [4, 16])
def test_a_slope_steeper_than_friction_is_refused(wang: Quadruped, sides: int) -> None:
    """Up the slope a pyramid of four sides holds 71 % of the cone, one of sixteen 98 %."""
    limits = ForceLimits(sides=sides)
    # Every side of a pyramid keeps 0.004 of the weight, of friction another 2 %, and feet that
    # carry little have little friction.
    enough = 1.3 * STEEP / limits.friction_share
    plan = plan_crawl(wang, up_a_ramp(wang, SLOPE, 1, friction=enough), forces=limits)
    assert gaitopt.verify(plan).ok
    with pytest.raises(InfeasibleStepError, match="friction") as caught:
        plan_crawl(wang, up_a_ramp(wang, SLOPE, 1, friction=0.99 * STEEP), forces=limits)
    assert any("friction" in name for name in caught.value.conflicts)


def test_vertical_normals_and_friction_enough_change_not_a_bit(wang: Quadruped, walk: Plan) -> None:
    columns = gaitopt.s_columns(3, columns=2)
    upright = {leg: np.tile([0.0, 0.0, 1.0], (2, 1)) for leg in LEGS}
    for footholds in (columns.with_(normals=upright, friction=0.6), columns.with_(friction=1.2)):
        plan = plan_crawl(wang, footholds, body_height=0.4)
        for one, other in zip(plan.path.coefficients, walk.path.coefficients, strict=True):
            np.testing.assert_array_equal(one, other)
        forces = [gaitopt.contact_forces(p, dt=0.1).forces for p in (plan, walk)]
        np.testing.assert_array_equal(*forces)
        checks = [[(c.name, c.worst) for c in gaitopt.verify(p)] for p in (plan, walk)]
        assert checks[0] == checks[1]


def test_a_slippery_foothold_gets_flatter_forces_and_others_do_not(walk: Plan) -> None:
    """The foothold that RH steps onto is slippery; where RH stood before is not."""
    columns, leg = walk.footholds, LEGS.index("RH")
    friction = {leg: np.full(2, 0.6) for leg in LEGS}
    friction["RH"][1] = 0.03
    slippery = plan_crawl(walk.robot, columns.with_(friction=friction), body_height=0.4)
    assert gaitopt.verify(slippery).ok
    times = np.linspace(0.0, slippery.duration, 400)
    found = gaitopt.contact_forces(slippery, times=times)
    on = foothold_indices(slippery, times)[:, leg] == 1
    use = steepness(found.forces, np.tile([0.0, 0.0, 1.0], (400, 4, 1)))
    assert use[found.standing[:, leg] & on, leg].max() <= 0.03 + 1e-6
    assert use[found.standing & (np.arange(4) != leg)].max() > 0.06
    assert not gaitopt.verify(over(walk, columns.with_(friction=friction))).ok


def test_forces_of_a_plan_keep_to_what_it_promises() -> None:
    """A plan within pyramids of eight sides needs forces that pyramids of four leave out."""
    robot = gaitopt.load_robot("wang2020")
    eight = gaitopt.ForceLimits(friction=0.05, sides=8)
    plan = gaitopt.plan_crawl(robot, gaitopt.s_columns(0, columns=2), forces=eight)
    own = gaitopt.contact_forces(plan)
    assert own.limits == eight and own.feasible_share == 1.0
    assert gaitopt.contact_forces(plan, gaitopt.ForceLimits()).limits == gaitopt.ForceLimits()
