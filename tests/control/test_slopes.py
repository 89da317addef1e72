"""Following a plan on ground that is not level: forces about its normals, contacts, rolling."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import gaitopt
from gaitopt import LEGS, ForceLimits, Plan
from gaitopt.control.build import build_reference
from gaitopt.control.forces import ForceDistribution
from gaitopt.control.gains import ControlGains
from gaitopt.control.nearest_forces import NearestForces
from gaitopt.control.tracking import TrackingController
from gaitopt.dynamics.contact_geometry import contact_geometry
from gaitopt.motion.rolling import rolled_away
from gaitopt.plan.contact_ground import ground_below

DT = 0.006
WEIGHT, LENGTH, FRICTION = 250.0, 0.2, 0.5
FEET = np.array([[0.2, 0.15, -0.4], [-0.2, 0.15, -0.4], [-0.2, -0.15, -0.4], [0.2, -0.15, -0.4]])
DOWN = np.array([0.0, 0.0, WEIGHT, 0.0, 0.0, 0.0])


def grasp(feet: np.ndarray) -> np.ndarray:
    """Wrench about the origin of unit forces at ``feet``."""
    moments = np.cross(feet[:, None], np.eye(3))
    return np.concatenate([np.tile(np.eye(3), (4, 1)), moments.reshape(12, 3)], axis=1).T


def turn(tilt: float, towards: float) -> np.ndarray:
    """The shortest rotation of the vertical by an angle towards a direction."""
    axis = np.array([-np.sin(towards), np.cos(towards), 0.0])
    cross = np.cross(np.eye(3), axis).T
    turned: np.ndarray = np.eye(3) + np.sin(tilt) * cross + (1.0 - np.cos(tilt)) * cross @ cross
    return turned


def turned(matrix: np.ndarray, wrench: np.ndarray, by: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The same feet and the same wrench after everything was turned."""
    both = np.kron(np.eye(2), by)
    return both @ matrix @ np.kron(np.eye(4), by.T), both @ wrench


@pytest.mark.parametrize("seed", range(8))
def test_forces_turn_with_the_world(seed: int) -> None:
    """Feet, wrench and ground turned together: the forces are the same, turned; also at limits."""
    rng = np.random.default_rng(seed)
    by = turn(rng.uniform(0.1, 0.6), rng.uniform(0.0, 2.0 * np.pi))
    wrench = DOWN + rng.normal(0.0, 0.4, 6) * WEIGHT * np.array([1, 1, 0.2, 0.1, 0.1, 0.1])
    load, friction = np.array([1.0, 1.0, 0.6, 1.0]), np.full(4, FRICTION)
    normals = np.tile(by[:, 2], (4, 1))
    other, other_wrench = turned(grasp(FEET), wrench, by)
    level = ForceDistribution(WEIGHT, LENGTH, FRICTION)
    sloped = ForceDistribution(WEIGHT, LENGTH, 0.9)
    sloped.stand_on(normals, friction)
    ours = level.share(grasp(FEET), wrench, load)
    theirs = sloped.share(other, other_wrench, load)
    assert theirs.status == ours.status
    # Moments are turned as wholes, but weighted alike.
    assert theirs.forces @ by == pytest.approx(ours.forces, abs=1e-4 * WEIGHT)

    planned = rng.uniform([-9, -9, 30], [9, 9, 80], (4, 3))
    near, far = (NearestForces(WEIGHT, LENGTH, ForceLimits(friction=f)) for f in (0.4, 0.9))
    far.stand_on(normals, np.full(4, 0.4))
    contacts = np.array([True, True, True, seed % 2 == 0])
    one = near.share(grasp(FEET), wrench, load, planned, contacts)
    two = far.share(other, other_wrench, load, planned @ by.T, contacts)
    assert two.forces @ by == pytest.approx(one.forces, abs=1e-4 * WEIGHT)
    assert two.status == one.status


def test_each_foot_keeps_to_its_own_cone() -> None:
    rng = np.random.default_rng(3)
    normals = np.array([turn(0.3, a)[:, 2] for a in (0.0, 1.5, 3.0, 4.5)])
    friction = np.array([0.3, 0.5, 0.7, 0.4])
    for _ in range(10):
        wrench = DOWN + rng.normal(0.0, 1.0, 6) * WEIGHT * np.array([1, 1, 0.2, 0.1, 0.1, 0.1])
        plain = ForceDistribution(WEIGHT, LENGTH, 0.6)
        plain.stand_on(normals, friction)
        nearest = NearestForces(WEIGHT, LENGTH, ForceLimits(reserve_on_four=0.01))
        nearest.stand_on(normals, friction)
        planned = 0.25 * WEIGHT * normals
        every = np.ones(4, dtype=bool)
        for forces, least in (
            (plain.share(grasp(FEET), wrench, np.ones(4)).forces, 0.0),
            (nearest.share(grasp(FEET), wrench, np.ones(4), planned, every).forces, 0.01),
        ):
            pressing = np.einsum("ij,ij->i", forces, normals)
            along = np.linalg.norm(forces - pressing[:, None] * normals, axis=1)
            assert (along <= friction * pressing + 1e-4 * WEIGHT).all()
            assert (pressing >= (least - 1e-4) * WEIGHT).all()


@pytest.fixture(scope="module")
def sloped(a1_walk: Plan) -> Plan:
    """The walk of a1 as if the ground had another normal below each foothold."""
    rng = np.random.default_rng(5)
    normals = {leg: [turn(rng.uniform(0.1, 0.4), a)[:, 2] for a in rng.uniform(0.0, 6.0, n)]
               for leg, n in a1_walk.footholds.counts.items()}  # fmt: skip
    friction = {leg: rng.uniform(0.5, 0.8, n) for leg, n in a1_walk.footholds.counts.items()}
    footholds = a1_walk.footholds.with_(normals=normals, friction=friction)
    return replace(a1_walk, footholds=footholds)


def test_contacts_are_where_the_ground_touches_the_balls(sloped: Plan) -> None:
    """The controller's Jacobians are those of the package's dynamics at these normals."""
    controller = TrackingController(sloped, dt=DT)
    reference = controller.reference
    for tick in range(reference.lead, len(reference), 60):
        q = np.concatenate([reference.position[tick], [0, 0, 0, 1], reference.joints[tick]])
        controller._stand_on(tick)
        _, jacobian, _ = controller._dynamics(tick, q)
        normals = reference.normals[tick]
        theirs = contact_geometry(sloped.robot, q[None], normals[None]).jacobians[0]
        assert jacobian.reshape(4, 3, -1) == pytest.approx(theirs, abs=1e-9)


def test_the_reference_knows_the_ground_below_each_foot(sloped: Plan) -> None:
    footholds = sloped.footholds
    assert footholds.normals is not None and footholds.friction is not None
    reference = build_reference(sloped, ControlGains.for_plan(sloped), DT)
    last = len(reference) - 1
    for i, leg in enumerate(LEGS):
        for tick, k in ((0, 0), (last, -1)):
            assert reference.normals[tick, i] == pytest.approx(footholds.normals[leg][k])
            # It counts on no more than the plan promises.
            least = min(footholds.friction[leg][k], 0.6)
            assert reference.friction[tick, i] == pytest.approx(least)
    # A plan without forces is followed with no more friction than the gains have.
    plain = replace(sloped, settings=replace(sloped.settings, timing="velocity", forces=None))
    gains = ControlGains.for_robot(sloped.robot, friction=0.55)
    assert build_reference(plain, gains, DT).friction.max() == pytest.approx(0.55)


def test_balls_roll_along_the_ground(sloped: Plan) -> None:
    times = np.arange(0.0, sloped.swings[0].start, 1e-3)
    motion, normals = sloped.at(times), ground_below(sloped, times, 0.6).normals
    rolled = rolled_away(sloped.robot, motion.q, motion.v, motion.contacts, 1e-3, normals)
    off = np.einsum("nfi,nfi->nf", rolled, normals)
    assert np.abs(off).max() < 1e-12
    assert np.linalg.norm(rolled[-1], axis=1).max() > 1e-3
    level = rolled_away(sloped.robot, motion.q, motion.v, motion.contacts, 1e-3)
    assert np.abs(rolled - level).max() > 1e-4


def test_planned_forces_make_the_motion_from_where_balls_touch() -> None:
    """At rest on a slope: the sum of forces and their moments about the true contacts."""
    robot = gaitopt.load_robot("a1")
    flat = gaitopt.s_columns(0, columns=1, robot=robot)
    by = turn(0.25, 0.7)
    tilted = flat.with_(normals={leg: by[None, :, 2] for leg in LEGS})
    still = gaitopt.plan_crawl(robot, flat)
    plan = replace(still, footholds=tilted)
    reference = build_reference(plan, ControlGains.for_plan(plan), DT)
    forces = reference.forces[reference.lead]
    weight = 9.81 * robot.mass
    assert forces.sum(axis=0) == pytest.approx([0.0, 0.0, weight], abs=1e-6 * weight)
    touching = plan.at([0.0]).feet[0] - robot.foot_radius * by[:, 2]
    import pinocchio as pin

    q = plan.at([0.0]).q[0]
    com = np.array(pin.centerOfMass(robot.model, robot.model.createData(), q))
    moment = np.cross(touching - com, forces).sum(axis=0)
    assert np.abs(moment).max() < 1e-4 * weight
