"""What legs without a roll joint ask of footholds: each lies in the plane of its leg.

The body then moves forward and back along a straight line, without turning. In front of every swing
it goes to where the support triangle holds it, along this line alone
(:mod:`gaitopt.optimize.cog.formulation`).
"""

from __future__ import annotations

from typing import Final

import numpy as np

from gaitopt.conventions import LEGS, FloatArray, rotation_z
from gaitopt.errors import InputError
from gaitopt.robots.leg_planes import foot_planes
from gaitopt.robots.quadruped import Quadruped
from gaitopt.terrain.footholds import Footholds

BESIDE: Final = 1e-4
"""Footholds that lie beside the planes of their legs by no more than this are taken into them [m]:
the last digit of places that somebody has written down."""
TURNED: Final = 1e-9
"""Angles of postures that count as zero [rad], for rounding."""


def in_foot_planes(robot: Quadruped, footholds: Footholds, heading: float) -> Footholds:
    """The footholds, each in the plane of its leg; as they are where all legs have roll joints.

    Args:
        robot: the robot.
        footholds: in the world.
        heading: of the walk [rad].

    Raises:
        InputError: a foothold lies beside the plane of its leg, or a posture asks for roll or yaw,
            or planes of legs are not parallel to the way. Names the foothold and the way out.
    """
    planes = foot_planes(robot)
    if planes is None:
        return footholds
    left = rotation_z(heading)[:, 1]
    beside = {leg: footholds[leg] @ left - planes[i] for i, leg in enumerate(LEGS)}
    middle = float(np.median(np.concatenate(list(beside.values()))))
    _check_places(robot, footholds, {leg: b - middle for leg, b in beside.items()}, planes)
    _check_postures(robot, footholds, heading)
    points = {leg: footholds[leg] - (beside[leg] - middle)[:, None] * left for leg in LEGS}
    return footholds.with_(points=points)


def _check_places(
    robot: Quadruped, footholds: Footholds, off: dict[str, FloatArray], planes: FloatArray
) -> None:
    """Refuse footholds that lie ``off`` the planes of their legs, to the left, by leg ``(n,)``."""
    worst = max(off, key=lambda leg: float(np.abs(off[leg]).max()))
    step = int(np.abs(off[worst]).argmax())
    if abs(off[worst][step]) <= BESIDE:
        return
    where = ", ".join(
        f"{leg} {abs(place):.4g} m {'left' if place > 0 else 'right'}"
        for leg, place in zip(LEGS, planes.tolist(), strict=True)
    )
    raise InputError(
        f"{robot.name}: leg {worst} has no roll joint, and its foothold {step} at "
        f"{np.round(footholds[worst][step], 4).tolist()} lies {abs(off[worst][step]):.4g} m beside "
        f"the plane of the leg; this robot walks straight ahead, its feet beside the body's middle "
        f"by {where}: take s_columns(robot=robot), as gaitopt walk without --footholds does, or "
        "set heading"
    )


def _check_postures(robot: Quadruped, footholds: Footholds, heading: float) -> None:
    """Refuse postures in which the planes of the legs are not upright and straight ahead."""
    if footholds.postures is None:
        return
    _, roll, _, yaw = footholds.postures.T
    turned = np.maximum(np.abs(roll), np.abs(np.sin(yaw - heading)))
    worst = int(turned.argmax())
    if turned[worst] > TURNED:
        raise InputError(
            f"{robot.name}: posture {worst} rolls the body by {roll[worst]:.4g} rad and turns it "
            f"by {yaw[worst] - heading:.4g} rad against the way, and its legs have no roll joint; "
            "let postures of such a robot pitch only"
        )
