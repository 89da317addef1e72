"""A height map as MuJoCo's height field: the same surface, triangle by triangle.

MuJoCo fills what lies below each triangle by a prism. It divides cells by the same diagonal as
:class:`gaitopt.HeightMap`. Heights are numbers of single precision, over the range of heights.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from gaitopt.errors import GroundError
from gaitopt.robots.quadruped import Quadruped
from gaitopt.terrain.footholds import Footholds
from gaitopt.terrain.height_map import HeightMap

BASE = 0.5
"""Thickness of the ground below its lowest height [m]. Chosen: feet never get so deep."""

SOFTER = (0.8, 0.9, 0.002)
"""MuJoCo's ``solimp`` on a height map: how hard contacts are where they begin, where they are deep,
and how deep that is [m]. A ball touches two to thirty triangles at once, each of which is a contact
of its own, and all together are harder than one. With MuJoCo's usual values (0.9, 0.95, 0.001)
anymal_c, in steps of 2 ms, slips by 18 mm on level cells of 1 cm, and misses two footholds on those
of 5 mm; with these values it slips by 8 mm on cells of 5, 10, 20 and 40 mm, as on a plane."""

FLAT = 1e-3
"""Range of heights of a map that is level [m]: MuJoCo wants one above 0, and does not use it."""


def add_height_field(
    mujoco: Any, spec: Any, name: str, robot: Quadruped, footholds: Footholds, bare: dict[str, Any]
) -> None:
    """Add the height map of ``footholds``, as far as the robot reaches.

    Points whose height is not known become pits, one length of a leg deeper than the lowest known
    height: nothing stands there.

    Args:
        mujoco, spec: the package, and the model that is made.
        name: of the shape.
        robot: the robot.
        footholds: those with the map.
        bare: how the shape touches others.

    Raises:
        GroundError: no known point of the map is within the robot's reach.
    """
    ground = within_reach(robot, footholds)
    depth = max(leg.reach for leg in robot.legs.values())
    low, high = ground.height_range
    if not ground.known.all():
        low -= depth
    heights = np.where(ground.known, ground.z, low) - low
    span = high - low if high > low else FLAT
    (x0, x1), (y0, y1) = ground.extent
    nx, ny = ground.shape
    field = spec.add_hfield(
        name=name, nrow=ny, ncol=nx, size=[(x1 - x0) / 2.0, (y1 - y0) / 2.0, span, BASE]
    )
    # Rows go along y there.
    field.userdata = (heights.T / span).astype(np.float32).reshape(-1)
    spec.worldbody.add_geom(
        name=name, type=mujoco.mjtGeom.mjGEOM_HFIELD, hfieldname=name,
        pos=[(x0 + x1) / 2.0, (y0 + y1) / 2.0, low], solimp=[*SOFTER, 0.5, 2.0],
        # Otherwise MuJoCo takes the mean of both shapes.
        priority=1, **bare,
    )  # fmt: skip


def within_reach(robot: Quadruped, footholds: Footholds) -> HeightMap:
    """The part of the footholds' map that the robot can come to while it walks over them.

    From each foothold that is twice the distance from the body's middle to the farthest foot.

    Raises:
        GroundError: no known point of the map lies there.
    """
    ground = footholds.ground
    if ground is None:
        raise GroundError("these footholds have no height map")
    reach = 2.0 * max(float(np.linalg.norm(leg.hip)) + leg.reach for leg in robot.legs.values())
    places = footholds.array[..., :2].reshape(-1, 2)
    first = np.floor((places.min(axis=0) - reach - ground.origin) / ground.resolution)
    last = np.ceil((places.max(axis=0) + reach - ground.origin) / ground.resolution)
    most = np.array(ground.shape) - 1
    (i, j) = np.clip(first, 0, most - 1).astype(int)
    (k, m) = np.clip(last, 1, most).astype(int)
    part = ground.z[i : k + 1, j : m + 1]
    if (last < 0).any() or (first > most).any() or not np.isfinite(part).any():
        raise GroundError(
            f"no known point of the map is within {reach:.1f} m of the footholds, which lie at x "
            f"{places[:, 0].min():.2f} to {places[:, 0].max():.2f} m and y "
            f"{places[:, 1].min():.2f} to {places[:, 1].max():.2f} m: {ground!r}"
        )
    return HeightMap(part, ground.resolution, (float(ground.x[i]), float(ground.y[j])))
