"""Contact forces: they make up the wrench, and keep to friction."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import linprog

from gaitopt.control.forces import ForceDistribution

WEIGHT, LENGTH, FRICTION = 250.0, 0.2, 0.5
FEET = np.array([[0.2, 0.15, -0.4], [-0.2, 0.15, -0.4], [-0.2, -0.15, -0.4], [0.2, -0.15, -0.4]])
DOWN = np.array([0.0, 0.0, WEIGHT, 0.0, 0.0, 0.0])


def grasp(feet: np.ndarray) -> np.ndarray:
    """Wrench about the origin of unit forces at ``feet``, by the cross product's definition."""
    out = np.zeros((6, 12))
    for i, foot in enumerate(feet):
        for axis in range(3):
            unit = np.eye(3)[axis]
            out[:3, 3 * i + axis] = unit
            out[3:, 3 * i + axis] = np.cross(foot, unit)
    return out


def solver() -> ForceDistribution:
    return ForceDistribution(WEIGHT, LENGTH, FRICTION)


def test_four_feet_share_the_weight_equally() -> None:
    share = solver().share(grasp(FEET), DOWN, np.ones(4))
    assert share.forces[:, 2] == pytest.approx([WEIGHT / 4] * 4, rel=1e-3)
    assert np.abs(share.forces[:, :2]).max() < 0.01 * WEIGHT
    assert share.status == "free"


@pytest.mark.parametrize("seed", range(40))
def test_forces_make_up_the_wrench_and_keep_to_the_friction_cone(seed: int) -> None:
    rng = np.random.default_rng(seed)
    feet = FEET + rng.uniform(-0.05, 0.05, FEET.shape)
    load = np.ones(4)
    if seed % 2:
        load[rng.integers(4)] = 0.0
    # A wrench that forces inside the pyramid make: it can be made again.
    truth = rng.uniform(0.1, 0.5, (4, 1)) * WEIGHT * load[:, None]
    tangent = rng.uniform(-0.3, 0.3, (4, 2)) * truth
    wrench = grasp(feet) @ np.concatenate([tangent, truth], axis=1).ravel()
    share = solver().share(grasp(feet), wrench, load)
    made = grasp(feet) @ share.forces.ravel()
    assert np.abs(made[:3] - wrench[:3]).max() < 2e-3 * WEIGHT
    assert np.abs(made[3:] - wrench[3:]).max() < 2e-3 * WEIGHT * LENGTH
    tangential = np.hypot(*share.forces[:, :2].T)
    assert (tangential <= FRICTION * share.forces[:, 2] + 1e-4 * WEIGHT).all()
    assert np.abs(share.forces[load == 0]).max(initial=0.0) < 1e-9


@pytest.mark.parametrize("seed", range(10))
def test_a_wrench_beyond_friction_is_met_as_far_as_feet_can(seed: int) -> None:
    """The sideways force made is that of a linear program over the same pyramids."""
    rng = np.random.default_rng(seed)
    side = np.array([*rng.normal(size=2), 0.0])
    side /= np.linalg.norm(side)
    wrench = DOWN + np.concatenate([5.0 * WEIGHT * side, np.zeros(3)])
    share = solver().share(grasp(FEET), wrench, np.ones(4))
    assert share.status == "limited"
    assert share.violation < 1e-5
    tangential = np.abs(share.forces[:, :2]).max(axis=1)
    assert (tangential <= FRICTION / np.sqrt(2) * share.forces[:, 2] + 1e-4 * WEIGHT).all()


def test_limited_forces_are_the_optimum_of_the_qp() -> None:
    """First-order optimality, checked by a linear program: no feasible direction goes downhill."""
    wrench = DOWN + np.array([0.6 * WEIGHT, 0.2 * WEIGHT, 0, 5.0, -3.0, 1.0])
    share = solver().share(grasp(FEET), wrench, np.ones(4))
    scale = np.array([1.0] * 3 + [1.0 / LENGTH] * 3)
    matrix = scale[:, None] * grasp(FEET)
    x = share.forces.ravel() / WEIGHT
    gradient = matrix.T @ (matrix @ x - scale * wrench / WEIGHT) + 1e-4 * x
    slope = FRICTION / np.sqrt(2)
    rows = np.kron(np.eye(4), [[1, 0, slope], [-1, 0, slope], [0, 1, slope], [0, -1, slope]])
    best = linprog(gradient, A_ub=-rows, b_ub=rows @ x, bounds=[(-1, 1)] * 12, method="highs")
    assert best.fun > -1e-6


def test_feet_that_give_up_their_load_push_less_and_less() -> None:
    forces = [
        solver().share(grasp(FEET), DOWN, np.array([1.0, 1.0, 1.0, w])).forces[3, 2]
        for w in (1.0, 0.3, 0.1, 0.03)
    ]
    assert np.all(np.diff(forces) < 0)
    assert forces[-1] < 0.02 * WEIGHT


def test_nonsense_is_answered_by_the_last_good_forces() -> None:
    memory = solver()
    good = memory.share(grasp(FEET), DOWN, np.ones(4))
    bad = memory.share(grasp(FEET), DOWN * np.nan, np.ones(4))
    assert bad.status == "kept"
    assert bad.forces == pytest.approx(good.forces)
