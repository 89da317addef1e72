"""The time-optimal route with bounded joint accelerations, and a ZMP that stays in its support.

Poses at knots are the control points of a quadratic B-spline in time. Its acceleration is constant
on a span about each knot: with spans ``d``, the velocity between the spans of knots ``k`` and ``k +
1`` is ``v(k) = (u(k+1) - u(k)) / h(k)`` with ``h(k) = (d(k) + d(k+1)) / 2``, and the acceleration
of span ``k`` is ``(v(k) - v(k-1)) / d(k)``. For the body and a flying foot that is exact; for the
joints, which follow by inverse kinematics, it holds up to the curvature of that map, and rows are
tightened by whoever looks there. The motion begins and ends at rest.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.optimize.route_problem import JOINTS, Band, Linearised, RouteProblem, Slots

LEAST_SPAN = 0.01
"""Shortest span [s]."""


class ZmpRows(NamedTuple):
    """``normal . zmp >= offset`` for the ZMP ``c - height / (g + a_z) a`` of the body centre.

    The height is that of the body centre above ``ground``. Each row is taken times its knot's span
    and ``(g + a_z) / g``, which makes it a polynomial of places and velocity jumps.

    Attributes:
        knot: ``(M,)``.
        normal: ``(M, 2)``.
        offset: ``(M,)`` [m].
        ground: ``(M,)`` [m].
        gravity: ``g`` [m/s^2].
    """

    knot: np.ndarray
    normal: FloatArray
    offset: FloatArray
    ground: FloatArray
    gravity: float


@dataclass(frozen=True, eq=False)
class RouteDynamics(RouteProblem):
    """A route problem with accelerations. Its times are the spans of all knots but the last.

    The last knot's span is as long as the one before it.

    Attributes:
        accelerations: limits on the span of every knot ``(K, 12)`` [rad/s^2].
        hurry: velocity limits between each two spans ``(K - 1, 12)`` [rad/s].
        zmp: rows of the zero moment point; none for joint accelerations alone.
    """

    accelerations: FloatArray = None  # type: ignore[assignment]
    hurry: FloatArray = None  # type: ignore[assignment]
    zmp: ZmpRows = None  # type: ignore[assignment]

    @cached_property
    def cost(self) -> FloatArray:
        """Gradient of the sum of all spans."""
        out = np.array(super().cost)
        out[self.numbering[1][-1]] += 1.0
        return out

    @property
    def settled(self) -> int:
        """None: a longer span changes accelerations, too."""
        return 0

    def settle(
        self, x: FloatArray, values: FloatArray, slack: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Nothing is changed."""
        return x, values

    def _values(self, poses: FloatArray, times: FloatArray, joints: FloatArray) -> FloatArray:
        between, spans = intervals(times), np.append(times, times[-1])
        base = super()._values(poses, between, joints)
        count = (self.knots - 1) * JOINTS
        spare = ((self.rates - self.hurry) * between[:, None]).ravel()
        base[: 2 * count] -= np.tile(spare, 2)
        moves = np.concatenate([joints, poses[:, :3]], axis=1)
        jumps = velocity_jumps(moves, between)
        room = self.accelerations * spans[:, None]
        z = self.zmp
        apart = (z.normal * poses[z.knot, :2]).sum(axis=1) - z.offset
        sway, heave = jumps[z.knot, JOINTS : JOINTS + 2], jumps[z.knot, JOINTS + 2]
        pull = (poses[z.knot, 2] - z.ground) * (z.normal * sway).sum(axis=1)
        return np.concatenate([
            base, (room - jumps[:, :JOINTS]).ravel(), (room + jumps[:, :JOINTS]).ravel(),
            apart * (spans[z.knot] + heave / z.gravity) - pull / z.gravity, times - LEAST_SPAN,
        ])  # fmt: skip

    def linearised(self, x: FloatArray) -> LinearisedDynamics:
        """Values and derivatives at ``x``."""
        return LinearisedDynamics(self, x)

    @cached_property
    def local(self) -> np.ndarray:
        """Unknowns about each knot ``(K, 3 c + 3)``; -1 where none is.

        In the order pose before, its span, pose, its span, pose after, its span.
        """
        placed, at, _ = self.numbering
        none = np.full((1, placed.shape[1] + 1), -1)
        each = np.concatenate([placed, np.append(at, at[-1:])[:, None]], axis=1)
        return np.concatenate(
            [np.concatenate([none, each[:-1]]), each, np.concatenate([each[1:], none])], axis=1
        )

    @cached_property
    def zmp_slots(self) -> Slots:
        """The ZMP's rows by their knots."""
        return Slots.of(self.zmp.knot, self.knots)

    @cached_property
    def wide(self) -> Band:
        """Where blocks at knots go in the banded matrix."""
        return Band.of(self.local, self.numbering[2])


def intervals(times: FloatArray) -> FloatArray:
    """Times between the middles of spans ``(K - 1,)``, of all spans but the last."""
    return (times + np.append(times[1:], times[-1:])) / 2.0


def velocity_jumps(moves: FloatArray, between: FloatArray) -> FloatArray:
    """Change of velocity over every span ``(K, n)``.

    Args:
        moves: control points ``(K, n)``.
        between: times between the middles of spans ``(K - 1,)`` [s].
    """
    velocity = np.diff(moves, axis=0) / between[:, None]
    rest = np.zeros((1, moves.shape[1]))
    return np.diff(np.concatenate([rest, velocity, rest]), axis=0)


class LinearisedDynamics(Linearised):
    """Values and derivatives of a route with accelerations at one point."""

    _problem: RouteDynamics

    def __init__(self, problem: RouteDynamics, x: FloatArray) -> None:
        super().__init__(problem, x)
        poses, times = problem.unpack(x)
        self._between, self._spans = intervals(times), np.append(times, times[-1])
        c = len(problem.columns)
        self._c = c
        flat = np.zeros((problem.knots, 3, c))
        for axis in range(3):
            flat[:, axis, problem.columns == axis] = 1.0
        self._ext = np.concatenate([self._slopes, flat], axis=1)
        moves = np.concatenate([self._bent.joints.reshape(-1, JOINTS), poses[:, :3]], axis=1)
        self._velocity = np.diff(moves, axis=0) / self._between[:, None]
        self._jump_rows = self._jumps()
        self._zmp_rows = self._zmp()

    def _columns(self, which: int) -> slice:
        """Local columns of the pose before (0), at (1), or after (2) a knot."""
        return slice(which * (self._c + 1), which * (self._c + 1) + self._c)

    def _on_spans(self, before: FloatArray, after: FloatArray) -> tuple[FloatArray, ...]:
        """Derivatives by the three local spans, from those by the two intervals beside a knot."""
        return before / 2.0, (before + after) / 2.0, after / 2.0

    def _jumps(self) -> FloatArray:
        """Derivative of the velocity jumps by each knot's local unknowns ``(K, 15, 3 c + 3)``."""
        h, ext = self._between[:, None, None], self._ext
        count, n = ext.shape[:2]
        out = np.zeros((count, n, 3 * self._c + 3))
        before, at, after = (self._columns(i) for i in range(3))
        rate = self._velocity / self._between[:, None]
        # v(k) - v(k-1) = (u(k+1) - u(k)) / h(k) - (u(k) - u(k-1)) / h(k-1)
        out[1:, :, before] += ext[:-1] / h
        out[1:, :, at] -= ext[1:] / h
        out[:-1, :, at] -= ext[:-1] / h
        out[:-1, :, after] += ext[1:] / h
        none = np.zeros((1, n))
        by_spans = self._on_spans(np.concatenate([none, rate]), np.concatenate([-rate, none]))
        for i, part in enumerate(by_spans):
            out[:, :, i * (self._c + 1) + self._c] += part
        return out

    def _zmp(self) -> FloatArray:
        """Derivative of the ZMP's rows by their knots' local unknowns ``(M, 3 c + 3)``."""
        z, c = self._problem.zmp, self._c
        apart, height, sway, heave = self._zmp_parts
        out = (apart / z.gravity)[:, None] * self._jump_rows[z.knot, JOINTS + 2]
        out -= (height / z.gravity)[:, None] * self._sway_rows
        out[:, 2 * c + 1] += apart
        here = self._ext[z.knot, JOINTS:]
        out[:, self._columns(1)] += (self._spans[z.knot] + heave / z.gravity)[:, None] * np.einsum(
            "md,mdc->mc", z.normal, here[:, :2]
        )
        out[:, self._columns(1)] -= (sway / z.gravity)[:, None] * here[:, 2]
        return np.asarray(out)

    @cached_property
    def _sway_rows(self) -> FloatArray:
        """Derivative of the velocity jumps along the rows' normals ``(M, 3 c + 3)``."""
        z = self._problem.zmp
        sway = self._jump_rows[z.knot, JOINTS : JOINTS + 2]
        return np.asarray(np.einsum("md,mdc->mc", z.normal, sway))

    @cached_property
    def _zmp_parts(self) -> tuple[FloatArray, ...]:
        """Of every row: distance of the body centre, its height, and jumps along and up."""
        z = self._problem.zmp
        apart = (z.normal * self._poses[z.knot, :2]).sum(axis=1) - z.offset
        rest = np.zeros((1, self._velocity.shape[1]))
        jumps = np.diff(np.concatenate([rest, self._velocity, rest]), axis=0)[z.knot]
        sway = (z.normal * jumps[:, JOINTS : JOINTS + 2]).sum(axis=1)
        return apart, self._poses[z.knot, 2] - z.ground, sway, jumps[:, JOINTS + 2]

    def _parts(self, v: FloatArray) -> tuple[FloatArray, ...]:
        """Of a vector over inequalities: the base problem's, up, down, ZMP, spans."""
        p = self._problem
        knots, zmp, spans = p.knots * JOINTS, len(p.zmp.knot), p.knots - 1
        base = len(v) - 2 * knots - zmp - spans
        parts = np.split(v, np.cumsum([base, knots, knots, zmp]))
        return (parts[0], parts[1].reshape(-1, JOINTS), parts[2].reshape(-1, JOINTS), *parts[3:])

    def _without_speed(self, v: FloatArray) -> FloatArray:
        out = np.array(v)
        out[: 2 * (self._problem.knots - 1) * JOINTS] = 0.0
        return out

    def _speed(self, v: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Of the base problem's part: the velocity limits', up and down ``(K - 1, 12)``."""
        both = v[: 2 * (self._problem.knots - 1) * JOINTS].reshape(2, -1, JOINTS)
        return both[0], both[1]

    @cached_property
    def _speed_rows(self) -> tuple[FloatArray, FloatArray]:
        """Derivatives of velocity limits by the local unknowns of each interval's first knot.

        ``room`` and ``turn``, each ``(K - 1, 12, 3 c + 3)``: the limits are ``room -+ turn``.
        """
        p, c = self._problem, self._c
        turn = np.zeros((p.knots - 1, JOINTS, 3 * c + 3))
        turn[:, :, self._columns(1)] = -self._slopes[:-1]
        turn[:, :, self._columns(2)] = self._slopes[1:]
        room = np.zeros_like(turn)
        room[:, :, 2 * c + 1] = room[:, :, 3 * c + 2] = p.hurry / 2.0
        return room, turn

    @cached_property
    def _room_rows(self) -> FloatArray:
        """Derivative of the allowed velocity jumps ``(K, 12, 3 c + 3)``."""
        out = np.zeros((self._problem.knots, JOINTS, 3 * self._c + 3))
        out[:, :, 2 * self._c + 1] = self._problem.accelerations
        return out

    def pull(self, v: FloatArray) -> FloatArray:
        """Transposed Jacobian times ``v (m,)``."""
        p = self._problem
        base, up, down, zmp, spans = self._parts(v)
        out = super().pull(self._without_speed(base))
        local = np.einsum("kj,kjc->kc", up + down, self._room_rows)
        local += np.einsum("kj,kjc->kc", down - up, self._jump_rows[:, :JOINTS])
        room, turn = self._speed_rows
        faster, slower = self._speed(base)
        local[:-1] += np.einsum("kj,kjc->kc", faster + slower, room)
        local[:-1] += np.einsum("kj,kjc->kc", slower - faster, turn)
        local += p.zmp_slots.spread(zmp[:, None] * self._zmp_rows).sum(axis=1)
        mine = p.local >= 0
        out += np.bincount(p.local[mine], local[mine], minlength=len(out))
        out[p.numbering[1]] += spans
        return out

    def push(self, dx: FloatArray) -> FloatArray:
        """Jacobian times ``dx (n,)``."""
        p = self._problem
        base = super().push(dx)
        moves = np.where(p.local >= 0, dx[np.maximum(p.local, 0)], 0.0)
        room, turn = (np.einsum("kjc,kc->kj", r, moves[:-1]) for r in self._speed_rows)
        count = (p.knots - 1) * JOINTS
        base[:count], base[count : 2 * count] = (room - turn).ravel(), (room + turn).ravel()
        jumps = np.einsum("kjc,kc->kj", self._jump_rows[:, :JOINTS], moves)
        room = np.einsum("kjc,kc->kj", self._room_rows, moves)
        return np.concatenate([
            base, (room - jumps).ravel(), (room + jumps).ravel(),
            (self._zmp_rows * moves[p.zmp.knot]).sum(axis=1), dx[p.numbering[1]],
        ])  # fmt: skip

    def normal(self, scale: FloatArray, duals: FloatArray) -> FloatArray:
        """``J' diag(scale) J`` minus the curvature of ``duals * values``, in banded form."""
        p = self._problem
        base, up, down, zmp, spans = self._parts(scale)
        blocks = -self._bow(duals)
        jumps = self._jump_rows[:, :JOINTS]
        for weight, rows in ((up, self._room_rows - jumps), (down, self._room_rows + jumps)):
            blocks += np.swapaxes(rows, 1, 2) @ (weight[:, :, None] * rows)
        room, turn = self._speed_rows
        faster, slower = self._speed(base)
        for weight, rows in ((faster, room - turn), (slower, room + turn)):
            blocks[:-1] += np.swapaxes(rows, 1, 2) @ (weight[:, :, None] * rows)
        spread = p.zmp_slots.spread(self._zmp_rows)
        blocks += np.swapaxes(spread, 1, 2) @ (p.zmp_slots.spread(zmp)[:, :, None] * spread)
        out = p.wide.matrix(blocks)
        narrow = super().normal(self._without_speed(base), self._parts(duals)[0])
        out[: len(narrow)] += narrow
        out[0, p.numbering[1]] += spans
        return out

    def _bow(self, duals: FloatArray) -> FloatArray:
        """Curvature of accelerations and ZMP at each knot's local unknowns ``(K, n, n)``."""
        p, c = self._problem, self._c
        _, up, down, zmp, _ = self._parts(duals)
        on_jumps = np.zeros((p.knots, JOINTS + 3))
        on_jumps[:, :JOINTS] = down - up
        z = p.zmp
        apart, height, _, _ = self._zmp_parts
        share = zmp / z.gravity
        pulls = np.column_stack([-(share * height)[:, None] * z.normal, share * apart])
        on_jumps[:, JOINTS:] += p.zmp_slots.spread(pulls).sum(axis=1)
        # Weights on the velocities, and from them on the joints at knots.
        on_velocity = on_jumps[:-1] - on_jumps[1:]
        on_moves = on_velocity / self._between[:, None]
        weights = np.zeros((p.knots, JOINTS))
        weights[1:] += on_moves[:, :JOINTS]
        weights[:-1] -= on_moves[:, :JOINTS]
        out = np.zeros((p.knots, 3 * c + 3, 3 * c + 3))
        at, after = self._columns(1), self._columns(2)
        curve = p.legs.curvature(self._bent, weights.reshape(-1, 4, 3))
        out[:, at, at] = curve[:, p.columns][:, :, p.columns]
        # v = (u+ - u) / h: its second derivatives by h, and by h and a pose; h is the mean of
        # two spans.
        pace = on_velocity / self._between[:, None] ** 2
        left = np.einsum("kj,kjc->kc", pace, self._ext[:-1]) / 2.0
        right = -np.einsum("kj,kjc->kc", pace, self._ext[1:]) / 2.0
        twice = (on_velocity * self._velocity).sum(axis=1) / (2.0 * self._between**2)
        times = (2 * c + 1, 3 * c + 2)
        for t in times:
            for where, part in ((at, left), (after, right)):
                out[:-1, where, t] += part
                out[:-1, t, where] += part
            for other in times:
                out[:-1, t, other] += twice
        # Products of the body centre's place with its span and with velocity jumps.
        here = np.zeros((2, len(z.knot), 3 * c + 3))
        here[0, :, at] = np.einsum("md,mdc->mc", z.normal, self._ext[z.knot, JOINTS : JOINTS + 2])
        here[1, :, at] = self._ext[z.knot, JOINTS + 2]
        times_apart = share[:, None] * self._jump_rows[z.knot, JOINTS + 2]
        times_apart[:, 2 * c + 1] += zmp
        times_height = -share[:, None] * self._sway_rows
        for place, other in zip(here, (times_apart, times_height), strict=True):
            one, two = p.zmp_slots.spread(place), p.zmp_slots.spread(other)
            outer = np.swapaxes(one, 1, 2) @ two
            out += outer + np.swapaxes(outer, 1, 2)
        return out
