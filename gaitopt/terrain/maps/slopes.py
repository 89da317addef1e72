"""Stairs, ramps and hills."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.errors import InputError
from gaitopt.terrain.maps.site import GroundKind, Site, Size

RISER = Size("riser", "height of a step", 0.1, 0.42, high=10.0)
TREAD = Size("tread", "length of a step", 0.28, 0.28, "", low=0.01)
WAVES = 12
"""Number of waves that hills are the sum of. Chosen: no direction stands out."""
ROUNDING = 1e-9
"""A step begins at a point of the grid also where rounding puts it this much before [m]."""


def stairs_up(site: Site, sizes: Mapping[str, float]) -> FloatArray:
    """A flight of stairs that goes up, all steps alike."""
    room = site.end - site.start
    count = max(int(room / sizes["tread"]), 1)
    first = site.start + _share(site) * max(room - count * sizes["tread"], 0.0)
    return _steps(site, sizes, site.x - first, count)


def stairs_down(site: Site, sizes: Mapping[str, float]) -> FloatArray:
    """A flight of stairs that goes down."""
    return -stairs_up(site, sizes)


def stairs(site: Site, sizes: Mapping[str, float]) -> FloatArray:
    """Stairs up to a landing as long as the stance, and down again."""
    room = (site.end - site.start - _landing(site)) / 2.0
    count = max(int(room / sizes["tread"]), 1)
    return _steps(site, sizes, _to_nearer_end(site, room - count * sizes["tread"]), count)


def ramp(site: Site, sizes: Mapping[str, float]) -> FloatArray:
    """A ramp up to a landing as long as the stance, and one down again.

    Raises:
        InputError: there is no room for a ramp beside the landing.
    """
    room = (site.end - site.start - _landing(site)) / 2.0
    if room <= 0.0:
        least = 2.0 * site.start + site.robot.stance_length
        raise InputError(
            f"a ramp has no room: length must be more than {least:.2f} m, for the ground about "
            f"start and goal is flat, and the landing is {site.robot.stance_length:.2f} m long"
        )
    run = (0.7 + 0.3 * _share(site)) * room
    along = np.clip(_to_nearer_end(site, room - run), 0.0, run)
    return np.asarray(np.tan(sizes["angle"]) * along + site.flat)


def hills(site: Site, sizes: Mapping[str, float]) -> FloatArray:
    """A sum of waves in all directions, which fades out towards start and end."""
    rng, turn = site.rng, 2.0 * np.pi
    z = site.flat
    for direction in turn * (np.arange(WAVES) + rng.uniform(size=WAVES)) / WAVES:
        number = turn / (sizes["wavelength"] * rng.uniform(0.7, 1.4))
        along = np.cos(direction) * site.x + np.sin(direction) * site.y
        z += np.sin(number * along + rng.uniform(0.0, turn)) / number
    fade = np.clip(_to_nearer_end(site, 0.0) / (sizes["wavelength"] / 2.0), 0.0, 1.0)
    z = (z - z.mean()) * fade**2 * (3.0 - 2.0 * fade)
    return np.asarray(z * (sizes["height"] / max(float(np.ptp(z)), 1e-12)))


def _steps(site: Site, sizes: Mapping[str, float], along: FloatArray, count: int) -> FloatArray:
    """Heights of ``count`` steps, the first of which begins where ``along`` is 0."""
    steps = np.clip(np.floor((along + ROUNDING) / sizes["tread"]) + 1.0, 0.0, count)
    return np.asarray(sizes["riser"] * steps + site.flat)


def _to_nearer_end(site: Site, spare: float) -> FloatArray:
    """How far each point is from the nearer end of the site [m]; a share of ``spare`` less."""
    inset = _share(site) * max(spare, 0.0)
    return np.minimum(site.x - (site.start + inset), site.end - inset - site.x)


def _landing(site: Site) -> float:
    """Length of a landing: that of the stance, so that the robot stands level on it once [m]."""
    return min(site.robot.stance_length, site.end - site.start)


def _share(site: Site) -> float:
    return float(site.rng.uniform())


STAIRS_UP = GroundKind("stairs that go up", stairs_up, (RISER, TREAD), rises=True)
STAIRS_DOWN = GroundKind("stairs that go down", stairs_down, (RISER, TREAD), rises=True)
STAIRS = GroundKind("stairs up to a landing, and down again", stairs, (RISER, TREAD))
"""At difficulty 1 risers are 11 cm for go2, 17 cm for wang2020, 18 cm for anymal_c. Treads are
28 cm whatever the robot: those of houses are 25 to 30 cm."""
RAMP = GroundKind(
    "a ramp up to a landing, and one down again",
    ramp,
    (Size("angle", "of the ramp", 0.0, np.radians(25.0), "", "rad", high=1.2),),
)
HILLS = GroundKind(
    "smooth hills",
    hills,
    (
        Size("height", "from the lowest to the highest place", 0.0, 1.0),
        Size("wavelength", "usual distance from hill to hill", 2.5, 2.5, "stance_length", low=0.01),
    ),
)
"""At difficulty 1 slopes are up to 25 to 35 degrees."""
