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
        waiting: whether there is such a foot.
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
        # Numbers of four feet are lists here: for four of them plain numbers are faster.
        self._lifting: list[bool] = _lifting(reference.standing).tolist()
        # All feet that stand at the plan's start have found the ground.
        self.grounded: BoolArray = np.array(reference.standing[0])
        self.awaited: BoolArray = np.zeros(four, dtype=np.bool_)
        self.waiting = False
        self.waited = 0.0
        self.probe: FloatArray = np.zeros(four)
        # How long each foot has borne load [s]; those at the start always have.
        self._bearing_time: list[float] = np.where(self.grounded, np.inf, 0.0).tolist()
        # How long each foot has been without contact, and how late each is that should stand [s].
        self._airborne_time, self._delay = [0.0] * four, [0.0] * four
        # How long the clock still may stand still [s].
        self._wait_left = gains.longest_wait

    @property
    def taken_up(self) -> FloatArray:
        """Share of its load that each foot has taken up since it has found the ground ``(4,)``."""
        # NumPy, because a loading time of 0 is allowed: it divides by zero.
        return np.minimum(np.array(self._bearing_time) / self._gains.loading_time, 1.0)

    def wait(self, tick: int) -> int:
        """The tick to follow. The clock stands still while a foot is missing that should stand.

        So no foot lifts off before another has taken up its load, and the body does not go on
        without its support. Where a foot lands at the very instant at which another lifts off, the
        walk would otherwise depend on the ground being exactly where the plan has it.
        """
        standing, gains = self._reference.standing, self._gains
        after = standing[min(tick + 1, len(standing) - 1)]
        if self._lifting[tick]:
            late = [time < gains.loading_time for time in self._bearing_time]
        else:
            late = [time > gains.tolerated_delay for time in self._delay]
        missing = any(a and b for a, b in zip(after.tolist(), late, strict=True))
        self.waiting = bool(self._reference.patient[tick]) and missing and self._wait_left > 0.0
        if not self.waiting:
            self.awaited = np.zeros(len(LEGS), dtype=np.bool_)
            if self._reference.patient[tick] and not missing:
                self._wait_left = gains.longest_wait
            return tick
        self.awaited = after & late
        self._wait_left -= self._dt
        self.waited += self._dt
        return tick

    def update(self, tick: int, contacts: BoolArray) -> None:
        """Follow which feet touch the ground, ``contacts (4,)``."""
        gains, dt = self._gains, self._dt
        stands = (self._reference.standing[tick] | self.awaited).tolist()
        grounded, probe = self.grounded.tolist(), self.probe.tolist()
        for i, (standing, touches) in enumerate(zip(stands, contacts.tolist(), strict=True)):
            airborne = 0.0 if touches else self._airborne_time[i] + dt
            found = standing and (touches or (grounded[i] and not airborne > gains.contact_loss))
            self._airborne_time[i], grounded[i] = airborne, found
            self._bearing_time[i] = self._bearing_time[i] + dt if found else 0.0
            if standing and not found:
                self._delay[i] += dt
                probe[i] = min(probe[i] + gains.probe_speed * dt, gains.probe_depth)
            else:
                self._delay[i], probe[i] = 0.0, probe[i] if standing else 0.0
        self.grounded, self.probe = np.array(grounded), np.array(probe)

    def loads(self, tick: int) -> FloatArray:
        """Share of a full load for each foot ``(4,)``, 0 for those in the air."""
        taken_up = self.taken_up
        load = self._reference.load[tick]
        if self.waiting:
            # While the clock stands still, the load of the foot that is about to lift off goes
            # over to the one that has landed.
            standing = self._reference.standing
            leaving = standing[tick] & ~standing[min(tick + 1, len(standing) - 1)]
            load = np.where(leaving, 1.0 - taken_up[self.awaited].min(), 1.0)
        return np.asarray(self.grounded * np.maximum(np.minimum(load, taken_up), LEAST_LOAD))


def _lifting(standing: BoolArray) -> BoolArray:
    """Whether a foot lifts off after each tick, for which feet stand ``(N, 4)``: ``(N,)``."""
    after = np.concatenate([standing[1:], standing[-1:]])
    return np.asarray((standing & ~after).any(axis=1))
