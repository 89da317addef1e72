"""Plans that begin and end at rest, and stop where they are asked to.

Controllers refuse a trajectory whose last point moves, and no robot begins at full speed. The path
stays the same; only the pace changes: towards a stop it falls evenly from the plan's to zero, and
afterwards it rises again. Velocities never become larger.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property
from math import comb

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.errors import InputError
from gaitopt.inputs import check_number
from gaitopt.motion.path import MotionPath
from gaitopt.plan.plan import Plan

REST = 1e-9
"""Largest velocity that counts as rest [m/s, rad/s]: plans that end at rest do so within 1e-16."""
RAMP = 0.2
"""Time in which the pace rises from zero to the plan's, or falls [s]: to a joint at 10 rad/s it is
an acceleration of 50 rad/s^2, which small motors have."""
LEAST_RAMP = 1e-3
"""Shortest ramp [s]: one period of a quick controller."""


def ends_moving(plan: Plan) -> tuple[bool, bool]:
    """Whether body or joints move at the plan's beginning, and at its end."""
    rates = np.abs(plan.path.evaluate([0.0, plan.duration], 1)).max(axis=1)
    return bool(rates[0] > REST), bool(rates[1] > REST)


def at_rest(plan: Plan, ramp: float = RAMP, stops: Iterable[float] = ()) -> Plan:
    """The plan, at rest at both ends and at all stops; itself where it is so already.

    Args:
        plan: any plan.
        ramp: time in which the pace rises from zero to the plan's, or falls to zero [s]. Each ramp
            makes the plan longer by half of it. 0 refuses a plan that moves at its ends.
        stops: times of the plan at which the motion is to stop [s].

    Raises:
        InputError: ``ramp`` is out of range, the plan is too short for its ramps, or it moves at
            its ends and ``ramp`` is 0.
    """
    check_number("ramp", ramp, 0.0, 100.0, "s")
    moving = ends_moving(plan)
    ends = [t for t, moves in zip((0.0, plan.duration), moving, strict=True) if moves]
    inner = [float(t) for t in stops if np.abs(plan.path.evaluate([t], 1)).max() > REST]
    places = sorted({*ends, *inner})
    if not places:
        return plan
    if ramp < LEAST_RAMP:
        raise InputError(
            f"this plan moves at {places[0]:.3f} s, where it has to be at rest for a controller: "
            f"give a ramp of at least {LEAST_RAMP:g} s, or a plan of gaitopt.retimed"
        )
    pace = _Pace(plan.duration, np.array(places), float(ramp))
    phases = tuple(
        replace(phase, start=a, duration=max(b - a, 0.0))
        for phase, a, b in zip(
            plan.phases,
            pace.new_times([p.start for p in plan.phases]).tolist(),
            pace.new_times([min(p.end, plan.duration) for p in plan.phases]).tolist(),
            strict=True,
        )
    )
    return replace(plan, path=_followed(plan.path, pace), phases=phases)


@dataclass(frozen=True, eq=False)
class _Pace:
    """New times of a plan's old ones.

    Attributes:
        duration: of the plan [s].
        stops: old times at which the pace is zero, in order [s].
        ramp: time of a ramp, during which half of it passes in the plan [s].
    """

    duration: float
    stops: FloatArray
    ramp: float

    def __post_init__(self) -> None:
        if self.ramp > self.duration or (np.diff(self.stops) < self.ramp - 1e-12).any():
            raise InputError(
                f"ramps of {self.ramp:g} s are too long for stops at "
                f"{', '.join(f'{t:.3f}' for t in self.stops)} s of {self.duration:.3f} s; "
                "give a shorter ramp"
            )

    @cached_property
    def breaks(self) -> FloatArray:
        """Old times at which ramps begin and end."""
        half = 0.5 * self.ramp
        around = np.concatenate([self.stops - half, self.stops, self.stops + half])
        inside = around[(around > 0.0) & (around < self.duration)]
        return np.unique(np.concatenate([[0.0, self.duration], inside]))

    def rates(self, times: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Pace just after old ``times``, and its change a second, up to the next break."""
        middles = times + 1e-9 * self.ramp
        gaps = middles[:, None] - self.stops
        nearest = np.abs(gaps).argmin(axis=1)
        gap = gaps[np.arange(len(times)), nearest]
        ramping = np.abs(gap) < 0.5 * self.ramp
        # Old time passes as the square of the new time since the stop: t = u^2 / (2 ramp).
        left = np.abs(times - self.stops[nearest])
        pace = np.where(ramping, np.sqrt(2.0 * left / self.ramp), 1.0)
        change = np.where(ramping, np.sign(gap) / self.ramp, 0.0)
        return np.minimum(pace, 1.0), change

    def new_times(self, old: object) -> FloatArray:
        """New times of old ones ``(N,)``."""
        times = np.asarray(old, dtype=np.float64)
        edges = self.breaks
        lengths = np.diff(edges)
        ramping = self.rates(edges[:-1])[1] != 0.0
        starts = np.concatenate([[0.0], np.cumsum(np.where(ramping, self.ramp, lengths))])
        # A ramp takes the whole of its time, whatever the plan's rounding says of its half.
        piece = np.clip(np.searchsorted(edges, times, side="right") - 1, 0, len(lengths) - 1)
        share = (times - edges[piece]) / lengths[piece]
        rising = self.rates(edges[:-1])[1][piece] > 0.0
        eased = np.where(rising, np.sqrt(np.clip(share, 0.0, 1.0)),
                         1.0 - np.sqrt(np.clip(1.0 - share, 0.0, 1.0)))  # fmt: skip
        inside = np.where(ramping[piece], eased * self.ramp, share * lengths[piece])
        return np.asarray(starts[piece] + inside)


def _followed(path: MotionPath, pace: _Pace) -> MotionPath:
    """The path at another pace, as polynomials of twice the degree in the new time."""
    old = np.unique(np.concatenate([path.times, pace.breaks]))
    new = pace.new_times(old)
    rate, change = pace.rates(old[:-1])
    degree = path.degree
    # Taylor's coefficients at the beginning of every piece, in the old time.
    series = [path.evaluate(old[:-1], k) / np.prod(np.arange(1, k + 1)) for k in range(degree + 1)]
    out = np.zeros((2 * degree + 1, len(old) - 1, path.coefficients.shape[2]))
    for k, values in enumerate(series):
        # The old time since the piece's start is w (rate + change w / 2), w the new one.
        for m in range(k + 1):
            factor = comb(k, m) * rate ** (k - m) * (0.5 * change) ** m
            out[2 * degree - (k + m)] += factor[:, None] * values
    return MotionPath(new, out)
