"""Which middles between places of a grid are looked at, and what is found there."""

from __future__ import annotations

import numpy as np
import pytest
from timings import Pair

from gaitopt import ForceLimits
from gaitopt.retiming import corners
from gaitopt.retiming.middles import bent, without_forces
from gaitopt.retiming.pacing import OtherLimits, Pacing
from gaitopt.retiming.reserves import MIDDLE_SHARE, tightened


@pytest.mark.parametrize("name", ["go2", "anymal_c"])
def test_middles_that_are_not_looked_at_have_forces(pairs: dict[str, Pair], name: str) -> None:
    """With corners too sharp for the grid, so that many intervals bend."""
    pacing = Pacing.of(pairs[name].old, ForceLimits(), OtherLimits(), 0.1)
    motion, _ = pacing.fastest()
    assert pacing.dynamics is not None
    looked = bent(motion, pacing.places, pacing.dynamics)
    assert 0.1 < looked.mean() < 0.9
    missing = without_forces(
        motion, motion.path(), np.flatnonzero(~looked), tightened(ForceLimits(), MIDDLE_SHARE)
    )
    assert not missing.any()


@pytest.fixture
def coarse(pairs: dict[str, Pair], monkeypatch: pytest.MonkeyPatch) -> Pacing:
    """With so few intervals of a rounded corner that forces are missing between their ends."""
    monkeypatch.setattr(corners, "CORNER_INTERVALS", 10)
    return Pacing.of(pairs["go2"].old, ForceLimits(), OtherLimits(), 0.4)


def test_forces_are_missing_in_middles_that_bend(coarse: Pacing) -> None:
    motion, found = coarse.fastest()
    assert coarse.dynamics is not None
    limits = tightened(ForceLimits(), MIDDLE_SHARE)
    missing = without_forces(motion, motion.path(), np.arange(len(motion.begin)), limits)
    assert missing.any() and bent(motion, coarse.places, coarse.dynamics)[missing].all()
    slower = coarse.slowed(motion, motion.path(), found)
    assert slower is not None and not slower.good[missing].any()
    assert slower.fastest()[0].times[-1] > motion.times[-1]


def test_only_chains_that_are_slowed_are_timed_anew(coarse: Pacing) -> None:
    motion, found = coarse.fastest()
    slower = coarse.slowed(motion, motion.path(), found)
    assert slower is not None and 0 < slower.good.sum() < len(slower.good)
    again, _ = slower.fastest()
    assert np.array_equal(again.begin[slower.good], motion.begin[slower.good])
    assert not np.array_equal(again.begin, motion.begin)
