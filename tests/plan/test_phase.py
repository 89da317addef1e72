"""What phases, their limits and their evidence take, and what they refuse."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gaitopt.conventions import LEGS, frozen
from gaitopt.errors import InputError
from gaitopt.plan.phase import CogEvidence, Limit, Phase


def a_phase(**changes: Any) -> Phase:
    """A stance phase, with some fields changed."""
    fields: dict[str, Any] = {
        "kind": "stance", "leg": "RH", "step": 0, "start": 0.0, "duration": 1.0,
        "cog_start": np.zeros(3), "cog_end": np.ones(3), "support": LEGS,
        "foot_start": np.zeros(3), "foot_end": np.zeros(3), "margin": 0.02,
    }  # fmt: skip
    return Phase(**{**fields, **changes})


def test_places_that_nobody_can_change_are_kept_as_they_are() -> None:
    rows = list(frozen(np.arange(6.0).reshape(2, 3)))
    phase = a_phase(cog_start=rows[0], cog_end=rows[1])
    assert phase.cog_start is rows[0]
    with pytest.raises(ValueError, match="read-only"):
        phase.cog_end[0] = 1.0


def test_places_that_somebody_may_change_are_copied() -> None:
    mine = np.zeros((2, 3))
    view = mine[0]
    view.setflags(write=False)  # its owner can still write
    phase = a_phase(cog_start=view)
    mine[0] = 7.0
    assert phase.cog_start.tolist() == [0.0, 0.0, 0.0]


@pytest.mark.parametrize(
    "changes",
    [
        {"cog_start": frozen([0.0, np.nan, 0.0])}, {"foot_end": frozen(np.zeros(4))},
        {"support": tuple(np.full((4, 3), np.nan))}, {"support": ("LF", "LF", "RF")},
        {"margin": np.nan}, {"duration": "1"}, {"limited_by": (1,)}, {"evidence": 3},
    ],
)  # fmt: skip
def test_what_is_no_phase_is_refused(changes: dict[str, Any]) -> None:
    with pytest.raises(InputError):
        a_phase(**changes)


@pytest.mark.parametrize(
    "given",
    [
        (1, "LF", 0.5), ("reach", None, 0.5), ("reach", "LF", "0.5"), ("reach", "LF", 0.5, (1.0,)),
        ("reach", "LF", 0.5, ((0.0, 1.0, 2.0),)), ("reach", "LF", 0.5, ((0.0, "1"),)),
    ],
)  # fmt: skip
def test_what_is_no_limit_is_refused(given: tuple[Any, ...]) -> None:
    with pytest.raises(InputError):
        Limit(*given)


def test_spans_of_limits_become_tuples() -> None:
    given: Any = [[0.0, np.float64(1.0)], (2, 3)]
    assert Limit("speed", "1 m/s", 0.5, given).spans == ((0.0, 1.0), (2, 3))


@pytest.mark.parametrize(
    "changes", [{"primal": "0"}, {"iterations": None}, {"multipliers": {"reach LF": True}}]
)
def test_evidence_without_numbers_is_refused(changes: dict[str, Any]) -> None:
    fields: dict[str, Any] = {
        "status": "solved", "objective": "distance", "multipliers": {"reach LF": 0.1},
        "primal": 0.0, "stationarity": 0.0, "complementarity": 0.0, "error_bound": 0.0,
        "iterations": 1,
    }  # fmt: skip
    assert CogEvidence(**fields).multipliers["reach LF"] == 0.1
    with pytest.raises(InputError, match="evidence"):
        CogEvidence(**{**fields, **changes})
