"""Swing curves by name."""

from __future__ import annotations

import numpy as np
import pytest

from gaitopt.errors import InputError
from gaitopt.swing.catalogue import SWING_CURVES, swing_curve
from gaitopt.swing.curve import SwingCurve
from gaitopt.swing.trapezoid import TrapezoidSwing

SWING = np.zeros(3), np.array([0.2, 0.0, 0.0]), 0.07, 0.5


def test_catalogue_names_the_six_curves() -> None:
    assert tuple(SWING_CURVES) == (
        "box", "cycloid", "sine arch", "half-ellipse", "polynomial", "trapezoid",
    )  # fmt: skip


@pytest.mark.parametrize("name", SWING_CURVES)
def test_a_curve_is_of_the_class_with_its_name(name: str) -> None:
    curve = swing_curve(name, *SWING)
    assert type(curve) is SWING_CURVES[name]
    assert curve.smoothness in (0, 1, 2) and curve.rest_order in (0, 1, 2)


def test_no_two_curves_are_the_same() -> None:
    t = np.linspace(0.0, 0.5, 11)
    paths = [swing_curve(name, *SWING).position(t).tobytes() for name in SWING_CURVES]
    assert len(set(paths)) == len(paths)


def test_options_reach_their_curve() -> None:
    curve = swing_curve("trapezoid", *SWING, ramp=0.1)
    assert isinstance(curve, TrapezoidSwing) and curve.ramp == 0.1


@pytest.mark.parametrize("name", ["ellipse", "Box", "", None, ["box"]])
def test_unknown_names_are_answered_with_the_known_ones(name: object) -> None:
    with pytest.raises(InputError) as caught:
        swing_curve(name, *SWING)  # type: ignore[arg-type]
    assert str(caught.value) == (
        "swing must be one of box, cycloid, sine arch, half-ellipse, polynomial, "
        f"trapezoid, got {name!r}"
    )


def test_unknown_options_are_answered_with_the_known_ones() -> None:
    with pytest.raises(InputError) as caught:
        swing_curve("trapezoid", *SWING, rampe=0.1)
    assert str(caught.value) == "swing 'trapezoid' has no option 'rampe'; its options: ramp"
    with pytest.raises(InputError) as caught:
        swing_curve("box", *SWING, ramp=0.1)
    assert str(caught.value) == "swing 'box' has no option 'ramp'; its options: none"


def test_catalogue_cannot_be_changed_by_accident() -> None:
    with pytest.raises(TypeError):
        SWING_CURVES["moonwalk"] = SwingCurve  # type: ignore[index]
