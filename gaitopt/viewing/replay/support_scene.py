"""The support polygon of every phase, its inside less the margin, and the COG's projection."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gaitopt.conventions import LEGS, FloatArray
from gaitopt.errors import InputError
from gaitopt.plan.phase import Phase
from gaitopt.plan.plan import Plan
from gaitopt.stability.support import shrunken_polygon, support_half_planes
from gaitopt.terrain.height_map import HeightMap
from gaitopt.viewing.colours import LEG_COLOURS
from gaitopt.viewing.replay.keyframes import POSITION_TOLERANCE, kept_samples
from gaitopt.viewing.replay.scene import (
    Appearance,
    Ball,
    Draped,
    FramePath,
    Heights,
    Node,
    Part,
    Polygon,
    Scene,
    Shape,
    Track,
    Tubes,
    pose,
    shown_during,
)
from gaitopt.viewing.replay.solids import border_strips, disc, strips_along
from gaitopt.viewing.replay.terrain_scene import Samples, swing_points

SUPPORT: FramePath = ("support",)
GROUND_LIFT = 1.5e-3
"""Height of marks above the ground, so that they are seen [m]."""
INK, INSIDE, DOT = "#3a4350", "#18a999", "#d7263d"
BALL = 0.011
"""Radius of the ball that marks the COG's projection on a height map [m]."""
INSIDE_ROUNDING = 1e-9
"""Rounding of places inside of a polygon [m]."""
MAP_TOLERANCE = 1e-3
"""Largest distance of that ball from the ground below the COG [m]."""


@dataclass(frozen=True, eq=False)
class Stance:
    """A phase that lasts, with the places ``(m, 3)`` of the feet that stand during it [m].

    ``plane`` holds ``z = c0 + c1 x + c2 y`` fitted to them.
    """

    phase: Phase
    feet: FloatArray
    plane: FloatArray

    def on_plane(self, flat: FloatArray, lift: float) -> FloatArray:
        """Points ``(n, 2)`` put ``lift`` [m] above the plane ``(n, 3)``."""
        return np.column_stack([flat, self.plane[0] + flat @ self.plane[1:] + lift])


def support_scene(
    plan: Plan, samples: Samples, root: FramePath = SUPPORT, *, heights: Heights | None = None
) -> Scene:
    """For each phase that lasts: the support polygon, its inside, and the swing that is flown.

    The inside is the support polygon less ``plan.settings.stability_margin``. Two feet have a line
    instead; phases with fewer, or with feet in one line, have nothing. Phase ``i`` of the
    plan has the frame ``(*root, str(i))``. All lie in the plane of the feet, or upon a height map
    where one is drawn (``heights``).
    """
    stances = standing_places(plan)
    # From the foot frames down to the ground they stand on, and up a little to be seen.
    lift = GROUND_LIFT - plan.robot.foot_radius
    margin = float(plan.settings.stability_margin)
    nodes, tracks = [Node(root)], []
    for index, stance in stances.items():
        phase, path = stance.phase, (*root, str(index))
        nodes.append(
            Node(path, (*_polygons(stance, margin, lift, heights), *_flown(phase, samples)))
        )
        tracks.append(shown_during(path, phase.start, phase.end, plan.duration))
    ground = plan.footholds.ground if heights is not None else None
    times, places = _projections(list(stances.values()), samples, ground, lift)
    if heights is None:
        marks, track = _projection(root, times, places, lift)
    else:
        marks, track = _projection_on(root, times, places, heights)
    return Scene((*nodes, *marks), (*tracks, track), plan.duration)


def standing_places(plan: Plan) -> dict[int, Stance]:
    """Of all phases that last, by their number in the plan: what stands, and where."""
    lasting = {i: phase for i, phase in enumerate(plan.phases) if phase.duration > 0}
    if not lasting:
        return {}
    middles = [min(p.start + p.duration / 2.0, plan.duration) for p in lasting.values()]
    every = plan.at(middles).feet
    standing = [
        feet[[LEGS.index(leg) for leg in phase.support]]
        for phase, feet in zip(lasting.values(), every, strict=True)
    ]
    planes = np.empty((len(standing), 3))
    for count in {len(feet) for feet in standing}:
        some = [k for k, feet in enumerate(standing) if len(feet) == count]
        planes[some] = _planes(np.array([standing[k] for k in some]))
    return {
        index: Stance(phase, feet, plane)
        for (index, phase), feet, plane in zip(lasting.items(), standing, planes, strict=True)
    }


def _planes(feet: FloatArray) -> FloatArray:
    """Coefficients ``(n, 3)`` of the least-squares planes through ``feet (n, m, 3)``.

    They are level below three feet, and of the least slope through feet in one line.
    """
    if feet.shape[1] < 3:
        height = feet[..., 2].mean(axis=1) if feet.shape[1] else 0.0
        return np.stack(np.broadcast_arrays(height, np.zeros(len(feet)), 0.0), axis=1)
    tables = np.concatenate([np.ones((*feet.shape[:2], 1)), feet[..., :2]], axis=2)
    return np.asarray((np.linalg.pinv(tables) @ feet[..., 2:])[..., 0])


def filled(stance: Stance, flat: FloatArray, lift: float, heights: Heights | None) -> Shape:
    """A convex polygon ``(n, 2)`` [m] in the plane of the feet, or upon a height map."""
    if heights is None:
        return Polygon(stance.on_plane(flat, lift))
    return Draped(heights, (flat,))


def outlined(
    stance: Stance, flat: FloatArray, width: float, lift: float, heights: Heights | None
) -> Shape:
    """The border of such a polygon, of a ``width`` [m]."""
    if heights is None:
        return Polygon(stance.on_plane(flat, lift), width)
    return Draped(heights, border_strips(flat, width))


def _polygons(stance: Stance, margin: float, lift: float, heights: Heights | None) -> list[Part]:
    if len(stance.feet) == 2:
        line = stance.on_plane(stance.feet[:, :2], lift)
        strips = strips_along(line[:, :2], 0.006)
        shape = Tubes((line,), 0.003) if heights is None else Draped(heights, strips)
        return [Part(shape, _flat(INK, 0.9, 6))]
    try:
        outer, inner = _outlines(stance.feet, margin)
    except InputError:
        return []
    # Triangles say more than polygons of four feet, during which the body only shifts.
    swing = stance.phase.kind == "swing"
    parts = []
    if len(outer) > 2:
        parts += [
            Part(filled(stance, outer, lift, heights), _flat("#ffffff", 0.5 if swing else 0.3, 4)),
            Part(outlined(stance, outer, 0.004, lift, heights),
                 _flat(INK, 0.9 if swing else 0.5, 6)),
        ]  # fmt: skip
    if len(inner) > 2:
        lift += 6e-4
        parts += [
            Part(filled(stance, inner, lift, heights), _flat(INSIDE, 0.45 if swing else 0.2, 5)),
            Part(outlined(stance, inner, 0.0025, lift, heights),
                 _flat(INSIDE, 0.95 if swing else 0.6, 7)),
        ]  # fmt: skip
    return parts


def _outlines(feet: FloatArray, margin: float) -> tuple[FloatArray, FloatArray]:
    """The support polygon ``(k, 2)``, and the same shrunk by the margin ``(m, 2)`` [m].

    Both are :func:`shrunken_polygon`'s, in a tenth of the time where all sides remain.

    Raises:
        InputError: the feet stand in one line.
    """
    planes = support_half_planes(feet)
    following = dict(planes.edges)
    ring = [planes.edges[0][0]]
    while len(ring) < len(planes.edges):
        ring.append(following.get(ring[-1], ring[-1]))
    if len(set(ring)) < len(ring) or following.get(ring[-1]) != ring[0]:
        return shrunken_polygon(feet, 0.0), shrunken_polygon(feet, margin)
    sides = [planes.edges.index((i, following[i])) for i in ring]
    normals, offsets = planes.normals[sides], planes.offsets[sides] + margin
    pairs = np.stack([np.roll(normals, 1, axis=0), normals], axis=1)
    targets = np.stack([np.roll(offsets, 1), offsets], axis=1)
    inner = np.linalg.solve(pairs, targets[..., None])[..., 0]
    if (normals @ inner.T < offsets[:, None] - INSIDE_ROUNDING).any():
        inner = shrunken_polygon(feet, margin)
    return feet[ring, :2], np.asarray(inner, dtype=np.float64)


def _flown(phase: Phase, samples: Samples) -> list[Part]:
    ways = {leg: swing_points(samples, leg, phase.start, phase.end) for leg in phase.flying}
    return [
        Part(Tubes((points,), 0.0045), Appearance(LEG_COLOURS[leg], casts_shadow=False))
        for leg, points in ways.items() if len(points) > 1
    ]  # fmt: skip


def _projections(
    stances: list[Stance], samples: Samples, ground: HeightMap | None, lift: float
) -> tuple[FloatArray, FloatArray]:
    """Times ``(n,)`` and places ``(n, 3)`` of the COG's vertical projection.

    It lies in the plane of the standing feet, or upon the ground where there is a map. The plane
    may change at once when the feet change, so each phase has its own places.
    """
    pieces = [_projected(stance, samples) for stance in stances]
    if ground is not None:
        pieces = [_upon(ground, t, p, lift) for t, p in pieces]
    times = np.concatenate([t for t, _ in pieces]) if pieces else samples.times[:1]
    places = np.concatenate([p for _, p in pieces]) if pieces else samples.cog[:1]
    return times, places


def _upon(
    ground: HeightMap, times: FloatArray, places: FloatArray, lift: float
) -> tuple[FloatArray, FloatArray]:
    """Places ``(n, 3)`` put upon a map, and enough between them that heights follow it.

    Where the ground is unknown, it is taken to be in the plane of the feet.
    """
    apart = np.linalg.norm(np.diff(places[:, :2], axis=0), axis=1)
    count = np.maximum(np.ceil(2.0 * apart / ground.resolution).astype(int), 1)
    first = np.repeat(np.cumsum(count) - count, count)
    part = (np.arange(len(first)) - first) / np.repeat(count, count)
    index = np.append(np.repeat(np.arange(len(count)), count) + part, len(places) - 1)
    numbers = np.arange(len(places))
    out = np.column_stack([np.interp(index, numbers, column) for column in places.T])
    z = ground.height(out[:, :2])
    out[:, 2] = np.where(np.isfinite(z), z, out[:, 2] + lift)
    return np.interp(index, numbers, times), out


def _projection(
    root: FramePath, times: FloatArray, places: FloatArray, lift: float
) -> tuple[tuple[Node, ...], Track]:
    """The COG's projection in the plane of the standing feet: its way, and where it is."""
    keys = kept_samples(times, places, POSITION_TOLERANCE)
    dot = Node(
        (*root, "cog"),
        (
            Part(disc(0.015), _flat("#ffffff", 0.95, 8), pose([0, 0, lift + 2.5e-3])),
            Part(disc(0.0105), _flat(DOT, 0.99, 9), pose([0, 0, lift + 3e-3])),
        ),
    )
    return (_trail((*root, "trail"), places[keys], lift), dot), Track(
        dot.path, "position", times[keys], places[keys]
    )


def _projection_on(
    root: FramePath, times: FloatArray, places: FloatArray, heights: Heights
) -> tuple[tuple[Node, ...], Track]:
    """The COG's projection upon a height map: its way, and where it is."""
    flat = places[kept_samples(times, places[:, :2], MAP_TOLERANCE), :2]
    way = Part(Draped(heights, strips_along(flat, 0.005)), _flat(INK, 0.99, 7))
    dot = Node((*root, "cog"), (Part(Ball(BALL), Appearance(DOT, casts_shadow=False)),))
    keys = kept_samples(times, places, MAP_TOLERANCE)
    return (Node((*root, "trail"), (way,)), dot), Track(
        dot.path, "position", times[keys], places[keys]
    )


def _trail(path: FramePath, places: FloatArray, lift: float) -> Node:
    apart = np.linalg.norm(np.diff(places, axis=0), axis=1) > 1e-6
    points = places[np.concatenate([[True], apart])]
    if len(points) < 2:
        return Node(path)
    points = points + np.array([0.0, 0.0, lift])
    return Node(path, (Part(Tubes((points,), 0.0024), _flat(INK, 0.99, 7)),))


def _projected(stance: Stance, samples: Samples) -> tuple[FloatArray, FloatArray]:
    """Times and places ``(n, 3)`` of the projected COG during a phase, its ends included."""
    start, end = stance.phase.start, stance.phase.end
    first = int(np.searchsorted(samples.times, start, side="right"))
    last = int(np.searchsorted(samples.times, end, side="left"))
    times = np.concatenate([[start], samples.times[first:last], [end]])
    # Only with the neighbours of the phase: with all samples the time would grow with the square of
    # the number of steps.
    near = slice(max(first - 1, 0), last + 1)
    flat = np.column_stack([
        np.interp(times, samples.times[near], samples.cog[near, i]) for i in range(2)
    ])  # fmt: skip
    return times, stance.on_plane(flat, 0.0)


def _flat(colour: str, opacity: float, layer: int) -> Appearance:
    return Appearance(colour, opacity, lit=False, casts_shadow=False, layer=layer)
