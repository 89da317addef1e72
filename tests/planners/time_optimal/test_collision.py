"""Distances of a walk's legs: measured where legs are close, left out where they cannot be."""

from __future__ import annotations

import numpy as np

from gaitopt import Quadruped
from gaitopt.planners.time_optimal.collision import ROW_DISTANCE, _distances_where_close
from gaitopt.robots.collisions.pairs import CollisionPairs

GJK = 2e-6
"""How far two measurements of one distance are apart that begin from other guesses [m]."""


def test_a_distance_changes_by_no_more_than_what_joints_turn(wang: Quadruped) -> None:
    shapes, random = CollisionPairs.of(wang), np.random.default_rng(0)
    assert shapes is not None
    start = random.uniform(-1.0, 1.0, (50, 12))
    turn = random.uniform(-0.2, 0.2, (50, 12))
    before, after = shapes.distances(start), shapes.distances(start + turn)
    # Distances of shapes that overlap are depths, which say less.
    apart = (before > 0.0) & (after > 0.0)
    most = np.abs(turn) @ shapes.levers.T
    assert (np.abs(after - before) <= most + GJK)[apart].all()
    assert (np.abs(after - before) / most)[apart].max() > 0.5


def test_every_place_at_which_legs_are_close_is_measured(wang: Quadruped) -> None:
    """Paths between random postures, with many places at which legs are close."""
    shapes, random = CollisionPairs.of(wang), np.random.default_rng(1)
    assert shapes is not None
    ends = random.uniform(-0.7, 0.7, (12, 12))
    share = np.linspace(0.0, 1.0, 21)[:-1, None]
    path = (ends[:-1, None] + np.diff(ends, axis=0)[:, None] * share).reshape(-1, 12)
    pairs = list(range(len(shapes.geometry.collisionPairs)))
    exact, found = shapes.distances(path, pairs), _distances_where_close(shapes, path, pairs)
    close = exact < ROW_DISTANCE - GJK
    assert 10 < close.sum() < close.size / 20
    measured = np.isfinite(found)
    assert measured[close].all() and measured.mean() < 0.5
    assert np.abs(found - exact)[measured].max() < GJK
