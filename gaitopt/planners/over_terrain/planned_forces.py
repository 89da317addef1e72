"""The limits of contact forces that walks over a map are searched and planned with."""

from __future__ import annotations

from gaitopt.dynamics.contacts import ForceLimits

SIDES = 8
"""Sides of the friction pyramids where no limits of forces are given: with four a slope of 25
degrees leaves little of a friction of 0.7, and eight steps up it take 13.2 s in place of 2.4 s."""
FRICTION_SHARE = 0.85
"""Share of the ground's friction that forces are planned with where no limits of forces are given.
Chosen: errors of the body, and feet that roll, need forces beside the planned ones. With all of it
feet of go2 and anymal_c slid by up to 34 mm on ground that is just as slippery."""
TRANSFER_TIME = 0.05
"""Time in which a foot takes over the robot's weight where no limits of forces are given [s].
Chosen: walks over rubble, stairs and ramps take 1 % longer by that, and their bodies are off their
plans by 3 to 8 mm in place of 7 to 10 mm in physics."""
RESERVE, RESERVE_ON_FOUR = 0.03, 0.02
"""Least normal forces where no limits of forces are given, as shares of the weight. Chosen: with 2
and 1 % a hind foot of anymal_c lost its contact for 50 ms down stairs; walks take 3 % longer."""


def usual_forces(friction: float) -> ForceLimits:
    """The limits where none are given, on ground with this coefficient of friction."""
    return ForceLimits(
        friction=FRICTION_SHARE * friction, sides=SIDES, transfer_time=TRANSFER_TIME,
        reserve=RESERVE, reserve_on_four=RESERVE_ON_FOUR,
    )  # fmt: skip
