"""Robots whose base does not have its z axis up.

Programs that draw machines often have y up. The hips of the four legs tell the plane of the body,
and the feet are below it.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.errors import RobotError
from gaitopt.robots.files.limbs import Limb
from gaitopt.robots.files.tree import UrdfTree

LEANING = 0.5
"""Cosine of the angle between the base's z axis and the normal of the hips' plane from which on the
base has z up. Chosen: hips of standing robots lie within 0.2 rad of the horizontal."""
FLATNESS = 0.3
"""Largest distance of hips from their plane, as a share of their second spread. Chosen."""
BELOW = 0.3
"""Least distance of the feet from the plane of the hips, as a share of their distance from the
hips, with which they tell what is below. Chosen."""


def stand_upright(tree: UrdfTree, limbs: Iterable[Limb], done: list[str]) -> None:
    """Give a robot whose base lies on its side a new one, whose z axis points up.

    Args:
        tree: the robot, in its first posture.
        limbs: its four legs.
        done: what was done to the file, in sentences.

    Raises:
        RobotError: the base is turned, and the legs do not tell what is below.
    """
    poses = tree.poses()
    limbs = list(limbs)
    hips = np.array([poses[limb.joints[0].child][:3, 3] for limb in limbs])
    _, spread, axes = np.linalg.svd(hips - hips.mean(axis=0))
    up = axes[2]
    if spread[2] > FLATNESS * spread[1] or abs(up[2]) > LEANING:
        return
    reach = np.array([_foot(tree, limb, poses) for limb in limbs]) - hips
    below = float(np.mean(reach @ up)), float(np.linalg.norm(reach, axis=1).mean())
    if abs(below[0]) < BELOW * below[1]:
        raise RobotError(
            f"{tree.label}: the hips lie in a plane that the z axis of the base {tree.base} does "
            f"not stand on (it is along {np.round(up, 2)}), and the legs do not hang down from it; "
            "turn the base so that its z axis points up"
        )
    if below[0] > 0.0:
        up = -up
    old = tree.base
    tree.put_above(tree.new_name("upright body"), _turn(up))
    done.append(
        f"the base {old} has its {_named(up)} axis up; the body {tree.base} is the same with z up"
    )


def _foot(tree: UrdfTree, limb: Limb, poses: Mapping[str, FloatArray]) -> FloatArray:
    """The place of the farthest link at a leg's end ``(3,)``, or of its last joint [m]."""
    places = tree.rigid_with(limb.end).values()
    far = max(places, key=lambda place: float(np.linalg.norm(place[:3, 3])))
    return np.asarray((poses[limb.end] @ far)[:3, 3])


def _turn(up: FloatArray) -> FloatArray:
    """The rotation ``(3, 3)`` by the least angle that takes a unit vector to z."""
    near = np.round(up)
    if np.linalg.norm(near) == 1.0 and np.linalg.norm(up - near) < 1e-2:
        up = near  # an axis of the base, but for rounded digits
    cross = np.cross(up, [0.0, 0.0, 1.0])
    if not cross.any():
        return np.diag([1.0, up[2], up[2]])
    x, y, z = cross
    matrix = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + matrix + matrix @ matrix / (1.0 + up[2]))


def _named(up: FloatArray) -> str:
    """The axis of the base that is nearest to a direction, with its sign."""
    axis = int(np.abs(up).argmax())
    return ("-" if up[axis] < 0.0 else "") + "xyz"[axis]
