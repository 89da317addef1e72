"""The joints of one leg in the body frame, and to which side its knee points."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.errors import InputError, RobotError
from gaitopt.robots.discovery import Chain
from gaitopt.robots.leg_angles import wrap_angle
from gaitopt.robots.limits import position_limits, velocity_limits

LEAST_LINK = 1e-4
"""Shortest upper or lower leg [m]; shorter ones are taken for a mistake."""
LEAST_BEND = 0.1
"""How far beyond the straight leg a knee's limits may reach on the other side, and the knee still
counts as bending to one side only [rad]. Chosen: some URDFs leave a little."""
ENOUGH_BEND, CLEARLY_LESS = 2.0, 0.7
"""A knee that bends to one side by less than the first [rad], and by less than the second as a
share of what it bends to the other, points to the other side. Chosen: a leg that is folded by 2 rad
is half as long as a straight one."""


class LegParts(NamedTuple):
    """A leg's joints in the body frame, and what is known of its knee.

    Attributes:
        model, name, chain, knee: see :func:`gaitopt.robots.leg_reading.read_leg`.
        points, axes: of the joints ``(nj, 3)``.
        tip: of the foot ``(3,)``.
    """

    model: Any
    name: str
    chain: Chain
    points: FloatArray
    axes: FloatArray
    tip: FloatArray
    knee: float | None

    @property
    def columns(self) -> list[int]:
        """Places of the joints' numbers in Pinocchio's vectors, after the free-flyer's 6."""
        return [self.model.joints[i].idx_v - 6 for i in self.chain.joints]

    @property
    def limits(self) -> FloatArray:
        """Position limits ``(2, nj)`` [rad]."""
        return position_limits(self.model)[:, self.columns]

    @property
    def rates(self) -> FloatArray:
        """Velocity limits ``(nj,)`` [rad/s]."""
        return velocity_limits(self.model)[self.columns]

    @property
    def listing(self) -> str:
        """The leg and its axes, in words."""
        named = zip(self.chain.names, self.axes, strict=True)
        axes = ", ".join(f"{joint} about {np.round(axis, 4)}" for joint, axis in named)
        return f"{self.model.name}: leg {self.name} ({axes}, in the body frame)"

    def check_links(self, lengths: FloatArray) -> None:
        """Refuse a leg whose upper or lower link has no length."""
        if lengths.min() < LEAST_LINK:
            ends = " and ".join((*self.chain.names[-2:], self.chain.foot))
            raise RobotError(
                f"{self.model.name}: leg {self.name} has a link of length {lengths.min():.2g} m "
                f"between {ends}; upper and lower leg need a length"
            )

    def knee_zero(self, bend: float, sign: float) -> float:
        """A knee's bend at zero [rad]: within half a turn of straight in the middle of its range.

        Args:
            bend: at zero, up to whole turns [rad].
            sign: sense of turning of the joint.
        """
        low, high = self.limits[:, -1]
        middle = sign * (low + high) / 2.0 if high - low < 2.0 * np.pi else 0.0
        return float(wrap_angle(bend, -middle))

    def knee_side(self, bends: FloatArray) -> float:
        """The side to which the knee points, from its bend at its limits ``(2,)`` [rad]."""
        return _knee_side(self.model, self.name, self.chain, bends, self.knee)


def _knee_side(
    model: Any, name: str, chain: Chain, bends: FloatArray, asked: float | None
) -> float:
    """The side to which the knee points: +1 forward, -1 backward.

    Args:
        model, name, chain: of the leg.
        bends: the knee's bend at its limits ``(2,)`` [rad].
        asked: the side that was asked for, if any.

    Raises:
        InputError: the limits do not allow the side that was asked for.
    """
    low, high = np.sort(bends)
    only = None
    if low > -LEAST_BEND and high > LEAST_BEND:
        only = 1.0
    elif high < LEAST_BEND and low < -LEAST_BEND:
        only = -1.0
    wider = _wider_side(float(low), float(high))
    if only is not None and asked not in (None, only):
        side = "forward" if only > 0 else "backward"
        raise InputError(
            f"{model.name}: the limits of {chain.names[-1]} let the knee of leg {name} point only "
            f"{side}; leave {name} out of knees, or change the limits"
        )
    return only or asked or wider or (-1.0 if name.endswith("F") else 1.0)


def _wider_side(low: float, high: float) -> float | None:
    """The side to which a knee bends clearly farther; ``None`` for about the same.

    Args:
        low, high: the knee's bend at its limits [rad].
    """
    least, most = min(-low, high), max(-low, high)
    if least < ENOUGH_BEND and least < CLEARLY_LESS * most:
        return 1.0 if high > -low else -1.0
    return None
