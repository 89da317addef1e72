"""Where a plan begins: a state, checked against the robot, its limits and the footholds."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gaitopt.conventions import LEGS, BoolArray, FloatArray
from gaitopt.errors import InfeasibleStateError, InputError
from gaitopt.inputs import check_kind
from gaitopt.motion.path import BASE_COLUMNS
from gaitopt.plan.state import State
from gaitopt.robots.collisions.pairs import TOUCHING, CollisionPairs
from gaitopt.robots.quadruped import Quadruped
from gaitopt.robots.rotations import rpy_to_matrix
from gaitopt.robots.whole_body import feet_from_joints, joints_from_feet
from gaitopt.terrain.footholds import Footholds

ROUNDING = 1e-6
"""Share of a velocity limit, or angle [rad], by which a state may exceed a limit: plans are known
to that."""
HIGH = 1e-3
"""How far a standing foot may be above or below its foothold [m]: the certificate allows that."""
SLIDING = 0.02
"""Fastest speed of a standing foot [m/s]. Estimated velocities are known to about a centimetre a
second; the plan begins with the base's velocity, and the joint rates of standing legs that go with
it."""
FEWEST = 2
"""Fewest feet on which a plan begins."""
SAME_GAP = 1e-6
"""Distances of links are known to that [m]."""
OTHER_SIDE = 1e-5
"""Largest difference of joint angles from those that a leg's inverse gives for its foot [rad]."""


@dataclass(frozen=True, eq=False)
class Begin:
    """A state from which a plan may begin.

    Attributes:
        robot: the robot.
        base: x, y, z, roll, pitch, yaw of the base, and their rates ``(2, 6)``.
        joints: their angles ``(nj,)`` [rad].
        feet: foot frames in the world, and their velocities, zero for those that stand
            ``(2, 4, 3)`` [m], [m/s].
        standing: which feet stand ``(4,)``.
        footholds: with the places of standing feet as their first ones.
    """

    robot: Quadruped
    base: FloatArray
    joints: FloatArray
    feet: FloatArray
    standing: BoolArray
    footholds: Footholds

    @classmethod
    def of(cls, robot: Quadruped, state: State, footholds: Footholds) -> Begin:
        """A state, with what is wrong with it refused.

        Args:
            robot: that is to walk.
            state: its state.
            footholds: their first ones are where feet stand, or land next.

        Raises:
            InputError: this is no state, or that of another robot.
            InfeasibleStateError: a joint exceeds a limit, a foot that stands is not on its
                foothold or slides, or a leg is bent to another side than planners bend it.
        """
        check_kind("start", state, State)
        if state.joint_names != robot.joint_names:
            raise InputError(
                f"start is the state of a robot with the joints {', '.join(state.joint_names)}, "
                f"and {robot.name} has {', '.join(robot.joint_names)}"
            )
        values, rates = np.array(state.columns), np.array(state.column_rates)
        _check_joints(robot, state)
        base, joints = values[:BASE_COLUMNS], values[BASE_COLUMNS:]
        feet = feet_from_joints(robot, base[:3], base[3:], joints)
        speeds = foot_velocities(robot, state)
        standing = np.array([leg in state.support for leg in LEGS])
        _check_feet(feet, speeds, standing, footholds)
        _check_sides(robot, base, joints, feet)
        speeds[standing] = 0.0
        points = {leg: np.array(footholds[leg]) for leg in LEGS}
        for i in np.flatnonzero(standing).tolist():
            points[LEGS[i]][0] = feet[i]
        return cls(robot, np.stack([base, rates[:BASE_COLUMNS]]), joints,
                   np.stack([feet, speeds]), standing, footholds.with_(points=points))  # fmt: skip

    @property
    def flying(self) -> tuple[str, ...]:
        """The legs whose feet are in the air."""
        return tuple(leg for leg, on in zip(LEGS, self.standing, strict=True) if not on)


def _check_joints(robot: Quadruped, state: State) -> None:
    """Refuse joints beyond their limits.

    Raises:
        InfeasibleStateError: names the joint, and by how much.
    """
    angles, rates = state.q[7:], state.v[6:]
    low, high = robot.position_limits
    over = np.maximum(low - angles, angles - high)
    worst = int(over.argmax())
    if over[worst] > ROUNDING:
        name, end = robot.joint_names[worst], high if angles[worst] > high[worst] else low
        raise InfeasibleStateError(
            f"start: joint {name} is at {angles[worst]:.4f} rad, {over[worst]:.3g} rad beyond its "
            f"limit of {end[worst]:.4f} rad; move it back first, as far as "
            "gaitopt.nearest_state(robot, state) says",
            f"joint position {name}", float(angles[worst]), float(end[worst]), "rad",
        )  # fmt: skip
    check_joint_rates(robot, rates)


def check_joint_rates(robot: Quadruped, rates: FloatArray) -> None:
    """Refuse joints that turn faster than they can.

    Args:
        robot: the robot.
        rates: of its joints ``(nj,)`` [rad/s].

    Raises:
        InfeasibleStateError: names the joint, and by how much.
    """
    use = np.abs(rates) / robot.velocity_limits
    worst = int(np.nan_to_num(use).argmax())
    if use[worst] > 1.0 + ROUNDING:
        name, limit = robot.joint_names[worst], float(robot.velocity_limits[worst])
        raise InfeasibleStateError(
            f"start: joint {name} turns at {abs(rates[worst]):.3f} rad/s, {use[worst]:.3g} times "
            f"its limit of {limit:.3f} rad/s; begin when it is slower",
            f"joint velocity {name}", float(abs(rates[worst])), limit, "rad/s",
        )  # fmt: skip


def foot_velocities(robot: Quadruped, state: State) -> FloatArray:
    """Velocities of the feet in the world ``(4, 3)`` [m/s]."""
    position, rpy = state.columns[:3], state.columns[3:6]
    feet = feet_from_joints(robot, position, rpy, state.q[7:])
    turned = rpy_to_matrix(rpy)
    linear, angular = turned @ state.v[:3], turned @ state.v[3:6]
    out = linear + np.cross(angular, feet - position)
    for i, leg in enumerate(LEGS):
        columns = list(robot.leg_columns[leg])
        jacobian = robot.legs[leg].jacobian(state.q[7:][columns])
        out[i] += turned @ robot.body_axes @ jacobian @ state.v[6:][columns]
    return np.asarray(out)


def _check_feet(
    feet: FloatArray, speeds: FloatArray, standing: BoolArray, footholds: Footholds
) -> None:
    """Refuse standing feet that are not on their footholds, or move.

    Raises:
        InfeasibleStateError: names the leg, and by how much.
    """
    for i in np.flatnonzero(standing).tolist():
        leg = LEGS[i]
        away = feet[i] - footholds[leg][0]
        for far, allowed, side in (
            (float(np.hypot(*away[:2])), footholds.landing_radius, "beside"),
            (float(abs(away[2])), HIGH, "above" if away[2] > 0.0 else "below"),
        ):
            if far > allowed:
                raise InfeasibleStateError(
                    f"start: foot {leg} stands {1e3 * far:.1f} mm {side} its first foothold, at "
                    f"most {1e3 * allowed:.1f} mm are allowed; give the place where it stands as "
                    "its first foothold, or leave the leg out of support where it is in the air",
                    f"contact {leg}", far, allowed, "m",
                )  # fmt: skip
        speed = float(np.linalg.norm(speeds[i]))
        if speed > SLIDING:
            raise InfeasibleStateError(
                f"start: foot {leg} stands, and moves at {speed:.3f} m/s, at most {SLIDING} m/s "
                "are allowed; leave the leg out of support where it is in the air",
                f"contact {leg}", speed, SLIDING, "m/s",
            )  # fmt: skip


def _check_sides(robot: Quadruped, base: FloatArray, joints: FloatArray, feet: FloatArray) -> None:
    """Refuse joint angles with which a leg is not bent as planners bend it.

    Raises:
        InfeasibleStateError: names the joint.
    """
    off = np.abs(joints_from_feet(robot, base[:3], base[3:], feet) - joints)
    worst = int(off.argmax())
    if off[worst] > OTHER_SIDE:
        name = robot.joint_names[worst]
        raise InfeasibleStateError(
            f"start: joint {name} is at {joints[worst]:.4f} rad, {off[worst]:.3g} rad from where "
            "planners have it for this place of the foot: the leg is bent to the other side, or "
            "a joint that no leg owns is not at its neutral angle; move it there first",
            f"joint side {name}", float(off[worst]), OTHER_SIDE, "rad",
        )  # fmt: skip


def check_few_feet(standing: int) -> None:
    """Refuse fewer than two standing feet.

    Raises:
        InfeasibleStateError: tells how many stand.
    """
    if standing < FEWEST:
        raise InfeasibleStateError(
            f"start: the robot stands on {standing} feet, and a plan begins on {FEWEST} or more; "
            "begin when they have landed, or, where it lies, put them down first, as "
            "gaitopt.feet_down(robot, state) says",
            "contact", float(standing), float(FEWEST), "feet",
        )  # fmt: skip


def check_apart(robot: Quadruped, joints: FloatArray) -> None:
    """Refuse a posture in which links of the robot touch, where their shapes are known.

    Raises:
        InfeasibleStateError: names the links, and by how much.
    """
    pairs = CollisionPairs.of(robot)
    if pairs is None:
        return
    gaps = pairs.distances(joints[None, pairs.columns])[0]
    worst = int(gaps.argmin())
    if gaps[worst] < TOUCHING - SAME_GAP:
        pair = pairs.geometry.collisionPairs[worst]
        names = [str(pairs.geometry.geometryObjects[i].name) for i in (pair.first, pair.second)]
        raise InfeasibleStateError(
            f"start: {' and '.join(names)} are {1e3 * gaps[worst]:.2f} mm apart, and what is "
            f"nearer than {1e3 * TOUCHING:g} mm touches; move the legs apart first, as far "
            "as gaitopt.nearest_state(robot, state) says",
            f"self-collision {' and '.join(names)}", float(gaps[worst]), TOUCHING, "m",
        )  # fmt: skip
