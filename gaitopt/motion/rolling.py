"""How far the balls of standing feet roll while a plan is walked.

A plan keeps the centre of a foot's ball in its place while the foot stands. The ball of a real foot
rolls as its leg turns: its centre moves by the radius times the angle. Over a stance this can be
as far as the top of a column is wide. A foot that knows this lands beside its foothold by half of
the way, so that it is never farther away than that.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from gaitopt.conventions import BoolArray, FloatArray
from gaitopt.dynamics.contact_geometry import contact_geometry
from gaitopt.robots.quadruped import Quadruped

BLOCK = 8192
"""Most samples whose Jacobians are computed at once; they take about 3 kB each."""


def rolled_away(
    robot: Quadruped,
    q: FloatArray,
    v: FloatArray,
    standing: BoolArray,
    dt: float,
    normals: FloatArray | None = None,
) -> FloatArray:
    """Distances of the feet from the plan's along the ground ``(N, 4, 3)`` [m], in the world.

    Feet that stand roll; those that fly go from one distance to the next one.

    Args:
        robot: the robot.
        q: Pinocchio's configurations of the plan ``(N, nq)``.
        v: its velocities ``(N, nv)``, those of the plan's feet, which do not roll.
        standing: which feet stand ``(N, 4)``.
        dt: time between samples [s].
        normals: of the ground below the feet ``(N, 4, 3)``; vertical by default.
    """
    up = np.broadcast_to([0.0, 0.0, 1.0] if normals is None else normals, (*standing.shape, 3))
    speed = np.zeros((*standing.shape, 3))
    for first in range(0, len(speed), BLOCK):
        part = slice(first, first + BLOCK)
        jacobians = contact_geometry(robot, q[part], up[part]).jacobians
        # The plan's ball turns while its centre stands still, and its contact goes backwards.
        # A ball that rolls does not slide: its centre goes forwards instead.
        speed[part] = -np.einsum("nfij,nj->nfi", jacobians, v[part])
    speed -= np.einsum("nfi,nfi->nf", speed, up)[..., None] * up
    out = np.zeros_like(speed)
    for leg in range(standing.shape[1]):
        _stances(out[:, leg], speed[:, leg] * dt, standing[:, leg])
        _flights(out[:, leg], standing[:, leg])
    return out


def _stances(out: FloatArray, steps: FloatArray, standing: BoolArray) -> None:
    """Write into ``out (N, 3)`` where one foot is while it stands."""
    for first, last in _runs(standing):
        way = np.cumsum(steps[first:last], axis=0)
        # Where it stands at the start it is in its place.
        middle = 0.5 * (way.min(axis=0) + way.max(axis=0)) if first else 0.0
        out[first:last] = way - middle


def _flights(out: FloatArray, standing: BoolArray) -> None:
    """Write into ``out (N, 3)`` where one foot is while it flies."""
    for first, last in _runs(~standing):
        before = out[first - 1] if first else np.zeros(3)
        after = out[last] if last < len(out) else before
        u = (np.arange(1.0, last - first + 1.0) / (last - first + 1.0))[:, None]
        # It begins and ends without velocity and acceleration.
        out[first:last] = before + (after - before) * u**3 * (10.0 - 15.0 * u + 6.0 * u**2)


def _runs(flags: BoolArray) -> list[tuple[int, int]]:
    """First and one after last of every run of true values."""
    edges = [0, *(np.flatnonzero(np.diff(flags)) + 1).tolist(), len(flags)]
    return [(a, b) for a, b in pairwise(edges) if flags[a]]
