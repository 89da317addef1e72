"""``plan_stride``: plan a walk up to an obstacle, over it with one leg after another, and on.

Source: [Shao2011]. Before each swing the body moves on four feet to the pose that the posture
optimisation finds (Section IV). Then one foot swings while the body stands still: over the obstacle
along the fastest joint spline (Section III), over open ground along a simple swing curve.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from gaitopt.conventions import FloatArray, Progress
from gaitopt.entering.begin import HIGH
from gaitopt.entering.ending import ended
from gaitopt.entering.standing_up import body_yaw, footholds_of
from gaitopt.entering.walking import forces_of, plan_from_state
from gaitopt.errors import InfeasibleStateError, InputError, StrideFault
from gaitopt.inputs import check_kind
from gaitopt.plan.plan import Plan
from gaitopt.plan.record import StrideRecord
from gaitopt.plan.settings.base import FORCES
from gaitopt.plan.settings.keywords import chosen_settings, takes_settings
from gaitopt.plan.settings.over_obstacle import BODY_HEIGHTS, StrideSettings
from gaitopt.plan.state import State
from gaitopt.planners.over_obstacle.approach import Stand, check_stand
from gaitopt.planners.over_obstacle.attempt import attempt
from gaitopt.planners.over_obstacle.clearance import Surroundings
from gaitopt.planners.over_obstacle.failure import infeasible
from gaitopt.robots.abilities import require_joints_that_feel
from gaitopt.robots.quadruped import Quadruped
from gaitopt.terrain.footholds import Footholds
from gaitopt.terrain.obstacles import Obstacle

MARGINS = (1.0, 1.5, 2.0)
"""Stability margins that are tried with contact forces, as multiples of the usual one, where none
is given: the true centre of mass may be nearer to a side of the support than the body centre."""


QUICKER = (1.0, 3.0, 10.0)
"""Accelerations of the joints that are tried on the way from a given state, as multiples of the
usual ones, where none are given: these are chosen for walks that begin at rest, and a robot that
trots or puts down a foot often comes to rest with larger ones only."""

HELPED = ("rad", "rad/s^2", "N", "N m")
"""Units of the limits for which larger accelerations help, as the body then brakes sooner: of
joints, contact forces and torques."""


@takes_settings(StrideSettings)
def plan_stride(
    robot: Quadruped,
    obstacle: Obstacle,
    settings: StrideSettings | None = None,
    *,
    progress: Progress | None = None,
    start: State | None = None,
    end: State | None = None,
    **options: Any,
) -> Plan:
    """Plan a statically stable walk over an obstacle.

    The robot walks along the obstacle's x axis on the level ground that the obstacle stands on, and
    begins in front of it. The planner chooses the footholds: each pair of feet strides over the
    obstacle in one cycle, and stands before and behind it as near as ``clearance`` allows. The
    distance of all parts of the robot from the obstacle is checked at every instant with the
    collision shapes of the URDF; where these are meshes, lines along the legs replace them.

    Args:
        robot: from :func:`gaitopt.load_robot`; legs with or without roll joint.
        obstacle: from :func:`gaitopt.rectangular_obstacle`, for instance.
        settings: all settings as one object; heading and obstacles in it are replaced by those of
            this obstacle. By default they fit the robot, and the body height is the largest of a
            few heights, from 0.9 to 0.7 of the legs' reach, at which the walk is possible.
        progress: called with (steps done, steps in all).
        start: the state in which the plan begins (:class:`gaitopt.State`), in front of the
            obstacle: moving, with feet in the air, lying low, turned, or far away. The robot first
            comes to rest on four feet, as in :func:`gaitopt.plan_crawl`, and then walks to where
            its feet stride over the obstacle; ``approach`` does not count. By default it rests in
            front of the obstacle. Where no acceleration is given, and the robot does not come to
            rest with the usual ones, three and ten times these are tried; the settings say which.
        end: the state in which the plan ends: at rest on the last footholds, with the body where it
            has it. The planner chooses the footholds, so the same call without ``end`` tells them.
        options: single settings by name: the fields of :class:`gaitopt.StrideSettings`;
            ``acceleration_limit`` and ``jerk_limit`` may be one number, or one for each joint of
            a leg from body to foot.

    With ``timing="forces"``, the default, the walk is as fast as contact forces and joint torques
    allow (:func:`gaitopt.retimed`). Where no margin is given and a foot presses too little, larger
    ones are tried.

    Returns:
        The plan. Its record holds ``clearance``, the least distance of any part of the robot from
        the obstacle [m]; ``foot_margin``, that of the balls of the feet during their swings over it
        [m]; ``energy_margin``, the least energy that tips the robot during a swing [J]; and the
        distances between the obstacle and the feet that stand beside it [m].

    Raises:
        InputError: a setting is unknown or out of range, a joint has no velocity limit, or with
            ``timing="forces"`` the robot has no mass or a jerk limit is given.
        RobotError: contact forces are promised, and the robot's joints rub with more than its
            weight, or its motors are too heavy to catch it.
        InfeasibleStepError: no such walk was found; names the largest obstacle that is possible.
        InfeasibleStateError: no plan begins in ``start``, or ends in ``end``; tells which limit is
            in the way.
    """
    _check_kinds(robot, obstacle)
    this = {"heading": obstacle.yaw, "obstacles": (obstacle,)}
    taken = sorted(this.keys() & options.keys())
    if taken:
        raise InputError(f"plan_stride takes {taken[0]} from the obstacle; leave it out")
    chosen = chosen_settings(StrideSettings, robot, settings, {**options, **this})
    if chosen.forces is not None:
        _check_forces(robot, chosen)
    margin_is_open = settings is None and options.get("stability_margin") is None
    margins = MARGINS if margin_is_open and chosen.forces is not None else MARGINS[:1]
    open_height = settings is None and options.get("body_height") is None
    reach = float(np.mean([leg.reach for leg in robot.legs.values()]))
    heights = [share * reach for share in BODY_HEIGHTS] if open_height else [chosen.body_height]

    def plan_with(asked: StrideSettings) -> Plan:
        candidates = [replace(asked, body_height=height) for height in heights]

        def walk(stand: Stand | None) -> Plan:
            return _first_plan(robot, obstacle, candidates, margins, progress, stand)

        if start is None:
            return walk(None)
        return _from_state(robot, obstacle, start, candidates[0], walk)

    given = any(options.get(name) is not None for name in ("accelerations", "acceleration_limit"))
    usual = start is not None and settings is None and not given
    plan = _with_quick_entry(plan_with, chosen) if usual else plan_with(chosen)
    if end is None:
        return plan
    return _with_clearance(ended(plan, end), Surroundings.of(robot, obstacle), "end")


def _with_quick_entry(
    plan_with: Callable[[StrideSettings], Plan], settings: StrideSettings
) -> Plan:
    """The plan from a state, with the least accelerations with which it comes to rest.

    Args:
        plan_with: plans it with settings.
        settings: with the usual accelerations.

    Raises:
        InfeasibleStateError: none of them will do; the error is that of the usual ones.
    """
    first: InfeasibleStateError | None = None
    for share in QUICKER:
        most = tuple(share * each for each in settings.accelerations)
        try:
            return plan_with(replace(settings, accelerations=most, acceleration_limit=max(most)))
        except InfeasibleStateError as error:
            first = first or error
            if error.unit not in HELPED:
                break
    assert first is not None
    raise first


def _from_state(
    robot: Quadruped, obstacle: Obstacle, start: State, settings: StrideSettings,
    walk: Callable[[Stand], Plan],
) -> Plan:  # fmt: skip
    """A walk that begins in a state.

    Args:
        robot, obstacle, start, settings: as for :func:`plan_stride`.
        walk: plans the walk from rest.

    Raises:
        InfeasibleStateError: no plan begins in the state.
    """
    check_kind("start", start, State)
    forces_of(settings)
    places = footholds_of(robot, start)

    def from_rest(over: Footholds, _: FloatArray) -> Plan:
        return walk(Stand(over.array[:, 0], body_yaw(robot, start)))

    check_stand(robot, obstacle, Stand(places.array[:, 0], 0.0), HIGH)
    around = Surroundings.of(robot, obstacle)
    here = around.nearest(np.array(start.columns)[None])
    _check_clearance(settings, here.shape, here.distance, 0.0, "start")
    plan = plan_from_state(robot, places, start, settings, from_rest)
    return _with_clearance(plan, around, "start")


def _with_clearance(plan: Plan, around: Surroundings, what: str) -> Plan:
    """The plan with the clearance of all of its path.

    Args:
        plan: over the obstacle.
        around: the robot and the obstacle.
        what: the argument that asks for the parts that are new.

    Raises:
        InfeasibleStateError: the robot comes too near to the obstacle.
    """
    settings = plan.settings
    assert isinstance(plan.record, StrideRecord) and isinstance(settings, StrideSettings)
    closest = around.along(plan.path, settings.clearance)
    _check_clearance(settings, closest.seen.shape, closest.proven, closest.time, what)
    nearest = f"{closest.seen.shape} at {closest.time:.2f} s"
    return replace(plan, record=replace(plan.record, clearance=closest.proven, nearest=nearest))


def _check_forces(robot: Quadruped, settings: StrideSettings) -> None:
    """Refuse what cannot be had with contact forces.

    Raises:
        InputError: the robot has no mass, or a jerk limit is given.
    """
    robot.require_masses()
    require_joints_that_feel(robot)
    if settings.jerk_limit is not None:
        raise InputError(
            "a jerk limit is not kept where contact forces set the timing: leave jerk_limit out, "
            'or take timing="velocity"'
        )


def _check_clearance(
    settings: StrideSettings, shape: str, distance: float, time: float, what: str
) -> None:
    """Refuse a state, or the way from or to one, that is too near to the obstacle.

    Args:
        settings: of the walk.
        shape: the nearest part of the robot.
        distance: of it from the obstacle [m].
        time: when [s].
        what: the argument that asks for the state.

    Raises:
        InfeasibleStateError: it is too near.
    """
    if distance < settings.clearance:
        raise InfeasibleStateError(
            f"{what}: {shape} is within {distance:.4g} m of the obstacle at {time:.3f} s, and "
            f"{settings.clearance:.4g} m are asked for; stand farther away from it, or reduce "
            "clearance",
            "clearance", distance, settings.clearance, "m", time,
        )  # fmt: skip


def _first_plan(
    robot: Quadruped,
    obstacle: Obstacle,
    candidates: list[StrideSettings],
    margins: tuple[float, ...],
    progress: Progress | None,
    stand: Stand | None,
) -> Plan:
    """The plan with the first of some settings with which one is found.

    Args:
        robot, obstacle, progress: as in :func:`plan_stride`.
        candidates: the settings.
        margins: multiples of their stability margin that are tried in turn where nothing but
            contact forces is missing.
        stand: where the robot stands before; ``None``: where the walk itself begins.

    Raises:
        InfeasibleStepError: none is; the error is that of the first settings that only lack
            forces, or else of the first ones.
    """
    around = Surroundings.of(robot, obstacle)
    faults: list[StrideFault] = []
    for settings in candidates:
        for share in margins:
            wider = replace(settings, stability_margin=share * settings.stability_margin)
            try:
                return attempt(robot, obstacle, wider, around, progress, stand)
            except StrideFault as fault:
                faults.append(fault)
                if fault.cause != FORCES:
                    break
    # A walk that only lacks forces came farthest.
    reason = next((found for found in faults if found.cause == FORCES), faults[0])
    raise infeasible(robot, obstacle, candidates, reason)


def _check_kinds(robot: object, obstacle: object) -> None:
    """Check that ``plan_stride`` got a robot with velocity limits and an obstacle.

    Raises:
        InputError: one of them is something else.
    """
    if not isinstance(robot, Quadruped) or not isinstance(obstacle, Obstacle):
        raise InputError(
            "plan_stride takes a Quadruped (from load_robot) and an Obstacle (rectangular_obstacle("
            f"0.11, 0.04), for instance), got {type(robot).__name__} and {type(obstacle).__name__}"
        )
    robot.require_velocity_limits()
