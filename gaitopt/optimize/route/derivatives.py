"""Values and derivatives of a time-optimal route problem, each knot's pose at a time.

A row looks at one pose, or at two neighbours and the time between them; so Jacobians are never
built, only multiplied with, and the matrix of a Newton step is banded.
"""

from __future__ import annotations

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.optimize.route.layout import RouteLayout
from gaitopt.optimize.route.legs import JOINTS


class RouteLinearisation:
    """A problem's values and derivatives at one point.

    Attributes:
        values: all inequalities ``(m,)``.
    """

    def __init__(self, problem: RouteLayout, x: FloatArray) -> None:
        self._problem = problem
        self._poses, times = problem.unpack(x)
        self._bent = problem.legs.kinematics(self._poses, problem.feet, problem.swing)
        joints = self._bent.joints.reshape(-1, JOINTS)
        self.values = problem.values_at(self._poses, times, joints)
        self._gradients = self._bent.joints_by_pose()
        self._slopes = self._gradients[:, :, problem.columns]
        rows, com = problem.rows, problem.com
        single = rows.linear + rows.square * self._poses[rows.knot]
        if com is not None:
            self._com = com.masses.at(self._poses, self._bent, self._gradients)
            single = np.concatenate([single, com.slopes(self._com)])[problem.order]
        self._rows = single[:, problem.columns]

    def _split(self, v: FloatArray) -> tuple[FloatArray, ...]:
        """Parts of a vector over inequalities: up, down, low, high, rows."""
        p = self._problem
        late = p.knots - p.fixed_knots
        spans = (p.knots - 1) * JOINTS
        low, high = (int(b.sum()) * late for b in p.used_limits)
        up, down, below, above, rows = np.split(v, np.cumsum([spans, spans, low, high]))
        return (up.reshape(-1, JOINTS), down.reshape(-1, JOINTS),
                below.reshape(late, -1), above.reshape(late, -1), rows)  # fmt: skip

    def _on_joints(self, v: FloatArray) -> FloatArray:
        """``sum of v * values`` as weights on the joints of every knot ``(K, 12)``."""
        p = self._problem
        up, down, below, above, _ = self._split(v)
        out = np.zeros((p.knots, JOINTS))
        out[1:] += down - up
        out[:-1] -= down - up
        out[p.fixed_knots :, p.used_limits[0]] += below
        out[p.fixed_knots :, p.used_limits[1]] -= above
        return out

    def jacobian_transpose_times(self, v: FloatArray) -> FloatArray:
        """Transposed Jacobian times ``v (m,)``."""
        p = self._problem
        up, down, _, _, rows = self._split(v)
        on_poses = np.einsum("kj,kjc->kc", self._on_joints(v), self._slopes)
        on_poses += p.slots.padded(rows[:, None] * self._rows).sum(axis=1)
        placed, at, size = p.numbering
        mine = placed >= 0
        out = np.bincount(placed[mine], on_poses[mine], minlength=size)
        out[at] += (up + down) @ p.turns
        return np.asarray(out)

    def jacobian_times(self, dx: FloatArray) -> FloatArray:
        """Jacobian times ``dx (n,)``."""
        p = self._problem
        placed, at, _ = p.numbering
        moves = np.where(placed >= 0, dx[np.maximum(placed, 0)], 0.0)
        joints = np.einsum("kjc,kc->kj", self._slopes, moves)
        turn, room = np.diff(joints, axis=0), p.turns * dx[at][:, None]
        late = joints[p.fixed_knots :]
        return np.concatenate([
            (room - turn).ravel(), (room + turn).ravel(), late[:, p.used_limits[0]].ravel(),
            -late[:, p.used_limits[1]].ravel(), (self._rows * moves[p.row_knots]).sum(axis=1),
        ])  # fmt: skip

    def newton_matrix(self, scale: FloatArray, multipliers: FloatArray) -> FloatArray:
        """``J' diag(scale) J`` minus the curvature of ``multipliers * values``, in banded form."""
        p = self._problem
        c = len(p.columns)
        up, down, below, above, rows = self._split(scale)
        slopes = self._slopes
        sides = np.concatenate([-slopes[:-1], slopes[1:]], axis=2)
        pair = np.swapaxes(sides, 1, 2) @ ((up + down)[:, :, None] * sides)
        cross = np.einsum("kjc,kj->kc", sides, (down - up) * p.turns)
        blocks = np.empty((p.knots - 1, 2 * c + 1, 2 * c + 1))
        blocks[:, :c, :c], blocks[:, c + 1 :, c + 1 :] = pair[:, :c, :c], pair[:, c:, c:]
        blocks[:, :c, c + 1 :], blocks[:, c + 1 :, :c] = pair[:, :c, c:], pair[:, c:, :c]
        blocks[:, :c, c] = blocks[:, c, :c] = cross[:, :c]
        blocks[:, c + 1 :, c] = blocks[:, c, c + 1 :] = cross[:, c:]
        blocks[:, c, c] = (up + down) @ p.turns**2
        single = self._single(below, above, rows, multipliers)
        blocks[:, :c, :c] += single[:-1]
        blocks[-1, c + 1 :, c + 1 :] += single[-1]
        return p.band.matrix(blocks)

    def _single(
        self,
        below: FloatArray,
        above: FloatArray,
        rows: FloatArray,
        multipliers: FloatArray,
    ) -> FloatArray:
        """What single knots add to the matrix ``(K, c, c)``."""
        p = self._problem
        on_rows = self._split(multipliers)[4]
        kinematics = self._curvature(self._on_joints(multipliers).reshape(-1, 4, 3), on_rows)
        out = -kinematics[:, p.columns][:, :, p.columns]
        bow = on_rows[:, None] * p.squares
        bend = p.slots.padded(bow).sum(axis=1)
        out[:, range(len(p.columns)), range(len(p.columns))] -= bend
        stiff = np.zeros((p.knots, JOINTS))
        stiff[p.fixed_knots :, p.used_limits[0]] += below
        stiff[p.fixed_knots :, p.used_limits[1]] += above
        if p.used_limits.any():
            out += np.swapaxes(self._slopes, 1, 2) @ (stiff[:, :, None] * self._slopes)
        spread = p.slots.padded(self._rows)
        out += np.swapaxes(spread, 1, 2) @ (p.slots.padded(rows)[:, :, None] * spread)
        return np.asarray(out)

    def _curvature(self, weights: FloatArray, on_rows: FloatArray) -> FloatArray:
        """Curvature of ``weights (K, 4, 3)`` on joints and of rows on the centre of mass."""
        p = self._problem
        if p.com is None:
            return p.legs.curvature(self._bent, weights)
        in_turn = np.empty_like(on_rows)
        in_turn[p.order] = on_rows
        pull = p.com.pull(in_turn[len(p.rows.knot) :], p.knots)
        masses = p.com.masses
        weights = weights + masses.on_joints(self._bent, self._com, pull)
        out = masses.curvature(self._bent, self._gradients, self._com, pull)
        return np.asarray(out + p.legs.curvature(self._bent, weights))
