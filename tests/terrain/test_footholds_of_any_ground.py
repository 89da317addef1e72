"""Footholds with normals, friction, ground, order, swing heights and postures."""

from __future__ import annotations

import pickle
from typing import Any

import numpy as np
import pytest

import gaitopt
from gaitopt import LEGS, Footholds, FootholdsError, HeightMap

COUNTS = {"LF": 2, "LH": 1, "RH": 3, "RF": 2}
POINTS = {leg: np.arange(3.0 * n).reshape(n, 3) for leg, n in COUNTS.items()}
ORDER = ("RH", "LF", "RF", "RH")


def full(**changes: Any) -> Footholds:
    """Footholds with everything that may be told of them."""
    told: dict[str, Any] = {
        "normals": {leg: np.tile([0.6, 0.0, 0.8], (n, 1)) for leg, n in COUNTS.items()},
        "friction": {leg: np.full(n, 0.5) for leg, n in COUNTS.items()},
        "ground": HeightMap(np.zeros((3, 3)), 0.5),
        "order": ORDER,
        "swing_heights": {leg: np.full(n - 1, 0.05) for leg, n in COUNTS.items()},
        "postures": np.zeros((5, 4)),
        "body_places": np.ones((5, 2)),
    }
    return Footholds(POINTS, None, **{**told, **changes})


def test_legs_may_take_unequal_numbers_of_steps() -> None:
    footholds = full()
    assert footholds.steps == 4 and len(footholds) == 3
    assert dict(footholds.counts) == COUNTS
    # The last foothold of a leg is repeated.
    assert footholds.array.shape == (4, 3, 3)
    assert (footholds.array[LEGS.index("LH")] == POINTS["LH"][0]).all()
    assert repr(footholds) == "Footholds(1 to 3 a leg, 4 steps, a height map)"


def test_a_ball_touches_beside_its_lowest_point() -> None:
    footholds = full()
    touching = footholds.touching(0.02)
    assert np.allclose(footholds.array - touching, [0.012, 0.0, 0.016])
    level = gaitopt.s_columns(0, columns=2)
    assert np.allclose(level.array - level.touching(0.02), [0.0, 0.0, 0.02])


def test_all_is_kept_and_compared() -> None:
    footholds = full()
    assert pickle.loads(pickle.dumps(footholds)) == footholds == footholds.with_()
    for name, other in (("order", ("LF", "RH", "RF", "RH")), ("friction", 0.6), ("normals", None),
                        ("ground", None), ("postures", None), ("swing_heights", None),
                        ("body_places", None)):  # fmt: skip
        assert footholds.with_(**{name: other}) != footholds


def test_a_plan_file_keeps_all(tmp_path: Any) -> None:
    plan = gaitopt.plan_crawl(
        gaitopt.load_robot("wang2020"), gaitopt.s_columns(0, columns=2), timing="velocity"
    )
    from dataclasses import replace

    told = replace(plan, footholds=full())
    told.save(tmp_path / "plan.npz")
    assert gaitopt.load_plan(tmp_path / "plan.npz").footholds == full()


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"order": ("RH", "LF", "RF")}, "in the order RH steps 1 times, and it has 3 footholds"),
        ({"order": ("RH", "LF", "RF", "XX")}, "unknown leg: 'XX'"),
        ({"order": None}, "every leg needs the same number"),
        ({"friction": 0.0}, r"friction must be from 0.001 to 10, got 0\.0"),
        ({"friction": {"LF": [1.0]}}, "missing: LH, RH, RF"),
        ({"ground": np.zeros((3, 3))}, "ground must be a HeightMap"),
        ({"postures": np.zeros((4, 4))}, r"shape \(5, 4\)"),
        ({"postures": np.full((5, 4), np.nan)}, "finite"),
        ({"body_places": np.zeros((4, 2))}, r"shape \(5, 2\)"),
        ({"normals": {leg: np.ones((n, 3)) for leg, n in COUNTS.items()}}, "length 1"),
        ({"normals": {leg: np.tile([1.0, 0, 0], (n, 1)) for leg, n in COUNTS.items()}}, "point up"),
        ({"swing_heights": {leg: [-0.1] * (n - 1) for leg, n in COUNTS.items()}},
         "swing_heights 0 of LF is -0.1"),
    ],
)  # fmt: skip
def test_what_does_not_fit_is_refused(changes: dict[str, Any], words: str) -> None:
    with pytest.raises(FootholdsError, match=words):
        full(**changes)
