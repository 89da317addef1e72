"""Robot files with random faults: each is read, or refused by an error of gaitopt."""

from __future__ import annotations

import random
import warnings

import pytest
from robot_faults import nonsense, small_files, with_a_fault

from gaitopt.errors import GaitoptError, RobotWarning
from gaitopt.robots.catalog import load_robot


@pytest.mark.parametrize("seed", range(4))
def test_faults_give_a_robot_that_makes_sense_or_a_typed_error(seed: int) -> None:
    """``tests/helpers/robot_faults.py`` does the same ten thousand times."""
    rng = random.Random(seed)
    texts = tuple(small_files().values())
    read = refused = 0
    for _ in range(60):
        text = rng.choice(texts)
        for _ in range(rng.choice((1, 1, 1, 3))):
            text = with_a_fault(text, rng)
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", RobotWarning)
                made = load_robot(text)
        except GaitoptError as error:
            assert str(error) and "\n" not in str(error)
            refused += 1
            continue
        read += 1
        assert not nonsense(made)
    assert read > 3 and refused > 5
