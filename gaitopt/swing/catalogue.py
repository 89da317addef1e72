"""All swing curves by name."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from types import MappingProxyType
from typing import Any, Final

from numpy.typing import ArrayLike

from gaitopt.errors import InputError
from gaitopt.inputs import check_choice
from gaitopt.swing.box_curve import BoxSwing
from gaitopt.swing.curve import SwingCurve
from gaitopt.swing.cycloid import CycloidSwing
from gaitopt.swing.ellipse import HalfEllipseSwing
from gaitopt.swing.obstacle_paths import Pattern
from gaitopt.swing.polynomial import PolynomialSwing
from gaitopt.swing.sine_arch import SineArchSwing
from gaitopt.swing.trapezoid import TrapezoidSwing

SWING_CURVES: Final[Mapping[str, type[SwingCurve]]] = MappingProxyType(
    {
        "box": BoxSwing,
        "cycloid": CycloidSwing,
        "sine arch": SineArchSwing,
        "half-ellipse": HalfEllipseSwing,
        "polynomial": PolynomialSwing,
        "trapezoid": TrapezoidSwing,
    }
)
"""The swing curves by name."""


def swing_curve(
    name: str,
    start: ArrayLike,
    end: ArrayLike,
    height: ArrayLike,
    duration: ArrayLike,
    **options: Any,
) -> SwingCurve:
    """The swing curve ``name``, for one swing or many at once.

    Args:
        name: one of :data:`SWING_CURVES`.
        start: where the feet lift off ``(..., 3)`` [m].
        end: where they touch down ``(..., 3)`` [m].
        height: swing height above the higher of the two ends ``(...)`` [m], 0 or more.
        duration: time in the air ``(...)`` [s].
        options: the curve's own settings: ``ramp`` of the trapezoid.

    Raises:
        InputError: no curve has this name, it has no such option, or a value is not what
            :class:`~gaitopt.swing.curve.SwingCurve` asks for.
    """
    check_choice("swing", name, SWING_CURVES)
    curve = SWING_CURVES[name]
    own = [f.name for f in fields(curve)][len(fields(SwingCurve)) :]
    for option in options:
        if option not in own:
            raise InputError(
                f"swing {name!r} has no option {option!r}; its options: {', '.join(own) or 'none'}"
            )
    return curve(start, end, height, duration, **options)  # type: ignore[arg-type]


PATTERNS: Final[dict[str, Pattern]] = {
    "trapezoid path": "trapezoid",
    "parabola path": "parabola",
}
"""Paths over an obstacle of [Shao2011], Fig. 3, as swings of a crawl."""
SWINGS: Final = (*SWING_CURVES, *PATTERNS)
"""Names of all swings of a crawl."""
