"""What a plan states of itself: phases that must agree with its path, and what nobody judges.

Figures, replays and labels read the places of the body and the feet from the phases. So a phase
that says something else than the path is a fault, although the robot follows the path alone.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import isnan
from typing import Final

import numpy as np

from gaitopt.certificate.check import JUMP, Check, judged, phase_name, unchecked
from gaitopt.certificate.trace import Motion
from gaitopt.conventions import LEGS
from gaitopt.plan.phase import Phase
from gaitopt.plan.plan import Plan
from gaitopt.robots.quadruped import Quadruped

NAME: Final = "phases agree with the path"
ROBOT: Final = "the robot's own file"
NOT_JUDGED: Final = "not judged"
STATEMENTS: Final = (
    "margins of single phases and what holds them back, what the planner tells of its work, "
    "postures and places that footholds want of the body, and settings that promise nothing: body "
    "height, heading, speed, objective, the curve of the swings, numbers of knots and rounds, the "
    "velocity and times of a gait"
)
"""What a plan file holds beside its path and its promises; see docs/trust.md."""
OPEN: Final = "the ground beside the footholds, of which the plan knows no columns and no map"
"""Where nothing says what legs and trunk could touch."""
NO_OBSTACLE: Final = "obstacles, of which the plan knows none"
"""Where somebody may have taken one away from a stride."""
ZMP: Final = "the ZMP's margin that the planner tells of"
"""Where contact forces are promised, and checked in its place."""


def phases_agree(plan: Plan, motion: Motion) -> Check:
    """Body centre and foot are where each phase says, at its begin and at its end.

    Planners write both from the same numbers: they agree to 1e-15 m. The leg and the step of a
    phase are those of a foot that flies then, or of the next one that does.
    """
    wrong = _wrong_step(plan)
    if wrong is not None:
        where = f"{phase_name(plan, wrong)}: another leg or step flies then, or next"
        return judged(NAME, np.inf, JUMP, "m", when=plan.phases[wrong].start, where=where)
    worst, when, where = 0.0, float("nan"), ""
    flights = {
        (swing.leg, index): swing.phases
        for swing in plan.swings
        for index in range(swing.phases[0], swing.phases[1] + 1)
    }
    for index, phase in enumerate(plan.phases):
        gap = max(_gap_of_centre(phase, motion, index), _gap_of_foot(phase, motion, index, flights))
        # What cannot be compared (NaN) is no agreement.
        if not gap <= worst:
            worst, when, where = gap, phase.start, phase_name(plan, index)
        if isnan(gap):
            break
    return judged(NAME, worst, JUMP, "m", when=when, where=where)


def _wrong_step(plan: Plan) -> int | None:
    """Index of the first phase whose leg and step are not those of its flight, or the next one."""
    flying: list[set[tuple[str, int]]] = [set() for _ in plan.phases]
    for swing in plan.swings:
        for index in range(swing.phases[0], swing.phases[1] + 1):
            flying[index].add((swing.leg, swing.step))
    following, wrong = {("", len(plan.swings))}, None
    for index in reversed(range(len(plan.phases))):
        following = flying[index] or following
        phase = plan.phases[index]
        if (phase.leg, phase.step) not in following:
            wrong = index
    return wrong


def _gap_of_centre(phase: Phase, motion: Motion, index: int) -> float:
    """How far the body centre is from where a phase has it, at most [m]."""
    first, last = _ends(motion, index, index)
    stated = ((phase.cog_start, motion.cog[first]), (phase.cog_end, motion.cog[last]))
    return max(float(np.linalg.norm(said - found)) for said, found in stated)


def _gap_of_foot(
    phase: Phase, motion: Motion, index: int, flights: Mapping[tuple[str, int], tuple[int, int]]
) -> float:
    """How far a phase's leg has its foot from where it says, before and after its flight [m].

    A flight lasts several phases where other feet land or lift off meanwhile: ``flights`` has the
    first and the last of them by leg and phase.
    """
    if not phase.leg:
        return 0.0
    begin, end = flights.get((phase.leg, index), (index, index))
    first, last = _ends(motion, begin, end)
    leg = LEGS.index(phase.leg)
    stated = (
        (phase.foot_start, motion.feet[first][leg]),
        (phase.foot_end, motion.feet[last][leg]),
    )
    return max(float(np.linalg.norm(said - found)) for said, found in stated)


def _ends(motion: Motion, begin: int, end: int) -> tuple[tuple[int, int], tuple[int, int]]:
    """Where the samples at the begin of one phase and at the end of another lie."""
    after = int(np.searchsorted(motion.phase, begin))
    beyond = int(np.searchsorted(motion.phase, end, side="right"))
    if beyond > after:
        return (0, after), (1, beyond - 1)
    # Phases of 0 s: both ends are the instant at which the next piece begins.
    instant = (0, after) if after < len(motion.phase) else (1, after - 1)
    return instant, instant


def not_judged(plan: Plan) -> Check:
    """A line that says what the certificate does not look at."""
    settings = plan.settings
    known = plan.footholds.ground is not None or plan.footholds.radius is not None
    told = [
        STATEMENTS,
        *([] if known else [OPEN]),
        *([NO_OBSTACLE] if settings.planner == "stride" and not settings.obstacles else []),
        *([ZMP] if settings.promised_forces and plan.record.zmp_margin is not None else []),
    ]
    return unchecked(NOT_JUDGED, "", "; ".join(told), needed=False)


def not_compared(robot: Quadruped) -> Check:
    """A line that says that the robot inside the plan was compared with no other file."""
    note = (
        f"lengths, masses and limits are those of the URDF inside the plan, which was compared "
        f"with no other: no robot named {robot.name!a} is known here; give the robot or its file"
    )
    return unchecked(ROBOT, "", note, needed=False)
