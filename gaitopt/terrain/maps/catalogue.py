"""The catalogue of made grounds, and the function that makes them."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

import numpy as np

from gaitopt.conventions import frozen
from gaitopt.errors import InputError
from gaitopt.inputs import check_kind, check_number, check_seed
from gaitopt.robots.quadruped import Quadruped
from gaitopt.terrain.height_map import HeightMap
from gaitopt.terrain.height_map_checks import MOST_POINTS
from gaitopt.terrain.maps.pits import BEAMS, GAPS
from gaitopt.terrain.maps.site import GroundKind, RobotSize, Site, Size
from gaitopt.terrain.maps.slopes import HILLS, RAMP, STAIRS, STAIRS_DOWN, STAIRS_UP
from gaitopt.terrain.maps.stones import RUBBLE, STEPPING_STONES

GROUNDS: Final[Mapping[str, GroundKind]] = MappingProxyType({
    "flat": GroundKind("level ground", lambda site, sizes: site.flat, ()),
    "rubble": RUBBLE,
    "stepping_stones": STEPPING_STONES,
    "stairs": STAIRS,
    "stairs_up": STAIRS_UP,
    "stairs_down": STAIRS_DOWN,
    "ramp": RAMP,
    "gaps": GAPS,
    "hills": HILLS,
    "beams": BEAMS,
})  # fmt: skip
"""What :func:`make_ground` can make, by name."""

RESOLUTION = 0.02
"""Distance of the points [m]: with it balls of usual feet touch few enough triangles for MuJoCo's
limit of 50 contacts."""
APRON_SHARE = 0.8
"""Flat ground before and behind the stance, as a share of the standing height. Chosen: trunk and
knees are above it."""
WIDTH = 1.5
"""Least width of a ground by default [m]."""
WIDTH_SHARE = 3.0
"""Width of a ground by default, as a share of the stance's width."""


def ground_names() -> tuple[str, ...]:
    """Names of the grounds that :func:`make_ground` can make."""
    return tuple(GROUNDS)


def make_ground(
    name: str,
    *,
    seed: int = 0,
    difficulty: float = 0.5,
    robot: Quadruped | None = None,
    length: float = 3.0,
    width: float | None = None,
    resolution: float = RESOLUTION,
    apron: float | None = None,
    **sizes: float,
) -> HeightMap:
    """Ground of a kind, by seed and difficulty, to a robot's size.

    A robot that starts at x = y = 0 has its goal at x = ``length``, y = 0. Around both, as far as
    ``apron`` before and behind, the ground is flat, and at the start its height is 0. The map ends
    with the aprons, and at y = ``-width / 2`` and ``width / 2``.

    Args:
        name: one of :func:`ground_names`: ``"flat"``, ``"rubble"``, ``"stepping_stones"``,
            ``"stairs"``, ``"stairs_up"``, ``"stairs_down"``, ``"ramp"``, ``"gaps"``, ``"hills"``
            or ``"beams"``.
        seed: of the random numbers; the same seed gives the same ground.
        difficulty: from 0, easy, to 1; sizes that are not given follow from it and the robot.
        robot: by default the ground fits wang2020.
        length: from start to goal [m].
        width: [m]; by default three times the width of the stance, at least 1.5 m.
        resolution: distance of the points of the grid [m].
        apron: [m]; by default half the length of the stance and 0.8 of the standing height.
        sizes: sizes of the ground by name, for instance ``height=0.15`` [m] for rubble;
            ``GROUNDS[name].sizes`` in :mod:`gaitopt.terrain.maps.catalogue` lists them, as does the
            page on terrain.

    Raises:
        InputError: the name is unknown, or a parameter is out of range.
    """
    if name not in GROUNDS:
        raise InputError(f"there is no ground named {name!r}; there are {', '.join(GROUNDS)}")
    if robot is not None:
        check_kind("robot", robot, Quadruped)
    size = RobotSize.of(robot)
    check_seed(seed)
    check_number("difficulty", difficulty, 0.0, 1.0)
    kind, given = GROUNDS[name], _sizes(name, sizes, difficulty, size)
    margin = size.stance_length / 2.0 + APRON_SHARE * size.standing_height
    margin = check_number("apron", margin if apron is None else apron, 0.0, 100.0, "m")
    across = max(WIDTH, WIDTH_SHARE * size.stance_width) if width is None else width
    site = _site(seed, size, margin, length, across, resolution)
    z = np.array(kind.build(site, given))
    after = site.x[:, 0] > site.end
    z[site.x[:, 0] < site.start] = 0.0
    z[after] = z[np.argmax(after) - 1] if kind.rises and after.any() else 0.0
    return HeightMap(z, resolution, (site.x[0, 0], site.y[0, 0]))


def _sizes(
    name: str, given: Mapping[str, float], difficulty: float, robot: RobotSize
) -> dict[str, float]:
    """Sizes of a ground by name: those that are given, and those that follow."""
    known: dict[str, Size] = {size.name: size for size in GROUNDS[name].sizes}
    unknown = [key for key in given if key not in known]
    if unknown:
        raise InputError(
            f"{name} has no size {', '.join(unknown)}"
            + (f"; it has {', '.join(known)}" if known else "; it has none")
        )
    return {
        key: size.value(difficulty, robot)
        if given.get(key) is None
        else check_number(key, given[key], size.low, size.high, size.unit)
        for key, size in known.items()
    }


def _site(
    seed: int, robot: RobotSize, apron: float, length: float, width: float, resolution: float
) -> Site:
    """The grid: the start and the middle of the width are points of it."""
    cell = check_number("resolution", resolution, 1e-3, 1.0, "m")
    length = check_number("length", length, 2.0 * apron + cell, 1e3, "m")
    width = check_number("width", width, 2.0 * cell, 1e3, "m")
    before, half = round(apron / cell), round(width / (2.0 * cell))
    count = before + round((length + apron) / cell) + 1
    if count * (2 * half + 1) > MOST_POINTS:
        raise InputError(
            f"a ground of {length:g} m by {width:g} m at {cell:g} m has more than "
            f"{MOST_POINTS:,} points; make it smaller, or its resolution coarser"
        )
    x = frozen(cell * (np.arange(count) - before))[:, None]
    y = frozen(cell * np.arange(-half, half + 1))[None]
    return Site(x, y, apron, length - apron, robot, np.random.default_rng(seed))
