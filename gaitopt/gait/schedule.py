"""Gait schedules: which feet stand at which time, over a cycle that repeats without end.

Every leg stands for the same share of the cycle, the duty factor, and touches down at its own share
of the cycle, its phase offset. Touchdowns and lift-offs within :data:`SNAP` of each other, or of
the cycle's start, are the same instant, so that no support lasts only for a rounding error.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike

from gaitopt.conventions import LEGS, BoolArray, FloatArray, frozen
from gaitopt.errors import InputError
from gaitopt.inputs import as_text, check_array, check_number
from gaitopt.robots.leg_names import LegMapping, leg_named

SNAP: Final = 1e-9
"""Shares of a cycle that differ by this or less are the same instant. Sums of shares are rounded to
about 1e-16, and times of long walks to 1e-11 of a cycle."""
SHORTEST: Final = 1e-6
"""Least share of the cycle for which a leg stands, and for which it swings: far above
:data:`SNAP`, so that both last."""
MOST_CYCLES: Final = 100_000
"""Most cycles that :meth:`GaitSchedule.intervals` lists: about a day of walking."""
OWN: Final = "own"
"""Name of a gait that has no other name."""
CYCLE_TIMES: Final = (1e-3, 1e5)
"""Shortest and longest cycle [s]; others are taken for a mistake."""


@dataclass(frozen=True)
class SupportInterval:
    """A time in which the same feet stand.

    Attributes:
        start: its start, which is part of it [s].
        end: its end, which is not [s].
        support: the legs that stand, in the order of :data:`gaitopt.LEGS`.
    """

    start: float
    end: float
    support: tuple[str, ...]

    @property
    def duration(self) -> float:
        """How long it lasts [s]."""
        return self.end - self.start


@dataclass(frozen=True)
class GaitSchedule:
    """Which feet stand at which time, over a cycle that repeats without end.

    A leg stands from its touchdown, inclusive, to its lift-off, exclusive. In a trot with a duty
    factor of 0.5 LF and RH stand in the first half of the cycle. Source: [XiLing], Module D,
    eqs. (28)-(38).

    Args:
        cycle_time: duration of a cycle [s].
        duty_factor: share of the cycle for which each leg stands, eq. (30).
        phase_offsets: for each leg the share of the cycle in [0, 1) at which it touches down,
            eq. (31). They are stored as given, save that a whole cycle becomes 0; the instants with
            rounding removed are :attr:`touchdowns`.
        name: of the gait.

    Raises:
        InputError: a number is out of range, or a leg is missing or unknown.
    """

    cycle_time: float
    duty_factor: float
    phase_offsets: Mapping[str, float]
    name: str = OWN

    def __post_init__(self) -> None:
        time = check_number("cycle_time", self.cycle_time, *CYCLE_TIMES, "s")
        duty = check_number("duty_factor", self.duty_factor, SHORTEST, 1.0 - SHORTEST)
        offsets = _checked_offsets(self.phase_offsets)
        if not (isinstance(self.name, str) and self.name):
            raise InputError(f"name must be a text, got {as_text(self.name)}")
        object.__setattr__(self, "cycle_time", time)
        object.__setattr__(self, "duty_factor", duty)
        object.__setattr__(self, "phase_offsets", LegMapping(offsets))

    def __hash__(self) -> int:
        return hash((self.cycle_time, self.duty_factor, *self.phase_offsets.values(), self.name))

    def __reduce__(self) -> tuple[object, ...]:
        return (
            GaitSchedule,
            (self.cycle_time, self.duty_factor, dict(self.phase_offsets), self.name),
        )

    @property
    def stance_time(self) -> float:
        """How long a leg stands in a cycle [s]."""
        return self.duty_factor * self.cycle_time

    @property
    def swing_time(self) -> float:
        """How long a leg swings in a cycle [s]."""
        return (1.0 - self.duty_factor) * self.cycle_time

    @property
    def steps(self) -> int:
        """Steps in a cycle: the number of different instants of lift-off, n_s of eq. (29)."""
        return len(self.order)

    @property
    def step_time(self) -> float:
        """Duration of a step, T_s of eq. (29) [s]."""
        return self.cycle_time / self.steps

    def stride(self, velocity: float) -> float:
        """Distance covered in a cycle at a body velocity [m/s], eq. (28) [m]."""
        return check_number("velocity", velocity, -1e6, 1e6, "m/s") * self.cycle_time

    @property
    def touchdowns(self) -> Mapping[str, float]:
        """Share of the cycle in [0, 1) at which each leg touches down.

        It is the phase offset to within a few :data:`SNAP`, so that instants that coincide are
        equal.
        """
        return self._instants[0]

    @property
    def liftoffs(self) -> Mapping[str, float]:
        """Share of the cycle in [0, 1) at which each leg lifts off."""
        return self._instants[1]

    @cached_property
    def _instants(self) -> tuple[Mapping[str, float], Mapping[str, float]]:
        touches = dict(self.phase_offsets)
        lifts = {leg: (share + self.duty_factor) % 1.0 for leg, share in touches.items()}
        instant = _joined(touches.values(), lifts.values())
        return (
            LegMapping({leg: instant[share] for leg, share in touches.items()}),
            LegMapping({leg: instant[share] for leg, share in lifts.items()}),
        )

    @cached_property
    def order(self) -> tuple[tuple[str, ...], ...]:
        """The legs in the order of their lift-offs from the cycle's start.

        Legs that lift off together stand in one tuple, in the order of :data:`gaitopt.LEGS`. A
        lift-off at the very start of the cycle is the first.
        """
        lifts = self.liftoffs
        return tuple(
            tuple(leg for leg in LEGS if lifts[leg] == share)
            for share in sorted(set(lifts.values()))
        )

    @cached_property
    def edges(self) -> FloatArray:
        """Shares of the cycle in [0, 1) at which the support changes ``(K,)``, increasing."""
        return frozen(sorted({*self.touchdowns.values(), *self.liftoffs.values()}))

    @cached_property
    def _patterns(self) -> BoolArray:
        """Which legs stand from each edge to the next ``(K, 4)``."""
        touch, lift = (_by_leg(shares) for shares in (self.touchdowns, self.liftoffs))
        # Instants are either equal to the last bit, or more than SNAP apart.
        standing = (self.edges[:, None] - touch) % 1.0 < (lift - touch) % 1.0
        standing.setflags(write=False)
        return standing

    @property
    def least_support(self) -> int:
        """The fewest feet that ever stand."""
        return int(self._patterns.sum(axis=1).min())

    @property
    def has_flight(self) -> bool:
        """Whether there are times at which no foot stands, and so there is no ZMP."""
        return self.least_support == 0

    def phase(self, t: ArrayLike) -> FloatArray:
        """The share of the cycle in [0, 1) that has passed at times ``(...)`` [s]: ``(...)``.

        Cycles repeat before t = 0 as well. A phase within :data:`SNAP` of a whole cycle is 0.

        Raises:
            InputError: a time is not finite.
        """
        times = check_array("t", t)
        if not np.isfinite(times).all():
            raise InputError("times must be finite")
        return wrapped(times / self.cycle_time)

    def leg_phases(self, t: ArrayLike) -> FloatArray:
        """The share of the cycle since each leg's last touchdown at times ``(...)``: ``(..., 4)``.

        Below the duty factor the leg stands, from there on it swings. A phase within
        :data:`SNAP` of a touchdown is 0.
        """
        return wrapped(self.phase(t)[..., None] - _by_leg(self.touchdowns))

    def support(self, t: ArrayLike) -> BoolArray:
        """Which feet stand at times ``(...)`` [s]: ``(..., 4)``, S(t) of eq. (36).

        A time less than :data:`SNAP` of a cycle before a touchdown or lift-off counts as that
        instant.
        """
        found = np.searchsorted(self.edges, self.phase(t) + SNAP, side="right") - 1
        return self._patterns[found]

    def intervals(self, duration: float) -> tuple[SupportInterval, ...]:
        """The maximal intervals of constant support from t = 0 to ``duration`` [s], in order.

        Each begins where the one before ends. None is shorter than :data:`SNAP` of a cycle.

        Raises:
            InputError: the duration is not positive, or of more than :data:`MOST_CYCLES` cycles.
        """
        most = MOST_CYCLES * self.cycle_time
        duration = check_number("duration", duration, SNAP * self.cycle_time, most, "s")
        cycles = np.arange(np.ceil(duration / self.cycle_time))
        times = (cycles[:, None] * self.cycle_time + self.edges * self.cycle_time).ravel()
        least = SNAP * self.cycle_time
        inside = (times > least) & (times < duration - least)
        starts = np.concatenate([[0.0], times[inside]]).tolist()
        patterns = np.tile(self._patterns, (len(cycles), 1))[inside]
        standing = np.concatenate([self.support([0.0]), patterns]).tolist()
        return tuple(
            SupportInterval(start, end, tuple(leg for leg, s in zip(LEGS, row, strict=True) if s))
            for start, end, row in zip(starts, [*starts[1:], duration], standing, strict=True)
        )

    def with_cycle_time(self, cycle_time: float) -> GaitSchedule:
        """The same gait, faster or slower."""
        return GaitSchedule(cycle_time, self.duty_factor, self.phase_offsets, self.name)

    def with_duty_factor(self, duty_factor: float, name: str = OWN) -> GaitSchedule:
        """The same touchdowns with longer or shorter stances.

        The cyclic order of the touchdowns stays the same, and so does that of the lift-offs. The
        name is another, because it may be another gait.
        """
        return GaitSchedule(self.cycle_time, duty_factor, self.phase_offsets, name)

    def to_dict(self) -> dict[str, Any]:
        """The schedule as plain JSON values."""
        return {
            "name": self.name,
            "cycle_time": self.cycle_time,
            "duty_factor": self.duty_factor,
            "phase_offsets": dict(self.phase_offsets),
        }

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> GaitSchedule:
        """The schedule that :meth:`to_dict` wrote.

        Raises:
            InputError: an entry is missing, unknown or out of range.
        """
        known = {"name", "cycle_time", "duty_factor", "phase_offsets"}
        if not isinstance(values, Mapping) or set(values) != known:
            got = ", ".join(map(str, values)) if isinstance(values, Mapping) else as_text(values)
            raise InputError(
                f"a gait schedule has the entries {', '.join(sorted(known))}, got {got}"
            )
        return cls(**values)


def wrapped(shares: ArrayLike) -> FloatArray:
    """``shares`` without whole cycles, in [0, 1); 0 where they are within :data:`SNAP` of one."""
    rest = np.mod(np.asarray(shares, dtype=np.float64), 1.0)
    return np.where((rest <= SNAP) | (rest >= 1.0 - SNAP), 0.0, rest)


def _by_leg(shares: Mapping[str, float]) -> FloatArray:
    return np.array([shares[leg] for leg in LEGS])


def _joined(touches: Iterable[float], lifts: Iterable[float]) -> dict[float, float]:
    """For each share of the cycle the instant that it belongs to.

    Shares that follow one another within :data:`SNAP` are the same instant. It is the cycle's
    start, where that is among them; else the first touchdown among them, or else the first of them.
    (A limit on their distance from that one would separate shares that differ by rounding.)

    Args:
        touches, lifts: shares of the cycle of the touchdowns and the lift-offs.
    """
    touching = set(touches)
    shares = sorted({*touching, *lifts, 0.0, 1.0})
    starts = [i for i, share in enumerate(shares) if i == 0 or share - shares[i - 1] > SNAP]
    instants = {}
    for start, end in zip(starts, [*starts[1:], len(shares)], strict=True):
        together = shares[start:end]
        instant = next((share for share in together if share in touching), together[0])
        if together[0] == 0.0 or together[-1] == 1.0:
            instant = 0.0
        instants.update(dict.fromkeys(together, instant))
    return instants


def _checked_offsets(offsets: object) -> dict[str, float]:
    """Phase offsets in the order of the legs."""
    named = [leg_named(str(name)) for name in offsets] if isinstance(offsets, Mapping) else []
    if not isinstance(offsets, Mapping) or sorted(map(str, named)) != sorted(LEGS):
        got = ", ".join(map(str, offsets)) if isinstance(offsets, Mapping) else as_text(offsets)
        raise InputError(f"phase_offsets must name each of {', '.join(LEGS)} once, got {got}")
    shares, found = dict(zip(named, offsets.values(), strict=True)), {}
    for leg in LEGS:
        share = check_number(f"phase_offsets[{leg!r}]", shares[leg], -1e6, 1e6)
        # A caller's own remainder may be a whole cycle: (-1e-17) % 1.0 is 1.0.
        if not -SNAP <= share <= 1.0 + SNAP:
            raise InputError(
                f"phase_offsets[{leg!r}] must be in [0, 1), got {share:g}; without whole cycles "
                f"that is {float(wrapped(share)):g}"
            )
        found[leg] = share if 0.0 < share < 1.0 else 0.0
    return found
