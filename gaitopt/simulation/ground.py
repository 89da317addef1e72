"""The ground of a simulation: a plane with columns, or the height map of the footholds."""

from __future__ import annotations

from typing import Any

import numpy as np

from gaitopt.conventions import LEGS, FloatArray
from gaitopt.errors import InputError
from gaitopt.robots.leg_names import leg_named
from gaitopt.robots.quadruped import Quadruped
from gaitopt.simulation.height_field import add_height_field
from gaitopt.simulation.pillars import column_radii
from gaitopt.simulation.settings import SimulationSettings
from gaitopt.simulation.shapes import LEAST_BALL, ground_bits, surface
from gaitopt.terrain.footholds import Footholds

LEVEL = 1e-6
"""A foothold this little above the ground lies on the ground itself [m]."""

GROUND = "gaitopt ground"
"""Name of the plane, or of the height map."""


def add_ground(
    mujoco: Any, spec: Any, robot: Quadruped, footholds: Footholds, settings: SimulationSettings,
    own: bool,
) -> list[list[str]]:  # fmt: skip
    """Add the ground, and the columns where there is no height map.

    Args:
        mujoco, spec: the package, and the model that is made.
        robot: the robot.
        footholds: where it steps.
        settings: of the contacts.
        own: whether the shapes of the robot are those of its file.

    Returns:
        For each leg the names of the shapes under its footholds, as many as
        :attr:`Footholds.array` has.

    Raises:
        InputError: ``settings.column_errors`` names an unknown column, or there are no columns.
        FootholdsError: columns overlap, and a foot in its place would touch the higher one.
        GroundError: the height map is nowhere near the footholds.
    """
    bare = {**ground_bits(own), **surface(settings)}
    if footholds.ground is not None:
        if settings.column_errors:
            raise InputError(
                "column_errors: footholds on a height map have no columns; simulate footholds "
                "whose ground has other heights (footholds.with_(ground=...))"
            )
        add_height_field(mujoco, spec, GROUND, robot, footholds, bare)
        return [[GROUND] * len(footholds) for _ in LEGS]
    errors = _column_errors(footholds, settings)
    foot = robot.foot_radius or LEAST_BALL
    radii, tops = column_radii(footholds, foot), footholds.array - [0.0, 0.0, foot]
    level = float(tops[..., 2].min())
    if footholds.radius is not None:
        level -= settings.column_height
    world = spec.worldbody
    world.add_geom(name=GROUND, type=mujoco.mjtGeom.mjGEOM_PLANE, size=[0, 0, 1.0],
                   pos=[0, 0, level], **bare)  # fmt: skip
    of_column = {**bare, **ground_bits(own, plate=footholds.radius is None)}
    names = []
    for i, leg in enumerate(LEGS):
        names.append([GROUND] * len(footholds))
        for k, top in enumerate(tops[i]):
            height = float(top[2] + errors[i, k]) - level
            if k >= footholds.counts[leg]:
                names[-1][k] = names[-1][k - 1]
            elif height > LEVEL:
                names[-1][k] = f"gaitopt column {leg} {k}"
                world.add_geom(
                    name=names[-1][k], type=mujoco.mjtGeom.mjGEOM_CYLINDER,
                    size=[radii[i, k], height / 2.0, 0],
                    pos=[top[0], top[1], level + height / 2.0], **of_column,
                )  # fmt: skip
    return names


def _column_errors(footholds: Footholds, settings: SimulationSettings) -> FloatArray:
    """How much higher each column is than the plan knows ``(4, n)`` [m].

    Raises:
        InputError: there is no such column.
    """
    errors = np.zeros(footholds.array.shape[:2])
    for name, index, error in settings.column_errors:
        leg = leg_named(str(name))
        if leg is None or not 0 <= index < footholds.counts[leg] or not np.isfinite(error):
            raise InputError(
                f"column_errors: there is no foothold {index} of leg {name!r}, or no finite error"
            )
        errors[LEGS.index(leg), index] = error
    return errors
