"""A short walk over a height map, and a search that would have found it, made without a search."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cache

import numpy as np

import gaitopt
from gaitopt import LEGS, Footholds, GroundLayers, HeightMap, Plan
from gaitopt.conventions import FloatArray

CELL = 0.02


def bumps(length: float = 1.1, width: float = 0.9, cell: float = CELL) -> HeightMap:
    """Waves 24 mm high and a block; a corner of 4 by 3 points is unknown."""
    x = np.arange(round(length / cell) + 1)[:, None] * cell - 0.45
    y = np.arange(round(width / cell) + 1)[None] * cell - width / 2.0
    z = 0.012 * np.sin(7.0 * x) * np.cos(5.0 * y)
    z[(np.abs(x - 0.1) < 0.05) & (np.abs(y) < 0.05)] = 0.06
    z[:4, :3] = np.nan
    return HeightMap(z, cell, (-0.45, -width / 2.0))


def footholds_on(ground: HeightMap, foot_radius: float, extra: bool = True) -> Footholds:
    """Places of the paper's columns, put upon a map; LF steps once more than the others."""
    flat = {leg: points[:, :2] for leg, points in gaitopt.s_columns(0, columns=3).points.items()}
    order = ["RH", "RF", "LH", "LF"] * 2
    if extra:
        flat["LF"] = np.vstack([flat["LF"], flat["LF"][-1] + [0.03, 0.0]])
        order.append("LF")
    rest = {leg: ground.ball(places, foot_radius) for leg, places in flat.items()}
    return Footholds(
        {leg: r.centres for leg, r in rest.items()},
        normals={leg: r.normals for leg, r in rest.items()}, ground=ground, order=order,
    )  # fmt: skip


@cache
def bumpy_walk() -> Plan:
    """Nine steps of wang2020 over :func:`bumps`."""
    robot = gaitopt.load_robot("wang2020")
    feet = footholds_on(bumps(), robot.foot_radius)
    return gaitopt.plan_crawl(robot, feet, timing="velocity", follow_terrain=True)


@dataclass(frozen=True)
class Straight:
    """A straight way."""

    poses: FloatArray = field(default_factory=lambda: np.linspace([0, 0, 0], [0.4, 0, 0], 41))


@dataclass(frozen=True)
class FoundSearch:
    """What is shown of a search, made up."""

    footholds: Footholds
    layers: GroundLayers
    tried: FloatArray
    complete: bool = True
    course: Straight = field(default_factory=Straight)
    refused: dict[str, int] = field(default_factory=dict)


def bumpy_search(complete: bool = True) -> FoundSearch:
    """A search that tried the footholds of :func:`bumpy_walk`, and places beside them."""
    plan = bumpy_walk()
    ground = plan.footholds.ground
    assert ground is not None
    feet = np.concatenate([plan.footholds[leg] for leg in LEGS])
    tried = np.concatenate([feet + np.array([dx, 0.0, 0.0]) for dx in (0.0, 0.02, 0.04)])
    layers = gaitopt.ground_layers(ground, robot=plan.robot)
    refused = {} if complete else {"a limb <would> touch the ground": 12, "out of reach": 3}
    return FoundSearch(plan.footholds, layers, tried, complete, refused=refused)
