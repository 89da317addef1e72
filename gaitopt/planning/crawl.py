"""The static gait with optimised walking speed, over given footholds.

Source: 000_6dacb41600db6a3c.txt. Before each swing the body moves on four feet to where the COG
optimisation puts it (Section III); then one foot swings while the body stands still; body and foot
move as fast as the joints allow (Section IV). Planned in a frame turned to the walk's heading.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from gaitopt.conventions import LEGS, FloatArray, Progress, leg_index, rotation_z
from gaitopt.errors import InfeasibleStepError, InputError
from gaitopt.gait.crawl import WANG_SEQUENCE, check_order, swing_order
from gaitopt.optimize.cog import (
    CogProblem,
    CogSolution,
    CogWorkspace,
    build_cog_problem,
    build_cog_problems,
    solve_cog,
)
from gaitopt.planning.assembly import assemble_plan
from gaitopt.planning.diagnosis import check_heights, explain_start, explain_step
from gaitopt.planning.plan import Plan
from gaitopt.planning.settings import CrawlSettings, Speed
from gaitopt.robots.quadruped import Quadruped
from gaitopt.terrain.footholds import Footholds


@dataclass(frozen=True, eq=False)
class CrawlSteps:
    """The steps of a walk, before anything is optimised; in the heading frame.

    Attributes:
        legs: the leg that swings at each step ``(S,)``.
        feet: where the feet stand before each step ``(S, 4, 3)`` [m].
        targets: where the swing foot touches down ``(S, 3)`` [m].
        heights: height of the body centre at the end of each stance phase ``(S,)`` [m].
        start_height: its height at the start [m].
    """

    legs: tuple[str, ...]
    feet: FloatArray
    targets: FloatArray
    heights: FloatArray
    start_height: float

    @cached_property
    def indices(self) -> np.ndarray:
        """Position of each step's leg in :data:`gaitopt.LEGS`."""
        return np.array([leg_index(leg) for leg in self.legs], dtype=int)


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
        from gaitopt.planning.free_gait import plan_free_crawl

        return plan_free_crawl(robot, footholds, settings, cog_start, progress)
    return plan_in_order(robot, footholds, settings, cog_start, progress)


def plan_in_order(
    robot: Quadruped,
    footholds: Footholds,
    settings: CrawlSettings,
    cog_start: ArrayLike | None = None,
    progress: Progress | None = None,
) -> Plan:
    """The crawl with the settings' sequence; arguments and errors of :func:`plan_crawl`."""
    steps = crawl_steps(footholds, settings)
    check_stance(steps)
    check_heights(robot, steps, settings)
    start = start_place(robot, steps, settings, cog_start)
    solutions = optimise_cogs(robot, steps, settings, start, progress)
    return assemble_plan(robot, footholds, settings, steps, start, solutions)


def start_of(
    robot: Quadruped, footholds: Footholds, settings: CrawlSettings, cog_start: ArrayLike | None
) -> FloatArray:
    """Body centre at the start of a walk ``(3,)`` [m], in the heading frame."""
    steps = crawl_steps(footholds, replace(settings, sequence=WANG_SEQUENCE))
    check_stance(steps)
    return start_place(robot, steps, settings, cog_start)


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
    from gaitopt.planning.route_crawl import plan_route

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


def check_robot(robot: Quadruped) -> None:
    """Refuse a robot whose legs cannot move sideways, or have no usable speed limits.

    Raises:
        InputError: names the leg or joint.
    """
    for name, leg in robot.legs.items():
        if not leg.has_roll:
            raise InputError(
                f"{robot.name}: leg {name} has no roll joint, so its foot cannot move sideways as "
                "a crawl over given footholds needs; use a robot with three joints a leg"
            )
        for joint, limit in zip(leg.joints, leg.velocity_limits, strict=True):
            if not (np.isfinite(limit) and limit > 0):
                raise InputError(
                    f"{robot.name}: joint {joint} has the velocity limit {limit:g} rad/s; set a "
                    'positive one in the URDF (<limit velocity="...">)'
                )


def check_stance(steps: CrawlSteps) -> None:
    """Refuse a first stance in which legs cross.

    Raises:
        InputError: names both legs; they may be swapped, or the heading forgotten.
    """
    first = dict(zip(LEGS, steps.feet[0], strict=True))
    for axis, side, pairs in (
        (1, "left of", (("LF", "RF"), ("LH", "RH"))),
        (0, "ahead of", (("LF", "LH"), ("RF", "RH"))),
    ):
        for one, other in pairs:
            if not first[one][axis] > first[other][axis]:
                raise InputError(
                    f"the first foothold of {one} is not {side} that of {other}, seen in the "
                    "direction of walking; are legs swapped, or is heading to be set?"
                )


def crawl_steps(footholds: Footholds, settings: CrawlSettings) -> CrawlSteps:
    """Lay out all steps: who swings, from which feet, onto what, below which body height."""
    points = footholds.array @ rotation_z(settings.heading)
    order = swing_order(settings.sequence, len(footholds))
    feet = np.empty((len(order) + 1, len(LEGS), 3))
    feet[0] = points[:, 0]
    for s, (leg, k) in enumerate(order):
        feet[s + 1] = feet[s]
        feet[s + 1, leg_index(leg)] = points[leg_index(leg), k]
    if settings.follow_terrain:
        ground = feet[:, :, 2].mean(axis=1)
        levels = (ground[:-1] + ground[1:]) / 2.0
        first = float(ground[0])
    else:
        first = float(points[..., 2].mean())
        levels = np.full(len(order), first)
    return CrawlSteps(
        legs=tuple(leg for leg, _ in order),
        feet=feet[:-1] if order else feet,
        targets=np.array([points[leg_index(leg), k] for leg, k in order]).reshape(-1, 3),
        heights=levels + settings.body_height,
        start_height=first + settings.body_height,
    )


def optimise_cogs(
    robot: Quadruped,
    steps: CrawlSteps,
    settings: CrawlSettings,
    start: FloatArray,
    progress: Progress | None = None,
) -> list[CogSolution]:
    """The COG target of every step, each starting from the one before.

    Raises:
        InfeasibleStepError: no COG position allows a step.
    """
    problems = step_problems(robot, steps, settings, settings.objective)
    workspace = CogWorkspace()
    solutions = []
    place = start[:2]
    for s, problem in enumerate(problems):
        solution = solve_cog(problem.starting_at(place), workspace)
        low = solution.margin < settings.stability_margin - 1e-9
        if solution.status != "solved" or low:
            raise explain_step(robot, steps, settings, s, place)
        solutions.append(solution)
        place = solution.position
        if progress is not None:
            progress(s + 1, len(problems))
    return solutions


def step_problems(
    robot: Quadruped, steps: CrawlSteps, settings: CrawlSettings, objective: str
) -> list[CogProblem]:
    """The COG problems of all steps (without their starts)."""
    if not steps.legs:
        return []
    return build_cog_problems(
        robot, steps.feet, steps.heights, steps.legs, steps.targets,
        stability_margin=settings.stability_margin, reach_fraction=settings.reach_fraction,
        objective=objective,  # type: ignore[arg-type]
    )  # fmt: skip


def start_place(
    robot: Quadruped,
    steps: CrawlSteps,
    settings: CrawlSettings,
    cog_start: ArrayLike | None,
) -> FloatArray:
    """Body centre at the start ``(3,)``, in the heading frame."""
    feet = dict(zip(LEGS, steps.feet[0], strict=True))
    wanted = steps.feet[0, :, :2].mean(axis=0)
    if cog_start is not None:
        try:
            given = np.asarray(cog_start, dtype=np.float64)
        except (TypeError, ValueError):
            given = np.empty(0)
        if given.shape != (2,) or not np.isfinite(given).all():
            raise InputError(
                f"cog_start must be two finite numbers (x, y) in metres, got {cog_start!r}"
            )
        wanted = given @ rotation_z(settings.heading)[:2, :2]
    problem = build_cog_problem(
        robot, feet, steps.start_height, wanted, reach_fraction=settings.reach_fraction
    )
    if cog_start is not None and problem.constraint_values(wanted).min() < -1e-9:
        worst = int(problem.constraint_values(wanted).argmin())
        raise InfeasibleStepError(
            f"the body cannot start at {given.tolist()}: {problem.names[worst]} is exceeded; leave "
            "cog_start out to start as near to the middle of the feet as the legs reach",
            step=-1, leg=LEGS[worst], conflicts=(problem.names[worst],),
            reach_fraction=settings.reach_fraction,
        )  # fmt: skip
    solution = solve_cog(problem)
    if solution.status != "solved":
        raise explain_start(robot, steps, settings, wanted)
    return np.append(solution.position, steps.start_height)
