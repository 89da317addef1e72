"""Values and derivatives of a time-optimal walk's rows at one point.

Most rows look at one pose; velocity rows look at two neighbouring poses and the time between them.
So the Jacobian is never built: products with it, and the banded Newton matrix, come from arrays
over knots and intervals.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.optimize.route.layout import RouteLayout
from gaitopt.optimize.route.leg_hessians import pose_hessian
from gaitopt.optimize.route.legs import JOINTS, ORIENTATION


class RouteLinearisation:
    """Values and derivatives of a problem's rows at one point.

    It is a :class:`gaitopt.interior_point.problem.Linearisation`.

    Attributes:
        values: all rows ``(m,)``.
    """

    def __init__(self, problem: RouteLayout, x: FloatArray) -> None:
        """Derive at the unknowns ``x (n,)``."""
        self._problem = problem
        self._poses, times = problem.unpack(x)
        level = not np.isin(problem.free_columns, range(ORIENTATION.start, ORIENTATION.stop)).any()
        last = problem.last_values[0] if problem.last_values else None
        if last is not None and not np.array_equal(last.x, x):
            last = None
        known = None if last is None else last.joints.reshape(-1, 4, 3)
        self._kinematics = problem.legs.kinematics(
            self._poses, problem.feet, problem.swing, level, known
        )
        joints = self._kinematics.joints.reshape(-1, JOINTS)
        self._all_joints_by_pose = self._kinematics.joints_by_pose()
        # By the entries of the poses that may be unknown: (K, 12, c) and (M, c).
        self._joints_by_pose = self._all_joints_by_pose[:, :, problem.free_columns]
        rows_by_pose, com = problem.rows.by_pose(self._poses), None
        if problem.com is not None:
            self._com = problem.com.masses.derivatives(
                self._poses, self._kinematics, self._all_joints_by_pose
            )
            com_rows = problem.com.by_pose(self._com)
            rows_by_pose = np.concatenate([rows_by_pose, com_rows])[problem.row_order]
            com = self._com.com
        self.values = (
            problem.row_values(self._poses, times, joints, com) if last is None else last.values
        )
        self._rows_by_pose = rows_by_pose[:, problem.free_columns]

    def jacobian_transpose_times(self, v: FloatArray) -> FloatArray:
        """Transposed Jacobian times ``v (m,)``: the gradient of ``v . values`` ``(n,)``."""
        p, parts = self._problem, self._problem.split(v)
        by_pose = (self._joint_weights(v)[:, None] @ self._joints_by_pose)[:, 0]
        by_pose += self._single_transpose_times(parts.single)
        at = p.numbering
        free = at.poses >= 0
        out = np.bincount(at.poses[free], by_pose[free], minlength=at.size)
        out[at.times] += (parts.velocity_up + parts.velocity_down) @ p.scaled_velocity_limits
        return np.asarray(out)

    @cached_property
    def _padded_rows(self) -> FloatArray:
        """Rows on single poses by unknown entries of the poses, knot by knot ``(K, rows, c)``."""
        return self._problem.rows_by_knot.padded(self._rows_by_pose)

    def _single_transpose_times(self, weights: FloatArray) -> FloatArray:
        """Gradient of weighted rows on single poses ``(M,)`` by the poses ``(K, c)``."""
        padded = self._problem.rows_by_knot.padded(weights)
        return np.asarray((padded[:, None] @ self._padded_rows)[:, 0])

    def jacobian_times(self, dx: FloatArray) -> FloatArray:
        """Jacobian times ``dx (n,)``: the change of all rows ``(m,)``, to first order."""
        p = self._problem
        moves = p.of_poses(dx)
        joints = (self._joints_by_pose @ moves[:, :, None])[:, :, 0]
        turned = np.diff(joints, axis=0)
        limit = p.scaled_velocity_limits * dx[p.numbering.times][:, None]
        return np.concatenate(
            [(limit - turned).ravel(), (limit + turned).ravel(), *self._single_times(joints, moves)]
        )

    def _single_times(self, joints: FloatArray, moves: FloatArray) -> list[FloatArray]:
        """The change of all rows but those of velocities, to first order.

        Args:
            joints: changes of the joints ``(K, 12)``.
            moves: of the poses' unknown entries ``(K, c)``.
        """
        late, (low, high) = joints[self._problem.fixed_knots :], self._problem.used_limits
        single = (self._rows_by_pose * moves[self._problem.row_knots]).sum(axis=1)
        return [late[:, low].ravel(), -late[:, high].ravel(), single]

    def newton_matrix(self, scale: FloatArray, multipliers: FloatArray) -> FloatArray:
        """``J' diag(scale) J`` minus the Hessian of ``multipliers . values``, in banded form."""
        p = self._problem
        c = len(p.free_columns)
        parts = p.split(scale)
        both = parts.velocity_up + parts.velocity_down
        # A velocity row's gradient: by the poses before and after, by the time between them.
        by_poses = np.concatenate([-self._joints_by_pose[:-1], self._joints_by_pose[1:]], axis=2)
        poses = np.swapaxes(by_poses, 1, 2) @ (both[:, :, None] * by_poses)
        pose_time = np.einsum(
            "kjc,kj->kc", by_poses,
            (parts.velocity_down - parts.velocity_up) * p.scaled_velocity_limits,
        )  # fmt: skip
        blocks = np.empty((p.knots - 1, 2 * c + 1, 2 * c + 1))
        before, after = slice(0, c), slice(c + 1, 2 * c + 1)
        blocks[:, before, before], blocks[:, after, after] = poses[:, :c, :c], poses[:, c:, c:]
        blocks[:, before, after], blocks[:, after, before] = poses[:, :c, c:], poses[:, c:, :c]
        blocks[:, before, c] = blocks[:, c, before] = pose_time[:, :c]
        blocks[:, after, c] = blocks[:, c, after] = pose_time[:, c:]
        blocks[:, c, c] = both @ p.scaled_velocity_limits**2
        # A knot's own block is added once: in the interval after it, or before the last knot.
        single = self._knot_blocks(scale, multipliers)
        blocks[:, before, before] += single[:-1]
        blocks[-1, after, after] += single[-1]
        return p.interval_band.matrix(blocks)

    def _joint_weights(self, v: FloatArray) -> FloatArray:
        """Gradient of ``v . values`` by the joints at every knot ``(K, 12)``.

        Without rows on single poses.
        """
        p, parts = self._problem, self._problem.split(v)
        out = np.zeros((p.knots, JOINTS))
        velocity = parts.velocity_down - parts.velocity_up
        out[1:] += velocity
        out[:-1] -= velocity
        out[p.fixed_knots :, p.used_limits[0]] += parts.position_low
        out[p.fixed_knots :, p.used_limits[1]] -= parts.position_high
        return out

    def _knot_blocks(self, scale: FloatArray, multipliers: FloatArray) -> FloatArray:
        """What rows on single poses, and all curvature, add to the Newton matrix ``(K, c, c)``."""
        p = self._problem
        columns, scales = p.free_columns, p.split(scale)
        on_single = p.split(multipliers).single
        hessian = self._hessian(self._joint_weights(multipliers).reshape(-1, 4, 3), on_single)
        out = -hessian[:, columns][:, :, columns]
        out[:, range(len(columns)), range(len(columns))] -= p.weighted_squares(on_single)
        on_positions = np.zeros((p.knots, JOINTS))
        on_positions[p.fixed_knots :, p.used_limits[0]] += scales.position_low
        on_positions[p.fixed_knots :, p.used_limits[1]] += scales.position_high
        if p.used_limits.any():
            by_pose = self._joints_by_pose
            out += np.swapaxes(by_pose, 1, 2) @ (on_positions[:, :, None] * by_pose)
        rows = self._padded_rows
        weights = p.rows_by_knot.padded(scales.single)
        out += np.swapaxes(rows, 1, 2) @ (weights[:, :, None] * rows)
        return np.asarray(out)

    def _hessian(self, joint_weights: FloatArray, on_single: FloatArray) -> FloatArray:
        """Hessian by the poses of weighted joints and of rows on the COM ``(K, 9, 9)``.

        Args:
            joint_weights: ``(K, 4, 3)``.
            on_single: weights of the rows on single poses ``(M,)``.
        """
        p, kinematics = self._problem, self._kinematics
        if p.com is None:
            return pose_hessian(p.legs, kinematics, joint_weights)
        unsorted = np.empty_like(on_single)
        unsorted[p.row_order] = on_single
        on_com = p.com.com_weights(unsorted[len(p.rows.knot) :], p.knots)
        masses = p.com.masses
        joint_weights = joint_weights + masses.joint_weights(kinematics, self._com, on_com)
        of_joints = masses.joint_hessian(kinematics, self._com, on_com)
        out = pose_hessian(p.legs, kinematics, joint_weights, of_joints)
        masses.add_orientation(out, kinematics, self._com, on_com)
        return out
