"""Which middles between places of a grid are looked at, and what is found there."""

from __future__ import annotations

import numpy as np
import pytest
from timings import Pair

from gaitopt import ForceLimits
from gaitopt.motion.path import MotionPath
from gaitopt.retiming import corners
from gaitopt.retiming import middles as between
from gaitopt.retiming.middles import bent, without_forces
from gaitopt.retiming.other_limits import OtherLimits
from gaitopt.retiming.pacing import Pacing
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


def test_forces_that_are_missing_beside_the_middle_are_found(
    pairs: dict[str, Pair], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The body falls like a stone at a sixth of one interval, and is pushed up in its middle.

    ``d2/du2 u^3 (1 - u)^3 = 6 w (1 - 5 w)`` with ``w = u (1 - u)`` is 0 at both ends, -3/8 in the
    middle, and 55/216 at a sixth.
    """
    pacing = Pacing.of(pairs["go2"].old, ForceLimits(), OtherLimits(), 0.4)
    motion, _ = pacing.fastest()
    path = motion.path()
    all_four = np.flatnonzero(pacing.course.standing[pacing.grid.piece].all(axis=1))
    own = all_four[[len(all_four) // 2]]
    assert not without_forces(motion, path, own, ForceLimits()).any()
    segment = int(np.searchsorted(path.times, motion.times[own[0]] + 1e-9)) - 1
    length = float(path.times[segment + 1] - path.times[segment])
    assert length == pytest.approx(motion.times[own[0] + 1] - motion.times[own[0]], rel=1e-6)
    coefficients = np.pad(path.coefficients, ((1, 0), (0, 0), (0, 0)))
    # u^3 (1 - u)^3 = -u^6 + 3 u^5 - 3 u^4 + u^3
    bump = np.array([-1.0, 3.0, -3.0, 1.0]) / length ** np.array([6, 5, 4, 3])
    coefficients[:4, segment, 2] -= 9.81 * 216.0 / 55.0 * length**2 * bump
    moved = MotionPath(path.times, coefficients)
    at = path.times[segment] + length * np.array([1.0 / 6.0, 0.5])
    more = (moved.evaluate(at, 2) - path.evaluate(at, 2))[:, 2]
    assert more == pytest.approx(9.81 * np.array([-1.0, 0.375 * 216.0 / 55.0]))
    assert without_forces(motion, moved, own, ForceLimits()).all()
    monkeypatch.setattr(between, "BETWEEN", (0.5,))
    monkeypatch.setattr(between, "THIRDS", ())
    assert not without_forces(motion, moved, own, ForceLimits()).any()


def test_forces_that_are_missing_at_a_third_are_found(
    pairs: dict[str, Pair], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The body falls like a stone at a third of one interval, where nothing else is unusual.

    ``d2/du2 u^3 (1 - u)^3 (1 - 2 u) = 6 w (1 - 2 u) (1 - 7 w)`` with ``w = u (1 - u)`` is 0 at both
    ends and in the middle, -20/81 at a third, and only 5/324 at a sixth.
    """
    pacing = Pacing.of(pairs["go2"].old, ForceLimits(), OtherLimits(), 0.4)
    motion, _ = pacing.fastest()
    path = motion.path()
    all_four = np.flatnonzero(pacing.course.standing[pacing.grid.piece].all(axis=1))
    own = all_four[[len(all_four) // 2]]
    segment = int(np.searchsorted(path.times, motion.times[own[0]] + 1e-9)) - 1
    length = float(path.times[segment + 1] - path.times[segment])
    coefficients = np.pad(path.coefficients, ((2, 0), (0, 0), (0, 0)))
    # u^3 (1 - u)^3 (1 - 2 u) = 2 u^7 - 7 u^6 + 9 u^5 - 5 u^4 + u^3
    bump = np.array([2.0, -7.0, 9.0, -5.0, 1.0]) / length ** np.array([7, 6, 5, 4, 3])
    coefficients[:5, segment, 2] += 9.81 * 81.0 / 20.0 * length**2 * bump
    moved = MotionPath(path.times, coefficients)
    at = path.times[segment] + length * np.array([1.0 / 6.0, 1.0 / 3.0, 0.5])
    more = (moved.evaluate(at, 2) - path.evaluate(at, 2))[:, 2]
    assert more == pytest.approx(9.81 * np.array([1.0 / 16.0, -1.0, 0.0]), abs=1e-6)
    # The motion uses all that its own limits allow, and at five sixths it falls by 1/16 of gravity.
    wider = ForceLimits(friction=0.9, reserve=0.01, torque_share=1.0)
    assert without_forces(motion, moved, own, wider).all()
    monkeypatch.setattr(between, "THIRDS", ())
    assert not without_forces(motion, moved, own, wider).any()
