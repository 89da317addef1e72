"""Which part of a height map is drawn below a walk, how finely, and where feet may stand on it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gaitopt.conventions import FloatArray
from gaitopt.plan.plan import Plan
from gaitopt.terrain.height_map import HeightMap
from gaitopt.terrain.layers import FRICTION, GroundLayers, ground_layers
from gaitopt.viewing.replay.scene import Heights

MOST_DRAWN = 150_000
"""Most points of a map that are drawn: 400 kB in a page. Chosen: ten times as many as maps of a few
metres have, and browsers draw their triangles without delay."""
MOST_LAYERED = 1_000_000
"""Most points for which a replay finds out where feet may stand: about a second."""


@dataclass(frozen=True, eq=False)
class GroundWindow:
    """The part of a plan's height map that is drawn.

    Attributes:
        ground: that part, with all its points.
        first: indices of its first point in the whole map.
        every: one of so many points is drawn, along x and along y.
        cropped: whether the whole map is larger.
        margin: least distance of the walk from where the map is cut off [m].
    """

    ground: HeightMap
    first: tuple[int, int]
    every: int
    cropped: bool
    margin: float

    @cached_property
    def heights(self) -> Heights:
        """The points that are drawn."""
        thin = self.ground.z[:: self.every, :: self.every]
        return Heights(thin, self.every * self.ground.resolution, self.ground.origin)

    @property
    def notes(self) -> tuple[str, ...]:
        """What is not drawn, in words."""
        out = []
        unknown = 1.0 - self.ground.known.mean()
        if unknown > 0.0:
            out.append(f"ground: {unknown:.1%} unknown and left out")
        if self.cropped:
            out.append(f"ground: only within {self.margin:.2g} m of the walk")
        if self.every > 1:
            out.append(
                f"ground drawn from one point every {1e3 * self.heights.step:.3g} mm, known "
                f"every {1e3 * self.ground.resolution:.3g} mm"
            )
        return tuple(out)

    def codes(self, plan: Plan, layers: GroundLayers | None) -> NDArray[np.uint8] | None:
        """Where feet may stand, or why not: indices in ``FOOTINGS`` of the points that are drawn.

        Args:
            plan: gives robot and friction, where there are no ``layers``.
            layers: of the whole map, where they are known; else they are computed, as by default.

        Returns:
            ``(nx, ny)``; ``None`` where the map is so large that it would take long.
        """
        i, j = self.first
        if layers is None or layers.codes.shape != _of(plan).shape:
            if self.ground.z.size > MOST_LAYERED:
                return None
            i, j, layers = self._layers(plan)
        nx, ny = self.ground.shape
        return layers.codes[i : i + nx : self.every, j : j + ny : self.every]

    def _layers(self, plan: Plan) -> tuple[int, int, GroundLayers]:
        """Layers of this part and a border around it, and the index of its first point in them.

        Whether a point lies in a pit follows from the ground around it.
        """
        ground, forces = _of(plan), plan.settings.promised_forces
        border = int(np.ceil(2.0 * max(plan.robot.stance_size) / ground.resolution))
        low = np.maximum(np.array(self.first) - border, 0)
        high = np.array(self.first) + self.ground.shape + border
        friction = FRICTION if forces is None else forces.friction
        layers = ground_layers(_part(ground, low, high), robot=plan.robot, friction=friction)
        i, j = (np.array(self.first) - low).tolist()
        return i, j, layers


def ground_window(plan: Plan, margin: float | None = None) -> GroundWindow | None:
    """The part of a plan's height map that is drawn; ``None`` where the plan has none.

    Maps with more than :data:`MOST_DRAWN` points are cut off around the walk, and if that is not
    enough, only some of the points are drawn.

    Args:
        plan: any plan.
        margin: with it, maps of all sizes are cut off, at this distance from the walk [m]; by
            default large ones are, at the size of the stance.
    """
    ground = plan.footholds.ground
    if ground is None:
        return None
    low, high = np.zeros(2, dtype=int), np.array(ground.shape)
    if margin is not None or ground.z.size > MOST_DRAWN:
        margin = float(np.hypot(*plan.robot.stance_size)) if margin is None else margin
        places = np.concatenate([_places(plan) - margin, _places(plan) + margin])
        cells = (places - ground.origin) / ground.resolution
        # At least one cell of the map, also where the walk is beside it.
        low = np.clip(np.floor(cells.min(axis=0)).astype(int), 0, high - 2)
        high = np.clip(np.ceil(cells.max(axis=0)).astype(int) + 1, low + 2, high)
        if not ground.known[low[0] : high[0], low[1] : high[1]].any():
            low, high = np.zeros(2, dtype=int), np.array(ground.shape)
    part = _part(ground, low, high)
    every = max(1, int(np.ceil(np.sqrt(part.z.size / MOST_DRAWN))))
    # With fewer than two points there is no cell.
    every = min(every, min(part.shape) - 1)
    cropped = part.shape != ground.shape
    return GroundWindow(part, (int(low[0]), int(low[1])), every, cropped, margin or 0.0)


def _of(plan: Plan) -> HeightMap:
    """The plan's height map."""
    assert plan.footholds.ground is not None
    return plan.footholds.ground


def _part(ground: HeightMap, low: np.ndarray, high: np.ndarray) -> HeightMap:
    """The points from index ``low (2,)`` to below ``high (2,)`` of a map."""
    z = ground.z[low[0] : high[0], low[1] : high[1]]
    return HeightMap(z, ground.resolution, ground.origin + ground.resolution * low)


def _places(plan: Plan) -> FloatArray:
    """Where feet stand and the body is, from above ``(n, 2)`` [m]."""
    feet = [points[:, :2] for points in plan.footholds.points.values()]
    return np.concatenate([*feet, plan.path.knots()[:, :2]])
