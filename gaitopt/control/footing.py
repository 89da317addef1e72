"""Which feet bear load, which are late, and when the clock stands still for them."""

from __future__ import annotations

import numpy as np

from gaitopt.control.gains import ControlGains
from gaitopt.control.reference import LEAST_LOAD, Reference
from gaitopt.conventions import LEGS, BoolArray, FloatArray


class Footing:
    """Follows the feet's contacts over time.

    Attributes:
        grounded: feet that should stand and have found the ground ``(4,)``.
        awaited: feet that the clock stands still for ``(4,)``.
        waited: how long it has stood still so far, beyond the pauses of the reference [s].
        probe: how far below its reference each foot reaches for the ground ``(4,)`` [m].

    Args:
        reference: what is followed.
        gains: of the controller.
        dt: control interval [s].
    """

    def __init__(self, reference: Reference, gains: ControlGains, dt: float) -> None:
        self._reference, self._gains, self._dt = reference, gains, dt
        four = len(LEGS)
        # All feet that stand at the plan's start have found the ground.
        self.grounded: BoolArray = np.array(reference.standing[0])
        self.awaited: BoolArray = np.zeros(four, dtype=np.bool_)
        self.waited = 0.0
        self.probe: FloatArray = np.zeros(four)
        # How long each foot has borne load [s]; those at the start always have.
        self._bearing_time = np.where(self.grounded, np.inf, 0.0)
        # How long each foot has been without contact, and how late each is that should stand [s].
        self._airborne_time = np.zeros(four)
        self._delay = np.zeros(four)
        # How long the clock still may stand still [s].
        self._wait_left = gains.longest_wait

    @property
    def taken_up(self) -> FloatArray:
        """Share of its load that each foot has taken up since it has found the ground ``(4,)``."""
        return np.minimum(self._bearing_time / self._gains.loading_time, 1.0)

    def wait(self, tick: int) -> int:
        """The tick to follow. The clock stands still while a foot is missing that should stand.

        So no foot lifts off before another has taken up its load, and the body does not go on
        without its support. Where a foot lands at the very instant at which another lifts off, the
        walk would otherwise depend on the ground being exactly where the plan has it.
        """
        standing, gains = self._reference.standing, self._gains
        after = standing[min(tick + 1, len(standing) - 1)]
        if (standing[tick] & ~after).any():
            missing = after & (self._bearing_time < gains.loading_time)
        else:
            missing = after & (self._delay > gains.tolerated_delay)
        if not self._reference.patient[tick]:
            self.awaited = np.zeros(len(LEGS), dtype=np.bool_)
            return tick
        if self._wait_left <= 0.0 or not missing.any():
            self.awaited = np.zeros(len(LEGS), dtype=np.bool_)
            if not missing.any():
                self._wait_left = gains.longest_wait
            return tick
        self.awaited = missing
        self._wait_left -= self._dt
        self.waited += self._dt
        return tick

    def update(self, tick: int, contacts: BoolArray) -> None:
        """Follow which feet touch the ground, ``contacts (4,)``."""
        gains, dt = self._gains, self._dt
        standing = self._reference.standing[tick] | self.awaited
        self._airborne_time = np.where(contacts, 0.0, self._airborne_time + dt)
        lost = self._airborne_time > gains.contact_loss
        self.grounded = standing & (contacts | (self.grounded & ~lost))
        self._bearing_time = np.where(self.grounded, self._bearing_time + dt, 0.0)
        probing = standing & ~self.grounded
        self._delay = np.where(probing, self._delay + dt, 0.0)
        deeper = np.minimum(self.probe + gains.probe_speed * dt, gains.probe_depth)
        self.probe = np.where(probing, deeper, np.where(standing, self.probe, 0.0))

    def loads(self, tick: int) -> FloatArray:
        """Share of a full load for each foot ``(4,)``, 0 for those in the air."""
        taken_up = self.taken_up
        load = self._reference.load[tick]
        if self.awaited.any():
            # While the clock stands still, the load of the foot that is about to lift off goes
            # over to the one that has landed.
            standing = self._reference.standing
            leaving = standing[tick] & ~standing[min(tick + 1, len(standing) - 1)]
            load = np.where(leaving, 1.0 - taken_up[self.awaited].min(), 1.0)
        return np.asarray(self.grounded * np.maximum(np.minimum(load, taken_up), LEAST_LOAD))
