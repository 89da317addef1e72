"""Where feet may stand on a map, for the search: from the layers of the ground."""

from __future__ import annotations

import numpy as np

from gaitopt.conventions import BoolArray, FloatArray
from gaitopt.planners.over_terrain.settings import TerrainSettings
from gaitopt.planners.over_terrain.surfaces import Stands
from gaitopt.robots.quadruped import Quadruped
from gaitopt.terrain.height_map import HeightMap
from gaitopt.terrain.layers import GroundLayers, ground_layers

SLOPE_COST, ROUGHNESS_COST, EDGE_COST = 0.5, 0.3, 0.5
"""Penalties of the steepest and of the roughest ground that is allowed, and of a place at an edge,
in times of usual steps.
Chosen against that of a step at the end of its freedom, which is 2.5: with three times as much
feet do not get to the edge of a stair, from which the next lower one is reached."""
FAR_FROM_EDGE = 3.0
"""Distance from an edge beyond which there is no penalty, in foot radii beyond the least one."""
BESIDE = 0.01
"""How far feet may be beside their footholds [m], since they land there, or roll:
what is usual in physics."""
TURN_COST = 5.0
"""Penalty of a foothold beside which the ground is turned by the angle of friction. Chosen: at the
crest of a ramp of 25 degrees a foot of go2 rolled over it and slid down, and it steps 8 cm farther
to be away from it."""
EVEN = 1e-3
"""Roughness up to which ground counts as even [m]: nothing is looked for beside it."""


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
    turn = turns_beside(ground, robot.foot_radius, layers.steppable & (layers.roughness > EVEN))
    turn /= np.arctan(limits["friction"])
    # A foot that is a little beside its place would slide.
    held = layers.steppable & (turn < 1.0)
    penalties += TURN_COST * turn**2
    return Stands.of(ground, robot.foot_radius, held, penalties, limits["friction"])


def turns_beside(ground: HeightMap, radius: float, where: BoolArray) -> FloatArray:
    """How much steeper or flatter a foot's contact is a little beside points of the grid.

    At a crest or at the rim of a low stone a foot that is :data:`BESIDE` its place stands on ground
    that is turned against what its forces are planned for.

    Args:
        ground: the map.
        radius: of the feet [m].
        where: points of the grid to look at ``(nx, ny)``.

    Returns:
        The largest angle between the normal at each point and one beside it ``(nx, ny)`` [rad]; 0
        where it was not looked at.
    """
    out = np.zeros(ground.shape)
    i, j = np.nonzero(where)
    around = np.pi / 4.0 * np.arange(8)
    beside = BESIDE * np.column_stack([np.cos(around), np.sin(around)])
    places = np.column_stack([ground.x[i], ground.y[j]])[:, None]
    offsets = np.concatenate([np.zeros((1, 2)), beside])
    normals = ground.ball(places + offsets, radius).normals
    cosines = np.einsum("nki,ni->nk", normals[:, 1:], normals[:, 0])
    out[i, j] = np.arccos(np.clip(np.nan_to_num(cosines, nan=-1.0).min(axis=1), -1.0, 1.0))
    return out


def start_stands(
    stands: Stands, ground: HeightMap, usual: FloatArray, freedom: float
) -> list[np.ndarray]:
    """The stands near each usual place ``(4, 2)`` [m], the nearest first."""
    out = []
    for place in usual:
        near = stands.near(ground, place, freedom)
        away = np.linalg.norm(stands.centres[near, :2] - place, axis=1)
        out.append(near[np.argsort(away, kind="stable")])
    return out
