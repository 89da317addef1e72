"""Solids that are built from points: tubes, flat polygons, and poses of cylinders."""

from __future__ import annotations

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.viewing.replay.scene import Ball, Cylinder, Look, Part, Surface, pose


def along(start: FloatArray, end: FloatArray, radius: float, look: Look) -> list[Part]:
    """A rounded tube from ``start (3,)`` to ``end (3,)`` [m]; nothing when they are one point."""
    line = np.asarray(end, dtype=np.float64) - start
    length = float(np.linalg.norm(line))
    if length < 1e-6:
        return []
    middle = np.asarray(start) + line / 2.0
    return [
        Part(Cylinder(radius, length), look, pose(middle, _frame(line / length))),
        Part(Ball(radius), look, pose(start)),
        Part(Ball(radius), look, pose(end)),
    ]


def tube(points: FloatArray, radius: float, sides: int = 6) -> Surface:
    """A tube around the polyline ``points (n, 3)`` [m], ``n >= 2``, open at its ends."""
    steps = np.diff(points, axis=0)
    steps /= np.maximum(np.linalg.norm(steps, axis=1, keepdims=True), 1e-12)
    tangents = np.concatenate([steps[:1], steps[:-1] + steps[1:], steps[-1:]])
    lengths = np.linalg.norm(tangents, axis=1, keepdims=True)
    tangents = np.where(lengths < 1e-9, np.concatenate([steps[:1], steps]), tangents)
    tangents /= np.linalg.norm(tangents, axis=1, keepdims=True)
    # Rings share one direction that no tangent comes near, so that the tube is not twisted.
    spread = np.abs(tangents).max(axis=0)
    other = np.cross(tangents, np.eye(3)[np.argmin(spread)])
    other /= np.linalg.norm(other, axis=1, keepdims=True)
    third = np.cross(tangents, other)
    angle = 2.0 * np.pi * np.arange(sides) / sides
    ring = np.cos(angle)[:, None] * other[:, None] + np.sin(angle)[:, None] * third[:, None]
    vertices = (points[:, None] + radius * ring).reshape(-1, 3)
    first = np.arange(len(points) - 1)[:, None] * sides
    here, there = np.arange(sides), np.roll(np.arange(sides), -1)
    a, b, c, d = first + here, first + there, first + here + sides, first + there + sides
    faces = np.stack([a, b, c, b, d, c], axis=-1).reshape(-1, 3)
    return Surface(vertices, faces)


def disc(radius: float, sides: int = 32) -> Surface:
    """A flat disc in the plane z = 0, around the origin [m]."""
    angle = 2.0 * np.pi * np.arange(sides) / sides
    rim = radius * np.column_stack([np.cos(angle), np.sin(angle), np.zeros(sides)])
    return filled(rim)


def filled(corners: FloatArray) -> Surface:
    """A convex polygon ``corners (n, 3)`` [m], ``n >= 3``, as a fan of triangles."""
    rest = np.arange(1, len(corners) - 1)
    return Surface(corners, np.column_stack([np.zeros_like(rest), rest, rest + 1]))


def band(corners: FloatArray, width: float) -> Surface:
    """The rim of a convex polygon ``corners (n, 3)``, counter-clockwise, ``width`` wide inward."""
    toward = np.roll(corners, -1, axis=0) - corners
    toward = toward / np.maximum(np.linalg.norm(toward, axis=1, keepdims=True), 1e-12)
    before = np.roll(toward, 1, axis=0)
    # The inner corner lies where the two sides, moved inward, meet; sharp corners are capped.
    sine = np.abs(np.cross(before, toward)[:, 2])[:, None]
    inner = corners + np.minimum(width / np.maximum(sine, 0.05), 6 * width) * (toward - before)
    n = len(corners)
    here, there = np.arange(n), np.roll(np.arange(n), -1)
    faces = np.concatenate([np.column_stack([here, there, there + n]),
                            np.column_stack([here, there + n, here + n])])  # fmt: skip
    return Surface(np.concatenate([corners, inner]), faces)


def merged(surfaces: list[Surface]) -> Surface:
    """Several surfaces as one."""
    counts = [len(s.vertices) for s in surfaces]
    starts = np.cumsum([0, *counts[:-1]])
    return Surface(
        np.concatenate([s.vertices for s in surfaces]),
        np.concatenate([s.faces + a for s, a in zip(surfaces, starts, strict=True)]),
    )


def _frame(axis: FloatArray) -> FloatArray:
    """A rotation ``(3, 3)`` that takes z to the unit vector ``axis (3,)``."""
    side = np.cross(axis, np.eye(3)[int(np.argmin(np.abs(axis)))])
    side /= np.linalg.norm(side)
    return np.column_stack([side, np.cross(axis, side), axis])
