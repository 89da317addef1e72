"""Inverse kinematics of any three hinges in a row.

Let ``d`` be the common normal of the first two axes, which have the angle ``alpha`` between them,
and ``v(q3)`` the way from its end on the second axis to the foot. The first joint changes neither
the foot's height along its axis nor the foot's distance from the start of ``d``. That gives two
components of ``v`` after the second joint: ``e1 / sin(alpha)`` square to the second axis in the
plane of both axes, and ``e2 / |d|`` along ``d``, where ``e1`` and ``e2`` depend on ``q3`` alone.
The second joint keeps the length of ``v`` square to its axis::

    (e1 / sin(alpha))**2 + (e2 / |d|)**2 = |v_across|**2

which is a trigonometric polynomial of second degree in ``q3``: there are at most four postures.
Where the first two axes meet (``d = 0``) ``e2 = 0`` gives ``q3`` in closed form, and where they are
parallel ``e1 = 0`` does. Source: [Pieper1968]; the elimination by the common normal is our own.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.robots.general_leg.hinges import ThreeHinges

EXACT = 1e-10
"""Two axes that miss each other by less, as a share of the leg's length, or being parallel by less
[rad], count as meeting, or parallel: the closed form is then exact to 1e-9 m."""
NEARLY = 1e-3
"""The same for a closed form that is only where Newton's method starts: with less the polynomial
has pairs of roots that are hardly told apart."""
SAMPLES = 2.0 * np.pi * np.arange(5) / 5.0
"""Angles at which a trigonometric polynomial of second degree is sampled: five determine it."""
ROUNDING = 1e-13
"""What a leading coefficient is raised to, as a share of the largest: roots at infinity belong to
no angle, and so they stay finite."""
FARTHEST = 10.0
"""Points farther from the hip than this times the leg's length are moved to there: they are out of
reach anyway, and their squares might overflow."""
MOST_STEPS = 30
"""Most steps of Newton's method. From the roots of the polynomial it takes two or three."""
CLOSE = 1e-13
"""Distance from a point at which Newton's method ends, as a share of the leg's length."""
LEAST_DAMPING, MOST_DAMPING = 1e-15, 1e2
"""Range of the damping, as a share of the leg's squared length: with the least one steps are
Newton's own, with the most they are a thousandth of what would be needed."""


@dataclass(frozen=True, eq=False)
class HingeInverse:
    """The inverse of three hinges.

    Attributes:
        hinges: the hinges.
        start: where the first axis is nearest to the second ``(3,)`` [m].
        across, aside: unit vectors square to the second axis, and to each other: ``across`` in the
            plane of both axes, ``aside`` along their common normal ``(3,)``.
        sine: of the angle between the first two axes.
        offset: from the first axis to the second along ``aside`` [m].
    """

    hinges: ThreeHinges
    start: FloatArray
    across: FloatArray
    aside: FloatArray
    sine: float
    offset: float

    @classmethod
    def of(cls, hinges: ThreeHinges) -> HingeInverse:
        """That of hinges."""
        (first, second, _), (one, other, _) = hinges.axes, hinges.points
        normal = np.cross(first, second)
        sine, way = float(np.linalg.norm(normal)), other - one
        if sine < NEARLY:
            start = one + (way @ first) * first
            aside = other - start
            aside = aside - (aside @ second) * second
            aside = aside / max(float(np.linalg.norm(aside)), np.finfo(float).tiny)
            return cls(hinges, start, np.cross(aside, second), aside, sine,
                       float(aside @ (other - start)))  # fmt: skip
        # With w for the axes, way + s second - t first is along the normal.
        start = one + (np.cross(way, second) @ normal) / sine**2 * first
        across = first - (first @ second) * second
        across = across / np.linalg.norm(across)
        aside = np.cross(second, across)
        return cls(hinges, start, across, aside, sine, float(aside @ way))

    @cached_property
    def shoulder(self) -> FloatArray:
        """Where the second axis is nearest to the first, at zero angles ``(3,)`` [m]."""
        return np.asarray(self.start + self.offset * self.aside)

    @cached_property
    def size(self) -> float:
        """A bound on the foot's distance from :attr:`start` [m]."""
        links = np.diff([self.shoulder, self.knee, self.hinges.foot], axis=0)
        return float(abs(self.offset) + np.linalg.norm(links, axis=1).sum())

    @property
    def is_closed_form(self) -> bool:
        """Whether no iteration is needed: the first two axes meet, or are parallel."""
        return abs(self.offset) < EXACT * self.size or self.sine < EXACT

    @property
    def is_rough(self) -> bool:
        """Whether :meth:`postures` are those of a leg that is nearly this one.

        Its first two axes meet, or are parallel.
        """
        nearly = abs(self.offset) < NEARLY * self.size or self.sine < NEARLY
        return nearly and not self.is_closed_form

    @property
    def is_singular(self) -> bool:
        """Whether the first two axes are nearly the same line."""
        return abs(self.offset) < NEARLY * self.size and self.sine < NEARLY

    def postures(self, points: FloatArray) -> FloatArray:
        """Joint angles that put the foot at points, or somewhere near ``(N, 4, 3)`` [rad].

        A point that is out of reach, or reached by fewer than four postures, has others that do
        not reach it. Unless the inverse is a closed form, all are the start of :meth:`improved`.

        Args:
            points: ``(N, 3)`` [m], finite.
        """
        way = self._near(points) - self.start
        first, second = self.hinges.axes[:2]
        along, square = (way @ first)[:, None], (way**2).sum(axis=-1)[:, None]
        meeting, parallel = abs(self.offset) < NEARLY * self.size, self.sine < NEARLY
        if meeting:
            knee = self._roots(self._second_part(square, self._knee_cycle))
        elif parallel:
            knee = self._roots(self._first_part(along, self._knee_cycle))
        else:
            knee = self._four_roots(along, square)
        v = self._to_foot(knee)
        flat = np.hypot(v @ self.across, v @ self.aside)
        if meeting:
            x = self._first_part(along, v) / self.sine
            y = _other_side(flat, x)
        elif parallel:
            y = self._second_part(square, v) / self.offset
            x = _other_side(flat, y)
        else:
            x = self._first_part(along, v) / self.sine
            y = self._second_part(square, v) / self.offset
        turned = np.arctan2(y, x)
        middle = turned - np.arctan2(v @ self.aside, v @ self.across)
        # Where the foot is once the second and third joint are turned, from the start.
        reached = (
            (v @ second)[..., None] * second
            + (flat * np.cos(turned))[..., None] * self.across
            + (flat * np.sin(turned) + self.offset)[..., None] * self.aside
        )
        return np.stack([_turn(first, reached, way[:, None]), middle, knee], axis=-1)

    def improved(self, q: FloatArray, points: FloatArray) -> FloatArray:
        """Joint angles nearby that put the foot at points, or as near as they can ``(N, 3)`` [rad].

        Newton's method, damped where a step would lead away ([Levenberg1944]).

        Args:
            q: where it starts ``(N, 3)`` [rad].
            points: ``(N, 3)`` [m], finite.
        """
        q, points = q.copy(), self._near(points)
        damping = np.full(len(q), LEAST_DAMPING * self.size**2)
        gap = points - self._feet(q)
        left = np.arange(len(q))
        for _ in range(MOST_STEPS):
            far = np.linalg.norm(gap[left], axis=-1) > CLOSE * self.size
            left = left[far & (damping[left] < MOST_DAMPING * self.size**2)]
            if not left.size:
                break
            slope = self.hinges.placed(q[left]).jacobian
            back = np.swapaxes(slope, -1, -2)
            matrix = back @ slope + damping[left, None, None] * np.eye(3)
            step = np.linalg.solve(matrix, back @ gap[left, :, None])[..., 0]
            found = q[left] + step
            less = points[left] - self._feet(found)
            better = np.linalg.norm(less, axis=-1) < np.linalg.norm(gap[left], axis=-1)
            q[left[better]], gap[left[better]] = found[better], less[better]
            damping[left] *= np.where(better, 0.1, 1e3)
            np.maximum(damping, LEAST_DAMPING * self.size**2, out=damping)
        return q

    def _feet(self, q: FloatArray) -> FloatArray:
        """Feet ``(N, 3)`` [m] at joint angles ``(N, 3)`` [rad]."""
        return np.stack(self.hinges.moved(self.hinges.foot, tuple(q.T)), axis=-1)

    def _near(self, points: FloatArray) -> FloatArray:
        """Points that are far out of reach, moved nearer in their directions."""
        way = points - self.start
        share = FARTHEST * self.size / np.maximum(np.abs(way).max(axis=-1), FARTHEST * self.size)
        return np.asarray(self.start + way * share[..., None])

    @cached_property
    def knee(self) -> FloatArray:
        """The place on the third axis beside the foot, at zero angles ``(3,)`` [m]."""
        axis, point = self.hinges.axes[2], self.hinges.points[2]
        return np.asarray(point + ((self.hinges.foot - point) @ axis) * axis)

    def _to_foot(self, knee: FloatArray) -> FloatArray:
        """``v``: from the shoulder to the foot at the knee's angles ``(..., 3)`` [m]."""
        arm = self.hinges.foot - self.knee
        turned = np.cross(self.hinges.axes[2], arm)
        cosine, sine = np.cos(knee)[..., None], np.sin(knee)[..., None]
        return np.asarray(self.knee - self.shoulder + cosine * arm + sine * turned)

    def _first_part(self, along: FloatArray, v: FloatArray) -> FloatArray:
        """``e1`` [m], of the foot's height along the first axis."""
        first, second = self.hinges.axes[:2]
        return np.asarray(along - (first @ second) * (v @ second))

    def _second_part(self, square: FloatArray, v: FloatArray) -> FloatArray:
        """``e2`` [m^2], of the foot's squared distance from the start of the common normal."""
        return np.asarray((square - self.offset**2 - (v**2).sum(axis=-1)) / 2.0)

    @cached_property
    def _knee_cycle(self) -> FloatArray:
        """``v`` at five angles of the knee ``(5, 3)`` [m]."""
        return self._to_foot(np.asarray(SAMPLES))

    def _roots(self, values: FloatArray) -> FloatArray:
        """Roots of ``a + b cos q + c sin q``, each twice ``(N, 4)`` [rad].

        Where there are none, they are where it is nearest to zero.

        Args:
            values: at five angles ``(N, 5)``.
        """
        level = values.mean(axis=-1)
        cosine, sine = (0.4 * values @ f(SAMPLES) for f in (np.cos, np.sin))
        size = np.hypot(cosine, sine)
        # The half-angle form keeps its precision where the two roots meet.
        half = np.arctan2(*(np.sqrt(np.maximum(x, 0.0)) for x in (size + level, size - level)))
        middle = np.arctan2(sine, cosine)[:, None]
        return np.asarray(middle + 2.0 * half[:, None] * np.array([1.0, 1.0, -1.0, -1.0]))

    def _four_roots(self, along: FloatArray, square: FloatArray) -> FloatArray:
        """Angles of the knee ``(N, 4)`` [rad]; those of complex roots are nearest to a root."""
        v, unit = self._knee_cycle, self.size
        flat = (v @ self.across) ** 2 + (v @ self.aside) ** 2
        first = self._first_part(along, v) * self.offset
        second = self._second_part(square, v) * self.sine
        values = first**2 + second**2 - (self.sine * self.offset) ** 2 * flat
        powers = np.arange(2, -3, -1)
        factors = values @ np.exp(-1j * powers * SAMPLES[:, None]) / (5.0 * unit**4)
        least = ROUNDING * np.abs(factors).max(axis=-1)
        factors[:, 0] += np.where(np.abs(factors[:, 0]) < least, least, 0.0)
        # Roots of a polynomial are the eigenvalues of its companion matrix.
        matrix = np.zeros((len(factors), 4, 4), dtype=complex)
        matrix[:, 0] = -factors[:, 1:] / factors[:, :1]
        matrix[:, range(1, 4), range(3)] = 1.0
        return np.angle(np.linalg.eigvals(matrix))


def _other_side(length: FloatArray, x: FloatArray) -> FloatArray:
    """Second components ``(N, 4)`` of vectors with a length and a first one, of either sign."""
    side = np.sqrt(np.maximum((length - x) * (length + x), 0.0))
    return np.asarray(side * np.array([1.0, -1.0, 1.0, -1.0]))


def _turn(axis: FloatArray, start: FloatArray, end: FloatArray) -> FloatArray:
    """Angle about ``axis (3,)`` from one vector to another ``(...)`` [rad]."""
    sine = np.cross(start, end) @ axis
    cosine = (start * end).sum(axis=-1) - (start @ axis) * (end @ axis)
    return np.asarray(np.arctan2(sine, cosine))
