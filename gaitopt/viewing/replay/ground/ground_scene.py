"""A height map as a scene: its surface, footholds with normals, and where feet may stand."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from gaitopt.conventions import LEGS, FloatArray
from gaitopt.plan.plan import Plan
from gaitopt.terrain.layers import FOOTINGS
from gaitopt.viewing.colours import FOOTING_COLOURS, LEG_COLOURS
from gaitopt.viewing.replay.ground.window import GroundWindow
from gaitopt.viewing.replay.scene import (
    Appearance,
    Box,
    Draped,
    FramePath,
    Heights,
    Node,
    Part,
    Relief,
    Scene,
    pose,
)
from gaitopt.viewing.replay.solids import rounded_bar
from gaitopt.viewing.replay.terrain_scene import FLOOR, ROUTE

FOOTING: Final[FramePath] = ("footing",)
DISC = 0.02
"""Radius of the disc at a foothold [m]: that of the marks on open ground."""
DISC_SIDES = 20
NORMAL_LENGTH, NORMAL_RADIUS = 0.07, 0.0016
"""Length and radius of a normal [m]. Chosen: longer than the feet are wide, so that it is seen
while a foot stands there."""
FLOOR_BELOW = 0.02
"""How far the floor lies below the lowest point of a map [m]."""
FLOOR_SIZE = 60.0
"""Size of the floor, as a multiple of the map's."""


def ground_scene(plan: Plan, window: GroundWindow) -> Scene:
    """The ground of a plan, and its footholds as discs with normals."""
    heights = window.heights
    relief = Part(Relief(heights), Appearance(FLOOR))
    nodes = [
        Node((*ROUTE, "ground"), (relief,)),
        Node((*ROUTE, "floor"), (_floor(heights),)),
        *(_footholds(plan, heights, leg) for leg in LEGS),
    ]
    return Scene(tuple(nodes))


def footing_scene(heights: Heights, codes: NDArray[np.uint8] | None) -> Scene:
    """Where feet may stand, and why not elsewhere, as a cover of the ground.

    Args:
        heights: the ground.
        codes: indices in ``FOOTINGS`` ``(nx, ny)``; with ``None`` the scene is empty.
    """
    if codes is None:
        return Scene(())
    palette = tuple(FOOTING_COLOURS[footing.value] for footing in FOOTINGS)
    look = Appearance("#ffffff", 0.8, casts_shadow=False, layer=1)
    return Scene((Node(FOOTING, (Part(Relief(heights, codes, palette), look),)),))


def footing_legend(node: Node) -> tuple[tuple[str, str], ...]:
    """Names and colours of the footings that occur in the frame of :func:`footing_scene`."""
    reliefs = [p.shape for p in node.parts if isinstance(p.shape, Relief)]
    codes = [shape.codes for shape in reliefs if shape.codes is not None]
    found = [FOOTINGS[i].value for i in np.unique(np.concatenate([c.ravel() for c in codes]))]
    return tuple((name, FOOTING_COLOURS[name]) for name in found)


def circle(middle: FloatArray, radius: float, sides: int = DISC_SIDES) -> FloatArray:
    """Corners of a regular polygon around ``middle (2,)`` ``(sides, 2)`` [m]."""
    angle = 2.0 * np.pi * np.arange(sides) / sides
    return np.asarray(middle + radius * np.column_stack([np.cos(angle), np.sin(angle)]))


def _footholds(plan: Plan, heights: Heights, leg: str) -> Node:
    """Where a leg's foot touches the ground: discs that lie on it, and its normals."""
    index, count = LEGS.index(leg), plan.footholds.counts[leg]
    touches = plan.footholds.touching(plan.robot.foot_radius)[index, :count]
    normals = plan.footholds.normal_array[index, :count]
    discs = Draped(heights, tuple(circle(place[:2], DISC) for place in touches))
    look = Appearance(LEG_COLOURS[leg], 0.85, lit=False, casts_shadow=False, layer=3)
    stick = Appearance(LEG_COLOURS[leg], casts_shadow=False)
    parts = [Part(discs, look)]
    for place, normal in zip(touches, normals, strict=True):
        # Without the balls at its ends.
        parts += rounded_bar(place, place + NORMAL_LENGTH * normal, NORMAL_RADIUS, stick)[:1]
    return Node((*ROUTE, f"footholds {leg}"), tuple(parts))


def _floor(heights: Heights) -> Part:
    """A wide plain below the map, seen where nothing of it is known and around it."""
    size = heights.step * np.array(heights.z.shape)
    x, y = (np.array(heights.origin) + size / 2.0).tolist()
    wide = FLOOR_SIZE * float(size.max())
    look = Appearance(FLOOR, casts_shadow=False, layer=-2)
    return Part(Box((wide, wide, 0.01)), look, pose([x, y, lowest(heights) - FLOOR_BELOW - 0.005]))


def lowest(heights: Heights) -> float:
    """Lowest height that is drawn [m]."""
    return float(np.nanmin(heights.z)) if np.isfinite(heights.z).any() else 0.0
