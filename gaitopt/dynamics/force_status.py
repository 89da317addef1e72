"""Whether an instant of a motion has contact forces, and which limits are exceeded."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite
from typing import Final

from gaitopt.conventions import FloatArray, TextEnum

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
        "normal force: the ground would have to pull at a foot, the foot keeps less than its "
        "reserve, or it bears more than it may so soon after it has landed or before it lifts off; "
        "move slower, move the centre of mass further inside the support, or lessen the reserve "
        "or the transfer time"
    )
    """Forces that make the motion press too little on a foot, or too much on one that has just
    landed or is about to lift off."""
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

    @property
    def words(self) -> str:
        """Its name, ``"normal force"`` for instance."""
        return self.name.lower().replace("_", " ")


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
            joint's torque limit; ``inf`` where this limit is zero.
    """

    sample: int
    time: float
    kind: ForceStatus
    name: str
    amount: float
    unit: str
    share: float

    @property
    def excess(self) -> str:
        """By how much the limit is exceeded, in words."""
        # A limit of zero has no shares.
        share = f" ({100.0 * self.share:.3g} %)" if isfinite(self.share) else ""
        return f"exceeded by {self.amount:.3g} {self.unit}{share}"

    def __str__(self) -> str:
        return f"{self.kind.words} of {self.name} at {self.time:.3f} s: {self.excess}"


@dataclass(frozen=True, eq=False)
class ForceResiduals:
    """What is left of the equations of motion, and how far limits are exceeded; 0 where kept.

    Attributes:
        force: of the base's three force equations ``(N,)`` [N].
        moment: of the base's three moment equations ``(N,)`` [N m].
        friction: horizontal force outside the friction pyramid ``(N, 4)`` [N].
        normal_force: normal force that is missing, or too much ``(N, 4)`` [N].
        torque: torque beyond the share of its limit that may be used ``(N, nj)`` [N m].
    """

    force: FloatArray
    moment: FloatArray
    friction: FloatArray
    normal_force: FloatArray
    torque: FloatArray
