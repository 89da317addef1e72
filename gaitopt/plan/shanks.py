"""Shanks of a planned walk that go into other legs' columns, told when the walk is planned.

Planners over columns look at feet, reach and margins; the certificate looks at all links against
all columns, all along. This look costs a millisecond for 64 steps, and tells the clear cases.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from gaitopt.conventions import LEGS, FloatArray, frozen
from gaitopt.plan.plan import Plan
from gaitopt.robots.at_many_poses.chain import Chain
from gaitopt.robots.collisions.pairs import CollisionPairs
from gaitopt.robots.quadruped import Quadruped
from gaitopt.robots.rotations import rpy_to_matrix

ALONG = np.linspace(-0.95, 0.95, 12)[:, None]
"""Places along the middle line of a shank, from end to end."""
LEAST_LENGTH = 0.5
"""Length of a shape that is the shank, as a share of the lower link."""
SMALL = 1e-5
"""Radius of the ball whose distance tells how deep a place is [m]: coal takes no points."""
TOLD = 1e-3
"""Depth within a column from which on it is told [m]."""


class _Bar(NamedTuple):
    """Balls within a shank.

    Attributes:
        joint: number of the joint that carries it.
        line: their middles, in the joint's frame ``(n, 3)`` [m].
        radii: of the balls ``(n,)`` [m].
    """

    joint: int
    line: FloatArray
    radii: FloatArray


class _Shanks(NamedTuple):
    """The shanks of a robot.

    Attributes:
        chain: of its joints.
        bars: by leg.
    """

    chain: Chain
    bars: Mapping[str, tuple[_Bar, ...]]


class ShankInColumn(NamedTuple):
    """A shank within a column.

    Attributes:
        leg: whose shank it is.
        column: leg whose foothold the column is.
        place: x and y of the column's middle ``(2,)`` [m].
        time: of the plan [s].
        below: how far the shank's lowest place there is below the column's top [m].
    """

    leg: str
    column: str
    place: FloatArray
    time: float
    below: float

    def in_words(self) -> str:
        """What is in the way, and what helps."""
        x, y = np.round(self.place, 3).tolist()
        return (
            f"the shank of {self.leg} goes {1e3 * self.below:.0f} mm into a column of {self.column}"
            f", at x = {x:g} m, y = {y:g} m and {self.time:.1f} s after the start, and the "
            "certificate will call the plan violated; what helps: move one of the two footholds, "
            "or thinner columns (radius)"
        )


def shank_in_column(plan: Plan) -> ShankInColumn | None:
    """The deepest place of a shank within a column of a plan; ``None`` without one.

    Balls within the shanks are looked at in the middle of each phase: what is told is so, and what
    is not told may still touch.

    Args:
        plan: over columns.
    """
    shanks, footholds = _shanks(plan.robot), plan.footholds
    if shanks is None:
        return None
    times = np.array([(phase.start + phase.end) / 2.0 for phase in plan.phases])
    values = plan.path.evaluate(times)
    base = rpy_to_matrix(values[:, 3:6])
    turns, places = shanks.chain.places(values[:, 6:])
    owners = [leg for leg in LEGS for _ in footholds[leg]]
    tops = np.concatenate([footholds[leg] for leg in LEGS])
    tops[:, 2] -= plan.robot.foot_radius
    deepest: ShankInColumn | None = None
    for leg, bars in shanks.bars.items():
        for bar in bars:
            local = bar.line @ np.swapaxes(turns[:, bar.joint], 1, 2) + places[:, bar.joint, None]
            points = values[:, None, :3] + local @ np.swapaxes(base, 1, 2)
            points[..., 2] -= bar.radii
            # Only places that are below the highest column may be within one.
            low, share = np.nonzero(points[..., 2] < tops[:, 2].max() - TOLD)
            some = points[low, share]
            away = np.linalg.norm(some[:, None, :2] - tops[:, :2], axis=2)
            below = np.where(away < footholds.landing_radius, tops[:, 2] - some[:, None, 2], 0.0)
            if below.max(initial=TOLD) <= (TOLD if deepest is None else deepest.below):
                continue
            at, column = np.unravel_index(int(below.argmax()), below.shape)
            deepest = ShankInColumn(
                leg, owners[column], frozen(tops[column, :2]), float(times[low[at]]),
                float(below[at, column]),
            )  # fmt: skip
    return deepest


@lru_cache(maxsize=32)
def _shanks(robot: Quadruped) -> _Shanks | None:
    """The shanks of a robot; ``None`` where a joint is no hinge."""
    chain = Chain.of(robot.model)
    if chain is None:
        return None
    return _Shanks(chain, {leg: tuple(_bars(robot, leg)) for leg in LEGS})


def _bars(robot: Quadruped, leg: str) -> list[_Bar]:
    """Balls within the shapes of a leg's shank; none where the shapes are not known."""
    pairs = CollisionPairs.of(robot)
    if pairs is None:
        return []
    knee = robot.model.getJointId(robot.legs[leg].joints[-1])
    bars = []
    for shape in pairs.geometry.geometryObjects:
        if shape.parentJoint != knee:
            continue
        shape.geometry.computeLocalAABB()
        box = shape.geometry.aabb_local
        half, middle = (np.asarray(a) / 2.0 for a in (box.max_ - box.min_, box.max_ + box.min_))
        if 2.0 * half.max() < LEAST_LENGTH * robot.legs[leg].lower:
            continue
        line = middle + ALONG * np.where(np.arange(3) == int(half.argmax()), half, 0.0)
        depths = np.minimum(half.min(), half.max() * (1.0 - np.abs(ALONG[:, 0])))
        # The middle line of a hull's box may leave the hull.
        depths = np.minimum(depths, _depths(shape.geometry, line))
        line, radii = line[depths > 0.0], depths[depths > 0.0]
        line = line @ shape.placement.rotation.T + shape.placement.translation
        bars.append(_Bar(int(knee), line, radii))
    return bars


def _depths(shape: Any, places: FloatArray) -> FloatArray:
    """How deep places ``(n, 3)`` are within one of coal's shapes ``(n,)`` [m]; negative outside.

    On the axis of a round one it may be the way to the side, where that to an end is shorter.
    """
    from pinocchio import coal

    ball, here, there = coal.Sphere(SMALL), coal.Transform3s(), coal.Transform3s()
    request, result = coal.DistanceRequest(), coal.DistanceResult()
    out = np.empty(len(places))
    for i, place in enumerate(places):
        there.setTranslation(place)
        result.clear()
        out[i] = -SMALL - coal.distance(shape, here, ball, there, request, result)
    return out
