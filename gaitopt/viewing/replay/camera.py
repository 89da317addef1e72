"""What a camera must see of a plan."""

from __future__ import annotations

import numpy as np

from gaitopt.plan.plan import Plan
from gaitopt.viewing.replay.terrain_scene import ground_level


def view_sphere(plan: Plan) -> tuple[tuple[float, float, float], float, float]:
    """Centre and radius [m] of a ball around route and body, and the heading [rad]."""
    level = ground_level(plan.footholds, plan.robot.foot_radius)
    body = plan.path.knots()[:, :3]
    points = np.concatenate([plan.footholds.array.reshape(-1, 3), body])
    low, high = points.min(axis=0), points.max(axis=0)
    low[2] = level
    x, y, z = ((low + high) / 2.0).tolist()
    ends = plan.footholds.array[:, [0, -1], :2].mean(axis=0)
    ahead = ends[1] - ends[0]
    if float(np.hypot(*ahead)) < 1e-6:
        ahead = np.array([np.cos(plan.settings.heading), np.sin(plan.settings.heading)])
    radius = float(np.linalg.norm(high - low)) / 2.0
    return (x, y, z), max(radius, 1.3 * robot_size(plan)), float(np.arctan2(ahead[1], ahead[0]))


def robot_size(plan: Plan) -> float:
    """Radius [m] of a ball around the robot as it walks."""
    legs = plan.robot.legs.values()
    return max(float(np.linalg.norm(leg.hip)) + 0.6 * (leg.upper + leg.lower) for leg in legs)
