"""Contact forces and joint torques of a motion, with the residuals that show whether they hold."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np

from gaitopt.conventions import LEGS, BoolArray, FloatArray, TextEnum
from gaitopt.dynamics.contacts import ForceLimits, effort_limits, pyramid_rows
from gaitopt.dynamics.force_space import ForceProblem

FORCE_TOLERANCE: Final = 1e-7
"""Violation of a limit that counts as rounding, as a share of the weight or of the torque limit:
ten times what the solver may leave."""


class ForceStatus(TextEnum):
    """Whether an instant of a motion has contact forces; the text tells what to do."""

    FEASIBLE = "feasible"
    """The forces make the motion and keep all limits."""
    FRICTION = (
        "friction: a foot would slip; accelerate less, or count on more friction, or on a pyramid "
        "with more sides"
    )
    """Forces that make the motion leave a friction pyramid."""
    NORMAL_FORCE = (
        "normal force: the ground would have to pull at a foot, or the foot keeps less than its "
        "reserve; move slower, move the centre of mass further inside the support, or lessen the "
        "reserve"
    )
    """Forces that make the motion press too little on a foot."""
    TORQUE = (
        "torque: a joint would need more torque than it has; move slower, take another posture or "
        "a lighter load, or use a larger share of the torque limits"
    )
    """Forces that make the motion need too much of a joint."""
    BALANCE = (
        "balance: no forces on the standing feet make this motion; two feet make no moment about "
        "the line that joins them, and no foot makes no force at all: move the body so that the "
        "moment vanishes, or keep more feet on the ground"
    )
    """The base's six equations have no solution."""


@dataclass(frozen=True)
class ForceViolation:
    """A limit that the forces of one instant do not keep.

    Attributes:
        sample: index of the instant.
        time: of the instant [s].
        kind: the limit's kind.
        name: the leg, the joint, or the standing legs.
        amount: how far the limit is exceeded, in :attr:`unit`.
        unit: ``"N"`` or ``"N m"``.
        share: the same as a share of the weight, of the weight times half the stance, or of the
            joint's torque limit.
    """

    sample: int
    time: float
    kind: ForceStatus
    name: str
    amount: float
    unit: str
    share: float

    def __str__(self) -> str:
        kind = self.kind.name.lower().replace("_", " ")
        return (
            f"{kind} of {self.name} at {self.time:.3f} s: exceeded by {self.amount:.3g} "
            f"{self.unit} ({100.0 * self.share:.3g} %)"
        )


@dataclass(frozen=True, eq=False)
class ForceResiduals:
    """What is left of the equations of motion, and how far limits are exceeded; 0 where kept.

    Attributes:
        force: of the base's three force equations ``(N,)`` [N].
        moment: of the base's three moment equations ``(N,)`` [N m].
        friction: horizontal force outside the friction pyramid ``(N, 4)`` [N].
        normal_force: missing normal force ``(N, 4)`` [N].
        torque: torque beyond the share of its limit that may be used ``(N, nj)`` [N m].
    """

    force: FloatArray
    moment: FloatArray
    friction: FloatArray
    normal_force: FloatArray
    torque: FloatArray


@dataclass(frozen=True, eq=False)
class ContactForces:
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


_KINDS: Final = (
    ForceStatus.FRICTION,
    ForceStatus.NORMAL_FORCE,
    ForceStatus.TORQUE,
    ForceStatus.BALANCE,
)


def judged(problem: ForceProblem, forces: FloatArray, conflicts: BoolArray) -> ContactForces:
    """Contact forces with the torques that belong to them and all residuals.

    Args:
        problem: the problem.
        forces: ``(N, 4, 3)`` in the world's axes [N].
        conflicts: which limits were found to be in the way ``(N, 8 + nj)``; those that the forces
            exceed are added.
    """
    standing, limits = problem.standing, problem.limits
    normals = problem.equations.contacts.normals
    pressing = np.einsum("nfi,nfi->nf", normals, forces)
    sliding = np.linalg.norm(forces - pressing[..., None] * normals, axis=2)
    friction = -(pyramid_rows(limits, normals) @ forces[..., None])[..., 0].min(axis=2)
    least = problem.weight * limits.least_normal_shares(standing)
    left = problem.equations.residuals(forces)
    torques = problem.equations.torques(forces)
    beyond = np.maximum(problem.torque_low - torques, torques - problem.torque_high)
    residuals = ForceResiduals(
        force=np.linalg.norm(left[:, :3], axis=1),
        moment=np.linalg.norm(left[:, 3:], axis=1),
        friction=np.where(standing, np.maximum(friction, 0.0), 0.0),
        normal_force=np.where(standing, np.maximum(least - pressing, 0.0), 0.0),
        torque=np.maximum(beyond, 0.0),
    )
    return ContactForces(
        times=problem.times,
        forces=forces,
        torques=torques,
        standing=standing,
        reserve=np.where(standing, pressing / problem.weight, np.inf).min(axis=1),
        friction_use=np.where(standing, _cone_use(sliding, limits.friction * pressing), 0.0),
        torque_use=_torque_use(problem, torques),
        residuals=residuals,
        conflict_table=conflicts | _exceeded(problem, residuals),
        limits=limits,
        joint_names=problem.robot.joint_names,
        unlimited=effort_limits(problem.robot).unknown,
        weight=problem.weight,
        length=problem.length,
    )


def _exceeded(problem: ForceProblem, residuals: ForceResiduals) -> BoolArray:
    """Which limits the forces exceed by more than rounding ``(N, 8 + nj)``."""
    largest = np.maximum(-problem.torque_low, problem.torque_high)
    return np.concatenate(
        [
            residuals.friction > FORCE_TOLERANCE * problem.weight,
            residuals.normal_force > FORCE_TOLERANCE * problem.weight,
            residuals.torque > FORCE_TOLERANCE * largest,
        ],
        axis=1,
    )


def _cone_use(sliding: FloatArray, holding: FloatArray) -> FloatArray:
    """Tangential force as a share of the largest one; ``inf`` where a foot does not press."""
    pressed = holding > 0.0
    return np.where(pressed, sliding / np.where(pressed, holding, 1.0), np.inf)


def _torque_use(problem: ForceProblem, torques: FloatArray) -> FloatArray:
    """Torques as shares of what the joints have ``(N, nj)``; NaN without a known limit."""
    bound = np.where(torques >= 0.0, problem.torque_high, -problem.torque_low)
    full = bound / problem.limits.torque_share
    known = np.isfinite(full)
    with np.errstate(divide="ignore", invalid="ignore"):
        use = np.abs(torques) / full
    # No torque at a speed at which the motor has none is no use at all.
    return np.where(known, np.where(torques == 0.0, 0.0, use), np.nan)
