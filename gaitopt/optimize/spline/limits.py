"""Limits of joints: velocity, acceleration and jerk."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from gaitopt.conventions import FloatArray, frozen
from gaitopt.errors import InputError
from gaitopt.inputs import as_text
from gaitopt.robots.leg import Leg


@dataclass(frozen=True, eq=False)
class JointLimits:
    """Limits of the absolute velocity, acceleration and jerk of each joint.

    Attributes:
        velocity: ``(nj,)`` [rad/s].
        acceleration: ``(nj,)`` [rad/s^2].
        jerk: ``(nj,)`` [rad/s^3]; infinite for no limit.

    Raises:
        InputError: shapes differ, or a limit is not positive.
    """

    velocity: FloatArray
    acceleration: FloatArray
    jerk: FloatArray

    def __post_init__(self) -> None:
        for name in ("velocity", "acceleration", "jerk"):
            try:
                values = np.asarray(getattr(self, name), dtype=np.float64)
            except (TypeError, ValueError):
                raise InputError(
                    f"{name} limits must be numbers, got {as_text(getattr(self, name))}"
                ) from None
            largest = np.inf if name == "jerk" else np.finfo(float).max
            if (
                values.ndim != 1
                or not values.size
                or not ((values > 0) & (values <= largest)).all()
            ):
                raise InputError(
                    f"{name} limits must be positive{'' if name == 'jerk' else ' and finite'}, one "
                    f"for each joint, got {as_text(getattr(self, name))}"
                )
            object.__setattr__(self, name, frozen(values))
        if not self.velocity.shape == self.acceleration.shape == self.jerk.shape:
            raise InputError(
                f"limits must be of the same joints, got {len(self.velocity)} of velocity, "
                f"{len(self.acceleration)} of acceleration and {len(self.jerk)} of jerk"
            )

    @classmethod
    def of_leg(cls, leg: Leg, acceleration: ArrayLike, jerk: ArrayLike) -> JointLimits:
        """The velocity limits of a leg's URDF with limits that a URDF does not hold.

        Args:
            leg: the leg.
            acceleration, jerk: for each joint, or one for all [rad/s^2], [rad/s^3].
        """
        size = leg.velocity_limits.shape
        try:
            both = [
                np.broadcast_to(np.asarray(a, dtype=np.float64), size) for a in (acceleration, jerk)
            ]
        except (TypeError, ValueError):
            raise InputError(
                f"acceleration and jerk must be one number or {size[0]}, for {leg.name}'s joints, "
                f"got {as_text(acceleration)} and {as_text(jerk)}"
            ) from None
        return cls(leg.velocity_limits, *both)
