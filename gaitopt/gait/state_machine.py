"""The gait state machine: what each leg does, by the clock and by its contact with the ground.

Every leg starts in INITIAL and then repeats LIFT_OFF, SWING, TOUCHDOWN and STANCE. From each state
it can change only to the next one. A planner needs no machine: :func:`swing_events` lists the
swings of a whole walk.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from math import inf
from types import MappingProxyType
from typing import Final

from gaitopt.conventions import LEGS
from gaitopt.errors import InputError
from gaitopt.gait.schedule import CYCLE_TIMES, GaitSchedule, wrapped
from gaitopt.gait.step_timing import GaitClock, Moment, check_cycles, first_swings
from gaitopt.gait.step_timing import SwingEvent as SwingEvent
from gaitopt.gait.step_timing import swing_events as swing_events
from gaitopt.inputs import check_kind, check_number
from gaitopt.robots.leg_names import as_leg

LONGEST_ADVANCE: Final = 1000
"""Most cycles in one call of :meth:`GaitStateMachine.advance` on a walk without end, so that a
wrong time does not make it run for hours."""
LONGEST_TIME: Final = 1e12
"""Latest time of a walk with an end [s]."""


class LegState(Enum):
    """State of a leg. Source: [XiLing], Module E, Section 5.1."""

    INITIAL = "initial"
    """It stands, and has not swung yet."""
    LIFT_OFF = "lift-off"
    """It has just left the ground."""
    SWING = "swing"
    """It is on its way to its next foothold."""
    TOUCHDOWN = "touchdown"
    """It has just come down."""
    STANCE = "stance"
    """It stands."""

    @property
    def following(self) -> LegState:
        """The only state that can come after this one."""
        return _FOLLOWING[self]

    @property
    def stands(self) -> bool:
        """Whether the foot is on the ground in this state."""
        return self not in (LegState.LIFT_OFF, LegState.SWING)


_FOLLOWING: Final = {
    LegState.INITIAL: LegState.LIFT_OFF,
    LegState.LIFT_OFF: LegState.SWING,
    LegState.SWING: LegState.TOUCHDOWN,
    LegState.TOUCHDOWN: LegState.STANCE,
    LegState.STANCE: LegState.LIFT_OFF,
}


@dataclass(frozen=True)
class LegEvent:
    """A leg's change to its next state.

    Attributes:
        time: of the change [s]: that of the clock, or, for a contact that comes early or late, that
            of the call of :meth:`GaitStateMachine.advance` which was told of it.
        leg: the leg.
        step: number of its swing, from 0.
        state: the new state.
        delay: how much later than planned it touched down [s]; negative if early, 0 for the other
            states.
    """

    time: float
    leg: str
    step: int
    state: LegState
    delay: float = 0.0


class GaitStateMachine:
    """The states of four legs during a walk.

    Without contacts every leg follows the clock. With measured contacts a swinging foot that meets
    the ground early touches down early. A foot that has not met it at its planned touchdown stays
    in its swing, and the clock of the gait stands still until it has: no other leg lifts off in the
    meantime, and everything later is delayed by the same time. Feet that are late by more than
    ``longest_wait`` are :attr:`overdue`; the caller decides what to do about them.

    LIFT_OFF and TOUCHDOWN last for ``transition_time``; but a LIFT_OFF ends at the planned
    touchdown at the latest, and a TOUCHDOWN at the next lift-off.

    Source: [XiLing], Module E, Sections 5.1 and 5.2.

    Args:
        schedule: the gait.
        cycles: swings of each leg, after which all stand; by default without end.
        first: the leg that lifts off first, see :func:`swing_events`.
        transition_time: how long LIFT_OFF and TOUCHDOWN last [s]; by default until the next call of
            :meth:`advance`, so that each is seen once.
        longest_wait: how late a foot may be before it is overdue [s].
        earliest_contact: share of the planned swing before which a contact does not count, because
            the foot has hardly left the ground.

    Raises:
        InputError: a number is out of range, or there is no such leg.
    """

    def __init__(
        self,
        schedule: GaitSchedule,
        cycles: int | None = None,
        *,
        first: str | None = None,
        transition_time: float | None = None,
        longest_wait: float = 0.5,
        earliest_contact: float = 0.5,
    ) -> None:
        check_kind("schedule", schedule, GaitSchedule)
        self.schedule = schedule
        self.cycles = None if cycles is None else check_cycles(cycles)
        self.longest_wait = check_number("longest_wait", longest_wait, 0.0, CYCLE_TIMES[1], "s")
        self.earliest_contact = check_number("earliest_contact", earliest_contact, 0.0, 1.0)
        self.transition_time = (
            None
            if transition_time is None
            else check_number("transition_time", transition_time, 0.0, CYCLE_TIMES[1], "s")
        )
        self._first = first_swings(schedule, first)
        self._start = schedule.liftoffs[min(LEGS, key=lambda leg: self._first[leg][0])]
        self._clock = GaitClock([schedule.cycle_time])
        self._time = 0.0
        self._latest = 0.0
        self._state = dict.fromkeys(LEGS, LegState.INITIAL)
        self._swings = dict.fromkeys(LEGS, 0)
        self._until = dict.fromkeys(LEGS, inf)
        self._late: set[str] = set()

    @property
    def time(self) -> float:
        """The present time [s]."""
        return self._time

    @property
    def cycles_passed(self) -> float:
        """Cycles since the start: the sum of ``dt / T`` over time, T the cycle time."""
        return self._clock.cycles_at(self._time)

    @property
    def phase(self) -> float:
        """The phase of the schedule in [0, 1)."""
        return float(wrapped(self._start + self.cycles_passed))

    @property
    def cycle_time(self) -> float:
        """Duration of the present cycle [s]."""
        return self._clock.period_at(self._time)

    @property
    def states(self) -> Mapping[str, LegState]:
        """The state of each leg."""
        return MappingProxyType(dict(self._state))

    @property
    def support(self) -> tuple[str, ...]:
        """The legs that stand, in the order of :data:`gaitopt.LEGS`."""
        return tuple(leg for leg in LEGS if self._state[leg].stands)

    @property
    def late(self) -> tuple[str, ...]:
        """The legs that should stand but have not met the ground; the clock stands still."""
        return tuple(leg for leg in LEGS if leg in self._late)

    @property
    def overdue(self) -> tuple[str, ...]:
        """The late legs, once the clock has stood still for longer than ``longest_wait``."""
        since = self._clock.halted
        return self.late if since is not None and self._time - since > self.longest_wait else ()

    @property
    def finished(self) -> bool:
        """Whether all legs have done all of their swings, and stand."""
        return all(n == self.cycles for n in self._swings.values()) and len(self.support) == 4

    @property
    def duration(self) -> float:
        """Planned time of the last touchdown [s]; infinite for a walk without end.

        It changes with the cycle time, and when the clock has stood still.
        """
        if self.cycles is None:
            return inf
        if self.cycles == 0:
            return 0.0
        last = max(touch for _, touch in self._first.values())
        return self._clock.time_of(last.later(self.cycles - 1))

    def set_cycle_time(self, cycle_time: float) -> None:
        """Change the duration of the cycles from the next one on [s]; the phase does not jump.

        A cycle begins whenever :attr:`cycles_passed` is a whole number; one that begins at the
        present time is changed, too.

        Raises:
            InputError: it is out of range.
        """
        self._clock.change(self._time, check_number("cycle_time", cycle_time, *CYCLE_TIMES, "s"))

    def advance(
        self, time: float, contacts: Mapping[str, bool] | None = None
    ) -> tuple[LegEvent, ...]:
        """Go on to ``time`` [s].

        Args:
            time: not before the present time; on a walk without end at most
                :data:`LONGEST_ADVANCE` cycles later.
            contacts: whether each foot touches the ground at ``time``, if that is measured. Without
                it feet touch down as planned, and those that are late do so now.

        Returns:
            The changes of state in the meantime, in order of time.

        Raises:
            InputError: the time is out of range, or contacts do not name each leg.
        """
        most = (
            self._time + self.cycle_time * LONGEST_ADVANCE if self.cycles is None else LONGEST_TIME
        )
        time = check_number("time", time, self._time, most, "s")
        touching = None if contacts is None else _checked_contacts(contacts)
        for leg in LEGS:
            if self._until[leg] == inf:
                self._until[leg] = self._time
        events: list[LegEvent] = []
        self._run(time, touching, events)
        self._land(time, touching, events)
        self._run(time, touching, events)
        self._time = time
        return tuple(events)

    def _run(
        self, time: float, touching: Mapping[str, bool] | None, events: list[LegEvent]
    ) -> None:
        """Make all changes of state that are due by the clock until ``time``.

        Of changes at the same instant, touchdowns come before lift-offs.
        """
        while True:
            leg = min(LEGS, key=lambda leg: (self._due(leg), self._state[leg].stands))
            due = self._due(leg)
            if due > time:
                return
            if self._state[leg] is LegState.SWING and touching is not None and not touching[leg]:
                self._late.add(leg)
                self._clock.halted = due
            else:
                self._move_on(leg, due, events)

    def _land(
        self, time: float, touching: Mapping[str, bool] | None, events: list[LegEvent]
    ) -> None:
        """Make the touchdowns, early or late, of feet that touch the ground at ``time``."""
        for leg in LEGS:
            late = leg in self._late
            touches = late if touching is None else touching[leg]
            far_enough = late or self._swung(leg, time) >= self.earliest_contact
            if self._state[leg] is LegState.SWING and touches and far_enough:
                self._late.discard(leg)
                self._move_on(leg, time, events)
        if not self._late:
            self._clock.resume(time)

    def _due(self, leg: str) -> float:
        """Time of a leg's next change of state by the clock [s]."""
        state = self._state[leg]
        if state is LegState.SWING:
            return inf if leg in self._late else self._next_touch(leg)
        if state is LegState.LIFT_OFF:
            return min(self._until[leg], self._next_touch(leg))
        if state is LegState.TOUCHDOWN:
            return min(self._until[leg], self._next_lift(leg))
        return self._next_lift(leg)

    def _next_lift(self, leg: str) -> float:
        """Time of a leg's next lift-off by the clock [s]; infinite if the clock stops before."""
        if self._swings[leg] == self.cycles:
            return inf
        time = self._clock.time_of(self._first[leg][0].later(self._swings[leg]))
        return time if self._clock.halted is None or time < self._clock.halted else inf

    def _next_touch(self, leg: str) -> float:
        """Time of the touchdown of a leg's swing by the clock [s]; infinite if it stops before."""
        time = self._clock.time_of(self._touch(leg))
        return time if self._clock.halted is None or time <= self._clock.halted else inf

    def _touch(self, leg: str) -> Moment:
        """The planned touchdown of a leg's present swing."""
        return self._first[leg][1].later(self._swings[leg] - 1)

    def _swung(self, leg: str, time: float) -> float:
        """The share of its planned swing that a leg has done at ``time``."""
        lift = self._first[leg][0].later(self._swings[leg] - 1).cycles
        return (self._clock.cycles_at(time) - lift) / (self._touch(leg).cycles - lift)

    def _move_on(self, leg: str, time: float, events: list[LegEvent]) -> None:
        """Change a leg's state to the next one, and add the event."""
        # By rounding, a clock that goes on can be ahead of the time at which it was told to.
        time = self._latest = max(time, self._latest)
        state = self._state[leg] = self._state[leg].following
        delay = 0.0
        if state is LegState.LIFT_OFF:
            self._swings[leg] += 1
        if state is LegState.TOUCHDOWN:
            delay = time - self._clock.time_of(self._touch(leg))
        if state in (LegState.LIFT_OFF, LegState.TOUCHDOWN):
            self._until[leg] = inf if self.transition_time is None else time + self.transition_time
        events.append(LegEvent(time, leg, self._swings[leg] - 1, state, delay))


def _checked_contacts(contacts: object) -> dict[str, bool]:
    named = {as_leg(name): name for name in contacts} if isinstance(contacts, Mapping) else {}
    if not isinstance(contacts, Mapping) or set(named) != set(LEGS) or len(contacts) != len(LEGS):
        got = ", ".join(map(str, contacts)) if isinstance(contacts, Mapping) else repr(contacts)
        raise InputError(f"contacts must name each of {', '.join(LEGS)} once, got {got}")
    return {leg: bool(contacts[named[leg]]) for leg in LEGS}
