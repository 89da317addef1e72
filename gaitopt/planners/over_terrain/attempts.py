"""The ways in which a step is tried: with the body higher, lower or pitched, and a lower swing."""

from __future__ import annotations

from typing import NamedTuple


class Attempt(NamedTuple):
    """One way to make a step.

    Attributes:
        height: of the body, as a share of the usual height.
        pitch: of the body, beyond that of the plane through the feet [rad].
        low: whether the foot only clears the ground, and does not rise by ``swing_height``.
        places: of the body that are tried at most.
    """

    height: float
    pitch: float = 0.0
    low: bool = True
    places: int = 8


ATTEMPTS = (Attempt(1.0, low=False), Attempt(0.92), Attempt(1.06), Attempt(0.84))
"""Ways that are tried one after the other while many steps are not possible. Chosen: a lower body
reaches footholds farther down, a higher one lifts limbs over stones, and a leg that lifts its foot
less comes less near to the step behind it."""
RARE_ATTEMPTS = (
    Attempt(1.0, -0.15), Attempt(1.0, 0.15), Attempt(0.88),
    Attempt(0.92, -0.15), Attempt(0.92, 0.15),
)  # fmt: skip
"""Ways that are tried where hardly any step is possible. Chosen: of nine heights and pitches those
that made steps possible on stairs of 12 cm and rubble of 15 cm (go2)."""
