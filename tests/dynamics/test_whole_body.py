"""The equations of motion, held against Pinocchio and finite differences."""

from __future__ import annotations

import ctypes
import re
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

import gaitopt
from gaitopt import LEGS, Quadruped
from gaitopt.certificate.force_samples import sample_forces
from gaitopt.dynamics.contact_geometry import contact_geometry
from gaitopt.dynamics.whole_body import (
    Motion,
    equations_of_motion,
    motion_of_path,
    path_dynamics,
)
from gaitopt.errors import InputError
from gaitopt.robots.whole_body import feet_from_joints

ROBOTS = ["wang2020", "a1", "anymal_c", "frog1"]
SAMPLES = 12


@pytest.fixture(scope="module", params=ROBOTS)
def robot(request: pytest.FixtureRequest) -> Quadruped:
    return gaitopt.load_robot(request.param)


def random_path(robot: Quadruped, seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Values of a path, and two derivatives, at random."""
    rng = np.random.default_rng(seed)
    shape = (SAMPLES, 6 + len(robot.joint_names))
    values = rng.uniform(-1.0, 1.0, shape)
    return values, rng.normal(size=shape), rng.normal(size=shape)


def random_motion(robot: Quadruped, seed: int) -> Motion:
    return motion_of_path(robot, *random_path(robot, seed))


def test_velocities_and_accelerations_are_derivatives_of_the_configuration(
    robot: Quadruped,
) -> None:
    values, first, second = random_path(robot, 1)
    model, step = robot.model, 1e-5

    def at(time: float) -> Motion:
        return motion_of_path(
            robot,
            values + time * first + time**2 / 2 * second,
            first + time * second,
            second,
        )

    now, before, after = at(0.0), at(-step), at(step)
    for i in range(SAMPLES):
        # The velocity is that of the configuration, in the tangent space at the middle.
        ahead = pin.difference(model, now.q[i], after.q[i])
        back = pin.difference(model, now.q[i], before.q[i])
        np.testing.assert_allclose((ahead - back) / (2 * step), now.v[i], atol=1e-8)
        # Pinocchio's acceleration is the derivative of the velocity's numbers.
        np.testing.assert_allclose((after.v[i] - before.v[i]) / (2 * step), now.a[i], atol=1e-7)
        # Over a longer time, with velocity and acceleration, the motion agrees to third order.
        for time in (1e-3, 2e-3):
            step_taken = pin.integrate(model, now.q[i], time * now.v[i] + time**2 / 2 * now.a[i])
            gap = pin.difference(model, step_taken, at(time).q[i])
            assert np.abs(gap).max() < 50.0 * time**3


def test_generalised_forces_are_those_of_the_mass_matrix(robot: Quadruped) -> None:
    motion = random_motion(robot, 2)
    equations = equations_of_motion(robot, motion)
    model, data = robot.model, robot.model.createData()
    for i, (q, v, a) in enumerate(zip(*motion, strict=True)):
        pin.computeAllTerms(model, data, q, v)
        np.testing.assert_allclose(equations.forces[i], data.M @ a + data.nle, atol=1e-9)


def test_feet_points_and_jacobians_are_those_of_pinocchio(robot: Quadruped) -> None:
    motion = random_motion(robot, 3)
    rng = np.random.default_rng(0)
    normals = rng.normal(size=(SAMPLES, 4, 3)) + np.array([0.0, 0.0, 3.0])
    found = contact_geometry(robot, motion.q, normals)
    unit = normals / np.linalg.norm(normals, axis=-1, keepdims=True)
    np.testing.assert_allclose(found.normals, unit, atol=1e-15)
    model, data = robot.model, robot.model.createData()
    for i, q in enumerate(motion.q):
        pin.computeJointJacobians(model, data, q)
        pin.updateFramePlacements(model, data)
        for k, leg in enumerate(LEGS):
            frame = model.getFrameId(robot.legs[leg].foot)
            arm = -robot.foot_radius * unit[i, k]
            np.testing.assert_allclose(
                found.points[i, k], data.oMf[frame].translation + arm, atol=1e-9
            )
            jacobian = pin.getFrameJacobian(model, data, frame, pin.LOCAL_WORLD_ALIGNED)
            # The contact point is carried by the foot: v + w x arm.
            moved = jacobian[:3] + np.cross(jacobian[3:].T, arm).T
            np.testing.assert_allclose(found.jacobians[i, k], moved, atol=1e-9)


def test_jacobians_are_derivatives_of_the_feet(robot: Quadruped) -> None:
    values, first, _ = random_path(robot, 4)
    step = 1e-6
    feet = [
        feet_from_joints(robot, y[:, :3], y[:, 3:6], y[:, 6:])
        for y in (values - step * first, values + step * first)
    ]
    motion = motion_of_path(robot, values, first, 0.0 * first)
    # Without a ball the contact point is the foot frame itself.
    points = contact_geometry(robot, motion.q).points + np.array([0.0, 0.0, robot.foot_radius])
    np.testing.assert_allclose(points, (feet[0] + feet[1]) / 2.0, atol=1e-9)
    if robot.foot_radius == 0.0:
        speeds = np.einsum("nlkv,nv->nlk", contact_geometry(robot, motion.q).jacobians, motion.v)
        np.testing.assert_allclose(speeds, (feet[1] - feet[0]) / (2 * step), atol=1e-7)


def test_torques_and_residuals_balance_the_equations_of_motion(robot: Quadruped) -> None:
    motion = random_motion(robot, 5)
    equations = equations_of_motion(robot, motion)
    forces = np.random.default_rng(1).normal(size=(SAMPLES, 4, 3)) * 50.0
    torques, residuals = equations.torques(forces), equations.residuals(forces)
    model, data = robot.model, robot.model.createData()
    for i, (q, v, a) in enumerate(zip(*motion, strict=True)):
        pin.computeAllTerms(model, data, q, v)
        left = data.M @ a + data.nle
        for jacobian, force in zip(equations.contacts.jacobians[i], forces[i], strict=True):
            left -= jacobian.T @ force
        left[:6] -= residuals[i]
        left[6:] -= torques[i]
        np.testing.assert_allclose(left, 0.0, atol=1e-9)


def test_along_a_path_the_equations_are_linear_in_acceleration_and_squared_speed(
    robot: Quadruped,
) -> None:
    values, first, second = random_path(robot, 6)
    dynamics = path_dynamics(robot, values, first, second)
    rng = np.random.default_rng(2)
    u, speed = rng.normal(size=SAMPLES), rng.uniform(0.0, 2.0, SAMPLES)
    # In time the path has the derivatives q' s' and q'' s'^2 + q' s''.
    rates = first * speed[:, None]
    accelerations = second * speed[:, None] ** 2 + first * u[:, None]
    direct = equations_of_motion(robot, motion_of_path(robot, values, rates, accelerations))
    np.testing.assert_allclose(dynamics.at(u, speed**2).forces, direct.forces, atol=1e-9)
    assert len(dynamics) == len(direct) == SAMPLES
    at_rest = pin.computeGeneralizedGravity(
        robot.model, robot.model.createData(), motion_of_path(robot, values, first, second).q[0]
    )
    np.testing.assert_allclose(dynamics.at(0.0, 0.0).forces[0], at_rest, atol=1e-9)


def test_a_robot_in_free_fall_needs_no_force(robot: Quadruped) -> None:
    columns = 6 + len(robot.joint_names)
    values = np.random.default_rng(3).uniform(-0.5, 0.5, (1, columns))
    falling = np.zeros((1, columns))
    falling[0, 2] = -9.81
    equations = equations_of_motion(
        robot, motion_of_path(robot, values, np.zeros((1, columns)), falling)
    )
    np.testing.assert_allclose(equations.forces, 0.0, atol=1e-9)


def test_without_openmp_pinocchio_gives_the_same_forces(
    robot: Quadruped, monkeypatch: pytest.MonkeyPatch
) -> None:
    rng, model = np.random.default_rng(3), robot.model
    q = np.array([pin.neutral(model)] * 5)
    motion = Motion(q, *rng.normal(size=(2, 5, model.nv)))
    forces = equations_of_motion(robot, motion).forces
    monkeypatch.delattr(pin, "rneaInParallel")
    assert np.array_equal(equations_of_motion(robot, motion).forces, forces)
    nothing = Motion(q[:0], *np.zeros((2, 0, model.nv)))
    assert equations_of_motion(robot, nothing).forces.shape == (0, model.nv)


def test_openmp_keeps_its_number_of_threads(robot: Quadruped) -> None:
    """Other libraries of a program compute with it, too."""
    mapped = Path("/proc/self/maps")
    lines = mapped.read_text().splitlines() if mapped.exists() else []
    paths = {line.split()[-1] for line in lines if re.search(r"/lib[gi]?omp[^/]*\.so", line)}
    for library in map(ctypes.CDLL, sorted(paths)):
        before = library.omp_get_max_threads()
        library.omp_set_num_threads(3)
        try:
            values = np.zeros((4, 6 + len(robot.joint_names)))
            equations_of_motion(robot, motion_of_path(robot, values, values, values))
            sample_forces(robot, values, values, values)
            assert library.omp_get_max_threads() == 3
        finally:
            library.omp_set_num_threads(before)


def test_inputs_that_do_not_fit_are_refused(wang: Quadruped) -> None:
    values = np.zeros((3, 18))
    with pytest.raises(InputError, match="values must be"):
        motion_of_path(wang, values[:, :17], values, values)
    with pytest.raises(InputError, match="one length: 3, 2, 3"):
        motion_of_path(wang, values, values[:2], values)
    with pytest.raises(InputError, match="second must be finite; row 1"):
        motion_of_path(wang, values, values, np.where(np.arange(3)[:, None] == 1, np.nan, values))
    motion = motion_of_path(wang, values, values, values)
    with pytest.raises(InputError, match=r"v must be \(3, 18\)"):
        equations_of_motion(wang, motion._replace(v=motion.v[:2]))
    with pytest.raises(InputError, match="normals must fit"):
        equations_of_motion(wang, motion, np.ones((3, 3, 3)))


def test_arrays_are_read_only(wang: Quadruped) -> None:
    values = np.zeros((1, 18))
    dynamics = path_dynamics(wang, values, values, values)
    for array in (dynamics.gravity, dynamics.contacts.jacobians, dynamics.at(0, 0).forces):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1.0
