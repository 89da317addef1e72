"""Makes the axes of a leg exactly parallel and square, where the digits of a file are rounded.

Files often give a quarter turn as 1.57 or 1.5708. The closed form of a leg needs axes that are
square to 1e-9; the file means that, and says it with fewer digits.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.robots.files.limbs import Limb
from gaitopt.robots.files.tree import UrdfTree

EXACT = 1e-10
"""Axes that are off by less are left alone [rad]: the closed form is then exact to 1e-9 m."""
ROUNDED = 0.02
"""Axes that are off by more are not meant to be square [rad]. Chosen: about one degree."""
TOLD = 1e-4
"""A change that is warned about [rad]: more than the digits of 1.5708."""


def straighten(tree: UrdfTree, limbs: Iterable[Limb]) -> list[str]:
    """Turn the axes of legs by as little as makes them parallel and square.

    Args:
        tree: the robot, whose joints change.
        limbs: its legs.

    Returns:
        Warnings.
    """
    poses, largest = tree.poses(), 0.0
    for limb in limbs:
        frames = [poses[joint.child][:3, :3] for joint in limb.joints]
        given = [f @ j.axis for f, j in zip(frames, limb.joints, strict=True)]
        wanted = _square(given) if len(given) > 2 else _sideways(given)
        turned = [float(np.linalg.norm(a - b)) for a, b in zip(given, wanted, strict=True)]
        if not EXACT < max(turned) < ROUNDED:
            continue
        largest = max(largest, *turned)
        for joint, frame, axis in zip(limb.joints, frames, wanted, strict=True):
            joint.turn(frame.T @ axis)
    if largest <= TOLD:
        return []
    return [
        f"axes of the legs were turned by up to {np.degrees(largest):.3g} degrees, so that they "
        "are parallel and square; correct them in the file if that is wrong"
    ]


def _sideways(axes: list[FloatArray]) -> list[FloatArray]:
    """The same for two axes, along an axis of the base where they miss it by rounding alone.

    Without a roll joint a foot leaves its plane where the axes are not quite square to the way.
    """
    pitch, other = _square(axes)
    near = np.round(pitch)
    if np.linalg.norm(near) == 1.0 and np.linalg.norm(pitch - near) < ROUNDED:
        return [near, near * np.sign(pitch @ other)]
    return [pitch, other]


def _square(axes: list[FloatArray]) -> list[FloatArray]:
    """Unit axes that are parallel (the last two), and square to them (the first of three)."""
    sign = 1.0 if axes[-2] @ axes[-1] >= 0.0 else -1.0
    pitch = axes[-2] + sign * axes[-1]
    pitch = pitch / np.linalg.norm(pitch)
    out = [pitch, sign * pitch]
    if len(axes) == 3:
        roll = axes[0] - (axes[0] @ pitch) * pitch
        length = float(np.linalg.norm(roll))
        # A first axis along the pitch axes is that of another kind of leg.
        out.insert(0, roll / length if length > 0.5 else axes[0])
    return out
