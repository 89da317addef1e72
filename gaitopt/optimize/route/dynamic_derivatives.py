"""Values and derivatives of the rows of a walk with acceleration limits.

All rows but those on single poses look at *places* (the joint angles and the body centre at a knot)
and at spans. In these they are simple: a velocity is a difference of two neighbouring places over
an interval, and a velocity change the difference of two velocities. So all products and matrices
are made in places and spans first (:class:`gaitopt.optimize.route.place_blocks.PlaceBlocks`), and
places are derived by poses last.

All times are counted in the problem's time unit here.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.optimize.route.derivatives import RouteLinearisation
from gaitopt.optimize.route.dynamic_layout import DynamicLayout, DynamicParts, interval_times
from gaitopt.optimize.route.legs import BODY, JOINTS, POSE
from gaitopt.optimize.route.place_blocks import PlaceBlocks, VelocityChanges

_LEVEL, _UP = slice(JOINTS, JOINTS + 2), JOINTS + 2
"""Where the body centre's horizontal and vertical places stand behind the joints."""


class DynamicRouteLinearisation(RouteLinearisation):
    """Values and derivatives of a problem's rows at one point."""

    _problem: DynamicLayout

    def __init__(self, problem: DynamicLayout, x: FloatArray) -> None:
        """Derive at the unknowns ``x (n,)``."""
        super().__init__(problem, x)
        poses, spans = problem.unpack(x)
        unit = problem.time_unit
        spans = spans / unit
        times = interval_times(spans)
        self._spans = np.append(spans, spans[-1])
        self._acceleration_limits = problem.acceleration_limits * unit**2
        self._velocity_limits = problem.interval_velocity_limits * unit
        self._gravity = problem.zmp.gravity * unit**2
        joints = self._kinematics.joints.reshape(-1, JOINTS)
        places = np.concatenate([joints, poses[:, BODY]], axis=1)
        self._changes = VelocityChanges(times, np.diff(places, axis=0) / times[:, None])
        changes = problem.velocity_changes(places, times * unit) * unit
        self._zmp_terms = problem.zmp.terms(poses, changes[:, JOINTS:])
        self._load = self._spans[problem.zmp.knot] + self._zmp_terms.change_up / self._gravity
        self._squares: tuple[FloatArray, PlaceBlocks, FloatArray] | None = None

    def jacobian_transpose_times(self, v: FloatArray) -> FloatArray:
        """Transposed Jacobian times ``v (m,)``: the gradient of ``v . values`` ``(n,)``."""
        p = self._problem
        parts = p.split_dynamic(v)
        on_places, on_spans = self._weights(parts)
        by_pose = (on_places[:, None, :JOINTS] @ self._joints_by_pose)[:, 0]
        by_pose[:, : len(p.body_axes)] += on_places[:, JOINTS + p.body_axes]
        single = p.split(parts.static).single
        by_pose += self._single_transpose_times(single)
        at = p.numbering
        free = at.poses >= 0
        out = np.bincount(at.poses[free], by_pose[free], minlength=at.size)
        out[at.times] += parts.spans + on_spans[:-1]
        out[at.times[-1]] += on_spans[-1]
        return np.asarray(out)

    def jacobian_times(self, dx: FloatArray) -> FloatArray:
        """Jacobian times ``dx (n,)``: the change of all rows ``(m,)``, to first order."""
        p, z = self._problem, self._problem.zmp
        moves = p.of_poses(dx)
        places = np.zeros((p.knots, JOINTS + 3))
        places[:, :JOINTS] = (self._joints_by_pose @ moves[:, :, None])[:, :, 0]
        places[:, JOINTS + p.body_axes] = moves[:, : len(p.body_axes)]
        least = dx[p.numbering.times]
        if p.entry is not None:
            least[0] = 0.0
        spans = np.append(least, least[-1])
        turned, changes = self._changes.times_moves(places, spans)
        limit = self._velocity_limits * interval_times(least)[:, None]
        bound, joints = self._acceleration_limits * spans[:, None], changes[:, :JOINTS]
        distance, height, inward, _ = self._zmp_terms
        body, change = places[z.knot, JOINTS:], changes[z.knot, JOINTS:]
        zmp = (z.normal * body[:, :2]).sum(axis=1) * self._load
        zmp += distance * (spans[z.knot] + change[:, 2] / self._gravity)
        along = (z.normal * change[:, :2]).sum(axis=1)
        zmp -= (body[:, 2] * inward + height * along) / self._gravity
        return np.concatenate([
            (limit[0] - turned).ravel(), (limit[1] + turned).ravel(),
            *self._single_times(places[:, :JOINTS], moves),
            (bound[0] - joints).ravel(), (bound[1] + joints).ravel(), zmp, least,
        ])  # fmt: skip

    def newton_matrix(self, scale: FloatArray, multipliers: FloatArray) -> FloatArray:
        """``J' diag(scale) J`` minus the Hessian of ``multipliers . values``, in banded form."""
        p = self._problem
        if self._squares is None or self._squares[0] is not scale:
            self._squares = scale, *self._squared(scale)
        _, blocks, own = self._squares
        if multipliers.any():
            curved, on_poses = self._curvature(multipliers)
            blocks, own = blocks.minus(curved), own - on_poses
        out = p.place_band.matrix(blocks.by_poses(self._joints_by_pose, p.body_axes, own))
        out[0, p.numbering.times] += p.split_dynamic(scale).spans
        return out

    def _squared(self, scale: FloatArray) -> tuple[PlaceBlocks, FloatArray]:
        """``J' diag(scale) J`` in places and spans, and what is of single poses ``(K, c, c)``.

        Without rows of shortest spans.
        """
        p = self._problem
        scales = p.split_dynamic(scale)
        single = p.split(scales.static)
        blocks = PlaceBlocks.empty(p.knots, joints=True)
        blocks.add_accelerations(self._changes, scales.accelerations, self._acceleration_limits)
        blocks.add_velocities(scales.velocities[:, :-1], self._velocity_limits)
        positions = single.position_low, single.position_high
        for used, position in zip(p.used_limits, positions, strict=True):
            blocks.add_positions(p.fixed_knots, used, position)
        rows = p.zmp_by_knot.padded(self._zmp_by_local)
        weights = p.zmp_by_knot.padded(scales.zmp)
        blocks.add_local(np.swapaxes(rows, 1, 2) @ (weights[:, :, None] * rows))
        rows = self._padded_rows
        weights = p.rows_by_knot.padded(single.single)
        return blocks, np.asarray(np.swapaxes(rows, 1, 2) @ (weights[:, :, None] * rows))

    def _curvature(self, multipliers: FloatArray) -> tuple[PlaceBlocks, FloatArray]:
        """The Hessian of ``multipliers . values``, as :meth:`_squared`."""
        p = self._problem
        weights = p.split_dynamic(multipliers)
        on_places, _ = self._weights(weights)
        on_single, columns = p.split(weights.static).single, p.free_columns
        own = self._hessian(on_places[:, :JOINTS].reshape(-1, 4, 3), on_single)
        if len(columns) < POSE:
            own = own[:, columns][:, :, columns]
        own[:, range(len(columns)), range(len(columns))] += p.weighted_squares(on_single)
        blocks = PlaceBlocks.empty(p.knots, joints=False)
        blocks.add_curvature(self._changes, self._on_velocities(weights))
        blocks.add_local(self._products(weights.zmp))
        return blocks, own

    def _weights(self, parts: DynamicParts) -> tuple[FloatArray, FloatArray]:
        """Gradient of weighted rows by places ``(K, 15)`` and by spans ``(K,)``.

        Without rows on single poses; 0 by a span that is no unknown.
        """
        p, z = self._problem, self._problem.zmp
        distance, _, inward, _ = self._zmp_terms
        up, down = parts.velocities[:, :-1]
        turned = np.zeros((p.knots - 1, JOINTS + 3))
        turned[:, :JOINTS] = down - up
        places, between = self._changes.transpose_times(self._on_velocities(parts), turned)
        places[:, :JOINTS] += self._joint_weights(parts.static)
        by_row = np.column_stack([
            (parts.zmp * self._load)[:, None] * z.normal, -parts.zmp * inward / self._gravity,
            parts.zmp * distance,
        ])  # fmt: skip
        by_knot = p.zmp_by_knot.padded(by_row).sum(axis=1)
        places[:, JOINTS:] += by_knot[:, :3]
        spans = (parts.accelerations * self._acceleration_limits).sum(axis=(0, 2)) + by_knot[:, 3]
        # An interval's time is the mean of two spans.
        between += (parts.velocities[:, :-1] * self._velocity_limits).sum(axis=(0, 2))
        spans[:-1] += between / 2.0
        spans[1:] += between / 2.0
        if p.entry is not None:
            spans[0] = 0.0
        return places, spans

    def _on_velocities(self, parts: DynamicParts) -> FloatArray:
        """Weights of all velocities, of joints and body centre, in weighted rows ``(K - 1, 15)``.

        Only by way of velocity changes.
        """
        p = self._problem
        on_changes = np.empty((p.knots, JOINTS + 3))
        on_changes[:, :JOINTS] = parts.accelerations[1] - parts.accelerations[0]
        of_rows = parts.zmp[:, None] * self._zmp_by_change
        on_changes[:, JOINTS:] = p.zmp_by_knot.padded(of_rows).sum(axis=1)
        return on_changes[:-1] - on_changes[1:]

    @cached_property
    def _zmp_by_change(self) -> FloatArray:
        """Derivative of the ZMP's rows by the body centre's velocity change ``(M, 3)``.

        A row is ``distance (span + up / g) - height inward / g``.
        """
        distance, height, _, _ = self._zmp_terms
        level = -(height / self._gravity)[:, None] * self._problem.zmp.normal
        return np.column_stack([level, distance / self._gravity])

    @cached_property
    def _zmp_by_local(self) -> FloatArray:
        """Derivative of the ZMP's rows by body centres and spans about the knot ``(M, 12)``."""
        z = self._problem.zmp
        distance, _, inward, _ = self._zmp_terms
        local = self._changes.by_local(slice(JOINTS, JOINTS + 3))[z.knot]
        out = (self._zmp_by_change[:, None] @ local)[:, 0]
        out[:, 3:5] += self._load[:, None] * z.normal
        out[:, 5] -= inward / self._gravity
        out[:, 10] += distance
        return np.asarray(out)

    def _products(self, zmp: FloatArray) -> FloatArray:
        """Second derivatives of the products in the ZMP's weighted rows ``(K, 12, 12)``.

        Those are distance times (span and upward change), and height times inward change. Distance
        and height depend on the pose at the knot alone.
        """
        p, z = self._problem, self._problem.zmp
        local = self._changes.by_local(slice(JOINTS, JOINTS + 3))
        sums = zmp[:, None] * z.normal
        sums = p.zmp_by_knot.padded(np.column_stack([sums, sums / self._gravity[:, None]]))
        plain, shared = np.split(sums.sum(axis=1), 2, axis=1)
        half = np.zeros((p.knots, 12, 12))
        half[:, 3:5] = shared[:, :, None] * local[:, 2:]
        half[:, 3:5, 10] += plain
        half[:, 5] = -(shared[:, None] @ local[:, :2])[:, 0]
        return half + np.swapaxes(half, 1, 2)
