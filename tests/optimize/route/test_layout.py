"""Rows of inequalities: joined, chosen, shifted; unknowns: numbered, packed and unpacked."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from gaitopt import Quadruped
from gaitopt.optimize.route.dynamic_layout import ZmpRows
from gaitopt.optimize.route.layout import Rows
from gaitopt.plan.settings.freedoms import VARIANTS

Array = NDArray[np.float64]


def some_rows(count: int, seed: int) -> Rows:
    rng = np.random.default_rng(seed)
    knot = np.sort(rng.integers(0, 5, count))
    return Rows(knot, rng.normal(size=(count, 9)), rng.normal(size=(count, 9)),
                rng.normal(size=count))  # fmt: skip


@given(counts=st.lists(st.integers(0, 6), max_size=4), seed=st.integers(0, 1000))
def test_joined_rows_are_sorted_and_all_there(counts: list[int], seed: int) -> None:
    """On one knot they stand in the order of the parts."""
    parts = [some_rows(count, seed + i) for i, count in enumerate(counts)]
    joined = Rows.joined(parts)
    assert (np.diff(joined.knot) >= 0).all()
    assert joined.linear.shape == joined.square.shape == (sum(counts), 9)
    for k in range(5):
        offsets = [value for part in parts for value in part.offset[part.knot == k]]
        assert joined.offset[joined.knot == k].tolist() == offsets


def test_joined_parts_need_not_be_sorted() -> None:
    """A table whose knots descend becomes one whose knots ascend, row by row."""
    zmp = ZmpRows(np.array([2, 0, 1]), np.eye(3)[:, :2], *np.arange(12.0).reshape(4, 3))
    joined = ZmpRows.joined([zmp])
    assert joined.knot.tolist() == [0, 1, 2]
    assert joined.offset.tolist() == [1.0, 2.0, 0.0]
    assert joined.normal.tolist() == [[0, 1], [0, 0], [1, 0]]


def test_chosen_and_shifted_rows_look_at_the_same_poses() -> None:
    rows = some_rows(12, 0)
    poses = np.random.default_rng(1).normal(size=(5, 9))
    kept = rows.chosen(rows.knot >= 2).shifted(-2)
    assert kept.values(poses[2:]) == pytest.approx(rows.values(poses)[rows.knot >= 2], abs=0)


def test_derivatives_of_rows_are_those_of_differences() -> None:
    rows = some_rows(12, 0)
    poses, step = np.random.default_rng(1).normal(size=(5, 9)), 1e-6
    for i in range(9):
        ahead, behind = (rows.values(poses + s * step * np.eye(9)[i]) for s in (1, -1))
        assert rows.by_pose(poses)[:, i] == pytest.approx((ahead - behind) / (2 * step), abs=1e-8)


@pytest.mark.parametrize("variant", list(VARIANTS)[:-1])
def test_packed_unknowns_unpack_to_the_same(
    wang: Quadruped, small_problem: Any, variant: str
) -> None:
    """Unknowns that knots share, as while the body stands still, are one number."""
    walk = small_problem(wang, variant)
    times = np.linspace(0.1, 0.3, walk.knots - 1)
    x = walk.pack(walk.poses, times)
    poses, unpacked = walk.unpack(x)
    assert poses == pytest.approx(walk.poses, abs=1e-15)
    assert unpacked == pytest.approx(times, abs=1e-15)
    assert sorted({*walk.numbering.times, *walk.numbering.poses.ravel()} - {-1}) == list(
        range(len(x))
    )


def test_a_knots_times_stand_between_its_poses(wang: Quadruped, small_problem: Any) -> None:
    """So the matrix of a Newton step is narrow, however long the walk."""
    walk = small_problem(wang, "posture")
    at = walk.numbering
    for k, time in enumerate(at.times):
        assert (at.poses[: k + 1][at.poses[: k + 1] >= 0] < time).all()
        assert (at.poses[k + 1][at.poses[k + 1] >= 0] > time).all()
    assert walk.interval_band.shape[0] <= 2 * 9 + 1


def test_another_start_changes_a_copy(wang: Quadruped, small_problem: Any) -> None:
    walk = small_problem(wang, "height")
    before = walk.poses.copy()
    moved = walk.with_start(before[0] + 0.01)
    assert (walk.poses == before).all()
    assert (moved.poses[0] == before[0] + 0.01).all() and (moved.poses[1:] == before[1:]).all()
    assert type(moved) is type(walk) and moved.rows is walk.rows


def test_the_largest_knots_are_those_with_the_largest_entries(
    wang: Quadruped, small_problem: Any
) -> None:
    walk = small_problem(wang, "height")
    x = np.zeros(walk.numbering.size)
    x[walk.numbering.poses[7, 0]], x[walk.numbering.times[2]] = -3.0, 2.0
    assert walk.largest_knots(x, 2).tolist() == [7, 3]


def test_longer_intervals_meet_all_velocity_limits(wang: Quadruped, small_problem: Any) -> None:
    """Values after the change are those that the problem gives for the new unknowns."""
    walk = small_problem(wang, "swing")
    x = walk.pack(walk.poses, np.zeros(walk.knots - 1))
    slack = np.full(len(walk.values(x)), 0.01)
    new, values = walk.restore(x, walk.values(x), slack)
    assert values == pytest.approx(walk.values(new), abs=1e-12)
    assert values[: walk.restorable].min() == pytest.approx(0.01, abs=1e-12)
    assert replace(walk, time_unit=0.5).restorable == walk.restorable
