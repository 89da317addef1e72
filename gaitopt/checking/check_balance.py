"""Checks of balance: static margins of the body's centre and of the true centre of mass."""

from __future__ import annotations

from math import nan

import numpy as np
from scipy.spatial import ConvexHull, QhullError
from scipy.spatial.transform import Rotation

from gaitopt.checking.certificate import Check
from gaitopt.checking.judging import SHORT, judged, phase_name
from gaitopt.checking.motion import Motion
from gaitopt.conventions import FloatArray
from gaitopt.planning.plan import Plan

GRAVITY = 9.81
ZMP_SLACK = 1e-3
"""How far the ZMP's margin may fall short of the plan's own figure, which is sampled [m]."""
DYNAMIC = "a dynamic gait promises no static margin: see its ZMP"


def margin_of_cog(plan: Plan, motion: Motion) -> Check:
    """While a foot flies, the body centre keeps the stability margin that was asked for."""
    if not plan.settings.static:
        return Check("margin of the body centre", "unchecked", nan, nan, "m", note=DYNAMIC)
    margins = _margins(motion, motion.cog, motion.cog_bulge)
    flying = np.asarray(~motion.standing.all(axis=1))
    short = np.where(flying, margins - plan.settings.stability_margin, margins)
    piece = int(short.argmin())
    asked = plan.settings.stability_margin if flying[piece] else 0.0
    return judged("margin of the body centre", float(margins[piece]), asked - SHORT, "m", ">=",
                   bound=motion.cog_bulge[piece], when=motion.pieces.starts[piece],
                   where=phase_name(plan, int(motion.phase[piece])))  # fmt: skip


def margin_of_com(plan: Plan, motion: Motion) -> Check:
    """The model's true centre of mass never leaves the support polygon."""
    if not plan.settings.static:
        return Check("margin of the true COM", "unchecked", nan, nan, "m", note=DYNAMIC)
    margins = _margins(motion, motion.com, motion.com_bulge)
    piece = int(margins.argmin())
    return judged("margin of the true COM", float(margins[piece]), 0.0, "m", ">=",
                   bound=motion.com_bulge[piece], when=motion.pieces.starts[piece],
                   where=phase_name(plan, int(motion.phase[piece])))  # fmt: skip


def _margins(motion: Motion, points: FloatArray, bulges: FloatArray) -> FloatArray:
    """Lower bound of the margin on every piece: hulls of the feet where the piece starts."""
    out = np.full(len(bulges), np.inf)
    for index in np.unique(motion.phase):
        mine = np.flatnonzero(motion.phase == index)
        standing = np.flatnonzero(motion.standing[mine[0]])
        feet = motion.feet[0, mine[0], standing, :2]
        moved = np.linalg.norm(
            (motion.feet[:, mine][:, :, standing, :2] - feet).reshape(-1, len(standing), 2), axis=2
        )
        try:
            sides = ConvexHull(feet).equations
        except (QhullError, ValueError):
            out[mine] = -np.inf
            continue
        # Qhull's distances are positive outside; the worse end of each piece counts.
        outside = (points[:, mine, :2] @ sides[:, :2].T + sides[:, 2]).max(axis=(0, 2))
        shift = moved.max() + motion.feet_bulge[mine][:, standing].max(axis=1)
        out[mine] = -outside - bulges[mine] - shift
    return out


def zmp(plan: Plan, motion: Motion) -> Check | None:
    """The ZMP of the body's centre keeps the margin that the plan tells of, while any foot stands.

    The centre counts as a point mass: ``c - h c'' / (g + c_z'')``. Between samples the ZMP leaves
    its chord by at most an eighth of its second derivative's bound times the squared step; the
    bound lets the height change and the load on the ground fall, but not its changes' changes.
    """
    claimed = plan.info.get("zmp_margin", None if plan.settings.static else _asked(plan))
    if not isinstance(claimed, float) or not np.isfinite(claimed):
        return None
    points, bulges = _zmp_of_centre(plan, motion)
    margins = np.full(len(bulges), np.inf)
    for index in np.unique(motion.phase):
        mine = np.flatnonzero(motion.phase == index)
        standing = np.flatnonzero(motion.standing[mine[0]])
        if standing.size:
            feet = motion.feet[0, mine[0], standing, :2]
            inside = -_outside(feet, points[:, mine]).max(axis=0)
            margins[mine] = inside - bulges[mine] - motion.feet_bulge[mine][:, standing].max(axis=1)
    piece = int(margins.argmin())
    return judged("ZMP of the body centre", float(margins[piece]), claimed - ZMP_SLACK, "m", ">=",
                  bound=bulges[piece], when=motion.pieces.starts[piece],
                  where=phase_name(plan, int(motion.phase[piece])))  # fmt: skip


def _asked(plan: Plan) -> float:
    """The margin that a dynamic plan was asked for, which it then promises of its ZMP."""
    return float(plan.settings.stability_margin)


def _outside(feet: FloatArray, points: FloatArray) -> FloatArray:
    """Distance ``(...)`` of ``points (..., 2)`` from the hull of ``feet``; negative inside it."""
    try:
        if len(feet) < 3:
            raise ValueError
        sides = ConvexHull(feet).equations
    except (QhullError, ValueError):
        gaps = feet[:, None] - feet[None]
        i, j = np.unravel_index(int((gaps**2).sum(axis=2).argmax()), (len(feet),) * 2)
        along = feet[j] - feet[i]
        square = max(float(along @ along), 1e-300)
        share = np.clip((points - feet[i]) @ along / square, 0.0, 1.0)
        return np.asarray(np.linalg.norm(points - feet[i] - share[..., None] * along, axis=-1))
    inside = (points @ sides[:, :2].T + sides[:, 2]).max(axis=-1)
    if not (inside > 0).any():
        return np.asarray(inside)
    corners = feet[ConvexHull(feet).vertices]
    ends = np.roll(corners, -1, axis=0)
    along = ends - corners
    share = np.clip(
        np.einsum("...cj,cj->...c", points[..., None, :] - corners, along)
        / (along**2).sum(axis=1), 0.0, 1.0,
    )  # fmt: skip
    gap = points[..., None, :] - corners - share[..., None] * along
    return np.asarray(np.where(inside > 0, np.linalg.norm(gap, axis=-1).min(axis=-1), inside))


def _zmp_of_centre(plan: Plan, motion: Motion) -> tuple[FloatArray, FloatArray]:
    """ZMP at both ends of every piece ``(2, P, 2)``, and how far it leaves its chord ``(P,)``."""
    arm = plan.robot.body_axes @ plan.robot.centre
    pieces = motion.pieces
    ground = plan.footholds.array[..., 2].mean() - plan.robot.foot_radius
    points = []
    for end in range(2):
        values = [pieces.at_ends(k)[end] for k in range(3)]
        turn = [v[:, 3:6] for v in values]
        swept = _arm_acceleration(arm, turn)
        pull = values[2][:, :3] + swept
        height = motion.cog[end, :, 2] - ground
        points.append(motion.cog[end, :, :2] - (height / (GRAVITY + pull[:, 2]))[:, None]
                      * pull[:, :2])  # fmt: skip
    rates = [pieces.largest(k) for k in range(5)]
    w, a, j, s = (r[:, 3:6].sum(axis=1) for r in rates[1:])
    radius = float(np.linalg.norm(arm))
    second = np.linalg.norm(rates[2][:, :2], axis=1) + radius * (w**2 + a)
    fourth = np.linalg.norm(rates[4][:, :2], axis=1) + radius * (
        w**4 + 6 * w**2 * a + 3 * a**2 + 4 * w * j + s
    )
    height = float((motion.cog[..., 2] - ground).max())
    # At least this much of the weight is on the ground; a body that rises and falls has less.
    load = max(GRAVITY - float(rates[2][:, 2].max(initial=0.0)), 0.1 * GRAVITY)
    risen = rates[2][:, 2] / load * np.linalg.norm(rates[2][:, :2], axis=1)
    return np.stack(points), (second + height / load * fourth + risen) * pieces.lengths**2 / 8.0


def _arm_acceleration(arm: FloatArray, turn: list[FloatArray]) -> FloatArray:
    """Acceleration ``(P, 3)`` of a point at ``arm`` in the base, by the base's turning alone."""
    rpy, rates, changes = turn
    rotation = Rotation.from_euler("ZYX", rpy[:, ::-1]).as_matrix()
    yaw, pitch = rpy[:, 2], rpy[:, 1]
    # World axes of the three hinges: z, then y turned by yaw, then x turned by yaw and pitch.
    zero, one = np.zeros_like(yaw), np.ones_like(yaw)
    z = np.stack([zero, zero, one], axis=1)
    y = np.stack([-np.sin(yaw), np.cos(yaw), zero], axis=1)
    x = np.stack([np.cos(yaw) * np.cos(pitch), np.sin(yaw) * np.cos(pitch), -np.sin(pitch)], axis=1)
    spin_z = z * rates[:, 2:3]
    spin_y = spin_z + y * rates[:, 1:2]
    spin = spin_y + x * rates[:, :1]
    change = (
        z * changes[:, 2:3] + y * changes[:, 1:2] + x * changes[:, :1]
        + np.cross(spin_z, y) * rates[:, 1:2] + np.cross(spin_y, x) * rates[:, :1]
    )  # fmt: skip
    place = rotation @ arm
    return np.asarray(np.cross(change, place) + np.cross(spin, np.cross(spin, place)))
