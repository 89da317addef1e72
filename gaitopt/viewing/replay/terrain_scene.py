"""What a plan walks on, and what it means: columns, ground, swings, support polygons, COG."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from gaitopt.conventions import LEGS, FloatArray
from gaitopt.plan.plan import Plan
from gaitopt.terrain.footholds import Footholds
from gaitopt.viewing.colours import LEG_COLOURS
from gaitopt.viewing.replay.keyframes import kept_between, sample_times
from gaitopt.viewing.replay.scene import (
    Appearance,
    Box,
    Cylinder,
    FramePath,
    Node,
    Part,
    Scene,
    Segments,
    Tubes,
    pose,
)
from gaitopt.viewing.replay.solids import disc

COLUMN_HEIGHT = 0.08
"""How far the lowest column is drawn to stand out of the ground [m]; the plan does not say."""

SWING_TOLERANCE = 5e-4
"""Largest distance between a foot's path and the tube drawn along it [m]."""

FLOOR, LINES = "#f0f3f6", "#bcc5cf"
MARK_LIFT = np.array([0.0, 0.0, 8e-4])
"""How far marks are drawn above the ground, so that it does not hide them [m]. Chosen."""
ROUTE: FramePath = ("route",)


@dataclass(frozen=True, eq=False)
class Samples:
    """The plan at many instants: ``times (N,)`` [s], ``cog (N, 3)`` and ``feet (N, 4, 3)`` [m].

    ``ways`` keeps what :func:`swing_points` has found.
    """

    times: FloatArray
    cog: FloatArray
    feet: FloatArray
    ways: dict[tuple[str, float, float], FloatArray] = field(default_factory=dict)


def samples_of(plan: Plan) -> Samples:
    """The plan at all instants between which it is straight within the replay's tolerances."""
    bounds = [time for p in plan.phases for time in (p.start, p.end) if 0 < time < plan.duration]
    found = plan.at(np.union1d(sample_times(plan.path), bounds))
    return Samples(found.t, found.cog, found.feet)


def terrain_scene(footholds: Footholds, foot_radius: float) -> Scene:
    """Columns (or marks on open ground) in their legs' colours, and the ground with a grid.

    Args:
        footholds: where the feet stand.
        foot_radius: how far the ground lies below a foothold [m].
    """
    drop = np.array([0.0, 0.0, foot_radius])
    level = ground_level(footholds, foot_radius)
    nodes = [_ground(footholds, level)]
    mark = disc(0.02)
    for leg in LEGS:
        tops = footholds[leg] - drop
        if footholds.radius is None:
            appearance = Appearance(LEG_COLOURS[leg], 0.85, lit=False, casts_shadow=False, layer=1)
            parts = tuple(Part(mark, appearance, pose(p + MARK_LIFT)) for p in tops)
        else:
            parts = tuple(_column(p, footholds.radius, level, leg) for p in tops)
        nodes.append(Node((*ROUTE, f"footholds {leg}"), parts))
    return Scene(tuple(nodes))


def ground_level(footholds: Footholds, foot_radius: float) -> float:
    """Height at which the ground is drawn [m]."""
    lowest = float(footholds.array[:, :, 2].min()) - foot_radius
    columns = footholds.radius is not None and footholds.ground is None
    return lowest - (COLUMN_HEIGHT if columns else 0.0)


def swings_scene(plan: Plan, samples: Samples) -> Scene:
    """The way of every flying foot, in its leg's colour."""
    find_ways(samples, [(swing.leg, swing.start, swing.end) for swing in plan.swings])
    lines: dict[str, list[FloatArray]] = {leg: [] for leg in LEGS}
    for swing in plan.swings:
        points = swing_points(samples, swing.leg, swing.start, swing.end)
        if len(points) > 1:
            lines[swing.leg].append(points)
    appearances = {
        leg: Appearance(LEG_COLOURS[leg], 0.55, casts_shadow=False, layer=3) for leg in LEGS
    }
    nodes = [
        Node((*ROUTE, f"swings {leg}"), (Part(Tubes(tuple(found), 0.0022), appearances[leg]),))
        for leg, found in lines.items() if found
    ]  # fmt: skip
    return Scene(tuple(nodes))


def swing_points(samples: Samples, leg: str, start: float, end: float) -> FloatArray:
    """The foot's way between two times as a polyline ``(n, 3)`` [m]."""
    if (leg, start, end) not in samples.ways:
        find_ways(samples, [(leg, start, end)])
    return samples.ways[leg, start, end]


def find_ways(samples: Samples, swings: Sequence[tuple[str, float, float]]) -> None:
    """Find the ways of feet, by leg, start and end, all at once."""
    ways, lengths = [], []
    for leg, start, end in swings:
        first, last = np.searchsorted(samples.times, [start - 1e-9, end + 1e-9])
        points = samples.feet[first:last, LEGS.index(leg)]
        # Thinned along its length: what counts is the shape, not when the foot is where.
        apart = np.linalg.norm(np.diff(points, axis=0), axis=1)
        length = np.concatenate([[0.0], np.cumsum(apart)])
        ways.append(points if length[-1] else points[:1])
        lengths.append(length[: len(ways[-1])])
    ends = np.cumsum([len(points) for points in ways], dtype=int)
    if not len(ends) or not ends[-1]:
        samples.ways.update(zip(swings, ways, strict=True))
        return
    starts = np.concatenate([[0], ends[:-1]])
    some, every = starts < ends, np.concatenate(ways)
    kept = kept_between(
        np.concatenate(lengths), every, SWING_TOLERANCE, starts[some], ends[some] - 1
    )
    bounds = np.searchsorted(kept, ends[:-1])
    samples.ways.update(zip(swings, np.split(every[kept], bounds), strict=True))


def _column(top: FloatArray, radius: float, level: float, leg: str) -> Part:
    height = float(top[2]) - level
    middle = [float(top[0]), float(top[1]), level + height / 2.0]
    return Part(Cylinder(radius, height), Appearance(LEG_COLOURS[leg]), pose(middle))


def _ground(footholds: Footholds, level: float) -> Node:
    """A wide floor with lines every 0.1 m under the route."""
    places = footholds.array[:, :, :2].reshape(-1, 2)
    low, high = places.min(axis=0) - 0.4, places.max(axis=0) + 0.4
    size = float(np.max(high - low))
    step = 0.1 * 2.0 ** max(0.0, np.ceil(np.log2(size / 6.0)))
    low, high = np.floor(low / step) * step, np.ceil(high / step) * step
    middle = (low + high) / 2.0
    floor = Box((40.0 * size, 40.0 * size, 0.01))
    lines = [[[x, low[1]], [x, high[1]]] for x in np.arange(low[0], high[0] + step / 2, step)] + [
        [[low[0], y], [high[0], y]] for y in np.arange(low[1], high[1] + step / 2, step)
    ]
    flat = np.array(lines).reshape(-1, 2)
    grid = Segments(np.column_stack([flat, np.full(len(flat), level + 5e-4)]))
    return Node(
        (*ROUTE, "ground"),
        (
            Part(
                floor,
                Appearance(FLOOR, casts_shadow=False, layer=-2),
                pose([*middle, level - 0.005]),
            ),
            Part(grid, Appearance(LINES, lit=False, casts_shadow=False, layer=-1)),
        ),
    )
