"""Values and derivatives of a time-optimal route with bounded accelerations.

Beyond the rows of the problem without, a knot's rows look at three neighbouring poses and spans.
"""

from __future__ import annotations

from functools import cached_property
from typing import NamedTuple

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.optimize.route.derivatives import RouteLinearisation
from gaitopt.optimize.route.dynamic_layout import DynamicLayout, intervals
from gaitopt.optimize.route.legs import JOINTS


class _Shares(NamedTuple):
    """A vector over inequalities by what they are about.

    Attributes:
        base: the base problem's, in which velocity limits count as zero.
        jumps, turns: accelerations' and velocities', up and down ``(2, K, 12)``; no velocity
            belongs to the last knot.
        zmp: by knot and slot ``(K, Z)``.
        spans: shortest spans' ``(K - 1,)``, with zero for one that is no unknown.
    """

    base: FloatArray
    jumps: FloatArray
    turns: FloatArray
    zmp: FloatArray
    spans: FloatArray


class DynamicRouteLinearisation(RouteLinearisation):
    """Values and derivatives of a route with accelerations at one point.

    What a knot's rows say of its neighbourhood stands in one stack ``(K, 24 + Z, 3 c + 3)``: the
    joints' velocity jumps over the knot's span, their turns to the next knot, and the ZMP's rows.
    Limits then are times a span plus or minus a row of it. All times are counted in the problem's
    unit.
    """

    _problem: DynamicLayout

    def __init__(self, problem: DynamicLayout, x: FloatArray) -> None:
        super().__init__(problem, x)
        poses, times = problem.unpack(x)
        times, unit = times / problem.time_unit, problem.time_unit
        self._between, self._spans = intervals(times), np.append(times, times[-1])
        self._most, self._fastest = (
            problem.acceleration_limits * unit**2,
            problem.interval_velocity_limits * unit,
        )
        self._gravity = problem.zmp.gravity * unit**2
        self._c = c = len(problem.columns)
        self._span, self._next = 2 * c + 1, 3 * c + 2
        flat = np.zeros((problem.knots, 3, c))
        for axis in range(3):
            flat[:, axis, problem.columns == axis] = 1.0
        self._ext = np.concatenate([self._slopes, flat], axis=1)
        moves = np.concatenate([self._bent.joints.reshape(-1, JOINTS), poses[:, :3]], axis=1)
        self._velocity = np.diff(moves, axis=0) / self._between[:, None]
        self._jumped = problem.velocity_changes(moves, self._between * unit) * unit
        self._jump_rows = self._jumps()
        self._stack = self._stacked()

    def _columns(self, which: int) -> slice:
        """Local columns of the pose before (0), at (1), or after (2) a knot."""
        return slice(which * (self._c + 1), which * (self._c + 1) + self._c)

    def _jumps(self) -> FloatArray:
        """Derivative of the velocity jumps by each knot's local unknowns ``(K, 15, 3 c + 3)``."""
        h, ext = self._between[:, None, None], self._ext
        count, n = ext.shape[:2]
        out = np.zeros((count, n, 3 * self._c + 3))
        before, at, after = (self._columns(i) for i in range(3))
        # v(k) - v(k-1) = (u(k+1) - u(k)) / h(k) - (u(k) - u(k-1)) / h(k-1)
        back, ahead = ext[:-1] / h, ext[1:] / h
        out[1:, :, before] = back
        out[1:, :, at] -= ahead
        out[:-1, :, at] -= back
        out[:-1, :, after] = ahead
        half = self._velocity / (2.0 * self._between[:, None])
        out[1:, :, self._c] = half
        out[1:, :, self._span] += half
        out[:-1, :, self._span] -= half
        out[:-1, :, self._next] = -half
        return out

    def _stacked(self) -> FloatArray:
        p = self._problem
        slots = p.zmp_slots
        out = np.zeros((p.knots, 2 * JOINTS + slots.shape[1], 3 * self._c + 3))
        out[:, :JOINTS] = self._jump_rows[:, :JOINTS]
        out[:-1, JOINTS : 2 * JOINTS, self._columns(1)] = -self._slopes[:-1]
        out[:-1, JOINTS : 2 * JOINTS, self._columns(2)] = self._slopes[1:]
        out[slots.group, 2 * JOINTS + slots.place] = self._zmp()
        return out

    def _zmp(self) -> FloatArray:
        """Derivative of the ZMP's rows by their knots' local unknowns ``(M, 3 c + 3)``."""
        z = self._problem.zmp
        apart, height, sway, heave = self._zmp_parts
        out = (apart / self._gravity)[:, None] * self._jump_rows[z.knot, JOINTS + 2]
        out -= (height / self._gravity)[:, None] * self._sway_rows
        out[:, self._span] += apart
        here = self._ext[z.knot, JOINTS:]
        load = self._spans[z.knot] + heave / self._gravity
        out[:, self._columns(1)] += load[:, None] * np.einsum("md,mdc->mc", z.normal, here[:, :2])
        out[:, self._columns(1)] -= (sway / self._gravity)[:, None] * here[:, 2]
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
        jumps = self._jumped[z.knot]
        sway = (z.normal * jumps[:, JOINTS : JOINTS + 2]).sum(axis=1)
        return apart, self._poses[z.knot, 2] - z.ground, sway, jumps[:, JOINTS + 2]

    def _shares(self, v: FloatArray) -> _Shares:
        p = self._problem
        knots, zmp, spans = p.knots * JOINTS, len(p.zmp.knot), p.knots - 1
        base = len(v) - 2 * knots - zmp - spans
        parts = np.split(v, np.cumsum([base, 2 * knots, zmp]))
        quiet, least = parts[0].copy(), parts[3].copy()
        speeds = 2 * (p.knots - 1) * JOINTS
        turns = np.zeros((2, p.knots, JOINTS))
        turns[:, :-1] = quiet[:speeds].reshape(2, -1, JOINTS)
        quiet[:speeds] = 0.0
        if p.entry is not None:
            least[0] = 0.0
        return _Shares(quiet, parts[1].reshape(2, -1, JOINTS), turns, p.zmp_slots.padded(parts[2]),
                       least)  # fmt: skip

    def jacobian_transpose_times(self, v: FloatArray) -> FloatArray:
        """Transposed Jacobian times ``v (m,)``."""
        p = self._problem
        s = self._shares(v)
        out = super().jacobian_transpose_times(s.base)
        weights = np.concatenate([s.jumps[1] - s.jumps[0], s.turns[1] - s.turns[0], s.zmp], axis=1)
        local = (weights[:, None] @ self._stack)[:, 0]
        local[:, self._span] += (s.jumps * self._most).sum(axis=(0, 2))
        pace = (s.turns[:, :-1] * self._fastest).sum(axis=(0, 2)) / 2.0
        local[:-1, self._span] += pace
        local[:-1, self._next] += pace
        mine = p.local >= 0
        out += np.bincount(p.local[mine], local[mine], minlength=len(out))
        out[p.numbering[1]] += s.spans
        return out

    def jacobian_times(self, dx: FloatArray) -> FloatArray:
        """Jacobian times ``dx (n,)``."""
        p = self._problem
        base = super().jacobian_times(dx)
        moves = np.where(p.local >= 0, dx[np.maximum(p.local, 0)], 0.0)
        rows = (self._stack @ moves[:, :, None])[:, :, 0]
        jumps, turns = rows[:, :JOINTS], rows[:-1, JOINTS : 2 * JOINTS]
        spans = moves[:, self._span, None]
        between = (moves[:-1, self._span] + moves[:-1, self._next])[:, None] / 2.0
        room, interval_velocity_limits = self._most * spans, self._fastest * between
        count = (p.knots - 1) * JOINTS
        base[:count], base[count : 2 * count] = (
            (interval_velocity_limits[0] - turns).ravel(),
            (interval_velocity_limits[1] + turns).ravel(),
        )
        slots = p.zmp_slots
        least = dx[p.numbering[1]]
        if p.entry is not None:
            least[0] = 0.0
        return np.concatenate([
            base, (room[0] - jumps).ravel(), (room[1] + jumps).ravel(),
            rows[slots.group, 2 * JOINTS + slots.place], least,
        ])  # fmt: skip

    def newton_matrix(self, scale: FloatArray, multipliers: FloatArray) -> FloatArray:
        """``J' diag(scale) J`` minus the curvature of ``multipliers * values``, in banded form."""
        p = self._problem
        s = self._shares(scale)
        weights = np.concatenate([s.jumps.sum(axis=0), s.turns.sum(axis=0), s.zmp], axis=1)
        blocks = np.swapaxes(self._stack, 1, 2) @ (weights[:, :, None] * self._stack)
        self._add_spans(blocks, s)
        kinematics = self._shares(multipliers)
        _, _, below, above, rows = self._split(s.base)
        blocks[:, self._columns(1), self._columns(1)] += self._single(
            below, above, rows, multipliers[: len(s.base)]
        )
        if multipliers.any():
            blocks -= self._bow(kinematics)
        out = p.wide.matrix(blocks)
        out[0, p.numbering[1]] += s.spans
        return out

    def _add_spans(self, blocks: FloatArray, s: _Shares) -> None:
        """Adds what limits times spans contribute to the squares of their rows."""
        signed = s.jumps[1] * self._most[1] - s.jumps[0] * self._most[0]
        cross = (signed[:, None] @ self._stack[:, :JOINTS])[:, 0]
        blocks[:, :, self._span] += cross
        blocks[:, self._span] += cross
        blocks[:, self._span, self._span] += (s.jumps * self._most**2).sum(axis=(0, 2))
        turns = s.turns[:, :-1]
        signed = (turns[1] * self._fastest[1] - turns[0] * self._fastest[0]) / 2.0
        cross = (signed[:, None] @ self._stack[:-1, JOINTS : 2 * JOINTS])[:, 0]
        square = (turns * self._fastest**2).sum(axis=(0, 2)) / 4.0
        for one in (self._span, self._next):
            blocks[:-1, :, one] += cross
            blocks[:-1, one] += cross
            for other in (self._span, self._next):
                blocks[:-1, one, other] += square

    def _bow(self, s: _Shares) -> FloatArray:
        """Curvature of accelerations and ZMP at each knot's local unknowns ``(K, n, n)``."""
        p, c = self._problem, self._c
        z = p.zmp
        multipliers = s.zmp[p.zmp_slots.group, p.zmp_slots.place]
        apart, height, _, _ = self._zmp_parts
        share = multipliers / self._gravity
        on_jumps = np.zeros((p.knots, JOINTS + 3))
        on_jumps[:, :JOINTS] = s.jumps[1] - s.jumps[0]
        pulls = np.column_stack([-(share * height)[:, None] * z.normal, share * apart])
        on_jumps[:, JOINTS:] += p.zmp_slots.padded(pulls).sum(axis=1)
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
        pace = (on_velocity / self._between[:, None] ** 2)[:, None] / 2.0
        left, right = (pace @ self._ext[:-1])[:, 0], -(pace @ self._ext[1:])[:, 0]
        twice = (on_velocity * self._velocity).sum(axis=1) / (2.0 * self._between**2)
        for t in (self._span, self._next):
            for where, part in ((at, left), (after, right)):
                out[:-1, where, t] += part
                out[:-1, t, where] += part
            for other in (self._span, self._next):
                out[:-1, t, other] += twice
        self._add_products(out, multipliers)
        return out

    def _add_products(self, out: FloatArray, multipliers: FloatArray) -> None:
        """Adds products of the body centre's place with its span and with velocity jumps."""
        z, slots = self._problem.zmp, self._problem.zmp_slots
        share = multipliers / self._gravity
        one, two = np.zeros((2, *slots.shape[:1], 2 * slots.shape[1], out.shape[1]))
        at, second = self._columns(1), slots.shape[1] + slots.place
        one[slots.group, slots.place, at] = np.einsum(
            "md,mdc->mc", z.normal, self._ext[z.knot, JOINTS : JOINTS + 2]
        )
        one[slots.group, second, at] = self._ext[z.knot, JOINTS + 2]
        along = share[:, None] * self._jump_rows[z.knot, JOINTS + 2]
        along[:, self._span] += multipliers
        two[slots.group, slots.place] = along
        two[slots.group, second] = -share[:, None] * self._sway_rows
        # Only rows at the pose itself are not zero.
        outer = np.swapaxes(one[:, :, at], 1, 2) @ two
        out[:, at] += outer
        out[:, :, at] += np.swapaxes(outer, 1, 2)
