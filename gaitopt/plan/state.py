"""The state of a robot at one instant: where it is, how it moves, and which feet stand."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from gaitopt.conventions import LEGS, ByValue, FloatArray, frozen
from gaitopt.errors import InputError
from gaitopt.inputs import as_text, check_array, check_kind, check_number
from gaitopt.robots.leg_names import by_leg
from gaitopt.robots.quadruped import Quadruped
from gaitopt.robots.rotations import (
    angular_to_rpy_rates,
    quaternion_to_matrix,
    quaternion_to_rpy,
    rpy_to_matrix,
)
from gaitopt.robots.standing import foot_below_hip
from gaitopt.robots.whole_body import base_of_body, configuration, joints_from_feet

UNIT = 1e-6
"""Most by which the length of a quaternion may differ from one; it is then divided by it."""
LARGEST = 1e6
"""Largest number of a state [m, rad, m/s, rad/s]: anything above is a mistake."""


@dataclass(frozen=True, eq=False)
class State(ByValue):
    """What a robot does at one instant; arrays are read-only.

    :meth:`gaitopt.Plan.state` gives that of a plan, :meth:`standing` one at rest.

    Attributes:
        q: configuration ``(nq,)``, Pinocchio's: base position [m], quaternion x, y, z, w, joints
            [rad].
        v: velocity ``(nv,)``, Pinocchio's: twist of the base in its own frame [m/s, rad/s], joint
            rates [rad/s].
        support: the legs that stand; the feet of all others are in the air. Where a foot is follows
            from ``q``.
        joint_names: names of the joints of ``q`` and ``v``, in order; those of
            :attr:`gaitopt.Quadruped.joint_names`.

    Raises:
        InputError: an array has another shape, a number is not finite, the quaternion has not the
            length one, or a leg is unknown.
    """

    q: FloatArray
    v: FloatArray
    support: tuple[str, ...]
    joint_names: tuple[str, ...]

    def __post_init__(self) -> None:
        names = _texts("joint_names", self.joint_names)
        q, v = (_numbers(name, getattr(self, name)) for name in ("q", "v"))
        if q.shape != (7 + len(names),) or v.shape != (6 + len(names),):
            raise InputError(
                f"a state with {len(names)} joints needs q ({7 + len(names)},) and v "
                f"({6 + len(names)},), got {q.shape} and {v.shape}"
            )
        length = float(np.linalg.norm(q[3:7]))
        if not abs(length - 1.0) <= UNIT:
            raise InputError(
                f"q[3:7] must be a quaternion x, y, z, w of length 1, got length {length:.6g}"
            )
        q = np.concatenate([q[:3], q[3:7] / length, q[7:]])
        legs = by_leg("support", dict.fromkeys(_texts("support", self.support), True))
        support = tuple(leg for leg in LEGS if leg in legs)
        for name, value in (("q", frozen(q)), ("v", frozen(v)), ("support", support),
                            ("joint_names", names)):  # fmt: skip
            object.__setattr__(self, name, value)

    def __reduce__(self) -> tuple[object, ...]:
        return (State, (self.q, self.v, self.support, self.joint_names))

    def __repr__(self) -> str:
        stands = " ".join(self.support) or "no foot"
        return f"State(base at {np.round(self.q[:3], 3).tolist()} m, on {stands})"

    @classmethod
    def of(
        cls,
        robot: Quadruped,
        position: ArrayLike,
        rpy: ArrayLike,
        joints: ArrayLike,
        *,
        linear: ArrayLike = (0.0, 0.0, 0.0),
        angular: ArrayLike = (0.0, 0.0, 0.0),
        rates: ArrayLike | None = None,
        support: Iterable[str] = LEGS,
    ) -> State:
        """The state of a robot whose base is measured in the world's axes.

        Args:
            robot: the robot.
            position: of the base ``(3,)`` [m].
            rpy: its roll, pitch and yaw ``(3,)`` [rad].
            joints: ``(nj,)`` [rad], in the order of :attr:`gaitopt.Quadruped.joint_names`.
            linear: velocity of the base's origin ``(3,)``, in the world's axes [m/s].
            angular: its angular velocity ``(3,)``, in the world's axes [rad/s].
            rates: of the joints ``(nj,)`` [rad/s]; zero by default.
            support: the legs that stand.

        Raises:
            InputError: an array has another shape, a number is not finite, or a leg is unknown.
        """
        check_kind("robot", robot, Quadruped)
        place, angles = _vector("position", position, 3), _vector("rpy", rpy, 3)
        turned = rpy_to_matrix(angles)
        count = len(robot.joint_names)
        v = np.concatenate([
            _vector("linear", linear, 3) @ turned, _vector("angular", angular, 3) @ turned,
            np.zeros(count) if rates is None else _vector("rates", rates, count),
        ])  # fmt: skip
        q = configuration(robot, place, angles, _vector("joints", joints, count))
        return cls(q, v, tuple(_texts("support", support)), robot.joint_names)

    @classmethod
    def standing(
        cls,
        robot: Quadruped,
        feet: ArrayLike | None = None,
        *,
        height: float | None = None,
        heading: float = 0.0,
    ) -> State:
        """A robot at rest on four feet, with its body level above the middle of them.

        Args:
            robot: the robot.
            feet: foot frames in the world ``(4, 3)`` [m], legs in the order of
                :data:`gaitopt.LEGS`; below the hips at height 0 by default, around the origin.
            height: of the hips above the mean height of the feet [m]; by default
                :attr:`gaitopt.Quadruped.standing_height`. A low one is that of a robot that sits.
            heading: direction that the body faces [rad].

        Raises:
            InputError: a number is not finite or out of range, or a leg does not reach its foot.
        """
        check_kind("robot", robot, Quadruped)
        given = robot.standing_height if height is None else height
        rise = check_number("height", given, 1e-3, 100.0, "m")
        yaw = check_number("heading", heading, -LARGEST, LARGEST, "rad")
        axes = rpy_to_matrix([0.0, 0.0, yaw])
        if feet is None:
            under = [foot_below_hip(robot.legs[leg], rise) - robot.centre for leg in LEGS]
            places = np.array(under) @ axes.T * [1.0, 1.0, 0.0]
        else:
            places = _numbers("feet", feet)
            if places.shape != (len(LEGS), 3):
                raise InputError(f"feet must be (4, 3), got {places.shape}")
        centre = places.mean(axis=0) + np.array([0.0, 0.0, rise])
        base = base_of_body(robot, centre, axes)
        joints = joints_from_feet(robot, base[:3], base[3:], places)
        return cls.of(robot, base[:3], base[3:], joints)

    @cached_property
    def columns(self) -> FloatArray:
        """The state as columns of a path ``(6 + nj,)``: base position, roll, pitch, yaw, joints.

        Whole turns of the yaw are not known: it is within half a turn.
        """
        return frozen(np.concatenate([self.q[:3], quaternion_to_rpy(self.q[3:7]), self.q[7:]]))

    @cached_property
    def column_rates(self) -> FloatArray:
        """Time derivatives of :attr:`columns` ``(6 + nj,)`` [m/s, rad/s]."""
        linear = quaternion_to_matrix(self.q[3:7]) @ self.v[:3]
        turning = angular_to_rpy_rates(self.columns[3:6], self.v[3:6])
        return frozen(np.concatenate([linear, turning, self.v[6:]]))


def _numbers(name: str, values: Any) -> FloatArray:
    """Finite numbers of a size that makes sense.

    Raises:
        InputError: these are none; names the first.
    """
    array = check_array(name, values)
    # Comparisons with NaN are false.
    wrong = np.argwhere(~(np.abs(array) <= LARGEST))
    if len(wrong):
        index = tuple(wrong[0].tolist())
        raise InputError(
            f"{name} must be finite numbers of at most {LARGEST:g}, got {array[index]:g} at index "
            f"{index}"
        )
    return array


def _vector(name: str, values: Any, length: int) -> FloatArray:
    array = _numbers(name, values)
    if array.shape != (length,):
        raise InputError(f"{name} must be ({length},), got {array.shape}")
    return array


def _texts(name: str, values: Any) -> tuple[str, ...]:
    """Texts as a tuple.

    Raises:
        InputError: these are no texts.
    """
    listed = isinstance(values, (Sequence, Iterable)) and not isinstance(values, str)
    listed &= getattr(values, "ndim", 1) > 0
    found = tuple(values) if listed else ()
    if not listed or not all(isinstance(value, str) for value in found):
        raise InputError(f"{name} must be a list of names, got {as_text(values)}")
    return found
