"""The ZMP of a point mass at the body's centre, and how far it leaves its chord between samples.

With ``u = h / (g + c_z'')``, h the height of the centre c above the ground, the ZMP is
``p = c - u c''`` along x and y. On a piece of a path all of these are smooth, so p leaves its
chord by at most an eighth of the piece's squared duration times the largest value of
``p'' = c'' - u'' c'' - 2 u' c''' - u c''''``. The derivatives of the path are bounded by their
Bernstein coefficients. Those of a point that turns with the base are bounded by its distance from
the base's origin and the sum of the rates of roll, pitch and yaw.
"""

from __future__ import annotations

import numpy as np

from gaitopt.certificate.enclosure import Pieces, chord_deviation
from gaitopt.certificate.placements import base_rotations, rotations_of
from gaitopt.certificate.trace import Motion
from gaitopt.conventions import GRAVITY, FloatArray
from gaitopt.plan.plan import Plan

HIGHEST = 4
"""Order of the highest derivative of the path in the second derivative of its ZMP."""


def ground_below(plan: Plan, motion: Motion) -> FloatArray:
    """Height of the ground ``(P,)`` [m]: the mean under the feet that stand.

    It is constant over a phase, and NaN while no foot stands.
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
    """ZMP of a point mass that moves with the base, and how far it leaves its chords at most.

    Args:
        pieces: of the path; its first six columns are the base's place and roll, pitch, yaw.
        arm: place of the mass in the base's frame ``(3,)`` [m].
        ground: height of the ground on every piece ``(P,)`` [m].

    Returns:
        The ZMP at both ends of every piece ``(2, P, 2)``, and bounds ``(P,)`` [m]. Where the load
        on the ground may vanish there is no ZMP: the bound is infinite and the points are zero.
    """
    ends = [_centre(pieces, arm, end) for end in range(2)]
    heights = np.stack([place[:, 2] for place, _ in ends]) - ground
    loads = GRAVITY + np.stack([acceleration[:, 2] for _, acceleration in ends])
    level, upright = _largest(pieces, arm)
    least = _least_load(pieces, arm, loads, upright[HIGHEST])
    safe = least > 0.0
    with np.errstate(divide="ignore", invalid="ignore"):
        points = np.stack([
            place[:, :2] - (height / load)[:, None] * acceleration[:, :2]
            for (place, acceleration), height, load in zip(ends, heights, loads, strict=True)
        ])  # fmt: skip
        highest = np.abs(heights).max(axis=0) + chord_deviation(upright[2], pieces.lengths)
        u, u1, u2 = _height_over_load(highest, upright, least)
        second = level[2] + u2 * level[2] + 2.0 * u1 * level[3] + u * level[4]
    points[:, ~safe] = 0.0
    return points, np.where(safe, chord_deviation(second, pieces.lengths), np.inf)


def _height_over_load(
    height: FloatArray, upright: list[FloatArray], load: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Bounds ``(P,)`` on the size of ``u = h / l`` and of its two derivatives.

    Args:
        height: bound on the size of the height h ``(P,)``.
        upright: bounds on the derivatives of h by order; those of the load l are two orders higher.
        load: lower bound of l ``(P,)``.
    """
    _, h1, h2, l1, l2 = upright
    u = height / load
    u1 = (h1 + u * l1) / load
    return u, u1, (h2 + 2.0 * u1 * l1 + u * l2) / load


def _centre(pieces: Pieces, arm: FloatArray, end: int) -> tuple[FloatArray, FloatArray]:
    """Place and acceleration ``(P, 3)`` of the mass at one end of every piece."""
    values = [pieces.at_ends(k)[end] for k in range(3)]
    turn = base_rotations(values[0])
    place = values[0][:, :3] + turn @ arm
    return place, values[2][:, :3] + arm_acceleration(arm, [v[:, 3:6] for v in values])


def _largest(pieces: Pieces, arm: FloatArray) -> tuple[list[FloatArray], list[FloatArray]]:
    """Bounds on the derivatives of the mass's place, horizontal and vertical, by order ``(P,)``.

    The n-th derivative of a product of three rotations is no larger than the n-th complete Bell
    polynomial of the sums of their rates, by the rules of Leibniz and Faa di Bruno. Order 0 is not
    needed; there the part of the rotations is left out.
    """
    rates = [pieces.largest(k) for k in range(HIGHEST + 1)]
    w, a, j, s = (r[:, 3:6].sum(axis=1) for r in rates[1:])
    bell = [0.0 * w, w, w**2 + a, w**3 + 3 * w * a + j,
            w**4 + 6 * w**2 * a + 3 * a**2 + 4 * w * j + s]  # fmt: skip
    turned = [float(np.linalg.norm(arm)) * b for b in bell]
    level = [np.linalg.norm(r[:, :2], axis=1) + t for r, t in zip(rates, turned, strict=True)]
    upright = [r[:, 2] + t for r, t in zip(rates, turned, strict=True)]
    return level, upright


def _least_load(
    pieces: Pieces, arm: FloatArray, loads: FloatArray, fourth: FloatArray
) -> FloatArray:
    """Lower bound ``(P,)`` of the load per mass [m/s^2]: the better of two.

    One is the lower end of the load's chord, less how far the load leaves it, by the bound on the
    ``fourth`` derivative of the height; the other comes from the Bernstein coefficients.
    """
    w, a = (pieces.largest(k)[:, 3:6].sum(axis=1) for k in (1, 2))
    enclosed = GRAVITY + pieces.enclosure(2)[0][:, 2] - np.linalg.norm(arm) * (w**2 + a)
    return np.asarray(
        np.maximum(enclosed, loads.min(axis=0) - chord_deviation(fourth, pieces.lengths))
    )


def arm_acceleration(arm: FloatArray, turn: list[FloatArray]) -> FloatArray:
    """Acceleration ``(P, 3)`` [m/s^2] of a point of a base that only turns.

    Args:
        arm: place of the point in the base's frame ``(3,)`` [m].
        turn: roll, pitch and yaw ``(P, 3)``, and their first and second derivatives.
    """
    rpy, rates, changes = turn
    rotation = rotations_of(rpy)
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
