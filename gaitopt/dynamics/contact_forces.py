"""Contact forces and joint torques of a motion, with the residuals that show whether they hold."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np

from gaitopt.conventions import LEGS, BoolArray, ByValue, FloatArray
from gaitopt.dynamics.contacts import ForceLimits
from gaitopt.dynamics.force_status import (
    FORCE_TOLERANCE,
    ForceResiduals,
    ForceStatus,
    ForceViolation,
)
from gaitopt.inputs import check_count, check_kind

_KINDS: Final = (
    ForceStatus.FRICTION,
    ForceStatus.NORMAL_FORCE,
    ForceStatus.TORQUE,
    ForceStatus.BALANCE,
)
"""In the order of the columns of :attr:`ContactForces.excess`."""


@dataclass(frozen=True, eq=False)
class ContactForces(ByValue):
    """Contact forces and joint torques of a motion at ``N`` instants; arrays are read-only.

    Where no forces keep all limits they are those that violate the limits least, and
    :attr:`status` and :attr:`residuals` say so.

    Attributes:
        times: of the instants ``(N,)`` [s].
        forces: of the ground on each foot, in the world's axes ``(N, 4, 3)`` [N].
        torques: of the joints, in the order of :attr:`joint_names` ``(N, nj)`` [N m].
        standing: which feet stand ``(N, 4)``.
        reserve: least normal force of a standing foot as a share of the weight ``(N,)``; ``inf``
            in flight.
        friction_use: share of the friction cone (the round one) that is used ``(N, 4)``; 1 on its
            border, 0 for feet in the air, ``inf`` for a foot that does not press.
        torque_use: torque as a share of what the joint has at this speed ``(N, nj)``; at most
            ``limits.torque_share`` where feasible, and NaN for joints without a known limit.
        residuals: how well equations and limits are kept, computed from the forces.
        conflict_table: which limits are in the way where no forces exist ``(N, 8 + nj)``: friction
            of each foot, normal force of each foot, torque of each joint. :meth:`conflicts` has
            their names.
        limits: what was asked.
        joint_names: names of the columns of ``torques``.
        unlimited: names of the joints without a known torque limit: nothing is promised of them.
        weight: of the robot [N].
        length: half the stance [m].
        velocity_jump: largest jump of a velocity of base or joints at a knot of the path
            [m/s, rad/s]. At a jump the forces are impulses, and no instant shows them.
    """

    times: FloatArray
    forces: FloatArray
    torques: FloatArray
    standing: BoolArray
    reserve: FloatArray
    friction_use: FloatArray
    torque_use: FloatArray
    residuals: ForceResiduals
    conflict_table: BoolArray
    limits: ForceLimits
    joint_names: tuple[str, ...]
    unlimited: tuple[str, ...]
    weight: float
    length: float
    velocity_jump: float = 0.0

    def __post_init__(self) -> None:
        check_kind("residuals", self.residuals, ForceResiduals)
        for owner in (self, self.residuals):
            for array in vars(owner).values():
                if isinstance(array, np.ndarray):
                    array.setflags(write=False)

    def __len__(self) -> int:
        return len(self.times)

    def __repr__(self) -> str:
        worst = self.worst()
        found = f"feasible at {100.0 * self.feasible_share:.4g} % of {len(self)} instants"
        return f"ContactForces({found}{'' if worst is None else f'; worst: {worst}'})"

    @cached_property
    def excess(self) -> FloatArray:
        """How far each kind of limit is exceeded, as a share ``(N, 4)``.

        Columns are friction, normal force, torque and balance. Shares are of the weight, of the
        joint's torque limit, and of the weight times half the stance.
        """
        left = self.residuals
        out = np.stack(
            [
                left.friction.max(axis=1) / self.weight,
                left.normal_force.max(axis=1) / self.weight,
                self._torque_excess().max(axis=1, initial=0.0),
                np.maximum(left.force, left.moment / self.length) / self.weight,
            ],
            axis=1,
        )
        out.setflags(write=False)
        return out

    @cached_property
    def status(self) -> tuple[ForceStatus, ...]:
        """Of each instant, whether it has forces, or which kind of limit is exceeded most."""
        largest = np.where(self.feasible, -1, self._beyond().argmax(axis=1))
        return tuple(ForceStatus.FEASIBLE if i < 0 else _KINDS[i] for i in largest)

    @cached_property
    def feasible(self) -> BoolArray:
        """Which instants have forces that keep all limits ``(N,)``."""
        return np.asarray((self._beyond() <= 0.0).all(axis=1))

    @property
    def feasible_share(self) -> float:
        """Share of the instants that have forces; 1 when there is no instant."""
        return float(self.feasible.mean()) if len(self) else 1.0

    def conflicts(self, sample: int) -> tuple[str, ...]:
        """Names of the limits that contradict each other at an instant.

        Lifting any one of them a little lessens what is exceeded, and no other limit does.

        Args:
            sample: index of the instant.

        Returns:
            For instance ``("friction LF", "torque LH_KFE")``; nothing for a feasible instant.
        """
        check_count("sample", sample, -len(self.times), len(self.times) - 1)
        names = [
            *(f"friction {leg}" for leg in LEGS),
            *(f"normal force {leg}" for leg in LEGS),
            *(f"torque {joint}" for joint in self.joint_names),
        ]
        return tuple(names[i] for i in np.flatnonzero(self.conflict_table[sample]))

    def violations(self) -> Iterator[ForceViolation]:
        """All limits that are exceeded, instant by instant."""
        for sample in np.flatnonzero(~self.feasible):
            yield from self._violations_at(int(sample))

    def worst(self) -> ForceViolation | None:
        """The limit that is exceeded most, as a share; ``None`` when all instants are feasible."""
        if self.feasible.all():
            return None
        beyond = np.where(np.isnan(self._beyond()), np.inf, self._beyond())
        sample = int(beyond.max(axis=1).argmax())
        return max(self._violations_at(sample), key=lambda v: v.share)

    def _beyond(self) -> FloatArray:
        """:attr:`excess` less what counts as rounding; NaN counts as infinite."""
        allowed = [FORCE_TOLERANCE] * 3 + [self.limits.balance_tolerance]
        return np.nan_to_num(self.excess - allowed, nan=np.inf)

    def _torque_excess(self) -> FloatArray:
        """Torques beyond what may be used, as shares of the limits ``(N, nj)``."""
        # The use is NaN for unknown limits, which nothing exceeds.
        over = np.nan_to_num(self.torque_use, nan=0.0) - self.limits.torque_share
        return np.where(self.residuals.torque > 0.0, np.maximum(over, 0.0), 0.0)

    def _violations_at(self, sample: int) -> Iterator[ForceViolation]:
        left, time = self.residuals, float(self.times[sample])
        for i, leg in enumerate(LEGS):
            for kind, table in (
                (ForceStatus.FRICTION, left.friction),
                (ForceStatus.NORMAL_FORCE, left.normal_force),
            ):
                amount = float(table[sample, i])
                if not amount <= FORCE_TOLERANCE * self.weight:
                    share = amount / self.weight
                    yield ForceViolation(sample, time, kind, leg, amount, "N", share)
        for j, share in enumerate(self._torque_excess()[sample]):
            if not share <= FORCE_TOLERANCE:
                yield ForceViolation(
                    sample, time, ForceStatus.TORQUE, self.joint_names[j],
                    float(left.torque[sample, j]), "N m", float(share),
                )  # fmt: skip
        yield from self._imbalance_at(sample)

    def _imbalance_at(self, sample: int) -> Iterator[ForceViolation]:
        left, time = self.residuals, float(self.times[sample])
        legs = [leg for leg, stands in zip(LEGS, self.standing[sample], strict=True) if stands]
        name = "-".join(legs) or "no foot"
        for table, unit, scale in (
            (left.force, "N", self.weight),
            (left.moment, "N m", self.weight * self.length),
        ):
            amount = float(table[sample])
            if not amount <= self.limits.balance_tolerance * scale:
                yield ForceViolation(
                    sample, time, ForceStatus.BALANCE, name, amount, unit, amount / scale
                )
