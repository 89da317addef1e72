"""Crosses at the footholds that were missed."""

from __future__ import annotations

from typing import Final

import numpy as np

from gaitopt.plan.plan import Plan
from gaitopt.viewing.replay.scene import Appearance, FramePath, Node, Part, Scene, Tubes

MISSED: Final[FramePath] = ("missed",)
ALARM = "#b00020"
"""Colour of what went wrong."""
ARM, WIDTH, RAISED = 0.035, 0.0035, 0.004
"""Half the length of an arm, its radius, and its height above the foothold [m]. Chosen: longer than
the discs and columns at footholds are wide, so that a foot does not hide it."""


def missed_scene(plan: Plan, steps: tuple[int, ...]) -> Scene:
    """A cross at the foothold of each of the plan's ``steps`` that was missed."""
    up = np.array([0.0, 0.0, RAISED - plan.robot.foot_radius])
    arms = [ARM * np.array([[1.0, 1.0, 0.0], [-1.0, -1.0, 0.0]]),
            ARM * np.array([[1.0, -1.0, 0.0], [-1.0, 1.0, 0.0]])]  # fmt: skip
    ends = {swing.step: swing.foot_end for swing in plan.swings}
    lines = tuple(ends[step] + up + arm for step in steps if step in ends for arm in arms)
    if not lines:
        return Scene(())
    look = Appearance(ALARM, lit=False, casts_shadow=False, layer=9)
    return Scene((Node(MISSED, (Part(Tubes(lines, WIDTH), look),)),))
