"""A coordinate of the body whose acceleration is linear between knots."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gaitopt.conventions import FloatArray

KNOT = 0.01
"""Time between knots, at most [s]: between them the ZMP leaves a line by 0.02 mm (accelerations of
an inverted pendulum of 0.3 m, 5 cm beside it)."""
MOST_KNOTS = 24
"""Most intervals of a phase, and least are a quarter of it."""
INSET = 1e-7
"""Share of an interval by which its ends lie inside: accelerations jump where feet land."""
SHARES = (INSET, 0.5, 1.0 - INSET)
"""Where in each interval the ZMP is looked at."""


@dataclass(frozen=True, eq=False)
class Accelerations:
    """Accelerations at knots, and what follows from them at instants.

    Attributes:
        knots: ``(K + 1,)`` [s].
        begin, end: the unknown at both ends of each interval ``(K,)``.
        times: instants at which the ZMP is looked at ``(N,)`` [s].
        place, velocity, acceleration: rows by the unknowns at these instants ``(N, n)``.
        stop: rows of the velocity, and of the acceleration, at the end ``(2, n)``.
        phase: of each instant ``(N,)``.
    """

    knots: FloatArray
    begin: np.ndarray
    end: np.ndarray
    times: FloatArray
    place: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    stop: FloatArray
    phase: np.ndarray

    @property
    def size(self) -> int:
        """How many unknowns each coordinate has."""
        return int(self.end[-1]) + 1

    @classmethod
    def of(cls, phases: FloatArray) -> Accelerations:
        """Over phases with these ends ``(P + 1,)`` [s]; between phases accelerations may jump."""
        counts = np.clip(np.ceil(np.diff(phases) / KNOT), MOST_KNOTS // 4, MOST_KNOTS).astype(int)
        parts = [np.linspace(a, b, n, endpoint=False)
                 for a, b, n in zip(phases[:-1], phases[1:], counts, strict=True)]  # fmt: skip
        knots = np.append(np.concatenate(parts), phases[-1])
        owner = np.repeat(np.arange(len(counts)), counts)
        begin = np.arange(len(owner)) + owner
        end = begin + 1
        size = int(end[-1]) + 1
        lengths = np.diff(knots)
        rows: list[list[FloatArray]] = [[], [], []]
        place, velocity = np.zeros(size), np.zeros(size)
        eye = np.eye(size)
        for i, h in enumerate(lengths.tolist()):
            a, b = eye[begin[i]], eye[end[i]]
            for share in (*SHARES, 1.0):
                t = share * h
                slope = (b - a) / h
                now = (place + velocity * t + a * t**2 / 2.0 + slope * t**3 / 6.0,
                       velocity + a * t + slope * t**2 / 2.0, a + slope * t)  # fmt: skip
                if share < 1.0:
                    for row, value in zip(rows, now, strict=True):
                        row.append(value)
            place, velocity = now[0], now[1]
        times = (knots[:-1, None] + lengths[:, None] * np.array(SHARES)).ravel()
        place_rows, velocity_rows, acceleration_rows = (np.array(row) for row in rows)
        return cls(knots, begin, end, times, place_rows, velocity_rows, acceleration_rows,
                   np.stack([velocity, eye[-1]]), np.repeat(owner, len(SHARES)))  # fmt: skip

    def coefficients(self, base: FloatArray, solution: FloatArray) -> FloatArray:
        """Polynomials of x and y, highest power first ``(4, K, 2)``.

        Args:
            base: x and y, and their rates, at the begin ``(2, 2)``.
            solution: accelerations ``(n, 2)``.
        """
        place, rate = np.array(base[0]), np.array(base[1])
        out = np.empty((4, len(self.begin), 2))
        for i, h in enumerate(np.diff(self.knots).tolist()):
            a, b = solution[self.begin[i]], solution[self.end[i]]
            slope = (b - a) / h
            out[:, i] = slope / 6.0, a / 2.0, rate, place
            place = place + rate * h + a * h**2 / 2.0 + slope * h**3 / 6.0
            rate = rate + a * h + slope * h**2 / 2.0
        return out
