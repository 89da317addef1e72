"""Values and derivatives of the rows of a walk with acceleration limits.

A row of accelerations or of the ZMP looks at the neighbourhood of its knot: three poses and three
spans. What is derived by a neighbourhood has the last axis ``3 c + 3``, in the order of
:attr:`gaitopt.optimize.route.dynamic_layout.DynamicLayout.neighbourhood`; ``n`` is short for it.

All times are counted in the problem's time unit here.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.optimize.route.derivatives import RouteLinearisation
from gaitopt.optimize.route.dynamic_layout import DynamicLayout, DynamicParts, interval_times
from gaitopt.optimize.route.legs import BODY, JOINTS

_LEVEL, _UP = slice(JOINTS, JOINTS + 2), JOINTS + 2
"""Where the body centre's horizontal and vertical places stand behind the joints."""


class DynamicRouteLinearisation(RouteLinearisation):
    """Values and derivatives of a problem's rows at one point.

    Limits of accelerations and velocities are rows ``limit * time -+ change``. The derivatives of
    all these changes, and of the ZMP's rows, stand in one stack, for every knot:

    - 12 velocity changes of the joints in the knot's span,
    - 12 turns of the joints in the interval after it, zero for the last knot,
    - the rows of the ZMP, filled up with zeros.
    """

    _problem: DynamicLayout

    def __init__(self, problem: DynamicLayout, x: FloatArray) -> None:
        """Derive at the unknowns ``x (n,)``."""
        super().__init__(problem, x)
        poses, spans = problem.unpack(x)
        unit = problem.time_unit
        spans = spans / unit
        self._times, self._spans = interval_times(spans), np.append(spans, spans[-1])
        self._acceleration_limits = problem.acceleration_limits * unit**2
        self._velocity_limits = problem.interval_velocity_limits * unit
        self._gravity = problem.zmp.gravity * unit**2
        # Columns of a neighbourhood: the poses before, at and after, this span and the next.
        c = len(problem.free_columns)
        self._before, self._at, self._after = (
            slice(i * (c + 1), i * (c + 1) + c) for i in range(3)
        )
        self._before_span, self._span, self._next_span = c, 2 * c + 1, 3 * c + 2
        body = np.zeros((problem.knots, 3, c))
        for axis in range(3):
            body[:, axis, problem.free_columns == axis] = 1.0
        self._places_by_pose = np.concatenate([self._joints_by_pose, body], axis=1)
        joints = self._kinematics.joints.reshape(-1, JOINTS)
        places = np.concatenate([joints, poses[:, BODY]], axis=1)
        self._velocity = np.diff(places, axis=0) / self._times[:, None]
        changes = problem.velocity_changes(places, self._times * unit) * unit
        self._zmp_terms = problem.zmp.terms(poses, changes[:, JOINTS:])
        self._changes_by_neighbours = self._derived_changes()
        self._stack = self._stacked()

    def jacobian_transpose_times(self, v: FloatArray) -> FloatArray:
        """Transposed Jacobian times ``v (m,)``: the gradient of ``v . values`` ``(n,)``."""
        p = self._problem
        parts = p.split_dynamic(v)
        out = super().jacobian_transpose_times(parts.static)
        local = (self._change_weights(parts)[:, None] @ self._stack)[:, 0]
        local[:, self._span] += (parts.accelerations * self._acceleration_limits).sum(axis=(0, 2))
        # An interval's time is the mean of two spans.
        half = (parts.velocities[:, :-1] * self._velocity_limits).sum(axis=(0, 2)) / 2.0
        local[:-1, self._span] += half
        local[:-1, self._next_span] += half
        used = p.neighbourhood >= 0
        out += np.bincount(p.neighbourhood[used], local[used], minlength=len(out))
        out[p.numbering.times] += parts.spans
        return out

    def jacobian_times(self, dx: FloatArray) -> FloatArray:
        """Jacobian times ``dx (n,)``: the change of all rows ``(m,)``, to first order."""
        p = self._problem
        static = super().jacobian_times(dx)
        near = np.where(p.neighbourhood >= 0, dx[np.maximum(p.neighbourhood, 0)], 0.0)
        stack = (self._stack @ near[:, :, None])[:, :, 0]
        changes, turns = stack[:, :JOINTS], stack[:-1, JOINTS : 2 * JOINTS]
        times = (near[:-1, self._span] + near[:-1, self._next_span])[:, None] / 2.0
        velocity = self._velocity_limits * times
        acceleration = self._acceleration_limits * near[:, self._span, None]
        count = (p.knots - 1) * JOINTS
        static[:count] = (velocity[0] - turns).ravel()
        static[count : 2 * count] = (velocity[1] + turns).ravel()
        zmp = p.zmp_by_knot
        spans = dx[p.numbering.times]
        if p.entry is not None:
            spans[0] = 0.0
        return np.concatenate([
            static, (acceleration[0] - changes).ravel(), (acceleration[1] + changes).ravel(),
            stack[zmp.group, 2 * JOINTS + zmp.place], spans,
        ])  # fmt: skip

    def newton_matrix(self, scale: FloatArray, multipliers: FloatArray) -> FloatArray:
        """``J' diag(scale) J`` minus the Hessian of ``multipliers . values``, in banded form."""
        p = self._problem
        scales, weights = p.split_dynamic(scale), p.split_dynamic(multipliers)
        squares = np.concatenate(
            [scales.accelerations.sum(axis=0), scales.velocities.sum(axis=0), scales.zmp], axis=1
        )
        blocks = np.swapaxes(self._stack, 1, 2) @ (squares[:, :, None] * self._stack)
        self._add_limits(blocks, scales)
        # Joints are as curved in the rows of velocities as in those of the static problem.
        static = multipliers[: len(scales.static)]
        blocks[:, self._at, self._at] += self._knot_blocks(scales.static, static)
        if multipliers.any():
            blocks -= self._neighbourhood_hessian(weights)
        out = p.knot_band.matrix(blocks)
        out[0, p.numbering.times] += scales.spans
        return out

    def _derived_changes(self) -> FloatArray:
        """Derivative of all velocity changes by the neighbourhoods ``(K, 15, 3 c + 3)``."""
        h, by_pose = self._times[:, None, None], self._places_by_pose
        count, n = by_pose.shape[:2]
        out = np.zeros((count, n, self._next_span + 1))
        # v(k) - v(k-1) = (u(k+1) - u(k)) / h(k) - (u(k) - u(k-1)) / h(k-1)
        back, ahead = by_pose[:-1] / h, by_pose[1:] / h
        out[1:, :, self._before] = back
        out[1:, :, self._at] -= ahead
        out[:-1, :, self._at] -= back
        out[:-1, :, self._after] = ahead
        # By a span: an interval's time is the mean of two.
        half = self._velocity / (2.0 * self._times[:, None])
        out[1:, :, self._before_span] = half
        out[1:, :, self._span] += half
        out[:-1, :, self._span] -= half
        out[:-1, :, self._next_span] = -half
        return out

    def _stacked(self) -> FloatArray:
        """The stack of derivatives ``(K, 24 + most ZMP rows, 3 c + 3)``."""
        p = self._problem
        zmp = p.zmp_by_knot
        out = np.zeros((p.knots, 2 * JOINTS + zmp.shape[1], self._next_span + 1))
        out[:, :JOINTS] = self._changes_by_neighbours[:, :JOINTS]
        out[:-1, JOINTS : 2 * JOINTS, self._at] = -self._joints_by_pose[:-1]
        out[:-1, JOINTS : 2 * JOINTS, self._after] = self._joints_by_pose[1:]
        out[zmp.group, 2 * JOINTS + zmp.place] = self._zmp_by_neighbours()
        return out

    def _zmp_by_neighbours(self) -> FloatArray:
        """Derivative of the ZMP's rows by the neighbourhoods ``(M, 3 c + 3)``.

        A row is ``distance (span + up / g) - height inward / g``.
        """
        z = self._problem.zmp
        distance, height, inward, up = self._zmp_terms
        by_up = self._changes_by_neighbours[z.knot, _UP]
        out = (distance / self._gravity)[:, None] * by_up
        out -= (height / self._gravity)[:, None] * self._inward_by_neighbours
        out[:, self._span] += distance
        body = self._places_by_pose[z.knot, JOINTS:]
        load = self._spans[z.knot] + up / self._gravity
        out[:, self._at] += load[:, None] * np.einsum("md,mdc->mc", z.normal, body[:, :2])
        out[:, self._at] -= (inward / self._gravity)[:, None] * body[:, 2]
        return np.asarray(out)

    @cached_property
    def _inward_by_neighbours(self) -> FloatArray:
        """Derivative of the velocity changes along the ZMP rows' normals ``(M, 3 c + 3)``."""
        z = self._problem.zmp
        level = self._changes_by_neighbours[z.knot, _LEVEL]
        return np.asarray(np.einsum("md,mdc->mc", z.normal, level))

    def _change_weights(self, parts: DynamicParts) -> FloatArray:
        """Weights of what is in the stack, for weighted rows ``(K, 24 + most ZMP rows)``."""
        up, down = parts.accelerations
        faster, slower = parts.velocities
        return np.concatenate([down - up, slower - faster, parts.zmp], axis=1)

    def _add_limits(self, blocks: FloatArray, scales: DynamicParts) -> None:
        """Add what ``limit * time`` contributes to squares of rows ``limit * time -+ change``."""
        limits, span = self._acceleration_limits, self._span
        signed = scales.accelerations[1] * limits[1] - scales.accelerations[0] * limits[0]
        cross = (signed[:, None] @ self._stack[:, :JOINTS])[:, 0]
        blocks[:, :, span] += cross
        blocks[:, span] += cross
        blocks[:, span, span] += (scales.accelerations * limits**2).sum(axis=(0, 2))
        limits, velocities = self._velocity_limits, scales.velocities[:, :-1]
        signed = (velocities[1] * limits[1] - velocities[0] * limits[0]) / 2.0
        cross = (signed[:, None] @ self._stack[:-1, JOINTS : 2 * JOINTS])[:, 0]
        square = (velocities * limits**2).sum(axis=(0, 2)) / 4.0
        for one in (span, self._next_span):
            blocks[:-1, :, one] += cross
            blocks[:-1, one] += cross
            for other in (span, self._next_span):
                blocks[:-1, one, other] += square

    def _neighbourhood_hessian(self, weights: DynamicParts) -> FloatArray:
        """Hessian of weighted rows of accelerations and the ZMP ``(K, 3 c + 3, 3 c + 3)``."""
        p, times = self._problem, self._times[:, None]
        zmp = weights.zmp[p.zmp_by_knot.group, p.zmp_by_knot.place]
        on_velocity = self._velocity_weights(weights, zmp)
        n = self._next_span + 1
        out = np.zeros((p.knots, n, n))
        # Velocities are linear in places. Places of joints are curved in the poses.
        on_places = on_velocity / times
        on_joints = np.zeros((p.knots, JOINTS))
        on_joints[1:] += on_places[:, :JOINTS]
        on_joints[:-1] -= on_places[:, :JOINTS]
        hessian = p.legs.hessian(self._kinematics, on_joints.reshape(-1, 4, 3))
        out[:, self._at, self._at] = hessian[:, p.free_columns][:, :, p.free_columns]
        # v = (u(k+1) - u(k)) / h: by h and a pose, and twice by h, which is the mean of two spans.
        by_time = (on_velocity / times**2)[:, None] / 2.0
        left = (by_time @ self._places_by_pose[:-1])[:, 0]
        right = -(by_time @ self._places_by_pose[1:])[:, 0]
        twice = (on_velocity * self._velocity).sum(axis=1) / (2.0 * self._times**2)
        for one in (self._span, self._next_span):
            for pose, part in ((self._at, left), (self._after, right)):
                out[:-1, pose, one] += part
                out[:-1, one, pose] += part
            for other in (self._span, self._next_span):
                out[:-1, one, other] += twice
        self._add_products(out, zmp)
        return out

    def _velocity_weights(self, weights: DynamicParts, zmp: FloatArray) -> FloatArray:
        """Weights of all velocities, of joints and body centre ``(K - 1, 15)``.

        Args:
            weights: of all rows.
            zmp: those of the ZMP's rows, row by row ``(M,)``.
        """
        p = self._problem
        distance, height, _, _ = self._zmp_terms
        share = zmp / self._gravity
        on_changes = np.zeros((p.knots, JOINTS + 3))
        on_changes[:, :JOINTS] = weights.accelerations[1] - weights.accelerations[0]
        of_rows = np.column_stack([-(share * height)[:, None] * p.zmp.normal, share * distance])
        on_changes[:, JOINTS:] += p.zmp_by_knot.padded(of_rows).sum(axis=1)
        return on_changes[:-1] - on_changes[1:]

    def _add_products(self, out: FloatArray, zmp: FloatArray) -> None:
        """Add the mixed second derivatives of the products in the ZMP's rows.

        Those are distance times (span and upward change), and height times inward change. Distance
        and height depend on the pose at the knot alone.

        Args:
            out: Hessians ``(K, 3 c + 3, 3 c + 3)``; are changed.
            zmp: weights of the ZMP's rows ``(M,)``.
        """
        z, rows = self._problem.zmp, self._problem.zmp_by_knot
        most = rows.shape[1]
        # One factor of each product by the pose at the knot, the other by the neighbourhood; for
        # each row first the product with the distance, in another row that with the height.
        by_pose = np.zeros((rows.shape[0], 2 * most, len(self._problem.free_columns)))
        by_neighbours = np.zeros((rows.shape[0], 2 * most, out.shape[1]))
        body = self._places_by_pose[z.knot, JOINTS:]
        by_pose[rows.group, rows.place] = np.einsum("md,mdc->mc", z.normal, body[:, :2])
        by_pose[rows.group, most + rows.place] = body[:, 2]
        share = (zmp / self._gravity)[:, None]
        upward = share * self._changes_by_neighbours[z.knot, _UP]
        upward[:, self._span] += zmp
        by_neighbours[rows.group, rows.place] = upward
        by_neighbours[rows.group, most + rows.place] = -share * self._inward_by_neighbours
        products = np.swapaxes(by_pose, 1, 2) @ by_neighbours
        out[:, self._at] += products
        out[:, :, self._at] += np.swapaxes(products, 1, 2)
