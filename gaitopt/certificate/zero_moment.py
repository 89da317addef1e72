"""The ZMP of the body's centre as a point mass, and how far it strays between samples.

With ``u = h / (g + c_z'')``, h the height of the centre c above the ground, the ZMP is
``p = c - u c''`` along x and y. On a piece of a path all of these are smooth, so p leaves its
chord by at most an eighth of the squared piece times the most of
``p'' = c'' - u'' c'' - 2 u' c''' - u c''''``. Derivatives of the path are bounded by their
Bernstein coefficients; those of a point that the base turns, by its distance and the sum of the
rates of roll, pitch and yaw.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from gaitopt.certificate.enclosure import Pieces, bulge
from gaitopt.certificate.trace import Motion
from gaitopt.conventions import GRAVITY, FloatArray
from gaitopt.plan.plan import Plan

HIGHEST = 4
"""Order of the highest derivative of the path that the ZMP's second one holds."""


def zmp_of_centre(plan: Plan, motion: Motion) -> tuple[FloatArray, FloatArray]:
    """ZMP at both ends of every piece ``(2, P, 2)``, and how far it leaves its chord ``(P,)`` [m].

    See :func:`traced_zmp`; the ground is that of :func:`ground_below`.
    """
    arm = plan.robot.body_axes @ plan.robot.centre
    return traced_zmp(motion.pieces, arm, ground_below(plan, motion))


def ground_below(plan: Plan, motion: Motion) -> FloatArray:
    """Height ``(P,)`` of the ground: mean of the feet that stand in the phase, below their balls.

    It is constant over a phase, and NaN in flight.
    """
    out = np.full(len(motion.phase), np.nan)
    for index in np.unique(motion.phase):
        mine = np.flatnonzero(motion.phase == index)
        standing = motion.standing[mine[0]]
        if standing.any():
            out[mine] = motion.feet[0, mine[0], standing, 2].mean() - plan.robot.foot_radius
    return out


def traced_zmp(
    pieces: Pieces, arm: FloatArray, ground: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """ZMP of a point mass that a path carries, and how far it leaves its chords.

    Args:
        pieces: of the path; its first six columns are the base's place and roll, pitch, yaw.
        arm: the mass in the base's frame ``(3,)`` [m].
        ground: height of the ground on every piece ``(P,)`` [m].

    Returns:
        The ZMP at both ends of every piece ``(2, P, 2)``, and bounds ``(P,)`` [m]. A bound is
        infinite, and its piece's points mean nothing, where the load on the ground may vanish.
    """
    ends = [_centre(pieces, arm, end) for end in range(2)]
    heights = np.stack([place[:, 2] for place, _ in ends]) - ground
    loads = GRAVITY + np.stack([pull[:, 2] for _, pull in ends])
    level, upright = _largest(pieces, arm)
    least = _least_load(pieces, arm, loads, upright[HIGHEST])
    safe = least > 0.0
    with np.errstate(divide="ignore", invalid="ignore"):
        points = np.stack([
            place[:, :2] - (height / load)[:, None] * pull[:, :2]
            for (place, pull), height, load in zip(ends, heights, loads, strict=True)
        ])  # fmt: skip
        most = np.abs(heights).max(axis=0) + bulge(upright[2], pieces.lengths)
        u, u1, u2 = _arm_of_the_load(most, upright, least)
        bend = level[2] + u2 * level[2] + 2.0 * u1 * level[3] + u * level[4]
    points[:, ~safe] = 0.0
    return points, np.where(safe, bulge(bend, pieces.lengths), np.inf)


def _arm_of_the_load(
    height: FloatArray, upright: list[FloatArray], load: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Bounds on ``u = h / l`` and two derivatives, from the most of |h| and the least of l."""
    _, h1, h2, l1, l2 = upright
    u = height / load
    u1 = (h1 + u * l1) / load
    return u, u1, (h2 + 2.0 * u1 * l1 + u * l2) / load


def _centre(pieces: Pieces, arm: FloatArray, end: int) -> tuple[FloatArray, FloatArray]:
    """Place and acceleration ``(P, 3)`` of the mass at one end of every piece."""
    values = [pieces.at_ends(k)[end] for k in range(3)]
    turn = Rotation.from_euler("ZYX", values[0][:, 5:2:-1]).as_matrix()
    place = values[0][:, :3] + turn @ arm
    return place, values[2][:, :3] + arm_acceleration(arm, [v[:, 3:6] for v in values])


def _largest(pieces: Pieces, arm: FloatArray) -> tuple[list[FloatArray], list[FloatArray]]:
    """Largest derivatives of the mass's place along the level and upwards, by order ``(P,)``.

    The n-th derivative of three turns in a row is no larger than the n-th complete Bell polynomial
    of the sums of their rates (Leibniz' and Faa di Bruno's rules). Order 0 is left at zero.
    """
    rates = [pieces.largest(k) for k in range(HIGHEST + 1)]
    w, a, j, s = (r[:, 3:6].sum(axis=1) for r in rates[1:])
    bell = [0.0 * w, w, w**2 + a, w**3 + 3 * w * a + j,
            w**4 + 6 * w**2 * a + 3 * a**2 + 4 * w * j + s]  # fmt: skip
    turned = [float(np.linalg.norm(arm)) * b for b in bell]
    level = [np.linalg.norm(r[:, :2], axis=1) + t for r, t in zip(rates, turned, strict=True)]
    upright = [r[:, 2] + t for r, t in zip(rates, turned, strict=True)]
    return level, upright


def _least_load(pieces: Pieces, arm: FloatArray, loads: FloatArray, bend: FloatArray) -> FloatArray:
    """Lower bound ``(P,)`` of the load per mass: by its ends' chord, or by its enclosure."""
    w, a = (pieces.largest(k)[:, 3:6].sum(axis=1) for k in (1, 2))
    enclosed = GRAVITY + pieces.enclosure(2)[0][:, 2] - np.linalg.norm(arm) * (w**2 + a)
    return np.asarray(np.maximum(enclosed, loads.min(axis=0) - bulge(bend, pieces.lengths)))


def arm_acceleration(arm: FloatArray, turn: list[FloatArray]) -> FloatArray:
    """Acceleration ``(P, 3)`` of a point at ``arm`` in the base, by the base's turning alone.

    Args:
        arm: ``(3,)`` [m].
        turn: roll, pitch and yaw ``(P, 3)`` and two derivatives.
    """
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
