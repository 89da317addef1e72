"""What joint_trajectory_controller does with a message, by its published rules.

Its page "Trajectory Representation" and its parameters say: a message is refused where a joint is
unknown or missing, times do not strictly increase, arrays have another length, or the last point
moves. Points are joined by polynomials of degree 1, 3 or 5, by the derivatives that they have; the
first one is reached from where the robot is. Effort is interpolated linearly.
"""

from __future__ import annotations

from typing import Any

import numpy as np

FIELDS = ("positions", "velocities", "accelerations")


def seconds(point: dict[str, Any]) -> float:
    stamp = point["time_from_start"]
    assert isinstance(stamp["sec"], int) and 0 <= stamp["nanosec"] < 10**9
    return stamp["sec"] + 1e-9 * stamp["nanosec"]


class Refused(Exception):
    pass


class TrajectoryController:
    """Takes a message, and tells positions and velocities at any time after its start."""

    def __init__(self, joints: list[str], effort: bool = False) -> None:
        self.joints = joints
        self.effort = effort

    def accept(self, message: dict[str, Any], present: np.ndarray | None = None) -> None:
        names, points = message["joint_names"], message["points"]
        if sorted(names) != sorted(self.joints):
            raise Refused(f"joints {names}")
        if not points:
            raise Refused("no points")
        times = np.array([seconds(p) for p in points])
        if (np.diff(times) <= 0).any() or times[0] < 0:
            raise Refused("times do not increase")
        for point in points:
            for name in (*FIELDS, "effort"):
                if len(point.get(name) or names) != len(names):
                    raise Refused(f"{name} has another length")
            if not point.get("positions"):
                raise Refused("no positions")
            if point.get("effort") and not self.effort:
                raise Refused("effort")
        if np.abs(points[-1].get("velocities", [0.0])).max() > np.finfo(np.float32).eps:
            raise Refused("the last point moves")
        order = [names.index(joint) for joint in self.joints]
        used = [name for name in FIELDS if points[0].get(name)]
        values = [np.array([p[name] for p in points])[:, order] for name in used]
        if times[0] > 0 and present is not None:
            times = np.concatenate([[0.0], times])
            still = [present] + [0.0 * present] * (len(values) - 1)
            values = [np.vstack([a, v]) for a, v in zip(still, values, strict=True)]
        self.times, self.values = times, values

    def polynomials(self, gap: int) -> np.ndarray:
        """Coefficients of a gap, the constant first ``(2 k, n)``, by the values at its ends."""
        length, k = self.times[gap + 1] - self.times[gap], len(self.values)
        rows, right = [], []
        for at, end in ((0.0, gap), (1.0, gap + 1)):
            for d in range(k):
                factors = [np.prod(range(p - d + 1, p + 1)) * at ** max(p - d, 0) if p >= d else 0.0
                           for p in range(2 * k)]  # fmt: skip
                rows.append(factors)
                right.append(self.values[d][end] * length**d)
        return np.linalg.solve(np.array(rows, dtype=float), np.array(right))

    def sampled(self, per_gap: int = 12) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Times, positions and velocities at that many places of every gap, and its ends."""
        share = np.linspace(0.0, 1.0, per_gap)
        times, positions, velocities = [], [], []
        for gap, (a, b) in enumerate(zip(self.times, self.times[1:], strict=False)):
            c = self.polynomials(gap)
            power = np.arange(len(c))
            times.append(a + share * (b - a))
            positions.append(share[:, None] ** power @ c)
            rate = power[1:, None] * c[1:] / (b - a)
            velocities.append(share[:, None] ** power[:-1] @ rate)
        return np.concatenate(times), np.vstack(positions), np.vstack(velocities)
