"""Where feet may stand on a map, for the search: from the layers of the ground."""

from __future__ import annotations

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.planners.over_terrain.settings import TerrainSettings
from gaitopt.planners.over_terrain.surfaces import Stands
from gaitopt.robots.quadruped import Quadruped
from gaitopt.terrain.height_map import HeightMap
from gaitopt.terrain.layers import GroundLayers, ground_layers

SLOPE_COST, ROUGHNESS_COST, EDGE_COST = 0.1, 0.06, 0.1
"""Penalties of the steepest and of the roughest ground that is allowed, and of a place at an edge.
Chosen against the cost of a step at the end of its freedom, which is 0.5: with three times as much
feet do not get to the edge of a stair, from which the next lower one is reached."""
FAR_FROM_EDGE = 3.0
"""Distance from an edge beyond which there is no penalty, in foot radii beyond the least one."""


def layers_for(robot: Quadruped, ground: HeightMap, settings: TerrainSettings) -> GroundLayers:
    """The layers of a map for a robot and its search."""
    return ground_layers(
        ground, robot=robot, friction=settings.friction, edge_margin=settings.edge_margin
    )


def stands_of(robot: Quadruped, layers: GroundLayers) -> Stands:
    """The places where feet may stand, and how good they are.

    A place whose contact itself is too steep is none, though the ground around it may be flat.
    """
    limits = layers.limits
    ground = layers.ground
    steep = np.tan(np.nan_to_num(layers.slope)) / limits["friction"]
    rough = np.nan_to_num(layers.roughness) / limits["max_roughness"]
    far = FAR_FROM_EDGE * max(robot.foot_radius, ground.resolution)
    near = 1.0 - np.clip((layers.edge_distance - limits["edge_margin"]) / far, 0.0, 1.0)
    penalties = SLOPE_COST * steep**2 + ROUGHNESS_COST * rough**2 + EDGE_COST * near**2
    return Stands.of(ground, robot.foot_radius, layers.steppable, penalties, limits["friction"])


def start_stands(stands: Stands, ground: HeightMap, usual: FloatArray, freedom: float) -> list[int]:
    """The stand nearest to each usual place ``(4, 2)`` [m]; -1 where none is near enough."""
    out = []
    for place in usual:
        near = stands.near(ground, place, freedom)
        away = np.linalg.norm(stands.centres[near, :2] - place, axis=1)
        out.append(int(near[away.argmin()]) if near.size else -1)
    return out
