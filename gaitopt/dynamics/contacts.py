"""Contacts of the feet with the ground, and what is asked of forces and torques there.

A contact force is linear in everything that limits it: it lies in a friction pyramid, which is an
inner approximation of the friction cone; it has a least normal component; and the joint torques
that belong to it keep to their limits. This module states these limits as rows of matrices, for
any number of samples.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from gaitopt.conventions import BoolArray, FloatArray, frozen
from gaitopt.errors import InputError
from gaitopt.inputs import (
    as_text,
    check_array,
    check_count,
    check_flags,
    check_kind,
    check_number,
    check_shape,
)

MOST_SIDES: Final = 64
"""Most sides of a friction pyramid: it then loses 0.1 % of the friction, and more rows than that
only cost time."""

LARGEST_RESERVE: Final = 1.0 / 3.0
"""Largest reserve while fewer than four feet stand: three feet that carry at least a third each
leave no choice at all."""

LARGEST_RESERVE_ON_FOUR: Final = 0.25
"""The same on four feet."""

LEAST_SHARE: Final = 0.001
"""Smallest coefficient of friction, and smallest share of the torques. Chosen here: next to
nothing."""

LONGEST_TRANSFER: Final = 10.0
"""Longest time in which a load is handed over [s]. Chosen here: longer than any step."""

LEAST_BALANCE_TOLERANCE: Final = 1e-12
"""Smallest tolerance of the balance: rounding alone leaves 1e-13."""

LEAST_NORMAL_LENGTH: Final = 1e-9
"""A contact normal shorter than this has no direction."""

LOWEST_NORMAL: Final = -0.999
"""Least vertical part of a unit contact normal. The two tangents of a contact come from the
rotation that takes the vertical to the normal; for a normal straight down there is no such
rotation."""


@dataclass(frozen=True)
class TorqueLine:
    """The line along which a motor's torque falls with its speed.

    Up to :attr:`knee` a joint has its whole torque. From there the torque that drives the joint in
    the direction of its motion falls linearly, and at :attr:`no_load` it is zero. A torque that
    brakes the joint keeps its limit.

    Attributes:
        knee: speed as a share of the joint's velocity limit.
        no_load: speed as a share of the joint's velocity limit; larger than :attr:`knee`.

    Raises:
        InputError: a share is not a positive number, or ``no_load`` is not above ``knee``.
    """

    knee: float
    no_load: float

    def __post_init__(self) -> None:
        check_number("knee", self.knee, 0.0, 100.0)
        check_number("no_load", self.no_load, 0.0, 100.0)
        if not self.no_load > self.knee:
            raise InputError(
                f"no_load must be above knee, got no_load {self.no_load:g} and knee {self.knee:g}"
            )


@dataclass(frozen=True)
class ForceLimits:
    """What is asked of contact forces and joint torques.

    Attributes:
        friction: coefficient of friction between foot and ground.
        reserve: share of the robot's weight that every standing foot keeps as normal force while
            fewer than four feet stand.
        reserve_on_four: the same while four feet stand; half of :attr:`reserve` when ``None``.
            With four feet the distribution of the load is not unique, and at the end of a stance
            the foot that is going to lift off carries almost nothing: 5 % of the weight on each
            of four feet made such instants infeasible.
        torque_share: share of each joint's effort limit that may be used.
        sides: number of sides of the friction pyramid. The pyramid lies inside the cone and
            touches it with its edges, so it keeps :attr:`friction_share` of the friction in the
            worst direction: 71 % with 4 sides, 92 % with 8.
        torque_line: how the torque falls with the speed of a joint, beside what is known of the
            robot's own motors (:attr:`gaitopt.Quadruped.torque_lines`).
        speed_share: share that counts of the speeds at which torques fall and end.
        balance_tolerance: what may be left of the six equations of the base, as a share of the
            weight and of the weight times half the stance's length. On three feet or more only
            rounding is. Two point feet make no moment about the line that joins them: with 1e-3
            the ZMP may be 1/1000 of half the stance beside that line, 0.2 mm for a stance of
            0.4 m. A foot that rolls on its ball moves its contact by more.
        transfer_time: time within which a foot takes over the robot's whole weight at the most
            [s]: its normal force rises from nearly nothing after it has landed, and falls to nearly
            nothing before it lifts off (:func:`gaitopt.plan.load_transfer.most_normal_shares`).
            0, the default, lets forces jump.

    Raises:
        InputError: a number is outside its range.
    """

    friction: float = 0.6
    reserve: float = 0.02
    reserve_on_four: float | None = None
    torque_share: float = 0.9
    sides: int = 4
    torque_line: TorqueLine | None = None
    balance_tolerance: float = 1e-3
    speed_share: float = 1.0
    transfer_time: float = 0.0

    def __post_init__(self) -> None:
        check_number("friction", self.friction, LEAST_SHARE, 10.0)
        check_number("reserve", self.reserve, 0.0, LARGEST_RESERVE)
        if self.reserve_on_four is not None:
            check_number("reserve_on_four", self.reserve_on_four, 0.0, LARGEST_RESERVE_ON_FOUR)
        check_number("torque_share", self.torque_share, LEAST_SHARE, 1.0)
        check_number("speed_share", self.speed_share, LEAST_SHARE, 1.0)
        check_number("transfer_time", self.transfer_time, 0.0, LONGEST_TRANSFER, "s")
        check_count("sides", self.sides, 3, MOST_SIDES)
        # A tenth of half the stance is no longer a small error.
        check_number("balance_tolerance", self.balance_tolerance, LEAST_BALANCE_TOLERANCE, 0.1)
        if self.torque_line is not None and not isinstance(self.torque_line, TorqueLine):
            raise InputError(
                f"torque_line must be a TorqueLine or None, got {as_text(self.torque_line)}"
            )

    @classmethod
    def or_default(cls, given: ForceLimits | None) -> ForceLimits:
        """What a user gave; the default limits for ``None``.

        Raises:
            InputError: it is something else.
        """
        if not isinstance(given, (cls, type(None))):
            raise InputError(f"limits must be ForceLimits or None, got {as_text(given)}")
        return cls() if given is None else given

    @classmethod
    def from_dict(cls, stored: Mapping[str, Any]) -> ForceLimits:
        """Limits from plain values, as a plan file stores them.

        Raises:
            InputError: a field is unknown, or a value is out of range.
        """
        check_kind("limits on forces", stored, Mapping)
        values = dict(stored)
        try:
            if isinstance(values.get("torque_line"), Mapping):
                values["torque_line"] = TorqueLine(**values["torque_line"])
            return cls(**values)
        except TypeError as error:
            raise InputError(f"these are no force limits: {error}") from error

    @property
    def friction_share(self) -> float:
        """Share of the friction that the pyramid keeps in its worst direction: cos(pi / sides)."""
        return float(np.cos(np.pi / self.sides))

    def least_normal_shares(self, standing: BoolArray) -> FloatArray:
        """Least normal force of each foot as a share of the weight ``(..., m)``.

        Args:
            standing: which feet stand ``(..., m)``. Feet in the air get 0.
        """
        standing = check_flags("standing", standing)
        on_four = self.reserve / 2.0 if self.reserve_on_four is None else self.reserve_on_four
        count = standing.sum(axis=-1, keepdims=True)
        return np.asarray(np.where(standing, np.where(count >= 4, on_four, self.reserve), 0.0))


class ContactGround(NamedTuple):
    """The ground below the four feet, for any number of samples; one for all broadcasts.

    Attributes:
        normals: unit normals, out of the ground ``(N, 4, 3)`` or ``(3,)``.
        grip: friction as a share of that of the limits ``(N, 4)`` or ``()``.
    """

    normals: FloatArray
    grip: FloatArray

    def at(self, which: np.ndarray) -> ContactGround:
        """That of some samples."""
        return self if self.normals.ndim == 1 else ContactGround(*(part[which] for part in self))


LEVEL_GROUND: Final = ContactGround(np.array([0.0, 0.0, 1.0]), np.array(1.0))
"""Level ground with all the friction of the limits."""


@dataclass(frozen=True, eq=False)
class Contacts:
    """Where feet touch the ground, over any number of samples.

    Attributes:
        points: contact points in the world ``(..., m, 3)`` [m].
        normals: unit normals of the ground there, out of the ground ``(..., m, 3)``.
        standing: which feet stand ``(..., m)``. Points and normals of the others mean nothing.
        grip: friction of each contact as a share of that of the limits ``(..., m)``.
    """

    points: FloatArray
    normals: FloatArray
    standing: BoolArray
    grip: FloatArray

    def __post_init__(self) -> None:
        for name in ("points", "normals", "standing", "grip"):
            getattr(self, name).setflags(write=False)

    @classmethod
    def below_feet(
        cls,
        feet: ArrayLike,
        standing: ArrayLike,
        radius: float = 0.0,
        normals: ArrayLike = (0.0, 0.0, 1.0),
        grip: ArrayLike = 1.0,
    ) -> Contacts:
        """The contacts of feet that are balls.

        The ball touches the ground one radius from its centre, against the normal.

        Args:
            feet: foot frames, which are the balls' centres ``(..., m, 3)`` [m].
            standing: which feet stand, as truth values ``(..., m)``.
            radius: of the balls [m], :attr:`Quadruped.foot_radius`.
            normals: of the ground, of any length, broadcast to the shape of ``feet``.
            grip: friction of each contact as a share of that of the limits, from 0 to 1, broadcast
                to ``(..., m)``.

        Raises:
            InputError: shapes do not fit, a number is not finite or out of its range, or a normal
                has no length or points down.
        """
        places = check_shape("feet", feet, 3)
        flags = np.array(standing)
        if flags.dtype != np.bool_ or flags.shape != places.shape[:-1]:
            raise InputError(
                f"standing must be truth values {places.shape[:-1]}, got {flags.dtype} "
                f"{flags.shape}"
            )
        if not np.isfinite(places[flags]).all():
            raise InputError("feet must be finite where they stand")
        check_number("radius", radius, 0.0, 10.0, "m")
        units = unit_normals(normals)
        try:
            up = np.array(np.broadcast_to(units, places.shape))
        except ValueError as error:
            raise InputError(f"normals must fit {places.shape}, got {units.shape}") from error
        return cls(places - radius * up, up, flags, grips(grip, places.shape[:-1]))


def grips(grip: ArrayLike, shape: tuple[int, ...]) -> FloatArray:
    """Shares of the friction of limits, one for each contact ``shape``.

    Raises:
        InputError: one is not from 0 to 1, or they do not fit the shape.
    """
    shares = check_array("grip", grip)
    try:
        given = np.array(np.broadcast_to(shares, shape))
    except ValueError as error:
        raise InputError(f"grip must fit {shape}, got {np.shape(grip)}: {error}") from error
    # Comparisons with NaN are false.
    if not ((given >= 0.0) & (given <= 1.0)).all():
        raise InputError("grip must be a share of the friction of the limits, from 0 to 1")
    return given


def unit_normals(normals: ArrayLike) -> FloatArray:
    """``normals (..., 3)`` of length one.

    Raises:
        InputError: one is not finite, has no length, or points straight down.
    """
    given = check_shape("normals", normals, 3)
    length = np.linalg.norm(given, axis=-1, keepdims=True)
    # Comparisons with NaN are false.
    if not ((length > LEAST_NORMAL_LENGTH) & (length < np.inf)).all():
        raise InputError("normals must be finite and have a length, got " + repr(given.tolist()))
    unit = given / length
    if not (unit[..., 2] > LOWEST_NORMAL).all():
        raise InputError("normals must point out of the ground; one points straight down")
    return np.asarray(unit)


def tangents(normals: ArrayLike) -> FloatArray:
    """Two unit tangents of each contact ``(..., 2, 3)``, square to each other and the normal.

    They are x and y of the world after the shortest rotation that takes z to the normal.

    Args:
        normals: of any length ``(..., 3)``.

    Raises:
        InputError: as in :func:`unit_normals`.
    """
    return _tangents(unit_normals(normals))


def _tangents(normals: FloatArray) -> FloatArray:
    """:func:`tangents` of unit normals."""
    x, y, z = np.moveaxis(normals, -1, 0)
    scale = 1.0 / (1.0 + z)
    out = np.empty((*x.shape, 2, 3))
    out[..., 0, 0], out[..., 1, 1] = 1.0 - x * x * scale, 1.0 - y * y * scale
    out[..., 0, 1] = out[..., 1, 0] = -x * y * scale
    out[..., 0, 2], out[..., 1, 2] = -x, -y
    return out


def pyramid_rows(
    limits: ForceLimits, normals: ArrayLike = (0.0, 0.0, 1.0), grip: ArrayLike = 1.0
) -> FloatArray:
    """Rows ``P (..., sides, 3)`` of the friction pyramids ``P f >= 0``.

    With four sides on level ground they say ``|fx|, |fy| <= friction / sqrt(2) * fz``. All rows
    of a contact together imply a normal force of at least 0.

    Args:
        limits: the coefficient of friction and the number of sides.
        normals: of any length ``(..., 3)``.
        grip: share of this friction that each contact has ``(...)``.

    Raises:
        InputError: as in :func:`unit_normals`.
    """
    return unit_pyramid_rows(limits, unit_normals(normals), np.asarray(grip, dtype=np.float64))


def unit_pyramid_rows(limits: ForceLimits, up: FloatArray, grip: FloatArray) -> FloatArray:
    """:func:`pyramid_rows` for normals ``up (..., 3)`` that are known to be of length one."""
    directions = _sides(limits.sides) @ _tangents(up)
    slope = limits.friction * limits.friction_share * grip
    return np.asarray(slope[..., None, None] * up[..., None, :] - directions)


@lru_cache(maxsize=16)
def _sides(count: int) -> FloatArray:
    """Unit vectors ``(count, 2)`` square to the sides of a pyramid, along its tangents."""
    angles = 2.0 * np.pi * np.arange(count) / count
    return frozen(np.stack([np.cos(angles), np.sin(angles)], axis=-1))
