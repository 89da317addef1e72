"""The test terrain of [Wang2020], Fig. 3: columns scattered along an S."""

from __future__ import annotations

import numpy as np

from gaitopt.conventions import LEGS, FloatArray
from gaitopt.errors import InputError
from gaitopt.inputs import as_text, check_count, check_kind, check_seed, is_real
from gaitopt.robots.leg_planes import foot_planes
from gaitopt.robots.quadruped import Quadruped
from gaitopt.terrain.footholds import Footholds

PAPER_STEP = 1.5 / 16
"""Mean step of the paper's walk: 1.5 m in 16 cycles [m]."""

PAPER_REACH = 0.57
"""Length of the paper's straight leg [m] ([Wang2020], Table I)."""

_CORNERS = {"LF": (1, 1), "LH": (-1, 1), "RH": (-1, -1), "RF": (1, -1)}
_TRIES = 1000
"""How often columns that overlap are drawn again. The paper's terrain needs a few draws; where
there is too little space for all columns, some overlap in the end."""


ROLLS = 0.6
"""Least diameter of columns as a share of the radius of the feet on them. Balls roll as their legs
turn. Locked wheels with radii of 71 to 127 mm roll by up to 0.2 of that to either side, on columns
with diameters of 0.26 to 0.42 of it to scale. Chosen: they then roll by two thirds of the column's
radius."""

LONGEST = 1e6
"""Largest length that is believed [m]: more is a mistake in the unit."""


def s_columns(
    seed: int = 0,
    *,
    robot: Quadruped | None = None,
    columns: int = 17,
    forward: float | None = None,
    amplitude: float | None = None,
    wavelength: float | None = None,
    jitter: float | None = None,
    height_jitter: float = 0.0,
    body_length: float | None = None,
    body_width: float | None = None,
    diameter: float | None = None,
) -> Footholds:
    """Random columns along an S-shaped route, one row for each leg.

    A nominal stance, each foot below its hip, moves along ``y = amplitude sin(2 pi x /
    wavelength)`` in equal steps; every column is then moved at random within a square. Columns that
    overlap are drawn again. The first column of each leg is where its foot stands at the start, so
    there are ``4 (columns - 1)`` steps.

    Args:
        seed: of the random numbers; the same seed gives the same terrain.
        robot: the terrain fits its size: lengths that are not given are in proportion to its legs,
            and feet start below its hips. For legs without roll joint the S is a straight line, and
            columns are moved along it only. By default it fits wang2020.
        columns: columns a leg.
        forward: distance walked along x [m]; by default the paper's step of 1.5 m / 16, to scale,
            for each column after the first.
        amplitude: sideways swing of the S [m]; 0.10 to scale by default.
        wavelength: length of one S along x [m]; 1.5 to scale by default.
        jitter: half the side of the square in which each column is placed [m]; 0.02 to scale by
            default.
        height_jitter: columns' tops differ by up to this much up or down [m]; the paper's are
            level.
        body_length, body_width: distances between the nominal feet [m]; 0.40 and 0.30 by default.
        diameter: of the columns [m]; by default 0.04 to scale, or :data:`ROLLS` times the radius of
            the robot's feet, where these are so large.

    Raises:
        InputError: a parameter is out of its range; the message names it.

    Source: [Wang2020], Section II.B and Fig. 3, which gives the 17 x 4 columns, the
    S, the 1.5 m and the diameter; amplitude and offsets are not published and are chosen here.
    """
    given = {
        "amplitude": amplitude, "wavelength": wavelength, "jitter": jitter,
        "body_length": body_length, "body_width": body_width, "diameter": diameter,
    }  # fmt: skip
    if robot is not None:
        check_kind("robot", robot, Quadruped)
    scale, fitted = _lengths(robot)
    lengths = {name: fitted[name] if value is None else value for name, value in given.items()}
    check_count("columns", columns, 1, 100_000)
    end = PAPER_STEP * scale * (columns - 1) if forward is None else forward
    _check(seed, forward=PAPER_STEP if forward is None else forward, height_jitter=height_jitter,
           **lengths)  # fmt: skip
    rng = np.random.default_rng(seed)
    x = np.linspace(0.0, end, columns)
    sideways = lengths["amplitude"] * np.sin(2.0 * np.pi * x / lengths["wavelength"])
    route = np.column_stack([x, sideways])
    half = np.array([lengths["body_length"], lengths["body_width"]]) / 2.0
    nominal = np.stack([route + half * np.array(_CORNERS[leg]) for leg in LEGS])
    square = np.full(2, lengths["jitter"])
    planes = None if robot is None else foot_planes(robot)
    if planes is not None:
        square[1] = 0.0
        if body_width is None:
            nominal[..., 1] = route[:, 1] + planes[:, None]
    placed = _scatter(rng, nominal.reshape(-1, 2), square, lengths["diameter"])
    tops = rng.uniform(-height_jitter, height_jitter, len(placed))
    points = np.column_stack([placed, tops]).reshape(len(LEGS), columns, 3)
    return Footholds(dict(zip(LEGS, points, strict=True)), radius=lengths["diameter"] / 2.0)


def _lengths(robot: Quadruped | None) -> tuple[float, dict[str, float]]:
    """Size of a robot's legs in proportion to wang2020's, and the terrain's lengths for it [m].

    The lengths for wang2020 are those of [Wang2020], or chosen (see :func:`s_columns`).
    """
    scale, (length, width), ball = 1.0, (0.40, 0.30), 0.0
    if robot is not None:
        ball = robot.foot_radius
        reach = float(np.mean([leg.reach for leg in robot.legs.values()]))
        scale, (length, width) = round(reach / PAPER_REACH, 6), robot.stance_size
    straight = robot is not None and not all(leg.has_roll for leg in robot.legs.values())
    return scale, {
        "amplitude": 0.0 if straight else 0.10 * scale, "wavelength": 1.5 * scale,
        "jitter": 0.02 * scale, "body_length": length, "body_width": width,
        "diameter": max(0.04 * scale, ROLLS * ball),
    }  # fmt: skip


def _scatter(
    rng: np.random.Generator, spots: FloatArray, jitter: FloatArray, diameter: float
) -> FloatArray:
    """A random place near each of ``spots (n, 2)`` [m], ``diameter`` apart where that is possible.

    ``jitter (2,)`` is half the sides of the rectangle around a spot [m].

    Both columns of a pair that overlaps are drawn again, because the second alone may have no place
    that is free.
    """
    places = spots + rng.uniform(-jitter, jitter, spots.shape)
    for _ in range(_TRIES):
        crowded = _nearer_than(places, diameter)
        if not crowded.size:
            break
        places[crowded] = spots[crowded] + rng.uniform(-jitter, jitter, (crowded.size, 2))
    return places


def _nearer_than(places: FloatArray, distance: float) -> np.ndarray:
    """Numbers of ``places (n, 2)`` that another one is nearer to than a distance [m]."""
    order = np.argsort(places[:, 0], kind="stable")
    ahead, crowded = places[order], np.zeros(len(places), dtype=np.bool_)
    for k in range(1, len(places)):
        along = ahead[k:, 0] - ahead[:-k, 0]
        if not (along < distance).any():
            break
        near = along**2 + (ahead[k:, 1] - ahead[:-k, 1]) ** 2 < distance**2
        crowded[order[k:][near]] = crowded[order[:-k][near]] = True
    return np.flatnonzero(crowded)


def _check(seed: int, **lengths: float) -> None:
    """Refuse a seed that is no whole number, and lengths that are negative or not finite.

    Raises:
        InputError: names what is wrong.
    """
    check_seed(seed)
    for name, value in lengths.items():
        lowest = 0.0 if name in ("amplitude", "jitter", "height_jitter") else 1e-6
        if not (is_real(value) and lowest <= value <= LONGEST):
            raise InputError(
                f"{name} must be a finite length from {lowest:g} to {LONGEST:g} m, got "
                f"{as_text(value)}"
            )
