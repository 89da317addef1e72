"""What is kept back from promised limits, for what happens between the places of a grid."""

from __future__ import annotations

from dataclasses import replace

from gaitopt.dynamics.contacts import ForceLimits, TorqueLine

FRICTION_SLACK = 0.004
"""What every side of a friction pyramid keeps on the grid, as a share of the weight, for what
happens between its places: a share of the friction of a foot that carries little is next to
nothing."""
PLANNED_SHARE = 0.02
"""Share by which forces are planned within tighter limits than are promised at places of the grid,
for what happens between them. The certificate judges every plan anew."""
MIDDLE_SHARE = 0.005
"""The same in the middle between two places: what exceeds that is timed anew."""


def tightened(limits: ForceLimits, share: float) -> ForceLimits:
    """Limits that leave a reserve.

    Args:
        limits: that are promised.
        share: of friction and torques, and of the speeds at which torques fall; a tenth of it of
            the weight.
    """
    left, line = 1.0 - share, limits.torque_line
    on_four = limits.reserve / 2.0 if limits.reserve_on_four is None else limits.reserve_on_four
    return replace(
        limits,
        friction=left * limits.friction,
        reserve=limits.reserve + 0.1 * share,
        reserve_on_four=on_four + 0.1 * share,
        torque_share=left * limits.torque_share,
        torque_line=None if line is None else TorqueLine(left * line.knee, left * line.no_load),
    )
