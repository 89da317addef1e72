"""Colours of the legs can be told apart, by colour-blind readers as well."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest

from gaitopt.conventions import LEGS, FloatArray
from gaitopt.viewing.colours import BACKGROUND, LEG_COLOURS, LEG_WORDS

VISION = {
    "all cones": np.eye(3),
    "protanopia": [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216],
                   [-0.003882, -0.048116, 1.051998]],
    "deuteranopia": [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413],
                     [-0.011820, 0.042940, 0.968881]],
    "tritanopia": [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602],
                   [0.004733, 0.691367, 0.303900]],
}  # fmt: skip
"""Matrices of [Machado2009] for linear RGB, with a severity of 1."""
XYZ = np.array([[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.0721750],
                [0.0193339, 0.1191920, 0.9503041]])  # fmt: skip
"""From linear sRGB to CIE XYZ (IEC 61966-2-1)."""


def linear(colour: str) -> FloatArray:
    """Linear RGB of ``"#rrggbb"``."""
    parts = np.array([int(colour[i : i + 2], 16) for i in (1, 3, 5)]) / 255.0
    return np.where(parts <= 0.04045, parts / 12.92, ((parts + 0.055) / 1.055) ** 2.4)


def lab(rgb: FloatArray) -> FloatArray:
    """CIELAB of linear RGB, with the white of sRGB."""
    x = XYZ @ np.clip(rgb, 0.0, 1.0) / XYZ.sum(axis=1)
    f = np.where(x > (6 / 29) ** 3, np.cbrt(x), x * (29 / 6) ** 2 / 3 + 4 / 29)
    return np.array([116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])])


def differences(colours: dict[str, str], vision: str) -> dict[tuple[str, str], float]:
    """Delta E of 1976 of every pair."""
    seen = {name: lab(np.asarray(VISION[vision]) @ linear(c)) for name, c in colours.items()}
    return {(a, b): float(np.linalg.norm(seen[a] - seen[b])) for a, b in combinations(seen, 2)}


def test_the_measure_is_right() -> None:
    """Black and white are 100 apart; red and green of the old pages were 17 for deuteranopes."""
    ends = differences({"white": "#ffffff", "black": "#000000"}, "all cones")
    assert ends["white", "black"] == pytest.approx(100.0, abs=1e-3)
    old = differences({"RH": "#2e9e5b", "LF": "#d1383d"}, "deuteranopia")
    assert old["RH", "LF"] == pytest.approx(17.0, abs=0.1)


@pytest.mark.parametrize("vision", VISION)
def test_legs_and_background_can_be_told_apart(vision: str) -> None:
    shown = {**LEG_COLOURS, "background": BACKGROUND}
    pair, least = min(differences(shown, vision).items(), key=lambda found: found[1])
    assert least > 30.0, pair


def test_every_leg_has_a_colour_and_a_name() -> None:
    assert set(LEG_COLOURS) == set(LEG_WORDS) == set(LEGS)
