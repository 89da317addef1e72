"""``plan_crawl``: the walk over given footholds, by whichever planner its settings ask for.

What some walks need only is imported where it is used: a first plan in a new process takes about
as long as its imports.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from gaitopt.conventions import Progress
from gaitopt.errors import InputError
from gaitopt.gait.crawl import FREE_ORDER
from gaitopt.inputs import as_text
from gaitopt.plan.plan import Plan
from gaitopt.plan.settings.crawl import CrawlSettings
from gaitopt.plan.settings.keywords import chosen_settings, takes_settings
from gaitopt.plan.settings.time_optimal import RouteSettings
from gaitopt.plan.state import State
from gaitopt.planners.phase_by_phase.beside_columns import warn_beside_columns
from gaitopt.planners.phase_by_phase.fitting_height import plan_at_fitting_height
from gaitopt.planners.phase_by_phase.planner import plan_in_order, with_first_posture
from gaitopt.planners.phase_by_phase.steps import check_walk
from gaitopt.planners.phase_by_phase.straight_ahead import in_foot_planes
from gaitopt.robots.abilities import require_joints_that_feel
from gaitopt.robots.quadruped import Quadruped
from gaitopt.terrain.footholds import Footholds

LEAST_TIME = "time"
"""The objective that is the time-optimal planner's."""
_ONLY_LEAST_TIME = ("free", "acceleration_limit", "horizon", "clearance")
_ONLY_PHASE_BY_PHASE = ("speed", "swing")


@takes_settings(CrawlSettings, RouteSettings)
def plan_crawl(
    robot: Quadruped,
    footholds: Footholds,
    settings: CrawlSettings | RouteSettings | None = None,
    *,
    progress: Progress | None = None,
    start: State | None = None,
    end: State | None = None,
    **options: Any,
) -> Plan:
    """Plan a statically stable walk over given footholds.

    Before each swing the body moves on four feet to where the optimisation of its centre puts it
    ([Wang2020], Section III); then one foot swings while the body stands still; body and foot move
    as fast as contact forces, joint torques and joint velocities allow, within the limits
    ``forces`` (:func:`gaitopt.retimed`). With ``timing="velocity"`` they move as fast as joint
    velocities allow, as in Section IV of the paper; such a plan says nothing of what physics does.
    With ``objective="time"`` all steps are optimised at once for the least time
    (:func:`gaitopt.plan_route`).

    Args:
        robot: from :func:`gaitopt.load_robot`. Without roll joints it walks straight ahead.
        footholds: where the feet go; the first of each leg is where it stands at the start. Those
            of legs without roll joint lie in the planes of the legs, to 0.1 mm, and are put into
            them. Their
            ``order`` holds where no ``sequence`` is asked for; their ``swing_heights`` hold in
            place of ``swing_height``, and their ``postures`` in place of ``body_height``,
            ``follow_terrain`` and ``heading``: the body moves from one to the next while four feet
            stand, and rests during swings.
        settings: all settings as one object. By default they fit the robot: margins and heights
            are to its size, and of a few body heights the first is taken at which the walk is
            possible and no legs touch each other or the trunk. Where it is possible at none of
            them, feet rise less.
        start: the state in which the plan begins (:class:`gaitopt.State`): moving, with feet in the
            air, lying low. The robot first comes to rest on four feet, and moves to where the walk
            begins; this entry keeps the same limits. A foot in the air lands on the first foothold
            of its leg. By default the robot rests where the walk begins.
        progress: called with (steps done, steps in all).
        end: the state in which the plan ends: at rest on the last footholds, with the body where it
            has it. By default the body stays where the last swing has it.
        options: single settings by name: the fields of :class:`gaitopt.CrawlSettings`; with
            ``objective="time"`` those of :class:`gaitopt.RouteSettings`.

    Returns:
        The plan; :meth:`Plan.sample` gives the motion, :func:`gaitopt.replay` shows it.

    Raises:
        InputError: a setting is unknown or out of range, or a foothold lies beside the plane of a
            leg without roll joint.
        RobotError: contact forces are promised, and the robot's joints rub with more than its
            weight, or its motors are too heavy to catch it.
        InfeasibleStepError: a step is impossible; tells which constraints are in the way, and what
            margin or reach would do.
        InfeasibleStateError: no plan begins in ``start``, or ends in ``end``; tells which limit is
            in the way.
        SolverError: a solution failed the check of its residuals.

    Warns:
        FootholdsWarning: a limb or a foot goes into a column, or legs touch at every body height
            that was tried, which the certificate will find; or the ball of a foot rolls nearly as
            far as its column is wide.
    """
    check_walk("plan_crawl", robot, footholds)
    if isinstance(settings, RouteSettings) or _asks_for_least_time(options):
        if isinstance(settings, CrawlSettings):
            raise InputError("objective='time' takes RouteSettings, got CrawlSettings")
        from gaitopt.planners.time_optimal.planner import plan_route

        options.pop("objective", None)
        return plan_route(
            robot, footholds, settings, start=start, end=end, progress=progress, **options
        )
    robot.require_velocity_limits()
    open_height = settings is None and options.get("body_height") is None
    open_swing = settings is None and options.get("swing_height") is None
    chosen = chosen_settings(CrawlSettings, robot, settings, options)
    chosen = chosen.with_order_of(footholds, options.get("sequence") is not None)
    if chosen.promised_forces is not None:
        require_joints_that_feel(robot)
    if footholds.postures is not None:
        chosen = with_first_posture(chosen, footholds)
    footholds = in_foot_planes(robot, footholds, chosen.heading)

    def walk(over: Footholds, asked: CrawlSettings) -> Plan:
        return _walk(robot, over, asked, open_height, open_swing, progress)

    if start is None:
        plan = walk(footholds, chosen)
    else:
        from gaitopt.entering.walking import plan_from_state, walk_from_near

        plan = plan_from_state(robot, footholds, start, chosen, walk_from_near(walk, chosen))
    warn_beside_columns(plan)
    if end is None:
        return plan
    from gaitopt.entering.ending import ended

    return ended(plan, end)


def _walk(
    robot: Quadruped, footholds: Footholds, chosen: CrawlSettings, open_height: bool,
    open_swing: bool, progress: Progress | None,
) -> Plan:  # fmt: skip
    """The walk from rest.

    Args:
        robot, footholds, progress: as for :func:`plan_crawl`.
        chosen: the settings.
        open_height: whether other body heights may be tried.
        open_swing: whether lower swings may be tried beside them.
    """
    if chosen.sequence == FREE_ORDER:
        from gaitopt.planners.free_order.planner import plan_free_at_fitting_height, plan_free_crawl

        at_height, at_fitting = plan_free_crawl, plan_free_at_fitting_height
    else:
        at_height, at_fitting = plan_in_order, plan_at_fitting_height
    if open_height:
        plan = at_fitting(robot, footholds, chosen, open_swing=open_swing, progress=progress)
    else:
        plan = at_height(robot, footholds, chosen, progress=progress)
    if chosen.forces is not None or not np.isfinite(robot.acceleration_limits).any():
        return plan
    from gaitopt.retiming.retimed import stopped

    return stopped(plan)


def _asks_for_least_time(options: dict[str, Any]) -> bool:
    """Whether options ask for the time-optimal walk; those that go with the other only are refused.

    Raises:
        InputError: options of both planners are given.
    """
    objective = options.get("objective", "distance")
    special = [name for name in _ONLY_LEAST_TIME if options.get(name) is not None]
    if not (isinstance(objective, str) and objective == LEAST_TIME):
        for name in set(_ONLY_LEAST_TIME) & set(options) - set(special):
            del options[name]
        if special:
            raise InputError(
                f"{', '.join(_ONLY_LEAST_TIME)} go with the objective 'time', got "
                f"{special[0]}={as_text(options[special[0]])} and the objective "
                f"{as_text(objective)}"
            )
        return False
    for name, default in zip(_ONLY_PHASE_BY_PHASE, ("max", "box"), strict=True):
        if options.pop(name, default) != default:
            raise InputError(
                "the objective 'time' has speeds and swings of its own: leave speed and swing out"
            )
    return True
