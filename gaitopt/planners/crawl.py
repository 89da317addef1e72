"""The static gait with optimised walking speed, over given footholds.

Source: [Wang2020]. Before each swing the body moves on four feet to where the COG
optimisation puts it (Section III); then one foot swings while the body stands still; body and foot
move as fast as the joints allow (Section IV). Planned in a frame turned to the walk's heading.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, Literal

from numpy.typing import ArrayLike

from gaitopt.conventions import Progress
from gaitopt.errors import InputError
from gaitopt.gait.crawl import WANG_SEQUENCE, check_order
from gaitopt.plan.plan import Plan
from gaitopt.plan.settings.crawl import CrawlSettings, Speed
from gaitopt.planners.phase_by_phase.planner import plan_in_order
from gaitopt.planners.phase_by_phase.steps import check_robot
from gaitopt.robots.quadruped import Quadruped
from gaitopt.terrain.footholds import Footholds


def plan_crawl(
    robot: Quadruped,
    footholds: Footholds,
    objective: Literal["distance", "margin", "time"] = "distance",
    speed: Speed = "max",
    stability_margin: float = 0.02,
    body_height: float = 0.40,
    swing_height: float = 0.07,
    sequence: Iterable[str] | Literal["free"] = WANG_SEQUENCE,
    swing: str = "box",
    *,
    reach_fraction: float = 1.0,
    heading: float = 0.0,
    follow_terrain: bool = False,
    cog_start: ArrayLike | None = None,
    free: str | Iterable[str] | None = None,
    com: Literal["body", "model"] = "body",
    acceleration_limit: float | None = None,
    horizon: int | None = None,
    progress: Progress | None = None,
) -> Plan:
    """Plan a statically stable walk over given footholds.

    Args:
        robot: from :func:`gaitopt.load_robot`; its legs need a roll joint.
        footholds: where the feet go; the first of each leg is where it stands at the start.
        objective: ``"distance"`` moves the COG as little as possible (the paper's method),
            ``"margin"`` to the largest stability margin (the SSM baseline); ``"time"`` optimises
            all steps at once for the least time (:func:`gaitopt.plan_route`).
        speed: ``"max"`` for the highest speed that the joints allow, or a speed of body and feet
            [m/s], which is still held within the joints' limits.
        stability_margin: ``S0``, distance of the COG from the support triangle's sides during
            swings [m].
        body_height: height of the hips above the mean height of the footholds [m]; ``h`` of
            eq. (8).
        swing_height: how far a foot rises above the higher end of its swing [m].
        sequence: order of the legs in a cycle, or of all steps of the walk, in which every leg
            steps equally often; ``"free"`` searches for the fastest order that is possible, which
            need not be periodic, and the plan's settings name it.
        swing: shape of the swing: ``"box"``, the shape of another swing curve
            (:data:`gaitopt.SWING_CURVES`), or a way over an obstacle, ``"trapezoid path"`` or
            ``"parabola path"``.
        reach_fraction: share of each leg's reach that may be used, in (0, 1]; 1 allows the
            straight leg, where the joint velocities that move the foot grow without bound.
        heading: direction in which the body faces, from the world's x axis [rad].
        follow_terrain: keep the body ``body_height`` above the mean of the four feet, instead of
            at a constant height.
        cog_start: where the body centre is at the start ``(2,)`` [m]; by default above the middle
            of the first footholds, or as near to it as the legs reach.
        free: with the objective ``"time"``, what is free beyond the body's targets, as for
            :func:`gaitopt.plan_route`; ``"swing"`` by default.
        com: with the objective ``"time"``, what keeps the stability margin: the body's centre
            (``"body"``) or the true centre of mass of the whole robot (``"model"``).
        acceleration_limit, horizon: with the objective ``"time"``, a limit of every joint
            [rad/s^2], and steps that are planned ahead, as for :func:`gaitopt.plan_route`.
        progress: called with (steps done, steps in all); with the objective ``"time"`` as for
            :func:`gaitopt.plan_route`.

    Returns:
        The plan; :meth:`Plan.sample` gives the motion, :func:`gaitopt.replay` shows it.

    Raises:
        InputError: a setting is out of range, or the robot's legs cannot move sideways.
        InfeasibleStepError: a step is impossible; tells which constraints are in the way, and what
            margin or reach would do.
        SolverError: a solution failed the check of its residuals.
    """
    if not isinstance(robot, Quadruped) or not isinstance(footholds, Footholds):
        raise InputError(
            f"plan_crawl takes a Quadruped (from load_robot) and Footholds, got "
            f"{type(robot).__name__} and {type(footholds).__name__}"
        )
    fast = (acceleration_limit, horizon, free)
    if objective == "time" or com != "body" or any(option is not None for option in fast):
        return _least_time(
            robot, footholds, objective, speed, swing, "swing" if free is None else free,
            stability_margin=stability_margin, body_height=body_height, swing_height=swing_height,
            sequence=sequence, reach_fraction=reach_fraction, heading=heading,
            follow_terrain=follow_terrain, cog_start=cog_start, com=com,
            acceleration_limit=acceleration_limit, horizon=horizon, progress=progress,
        )  # fmt: skip
    free_order = isinstance(sequence, str) and sequence == "free"
    settings = CrawlSettings(
        objective=objective, speed=speed, stability_margin=stability_margin,
        body_height=body_height, swing_height=swing_height,
        sequence=WANG_SEQUENCE if free_order else check_order(sequence),
        swing=swing, reach_fraction=reach_fraction, heading=heading, follow_terrain=follow_terrain,
    )  # fmt: skip
    check_robot(robot)
    if free_order:
        from gaitopt.planners.free_order.planner import plan_free_crawl

        return plan_free_crawl(robot, footholds, settings, cog_start, progress)
    return plan_in_order(robot, footholds, settings, cog_start, progress)


def _least_time(
    robot: Quadruped,
    footholds: Footholds,
    objective: str,
    speed: Speed,
    swing: str,
    free: str | Iterable[str],
    **settings: Any,
) -> Plan:
    """The walk by :func:`gaitopt.plan_route`, when the other settings go with it."""
    from gaitopt.planners.time_optimal.planner import plan_route

    if objective != "time":
        raise InputError(
            f"free, com, acceleration_limit and horizon go with the objective 'time', got "
            f"{objective!r}"
        )
    if speed != "max" or swing != "box":
        raise InputError(
            "the objective 'time' has speeds and swings of its own: leave speed and swing out, got "
            f"{speed!r} and {swing!r}"
        )
    return plan_route(robot, footholds, free, **settings)
