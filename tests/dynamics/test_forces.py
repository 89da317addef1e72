"""Contact forces: known answers, symmetry, Pinocchio and another solver as judges, faults."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from proxsuite import proxqp
from stances import Stance, centre_of_mass, largest_reserve, level_feet, reference, stance

import gaitopt
from gaitopt import LEGS, Quadruped
from gaitopt.dynamics.contact_forces import ContactForces
from gaitopt.dynamics.contacts import ForceLimits
from gaitopt.dynamics.force_space import ForceProblem, force_rows, force_spaces
from gaitopt.dynamics.force_status import ForceStatus, ForceViolation
from gaitopt.dynamics.forces import ForceObjective, build_force_problem, solve_forces
from gaitopt.errors import InputError
from gaitopt.stability.zmp import whole_body_zmp

ALL = np.ones((1, 4), dtype=np.bool_)
OBJECTIVES = list(ForceObjective)


@pytest.fixture(scope="module")
def a1() -> Quadruped:
    return gaitopt.load_robot("a1")


@pytest.fixture(scope="module")
def anymal_c() -> Quadruped:
    return gaitopt.load_robot("anymal_c")


def on_feet(*legs: str) -> np.ndarray:
    return np.array([[leg in legs for leg in LEGS]])


def solved(
    robot: Quadruped,
    state: Stance,
    standing: np.ndarray = ALL,
    objective: ForceObjective | str = "smoothest",
    limits: ForceLimits | None = None,
    normals: object = (0.0, 0.0, 1.0),
) -> ContactForces:
    problem = build_force_problem(robot, state.motion, standing, limits, normals=normals)  # type: ignore[arg-type]
    return solve_forces(problem, objective)


# --- known answers ----------------------------------------------------------------------------


@pytest.mark.parametrize("objective", OBJECTIVES)
@pytest.mark.parametrize("name", ["wang2020", "a1", "anymal_c", "frog1"])
def test_at_rest_the_forces_carry_the_weight(name: str, objective: ForceObjective) -> None:
    robot = gaitopt.load_robot(name)
    state = stance(robot)
    found = solved(robot, state, objective=objective)
    assert found.status == (ForceStatus.FEASIBLE,), found
    np.testing.assert_allclose(found.forces[0].sum(axis=0), [0, 0, robot.mass * 9.81], atol=1e-8)
    com = centre_of_mass(robot, state.motion)
    points = state.feet - [0.0, 0.0, robot.foot_radius]
    moment = np.cross(points - com, found.forces[0]).sum(axis=0)
    np.testing.assert_allclose(moment, 0.0, atol=1e-8)


def test_a_symmetric_robot_puts_a_quarter_on_each_foot(wang: Quadruped) -> None:
    found = solved(wang, stance(wang, place=-wang.centre[:2]))
    share = found.forces[0] / (wang.mass * 9.81)
    np.testing.assert_allclose(share[:, 2], 0.25, atol=1e-3)
    np.testing.assert_allclose(share[:, :2], 0.0, atol=1e-3)
    assert found.reserve[0] == pytest.approx(0.25, abs=1e-3)


@pytest.mark.parametrize("objective", OBJECTIVES)
def test_on_three_level_feet_the_normal_forces_are_those_of_statics(
    anymal_c: Quadruped, objective: ForceObjective
) -> None:
    state = stance(anymal_c, place=(-0.05, 0.04))
    found = solved(anymal_c, state, on_feet("LF", "LH", "RH"), objective)
    # The loads are the COM's barycentric coordinates in the triangle of the feet.
    corners = state.feet[:3, :2]
    com = centre_of_mass(anymal_c, state.motion)[:2]
    loads = np.linalg.solve(np.vstack([corners.T, np.ones(3)]), np.append(com, 1.0))
    assert (loads > 0.05).all()
    np.testing.assert_allclose(found.forces[0, :3, 2] / (anymal_c.mass * 9.81), loads, atol=1e-9)
    np.testing.assert_array_equal(found.forces[0, 3], 0.0)
    assert found.reserve[0] == pytest.approx(loads.min(), abs=1e-9)


@pytest.mark.parametrize("objective", OBJECTIVES)
def test_the_centre_of_pressure_is_the_zero_moment_point(
    a1: Quadruped, objective: ForceObjective
) -> None:
    rng = np.random.default_rng(0)
    for _ in range(5):
        state = stance(
            a1,
            rpy=rng.uniform(-0.1, 0.1, 3),
            velocity=rng.uniform(-0.5, 0.5, 6),
            acceleration=rng.uniform(-2.0, 2.0, 6),
        )
        found = solved(a1, state, objective=objective)
        load = found.forces[0, :, 2]
        pressure = load @ state.feet[:, :2] / load.sum()
        np.testing.assert_allclose(pressure, whole_body_zmp(a1.model, *state.motion)[0], atol=1e-9)


def test_a_mirrored_motion_has_mirrored_forces(wang: Quadruped) -> None:
    rng = np.random.default_rng(1)
    mirror, turn = np.array([1.0, -1.0, 1.0]), np.array([-1.0, 1.0, -1.0])
    swapped = [LEGS.index(leg) for leg in ("RF", "RH", "LH", "LF")]
    both = np.concatenate([mirror, turn])
    place, rpy = rng.uniform(-0.02, 0.02, 2), rng.uniform(-0.1, 0.1, 3)
    velocity, acceleration = rng.uniform(-0.3, 0.3, 6), rng.uniform(-1.0, 1.0, 6)
    feet = level_feet(wang) + rng.uniform(-0.03, 0.03, (4, 3))
    one = stance(
        wang, place=place, rpy=rpy, feet=feet, velocity=velocity, acceleration=acceleration
    )
    other = stance(
        wang, place=place * mirror[:2], rpy=rpy * turn, feet=(feet * mirror)[swapped],
        velocity=velocity * both, acceleration=acceleration * both,
    )  # fmt: skip
    for objective in ("smoothest", "least torque"):
        first = solved(wang, one, objective=objective)
        second = solved(wang, other, objective=objective)
        expected = (first.forces[0] * mirror)[swapped]
        np.testing.assert_allclose(second.forces[0], expected, atol=1e-5)


# --- judges -----------------------------------------------------------------------------------


@pytest.mark.parametrize("objective", OBJECTIVES)
def test_pinocchio_agrees_that_forces_and_torques_make_the_motion(
    a1: Quadruped, objective: ForceObjective
) -> None:
    state = stance(a1, velocity=[0.3, 0.1, 0, 0.1, 0.2, 0.3], acceleration=[1, -1, 0.5, 1, 2, 1])
    found = solved(a1, state, objective=objective)
    model, data = a1.model, a1.model.createData()
    q, v, a = (x[0] for x in state.motion)
    pin.computeAllTerms(model, data, q, v)
    left = data.M @ a + data.nle
    pin.computeJointJacobians(model, data, q)
    pin.updateFramePlacements(model, data)
    for leg, force in zip(LEGS, found.forces[0], strict=True):
        frame = model.getFrameId(a1.legs[leg].foot)
        jacobian = pin.getFrameJacobian(model, data, frame, pin.LOCAL_WORLD_ALIGNED)
        moment = np.cross([0.0, 0.0, -a1.foot_radius], force)
        left -= jacobian.T @ np.concatenate([force, moment])
    left[6:] -= found.torques[0]
    np.testing.assert_allclose(left, 0.0, atol=1e-9)
    assert found.residuals.force[0] < 1e-9 and found.residuals.moment[0] < 1e-9


coordinates = st.floats(-1.0, 1.0)


@settings(max_examples=60)
@given(
    st.tuples(*[coordinates] * 8),
    st.tuples(*[coordinates] * 6),
    st.sampled_from(["four", "three", "two"]),
    st.floats(-0.3, 0.3),
    st.sampled_from(OBJECTIVES),
)
def test_random_stances_agree_with_a_linear_program_over_all_forces(
    a1: Quadruped,
    places: tuple[float, ...],
    accelerations: tuple[float, ...],
    count: str,
    slope: float,
    objective: ForceObjective,
) -> None:
    feet = level_feet(a1)
    feet[:, 2] += 0.03 * np.array(places[:4])
    state = stance(
        a1, place=0.05 * np.array(places[4:6]), rpy=(0.1 * places[6], 0.1 * places[7], 0.0),
        feet=feet, acceleration=3.0 * np.array(accelerations),
    )  # fmt: skip
    standing = {"four": ALL, "three": on_feet("LF", "RH", "RF"), "two": on_feet("LF", "RH")}[count]
    limits = ForceLimits(torque_share=0.6)
    normal = (slope, 0.0, 1.0)
    found = solved(a1, state, standing, objective, limits, normal)
    best = largest_reserve(reference(a1, state.motion, 0, standing[0], limits, normal))
    needed = limits.least_normal_shares(standing[0]).max()
    if count == "two":
        # Two feet do not make the moment that a random motion asks for, whatever else they do; but
        # it may be so small that it counts as none.
        tolerated = limits.balance_tolerance * found.weight * found.length
        assert not found.feasible[0] or found.residuals.moment[0] <= tolerated
        check_limits(found, normal)
        return
    if best is None or abs(best - needed) > 1e-6:
        assert found.feasible[0] == (best is not None and best >= needed)
    if best is not None and objective is ForceObjective.LARGEST_RESERVE:
        assert found.reserve[0] == pytest.approx(best, abs=1e-6)
    check_limits(found, normal)


def check_limits(found: ContactForces, normal: tuple[float, ...]) -> None:
    """Feasible samples keep cones, normal forces and torques, computed here once more."""
    up = np.asarray(normal) / np.linalg.norm(normal)
    for i in np.flatnonzero(found.feasible):
        forces = found.forces[i, found.standing[i]]
        pressing = forces @ up
        sliding = np.linalg.norm(forces - pressing[:, None] * up, axis=1)
        assert (sliding <= found.limits.friction * pressing + 1e-5).all()
        assert (found.friction_use[i] <= 1.0 + 1e-6).all()
        share = found.limits.least_normal_shares(found.standing[i]).max(initial=0.0)
        assert (pressing >= (share - 1e-6) * found.weight).all()
        use = np.nan_to_num(found.torque_use[i])
        assert (use <= found.limits.torque_share + 1e-6).all()


def test_each_objective_is_the_best_of_its_kind(anymal_c: Quadruped) -> None:
    state = stance(anymal_c, place=(0.04, 0.02), acceleration=[1.5, 0.5, 0, 0, 0, 0])
    found = {o: solved(anymal_c, state, objective=o) for o in OBJECTIVES}
    assert all(f.feasible.all() for f in found.values())
    norm = {o: np.linalg.norm(f.forces) for o, f in found.items()}
    torque = {o: np.linalg.norm(f.torque_use) for o, f in found.items()}
    assert min(norm, key=norm.__getitem__) is ForceObjective.SMOOTHEST
    assert min(torque, key=torque.__getitem__) is ForceObjective.LEAST_TORQUE
    reserve = {o: float(f.reserve[0]) for o, f in found.items()}
    assert max(reserve, key=reserve.__getitem__) is ForceObjective.LARGEST_RESERVE


@pytest.mark.parametrize("objective", ["smoothest", "least torque"])
def test_another_solver_finds_the_same_forces_where_limits_bind(
    a1: Quadruped, objective: str
) -> None:
    limits = ForceLimits(friction=0.1475, torque_share=0.35, reserve_on_four=0.1)
    state = stance(a1, place=(0.03, 0.02), acceleration=[1.0, 0.4, 0.0, 0.0, 0.0, 0.0])
    problem = build_force_problem(a1, state.motion, ALL, limits)
    found = solve_forces(problem, objective)
    assert found.feasible.all()
    task = reference(a1, state.motion, 0, ALL[0], limits)
    rows = np.vstack([task.rows, task.normal_rows])[:, :-1]
    least = 0.1 * a1.mass * 9.81
    high = np.concatenate([task.limits, np.full(4, -least)])
    if objective == "smoothest":
        hessian, gradient = np.eye(12), np.zeros(12)
    else:
        jacobian = problem.equations.contacts.jacobians[0, ..., 6:].reshape(12, 12)
        unit = limits.torque_share * a1.effort_limits
        by_force = -(jacobian / unit).T
        hessian = by_force.T @ by_force + 1e-4 / found.weight**2 * np.eye(12)
        gradient = by_force.T @ (problem.equations.joint_forces[0] / unit)
    scale = 1.0 / np.abs(hessian).max()
    qp = proxqp.dense.QP(12, 6, len(rows))
    qp.settings.eps_abs = 1e-9
    qp.init(hessian * scale, gradient * scale, task.equality[:, :-1], task.target, rows,
            np.full(len(rows), -1e20), high)  # fmt: skip
    qp.solve()
    # Some limit binds, or the test would be one of the free solution.
    assert np.abs(rows @ qp.results.x - high).min() < 1e-6
    np.testing.assert_allclose(found.forces[0].ravel(), qp.results.x, atol=1e-4)


def test_forces_of_many_samples_are_those_of_each(a1: Quadruped) -> None:
    states = [stance(a1, acceleration=[x, 0, 0, 0, 0, 0]).motion for x in np.linspace(-3, 3, 7)]
    motion = type(states[0])(*(np.concatenate(parts) for parts in zip(*states, strict=True)))
    standing = np.array([[True] * 4, [True, True, True, False]] * 3 + [[True, False, True, False]])
    together = solve_forces(build_force_problem(a1, motion, standing))
    for i, state in enumerate(states):
        alone = solve_forces(build_force_problem(a1, state, standing[i : i + 1]))
        np.testing.assert_allclose(together.forces[i], alone.forces[0], atol=1e-6)
        assert together.status[i] is alone.status[0]


@pytest.mark.parametrize("name", ["grip", "most"])
@pytest.mark.parametrize("given", [
    "0.5", None, np.ma.masked_equal([0.5, 0.5, 1.0, 0.5], 1.0), np.nan, -0.1, [0.5, 0.5],
])  # fmt: skip
def test_shares_of_friction_and_weight_are_numbers_that_are_known(
    a1: Quadruped, name: str, given: Any
) -> None:
    asked: dict[str, Any] = {name: given}
    with pytest.raises(InputError, match=rf"^{name} must "):
        build_force_problem(a1, stance(a1).motion, ALL, **asked)


# --- planted faults ---------------------------------------------------------------------------


def test_a_foot_that_would_have_to_pull_is_named(a1: Quadruped) -> None:
    # On LF, LH and RF the centre of mass moves over the side that is opposite to LF.
    state = stance(a1, place=(-0.04, -0.04))
    found = solved(a1, state, on_feet("LF", "LH", "RF"))
    assert found.status == (ForceStatus.NORMAL_FORCE,)
    worst = found.worst()
    assert worst is not None and worst.name == "LF" and worst.unit == "N"
    assert found.forces[0, LEGS.index("LF"), 2] < 0.0
    assert "normal force of LF at 0.000 s: exceeded by" in str(worst)
    assert "feasible at 0 % of 1 instants; worst: normal force of LF" in repr(found)


@pytest.mark.parametrize("factor, feasible", [(1.01, True), (0.99, False)])
def test_one_percent_of_friction_decides(a1: Quadruped, factor: float, feasible: bool) -> None:
    # At rest on a slope: tangential over normal force of all feet together is the slope.
    slope = 0.3
    limits = ForceLimits(friction=slope / np.cos(np.pi / 4) * factor, reserve=0.0)
    found = solved(a1, stance(a1), limits=limits, normals=(slope, 0.0, 1.0))
    assert found.feasible[0] == feasible
    if not feasible:
        assert found.status == (ForceStatus.FRICTION,)
        # What is missing is 1 % of the weight's part along the slope, of the feet together.
        along = slope / np.hypot(1.0, slope) * found.weight
        assert found.residuals.friction.sum() == pytest.approx(0.01 * along, rel=1e-3)


@pytest.mark.parametrize("objective", OBJECTIVES)
@pytest.mark.parametrize("factor, feasible", [(1.01, True), (0.99, False)])
def test_one_percent_of_torque_decides(
    anymal_c: Quadruped, factor: float, feasible: bool, objective: ForceObjective
) -> None:
    # With so much friction torque alone is in the way.
    state, friction = stance(anymal_c, place=(-0.05, 0.04), height=0.35), 3.0
    standing = on_feet("LF", "LH", "RH")
    low, high = 0.0, 1.0
    for _ in range(40):
        middle = (low + high) / 2.0
        limits = ForceLimits(friction, torque_share=middle)
        best = largest_reserve(reference(anymal_c, state.motion, 0, standing[0], limits))
        low, high = (low, middle) if best is not None else (middle, high)
    assert 0.1 < high < 0.95
    limits = ForceLimits(friction, torque_share=high * factor)
    found = solved(anymal_c, state, standing, objective, limits)
    assert found.feasible[0] == feasible
    if not feasible:
        assert found.status == (ForceStatus.TORQUE,)
        worst = found.worst()
        assert worst is not None and worst.unit == "N m"
        assert worst.name in anymal_c.joint_names and worst.share < 0.02
        conflicts = found.conflicts(0)
        assert f"torque {worst.name}" in conflicts
        assert all(name.startswith("torque") for name in conflicts)


def test_limits_that_exclude_one_another_are_named_together(anymal_c: Quadruped) -> None:
    state = stance(anymal_c, place=(-0.05, 0.04), height=0.35)
    standing = on_feet("LF", "LH", "RH")
    weak = ForceLimits(torque_share=0.3)
    found = solved(anymal_c, state, standing, limits=weak)
    conflicts = found.conflicts(0)
    assert any(name.startswith("torque") for name in conflicts)
    assert any(name.startswith("friction") for name in conflicts)
    # Lifting what is named helps, whichever kind it is.
    total = found.excess.sum()
    for more in (replace(weak, torque_share=0.31), replace(weak, friction=0.65)):
        assert solved(anymal_c, state, standing, limits=more).excess.sum() < total
    strong = solved(anymal_c, state, standing)
    assert strong.feasible[0] and strong.conflicts(0) == ()


def test_too_little_load_is_a_violation_of_the_reserve(wang: Quadruped) -> None:
    state = stance(wang, place=-wang.centre[:2])
    found = solved(wang, state, limits=ForceLimits(reserve=0.0, reserve_on_four=0.25))
    assert found.status == (ForceStatus.NORMAL_FORCE,) or found.reserve[0] == pytest.approx(0.25)
    shifted = stance(wang, place=-wang.centre[:2] + [0.03, 0.0])
    found = solved(wang, shifted, limits=ForceLimits(reserve_on_four=0.25))
    assert found.status == (ForceStatus.NORMAL_FORCE,)
    best = solved(wang, shifted, limits=ForceLimits(reserve_on_four=0.25),
                  objective="largest reserve")  # fmt: skip
    assert best.reserve[0] >= found.reserve[0] - 1e-9
    assert best.status == (ForceStatus.NORMAL_FORCE,)


# --- two feet and fewer -----------------------------------------------------------------------


def above_diagonal(robot: Quadruped, beside: float) -> Stance:
    """At rest with the COM at a distance from the line that joins LF and RH."""
    feet = level_feet(robot)
    along = feet[0, :2] - feet[2, :2]
    across = np.array([-along[1], along[0]]) / np.hypot(*along)
    place = np.zeros(2)
    for _ in range(20):
        # The base moves and the feet stay, so the legs' masses follow by a part: repeat.
        com = centre_of_mass(robot, stance(robot, place=place).motion)[:2]
        place -= across * (across @ (com - feet[0, :2]) - beside)
    return stance(robot, place=place)


@pytest.mark.parametrize("objective", OBJECTIVES)
def test_on_two_feet_a_robot_stands_on_the_line_that_joins_them(
    a1: Quadruped, objective: ForceObjective
) -> None:
    found = solved(a1, above_diagonal(a1, 0.0), on_feet("LF", "RH"), objective)
    assert found.feasible[0]
    np.testing.assert_allclose(found.forces[0].sum(axis=0), [0, 0, a1.mass * 9.81], atol=1e-6)


def test_beside_the_line_the_missing_moment_is_weight_times_distance(a1: Quadruped) -> None:
    for beside in (1e-3, -5e-3):
        found = solved(a1, above_diagonal(a1, beside), on_feet("LF", "RH"))
        assert found.status == (ForceStatus.BALANCE,)
        worst = found.worst()
        assert worst is not None and worst.name == "LF-RH"
        missing = found.weight * abs(beside)
        assert worst.amount == found.residuals.moment[0] == pytest.approx(missing, rel=1e-9)
        assert found.residuals.force[0] < 1e-9
        lenient = replace(found.limits, balance_tolerance=1.001 * abs(beside) / found.length)
        assert solved(a1, above_diagonal(a1, beside), on_feet("LF", "RH"), limits=lenient).feasible


def test_in_flight_a_robot_falls(a1: Quadruped) -> None:
    nobody = np.zeros((1, 4), dtype=np.bool_)
    still = solved(a1, stance(a1), nobody)
    assert still.status == (ForceStatus.BALANCE,)
    assert still.residuals.force[0] == pytest.approx(still.weight)
    worst = still.worst()
    assert worst is not None and worst.name == "no foot"
    assert still.reserve[0] == np.inf
    values = np.zeros((1, 18))
    falling = np.zeros((1, 18))
    falling[0, 2] = -9.81
    motion = gaitopt.dynamics.whole_body.motion_of_path(a1, values, values, falling)
    free = solve_forces(build_force_problem(a1, motion, nobody))
    assert free.feasible[0] and free.worst() is None


def test_on_one_foot_forces_are_unique(a1: Quadruped) -> None:
    found = solved(a1, stance(a1), on_feet("LF"))
    assert found.status == (ForceStatus.BALANCE,)
    assert (found.forces[0, 1:] == 0.0).all()


# --- the problem ------------------------------------------------------------------------------


def test_directions_change_no_wrench(a1: Quadruped) -> None:
    problem = build_force_problem(a1, stance(a1).motion, ALL)
    (space,) = force_spaces(problem)
    assert space.directions.shape == (1, 12, 6)
    z = np.random.default_rng(0).normal(size=(1, 6))
    forces = problem.weight * space.forces(z)
    np.testing.assert_allclose(problem.equations.residuals(forces), 0.0, atol=1e-9)
    rows = force_rows(problem, space)
    assert rows.matrix.shape == (1, 4 * 4 + 4 + 12, 6)


def test_joints_without_limits_have_no_rows_and_are_reported() -> None:
    robot = gaitopt.load_robot("solo12")
    problem = build_force_problem(robot, stance(robot).motion, ALL)
    (space,) = force_spaces(problem)
    assert force_rows(problem, space).matrix.shape == (1, 20, 6)
    for objective in OBJECTIVES:
        found = solve_forces(problem, objective)
        assert found.feasible[0]
        assert found.unlimited == robot.joint_names
        assert np.isnan(found.torque_use).all()


def test_what_does_not_fit_is_refused(a1: Quadruped) -> None:
    motion = stance(a1).motion
    problem: ForceProblem = build_force_problem(a1, motion, ALL)
    with pytest.raises(
        InputError, match="there are 'smoothest', 'least torque', 'largest reserve'"
    ):
        solve_forces(problem, "best")
    with pytest.raises(InputError, match=r"standing must be truth values \(1, 4\)"):
        build_force_problem(a1, motion, np.ones((1, 4)))
    with pytest.raises(InputError, match="times"):
        build_force_problem(a1, motion, ALL, times=[0.0, 1.0])
    with pytest.raises(InputError, match="balance_tolerance"):
        ForceLimits(balance_tolerance=0.5)


def test_every_status_says_what_to_do() -> None:
    for status in ForceStatus:
        assert status is ForceStatus.FEASIBLE or (": " in status and "; " in status.value + "; ")


def test_a_limit_of_zero_has_no_share() -> None:
    found = ForceViolation(0, 0.0, ForceStatus.TORQUE, "LF_KFE", 1.6, "N m", np.inf)
    assert found.excess == "exceeded by 1.6 N m"
    assert replace(found, share=0.25).excess == "exceeded by 1.6 N m (25 %)"
