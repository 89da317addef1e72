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

    def sampled(self, per_gap: int = 12) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Times, positions and velocities at that many places of every gap, and its ends.

        A gap's polynomial is that of degree 2 k - 1 with the k given values at both ends: its
        coefficients are found from these equations, in the share of the gap that has passed.
        """
        k = len(self.values)
        rows = [[_derivative(p, d, end) for p in range(2 * k)] for end in (0, 1) for d in range(k)]
        lengths = np.diff(self.times)[:, None]
        right = [v[part] * lengths**d for part in (slice(None, -1), slice(1, None))
                 for d, v in enumerate(self.values)]  # fmt: skip
        coefficients = np.einsum("pc,cgn->pgn", np.linalg.inv(np.array(rows)), np.array(right))
        share, power = np.linspace(0.0, 1.0, per_gap), np.arange(2 * k)
        places = np.einsum("sp,pgn->gsn", share[:, None] ** power, coefficients)
        slopes = power[1:] * share[:, None] ** power[:-1]
        rates = np.einsum("sp,pgn->gsn", slopes, coefficients[1:]) / lengths[:, :, None]
        times = self.times[:-1, None] + share * lengths
        joints = len(self.joints)
        return times.ravel(), places.reshape(-1, joints), rates.reshape(-1, joints)


def _derivative(power: int, order: int, at: float) -> float:
    """The derivative of this order of ``x ** power``."""
    factor = float(np.prod(range(power - order + 1, power + 1))) if power >= order else 0.0
    return factor * at ** max(power - order, 0)
