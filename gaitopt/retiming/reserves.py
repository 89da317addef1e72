"""What is kept back from promised limits, for what happens between the places of a grid."""

from __future__ import annotations

from dataclasses import replace

from gaitopt.dynamics.contacts import (
    LARGEST_RESERVE,
    LARGEST_RESERVE_ON_FOUR,
    LEAST_SHARE,
    ForceLimits,
)

FRICTION_SLACK = 0.004
"""What every side of a friction pyramid keeps on the grid, as a share of the weight, for what
happens between its places: a share of the friction of a foot that carries little is next to
nothing."""
PLANNED_SHARE = 0.02
"""Share by which forces are planned within tighter limits than are promised at places of the grid,
for what happens between them. The certificate judges every plan anew."""
MIDDLE_SHARE = 0.005
"""The same between two places: what exceeds that is timed anew."""
SHARE_OF_WEIGHT = 0.1
"""What is kept back of normal forces for each share of the other limits, as a share of the
weight."""


def tightened(limits: ForceLimits, share: float) -> ForceLimits:
    """Limits that leave a reserve, as far as there is one: no limit leaves its range.

    Args:
        limits: that are promised.
        share: of friction and torques, and of the speeds at which torques fall; a tenth of it of
            the weight.
    """
    left = 1.0 - share
    on_four = limits.reserve / 2.0 if limits.reserve_on_four is None else limits.reserve_on_four
    return replace(
        limits,
        friction=max(left * limits.friction, LEAST_SHARE),
        reserve=min(limits.reserve + SHARE_OF_WEIGHT * share, LARGEST_RESERVE),
        reserve_on_four=min(on_four + SHARE_OF_WEIGHT * share, LARGEST_RESERVE_ON_FOUR),
        torque_share=max(left * limits.torque_share, LEAST_SHARE),
        speed_share=max(left * limits.speed_share, LEAST_SHARE),
    )
