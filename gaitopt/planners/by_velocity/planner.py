"""``plan_gait``: plan walk, trot and other gaits by velocity, from standing to standing.

Sources: [Wang2024], [XiLing]; with contact forces also [Kajita2003].
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from gaitopt.conventions import LEGS, FloatArray, Progress
from gaitopt.entering.ending import ended
from gaitopt.entering.entered import shifted
from gaitopt.entering.standing_up import body_yaw, footholds_of
from gaitopt.entering.walking import plan_from_state
from gaitopt.errors import InputError
from gaitopt.gait.schedule import GaitSchedule
from gaitopt.gait.step_timing import adapted_step_time, cycles_spanned
from gaitopt.inputs import check_kind
from gaitopt.plan.plan import Plan
from gaitopt.plan.settings.by_velocity import GaitSettings
from gaitopt.plan.settings.keywords import chosen_settings, takes_settings
from gaitopt.plan.state import State
from gaitopt.planners.by_velocity.ahead import why_not_ahead
from gaitopt.planners.by_velocity.attempt import attempt
from gaitopt.planners.by_velocity.limits import explain
from gaitopt.planners.by_velocity.motion import GaitMotion
from gaitopt.planners.by_velocity.phases import gait_phases, smallest_zmp_margin
from gaitopt.robots.abilities import require_joints_that_feel
from gaitopt.robots.quadruped import Quadruped
from gaitopt.swing.catalogue import SWING_CURVES, swing_curve
from gaitopt.terrain.footholds import Footholds

MARGIN_SAMPLES = 101
"""Instants of a cycle at which its ZMP margin is computed. Chosen here: a hundredth of a cycle
apart, several in each phase."""


@takes_settings(GaitSettings, distance=float, duration=float, ramp=float)
def plan_gait(
    robot: Quadruped,
    schedule: GaitSchedule,
    settings: GaitSettings | None = None,
    *,
    progress: Progress | None = None,
    start: State | None = None,
    end: State | None = None,
    **options: Any,
) -> Plan:
    """Plan a gait at a commanded velocity on level ground.

    The robot starts standing with its feet below its hips, accelerates, walks at the commanded
    velocity, slows down, and stops on four feet. Standing feet are fixed in the world. Each
    foothold is the foot's nominal place under the body in the middle of its stance. So the foot
    touches down ahead of that place by half the stance time times the velocity ([Wang2024],
    eqs. (15) and (16), as corrected in ``docs/papers.md``).

    Args:
        robot: from :func:`gaitopt.load_robot`.
        schedule: the gait, :func:`gaitopt.trot` for instance.
        settings: all settings as one object, with the same schedule. By default they fit the
            robot.
        progress: called with (stages done, stages in all).
        start: the state in which the plan begins (:class:`gaitopt.State`). The robot first comes to
            rest on four feet, as in :func:`gaitopt.plan_stand_up`, and walks on from there: its
            first footholds are where its feet then stand, and it goes in the direction that the
            body faces where no ``heading`` is given. Feet need level ground. By default the robot
            stands at the origin, with its feet below its hips.
        end: the state in which the plan ends: at rest on the last footholds, with the body where it
            has it. The gait chooses its footholds, so the same call without ``end`` tells them. By
            default the body stays where the gait stops.
        options: single settings by name: the fields of :class:`gaitopt.GaitSettings`, and
            ``distance`` [m] or ``duration`` [s] at full speed, and ``ramp`` [s]; see
            :meth:`gaitopt.GaitSettings.for_robot`. ``velocity`` is forward and sideways in the
            body's axes, or a forward velocity alone [m/s].

    With ``timing="forces"`` the body leaves its straight way a little, so that contact forces and
    joint torques within ``forces`` make the motion of the whole robot at every instant. On two
    feet the ZMP of the whole robot is on the line between them, to within
    :attr:`gaitopt.ForceLimits.balance_tolerance`. The body is level, at one height, if that can be.
    Where no foot stands for a time it cannot: the robot then falls freely, and keeps its angular
    momentum. So in gaits with flight the body rises, falls and turns, about a level way at
    ``body_height``. It does so as well where a level body has no forces on two feet, as in a bound.

    Returns:
        The plan. Its record holds ``zmp_margin``, the smallest margin of the ZMP while any foot
        stands [m] (for a trot: minus the distance from the support line): of the whole robot's with
        ``timing="forces"``, and else of the body centre's. ``flight`` is the share of the time in
        which no foot stands, and there is no ZMP.

    Raises:
        InputError: a setting is unknown or out of range, neither distance nor duration is given,
            or with ``timing="forces"`` the body may not sway, or a leg has no roll joint.
        RobotError: contact forces are promised, and the robot's joints rub with more than its
            weight, or its motors are too heavy to catch it.
        InfeasibleSpeedError: a joint, a leg's reach or contact forces do not allow the velocity;
            names the fastest one that is possible.
        InfeasibleStateError: no plan begins in ``start``, or ends in ``end``; tells which limit is
            in the way.
        SolverError: no sway of the body was found.
    """
    if not isinstance(robot, Quadruped) or not isinstance(schedule, GaitSchedule):
        raise InputError(
            "plan_gait takes a Quadruped (from load_robot) and a GaitSchedule (gaitopt.trot(0.5), "
            f"for instance), got {type(robot).__name__} and {type(schedule).__name__}"
        )
    if isinstance(settings, GaitSettings) and settings.schedule != schedule:
        raise InputError(
            f"settings have the schedule {settings.schedule.name!r}, and the schedule to plan is "
            f"{schedule.name!r}: give the same schedule twice"
        )
    if settings is None:
        options["schedule"] = schedule
        if start is not None and options.get("heading") is None:
            check_kind("start", start, State)
            options["heading"] = body_yaw(robot, start)
    chosen = chosen_settings(GaitSettings, robot, settings, options)
    if chosen.forces is not None:
        _check_forces(robot, chosen)
    if start is None:
        plan = _planned(robot, chosen, progress)
    else:
        plan = _from_state(robot, start, chosen, progress)
    return plan if end is None else ended(plan, end)


def _from_state(
    robot: Quadruped, start: State, settings: GaitSettings, progress: Progress | None
) -> Plan:
    """The gait that begins in a state; arguments and errors are those of :func:`plan_gait`."""

    def walk(over: Footholds, _: FloatArray) -> Plan:
        feet = np.array([over[leg][0] for leg in LEGS])
        middle = feet.mean(axis=0)
        plan = _planned(robot, settings, progress, feet - middle)
        return shifted(plan, middle)

    return plan_from_state(robot, footholds_of(robot, start), start, settings, walk)


def _check_forces(robot: Quadruped, settings: GaitSettings) -> None:
    """Refuse what no path of the body gives contact forces.

    Raises:
        InputError: the body may not sway, legs have no roll joint and the gait is none that
            they can walk straight ahead, feet lift off and land at some speed, or the robot has no
            mass.
    """
    robot.require_masses()
    require_joints_that_feel(robot)
    if not settings.sway:
        why = "the body has to leave its straight way for them, and sway=False forbids it"
    elif (ahead := why_not_ahead(robot, settings)) is not None:
        why = ahead
    elif np.abs(_swing_ends(settings.swing)).max() > 0.0:
        gentle = ", ".join(repr(n) for n in SWING_CURVES if not _swing_ends(n).any())
        why = (
            f"on the swing curve {settings.swing!r} feet lift off and land at some speed, and no "
            f"force makes velocities jump (they do not on {gentle})"
        )
    else:
        return
    raise InputError(f'no contact forces are planned here: {why}; take timing="velocity"')


def _swing_ends(name: str) -> FloatArray:
    """Velocities of a foot at both ends of a swing of a unit length and time ``(2, 3)``."""
    curve = swing_curve(name, (0.0, 0.0, 0.0), (1.0, 0.0, 0.0), 1.0, 1.0)
    return np.round(curve.velocity(np.array([0.0, 1.0])), 9)


def _planned(
    robot: Quadruped, settings: GaitSettings, progress: Progress | None,
    stands: FloatArray | None = None,
) -> Plan:  # fmt: skip
    """Plan a gait with complete settings; errors are those of :func:`plan_gait`.

    Args:
        robot, settings, progress: of the gait.
        stands: where its feet stand at the start, as in :func:`attempt`.
    """
    stages = 3 if settings.adapt else 2
    found = attempt(robot, settings, stands)
    if progress is not None:
        progress(1, stages)
    if settings.adapt and found.path is not None:
        settings = replace(settings, cycle_times=_adapted_times(found.motion, settings))
        found = attempt(robot, settings, stands)
    motion, path = found.motion, found.path
    if found.violations or path is None:
        raise explain(settings, found.violations, lambda other: _is_possible(robot, other, stands))
    phases, record = gait_phases(motion, path, whole_robot=settings.forces is not None)
    if progress is not None:
        progress(stages, stages)
    return Plan(robot, motion.footholds, settings, phases, path, record)


def _is_possible(robot: Quadruped, settings: GaitSettings, stands: FloatArray | None) -> bool:
    """Whether a gait keeps all limits."""
    found = attempt(robot, settings, stands)
    return found.path is not None and not found.violations


def _adapted_times(motion: GaitMotion, settings: GaitSettings) -> tuple[float, ...]:
    """Times of all cycles [s], adapted to the ZMP margins of a motion with the nominal time.

    Source: [XiLing], "Stability and Gait Control", Section 4. Cycles in which no foot stands, so
    that they have no margin, count as average.
    """
    count = max(cycles_spanned(settings.schedule, settings.cycles), 1)
    nominal = settings.schedule.cycle_time
    margins = []
    for k in range(count):
        start = settings.lead + k * nominal
        times = np.linspace(start, min(start + nominal, motion.duration), MARGIN_SAMPLES)
        margins.append(smallest_zmp_margin(motion, times))
    known = [m for m in margins if np.isfinite(m)]
    mean = float(np.mean(known)) if known else 0.0
    return tuple(
        float(adapted_step_time(nominal, m if np.isfinite(m) else mean, mean, settings.adapt))
        for m in margins
    )
