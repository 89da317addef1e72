"""Whether a body can stand at the goal and at the start: asked before anything is searched.

What is asked of the last step, and of the first one, is asked here with less strict conditions, so
that nothing is refused that a search would find. Every leg needs a stand within the widest freedom
of its usual place. Whatever the pitch and roll of the body, all of its trunk is above known ground,
while its centre of mass is within the stability margin of the region that the stands span.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.ndimage import binary_dilation
from scipy.spatial import ConvexHull, QhullError

from gaitopt.conventions import BoolArray, FloatArray
from gaitopt.optimize.route.centre_of_mass import MassDistribution
from gaitopt.planners.over_terrain.beam.candidates import FREER
from gaitopt.planners.over_terrain.beam.ending import Ending
from gaitopt.planners.over_terrain.judge import Judge
from gaitopt.planners.over_terrain.pairs import Cause
from gaitopt.planners.over_terrain.search import Search
from gaitopt.planners.over_terrain.settings import TerrainSettings
from gaitopt.planners.over_terrain.setup import with_settings
from gaitopt.planners.over_terrain.ways.fineness import FINE
from gaitopt.robots.rotations import rpy_to_matrix

PITCHED = max(abs(attempt.pitch) for attempt in (*FINE.attempts, *FINE.rare))
"""Largest pitch beyond that of the plane through the feet that a search tries [rad]."""
TILT, MOST_TILTS = 0.02, 16
"""Distance of the pitches and rolls that are looked at [rad], and most of either."""
MOST_PLACES = 20_000
"""Most places of the body that are looked at; where there are more nothing is refused."""


class Region(NamedTuple):
    """Where a search may put the body in a step.

    Attributes:
        corners: places of all stands that feet may have ``(n, 2)`` [m].
        steepest: largest slope of the plane through the feet, as a tangent.
        yaw: of the body [rad].
    """

    corners: FloatArray
    steepest: float
    yaw: float


def no_room_at_ends(
    search: Search, ways: Sequence[TerrainSettings], aside: float = 0.0
) -> tuple[Ending, dict[Cause, int]] | None:
    """At which end the body cannot stand in any way of walking, and what is in the way.

    Args:
        search: with the usual settings.
        ways: settings of the ways of walking.
        aside: how far beside the course others may lead between the same ends [m].

    Returns:
        The end, and in how many ways of walking each cause is in the way; ``None`` where both ends
        may have room.
    """
    for ending, last in ((Ending.NO_GOAL, True), (Ending.NO_START, False)):
        causes: dict[Cause, int] = {}
        for settings in ways:
            cause = _cause(with_settings(search, settings), last, aside)
            if cause is None:
                break
            causes[cause] = causes.get(cause, 0) + 1
        else:
            return ending, causes
    return None


def _cause(search: Search, last: bool, aside: float) -> Cause | None:
    """What is in the way of the last or first step of a search; ``None`` where nothing may be."""
    region = _region(search, last, aside)
    if region is None:
        return Cause.GROUND
    return None if _some_room(search.judge, region) else Cause.TRUNK


def _region(search: Search, last: bool, aside: float) -> Region | None:
    """Where the body may be in the last or first step; ``None`` where a leg has no stand."""
    cycles, candidates = search.cycles, search.candidates
    now = [candidates.near(search.usual(leg, cycles if last else 0)) for leg in range(4)]
    if not all(near.size for near in now):
        return None
    # The body lies as the plane through the feet before and after the step.
    widest = max(FREER) * search.judge.settings.freedom + aside
    places = [search.usual(leg, cycles - 1 if last else 1) for leg in range(4)]
    other = [search.stands.near(search.layers.ground, place, widest) for place in places]
    centres = search.stands.centres
    heights = centres[np.concatenate(now + other), 2]
    settings = search.judge.settings
    # A support triangle with the margin is wider than twice the margin in every direction.
    least = np.sqrt(2.0) * max(settings.stability_margin, 1e-9)
    steepest = settings.follow * float(np.ptp(heights)) / least
    share = 1.0 if last else 1.0 / (4 * cycles)
    yaw = float(search.course.at(share * search.course.length)[2])
    return Region(centres[np.concatenate(now), :2], steepest, yaw)


def _some_room(judge: Judge, region: Region) -> bool:
    """Whether all of the trunk is above known ground in some pose that may be asked for.

    Places and angles are on grids; what lies between them is allowed for, so that no pose is
    missed.
    """
    try:
        sides = ConvexHull(region.corners).equations
    except QhullError:
        return True
    surfaces, robot = judge.surfaces, judge.robot
    trunk = judge.limbs.spheres.trunk.centres - robot.centre
    low, high, spread = _com_box(judge.places.masses)
    cell = surfaces.cell
    aside = spread + cell
    ends = zip(region.corners.min(axis=0), region.corners.max(axis=0), strict=True)
    axes = [np.arange(a - aside, b + aside + cell, cell) for a, b in ends]
    if len(axes[0]) * len(axes[1]) > MOST_PLACES:
        return True
    places = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
    tilt = float(np.arctan(region.steepest))
    pitches, rolls = _angles(tilt + PITCHED), _angles(tilt)
    between = sum(float(np.diff(a).max(initial=0.0)) / 2.0 for a in (pitches, rolls))
    moved = between * np.linalg.norm(trunk, axis=1).max() + cell / np.sqrt(2.0)
    tables = _known_near(judge, int(np.ceil(moved / cell)) + 1)
    slack = between * spread + cell / np.sqrt(2.0) - judge.settings.stability_margin
    values = places @ sides[:, :2].T + sides[:, 2]
    for pitch in sorted(pitches, key=abs):
        for roll in sorted(rolls, key=abs):
            turn = rpy_to_matrix(np.array([roll, pitch, region.yaw]))
            # The centre of mass from the body's, along the normals of the sides; 0 is for legs that
            # do not reach.
            along = sides[:, :2] @ turn[:2]
            least = along @ ((low + high) / 2.0) - np.abs(along) @ ((high - low) / 2.0)
            asked = places[(values + np.minimum(least, 0.0) <= slack).all(axis=1)]
            for ball, size in zip((trunk @ turn.T)[:, :2], judge.limbs.trunk_sizes, strict=True):
                asked = asked[_at(judge, tables, asked + ball, int(size))]
            if len(asked):
                return True
    return False


def _angles(most: float) -> FloatArray:
    """Angles from ``-most`` to ``most``, with 0 among them."""
    half = min(int(np.ceil(most / TILT)), MOST_TILTS // 2)
    return np.linspace(-most, most, 2 * half + 1)


def _com_box(masses: MassDistribution) -> tuple[FloatArray, FloatArray, float]:
    """Bounds of the centre of mass from the body's, body frame ``(3,)``, and its largest distance.

    They hold for all angles of the joints.
    """
    middle, half = masses.body.copy(), np.zeros(3)
    for leg in range(4):
        one, two, three = masses.parts[:, leg]
        turned = np.hypot(two[0], two[2]) + np.hypot(three[0], three[2])
        aside = np.hypot(one[1] + two[1] + three[1], abs(one[2]) + turned)
        middle += masses.axes[leg] @ np.array([one[0], 0.0, 0.0])
        half += np.abs(masses.axes[leg]) @ np.array([turned, aside, aside])
    low, high = middle - half, middle + half
    return low, high, float(np.linalg.norm(np.maximum(np.abs(low), np.abs(high))))


def _known_near(judge: Judge, cells: int) -> BoolArray:
    """Where the tables of the ground are known within some cells ``(C, nx + 2, ny + 2)``."""
    square = np.ones((1, 2 * cells + 1, 2 * cells + 1), dtype=np.bool_)
    known = np.isfinite(judge.surfaces.tables)
    return np.asarray(binary_dilation(known, structure=square), dtype=np.bool_)


def _at(judge: Judge, known: BoolArray, places: FloatArray, size: int) -> BoolArray:
    """Values of a table at places ``(n, 2)`` [m]: ``(n,)``."""
    surfaces = judge.surfaces
    at = np.floor((places - surfaces.ground.origin) / surfaces.cell + 1.5).astype(np.intp)
    i, j = np.clip(at, 0, np.subtract(known.shape[1:], 1)).T
    return np.asarray(known[size, i, j])
