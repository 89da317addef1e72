"""Bounds hold for every instant, and are not far from the truth."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

import gaitopt
from gaitopt import MotionPath
from gaitopt.certificate.enclosure import Pieces, acceleration_bounds, chain_to, chord_deviation
from gaitopt.certificate.placements import configurations

Array = NDArray[np.float64]


def random_path(seed: int, degree: int, columns: int, scale: float = 1.0) -> MotionPath:
    rng = np.random.default_rng(seed)
    times = np.concatenate([[0.0], np.cumsum(rng.uniform(0.2, 1.0, 4))])
    return MotionPath(times, scale * rng.normal(size=(degree + 1, 4, columns)))


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 10_000), st.integers(0, 5), st.integers(0, 3))
def test_a_polynomial_stays_in_its_enclosure(seed: int, degree: int, derivative: int) -> None:
    path = random_path(seed, degree, 3)
    pieces = Pieces.of(path)
    low, high = pieces.enclosure(derivative)
    for i, (start, length) in enumerate(zip(pieces.starts, pieces.lengths, strict=True)):
        inside = start + length * np.linspace(0, 1 - 1e-9, 300)
        seen = path.evaluate(inside, derivative)
        assert (seen >= low[i] - 1e-9).all() and (seen <= high[i] + 1e-9).all()


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10_000), st.integers(1, 5), st.integers(1, 7))
def test_cutting_changes_nothing_but_tightens(seed: int, degree: int, count: int) -> None:
    path = random_path(seed, degree, 2)
    whole = Pieces.of(path)
    cut = whole.cut(np.full(4, count))
    starts, ends = cut.values()
    assert starts == pytest.approx(path.evaluate(cut.starts), abs=1e-9)
    assert ends == pytest.approx(path.evaluate(cut.starts + cut.lengths - 1e-12), abs=1e-7)
    assert cut.lengths.sum() == pytest.approx(path.duration)
    assert cut.largest(1).max() <= whole.largest(1).max() + 1e-9


def test_lines_are_enclosed_exactly() -> None:
    path = MotionPath.polyline([0.0, 2.0, 3.0], [[0.0], [1.0], [-1.0]])
    low, high = Pieces.of(path).enclosure(1)
    assert low.ravel() == pytest.approx([0.5, -2.0])
    assert high.ravel() == pytest.approx([0.5, -2.0])
    assert not Pieces.of(path).largest(2).any()


@pytest.mark.parametrize("name", ["wang2020", "anymal_c", "hyq", "quadruped"])
@pytest.mark.parametrize("degree", [1, 3])
def test_second_derivatives_of_feet_are_bounded(name: str, degree: int) -> None:
    """Against finite differences of Pinocchio's forward kinematics, base turning and moving."""
    robot = gaitopt.load_robot(name)
    model, data = robot.model, robot.model.createData()
    path = random_path(3, degree, 6 + len(robot.joint_names), scale=0.5)
    pieces = Pieces.of(path)
    rates, accelerations = pieces.largest(1), pieces.largest(2)
    frame = model.frames[model.getFrameId(robot.legs["LF"].foot)]
    chain = chain_to(model, frame.parentJoint, frame.placement.translation)
    bounds = acceleration_bounds([chain], rates, accelerations)[:, 0]
    tightest = 0.0
    for i, (start, length) in enumerate(zip(pieces.starts, pieces.lengths, strict=True)):
        h = 1e-4
        times = np.linspace(start + 2 * h, start + length - 2 * h, 60)
        seen = []
        for offset in (-h, 0.0, h):
            places = []
            for q in configurations(path.evaluate(times + offset)):
                pin.framesForwardKinematics(model, data, q)
                places.append(data.oMf[model.getFrameId(frame.name)].translation.copy())
            seen.append(np.array(places))
        size = np.linalg.norm(seen[0] - 2 * seen[1] + seen[2], axis=1) / h**2
        assert size.max() <= bounds[i] * (1 + 1e-3)
        tightest = max(tightest, float(size.max() / bounds[i]))
    assert tightest > 0.02


def test_a_circle_leaves_its_chord_by_no_more_than_the_bound() -> None:
    """A point on a radius of 1 m turning at 1 rad/s: the sagitta is 1 - cos(h / 2)."""
    for h in (0.01, 0.1, 0.5):
        assert 1 - np.cos(h / 2) <= float(chord_deviation(np.array([1.0]), np.array([h]))[0])
        assert float(chord_deviation(np.array([1.0]), np.array([h]))[0]) < 1.05 * (
            1 - np.cos(h / 2)
        )


def test_configurations_are_pinocchios() -> None:
    rng = np.random.default_rng(0)
    values = rng.uniform(-1, 1, (20, 18))
    for row, q in zip(values, configurations(values), strict=True):
        matrix = pin.Quaternion(*q[[6, 3, 4, 5]]).toRotationMatrix()
        assert matrix == pytest.approx(pin.rpy.rpyToMatrix(*row[3:6]), abs=1e-12)
        assert q[:3] == pytest.approx(row[:3]) and q[7:] == pytest.approx(row[6:])


def test_a_rate_whose_coefficients_exceed_the_limit_and_whose_values_do_not_is_kept() -> None:
    """0.9993, 1.00034, 0.9993 are Bernstein coefficients of a rate that is at most 0.99982."""
    from gaitopt.certificate.joints import _size, _worst

    ends, middle, span = 0.9993, 1.00034, 0.01
    coefficients = np.zeros((4, 1, 7))
    coefficients[:3, 0, 6] = (
        2.0 * (ends - middle) / span**2 / 3.0, 2.0 * (middle - ends) / span / 2.0, ends
    )  # fmt: skip
    pieces = Pieces(np.zeros(1), np.full(1, span), coefficients)
    assert pieces.largest(1)[0, 6] == pytest.approx(middle)
    worst, when, joint = _worst(pieces, 1, _size, 1.0)
    assert worst == pytest.approx(0.5 * (ends + middle), abs=1e-9) and joint == 0
    assert when == pytest.approx(0.5 * span)
    assert _worst(pieces, 1, _size, 0.99981)[0] > 0.99981
