"""Sums over groups of rows, banded matrices, and a problem of a thousand unknowns."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from gaitopt.interior_point.band import BlockBand, RowGroups
from gaitopt.interior_point.solver import minimise

Array = NDArray[np.float64]


@given(groups=st.integers(1, 6), rows=st.integers(0, 20), seed=st.integers(0, 10**6))
def test_padded_rows_sum_to_the_same(groups: int, rows: int, seed: int) -> None:
    """Group by group, as a loop does it; groups without rows are zero."""
    rng = np.random.default_rng(seed)
    group = np.sort(rng.integers(0, groups, rows))
    values = rng.normal(size=(rows, 3))
    padded = RowGroups.of(group, groups).padded(values)
    assert padded.shape[::2] == (groups, 3)
    for g in range(groups):
        mine = values[group == g]
        assert (padded[g, : len(mine)] == mine).all()
        assert (padded[g, len(mine) :] == 0.0).all()


@given(size=st.integers(1, 8), blocks=st.integers(1, 6), seed=st.integers(0, 10**6))
def test_blocks_add_up_to_the_dense_matrix(size: int, blocks: int, seed: int) -> None:
    """Also where an unknown is missing, stands in many blocks, or twice in one."""
    rng = np.random.default_rng(seed)
    unknowns = rng.integers(-1, size, (blocks, 4))
    values = rng.normal(size=(blocks, 4, 4))
    values += np.swapaxes(values, 1, 2)
    dense = np.zeros((size, size))
    for block, numbers in zip(values, unknowns, strict=True):
        for i, row in enumerate(numbers):
            for j, column in enumerate(numbers):
                if row >= 0 and column >= 0:
                    dense[row, column] += block[i, j]
    band = BlockBand.of(unknowns, size)
    assert band.shape[1] == size and band.shape[0] <= size
    full = np.zeros((size, size))
    for d, diagonal in enumerate(band.matrix(values)):
        full += np.diag(diagonal[: size - d], -d) + (np.diag(diagonal[: size - d], d) if d else 0)
    assert full == pytest.approx(dense, abs=1e-12)


class Chain:
    """A chain that hangs as low as it can over one peg: neighbours differ by a step at most.

    The least sum of ``x >= 0`` with ``|x(i+1) - x(i)| <= step`` and ``x(peg) >= height`` is a tent.
    """

    def __init__(self, size: int, peg: int, height: float, step: float) -> None:
        self.peg, self.height, self.step = peg, height, step
        self.linear_cost, self.quadratic_cost = np.ones(size), np.zeros(size)
        self.restorable = 0
        pairs = np.stack([np.arange(size - 1), np.arange(1, size)], axis=1)
        self.band = BlockBand.of(pairs, size)

    def values(self, x: Array) -> Array:
        change = np.diff(x)
        return np.concatenate(
            [self.step - change, self.step + change, x, [x[self.peg] - self.height]]
        )

    def restore(self, x: Array, values: Array, slack: Array) -> tuple[Array, Array]:
        return x, values

    def linearise(self, x: Array) -> ChainLinearisation:
        return ChainLinearisation(self, x)


class ChainLinearisation:
    def __init__(self, chain: Chain, x: Array) -> None:
        self.chain, self.values = chain, chain.values(x)

    def jacobian_times(self, dx: Array) -> Array:
        change = np.diff(dx)
        return np.concatenate([-change, change, dx, [dx[self.chain.peg]]])

    def jacobian_transpose_times(self, v: Array) -> Array:
        size = len(self.chain.linear_cost)
        up, down, single, peg = np.split(v, [size - 1, 2 * size - 2, 3 * size - 2])
        out = single.copy()
        out[1:] += down - up
        out[:-1] -= down - up
        out[self.chain.peg] += peg[0]
        return out

    def newton_matrix(self, scale: Array, multipliers: Array) -> Array:
        size = len(self.chain.linear_cost)
        up, down, single, peg = np.split(scale, [size - 1, 2 * size - 2, 3 * size - 2])
        blocks = (up + down)[:, None, None] * np.array([[1.0, -1], [-1, 1]])
        out = self.chain.band.matrix(blocks)
        out[0] += single
        out[0, self.chain.peg] += peg[0]
        return out


@pytest.mark.parametrize("size", [100, 1000])
def test_a_banded_chain_is_a_tent(size: int) -> None:
    """Ten times as many unknowns take no more iterations."""
    chain = Chain(size, size // 3, 5.0, 0.1)
    solution = minimise(chain, np.ones(size), tolerance=1e-6)
    tent = np.maximum(5.0 - 0.1 * np.abs(np.arange(size) - size // 3), 0.0)
    assert solution.solved
    assert solution.iterations <= 80
    assert solution.x == pytest.approx(tent, abs=1e-3)
    assert solution.objective() == pytest.approx(float(tent.sum()), rel=1e-5)
