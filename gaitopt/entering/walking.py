"""A planner's walk from a given state: the entry to rest first, then the walk from there."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TypeVar

from gaitopt.conventions import FloatArray
from gaitopt.dynamics.contacts import ForceLimits
from gaitopt.entering.begin import Begin
from gaitopt.entering.entered import entered
from gaitopt.entering.judging import at_rest
from gaitopt.entering.landing import landed
from gaitopt.errors import InfeasibleStepError, InputError
from gaitopt.plan.plan import Plan
from gaitopt.plan.settings.base import PlanSettings
from gaitopt.plan.settings.over_footholds import FootholdSettings
from gaitopt.plan.state import State
from gaitopt.robots.quadruped import Quadruped
from gaitopt.robots.rotations import rpy_to_matrix
from gaitopt.terrain.footholds import Footholds

WalkFrom = Callable[[Footholds, FloatArray], Plan]
"""Plans a walk from rest over footholds, given where the body centre comes to rest ``(3,)`` [m]."""


def plan_from_state(
    robot: Quadruped, footholds: Footholds, start: State, settings: PlanSettings, walk: WalkFrom
) -> Plan:
    """A walk that begins in a state.

    Args:
        robot: the robot.
        footholds: the first of each leg is where its foot stands, or lands next.
        start: the state.
        settings: of the walk; they say what is promised of forces, and how high feet rise.
        walk: plans the walk from rest.

    Raises:
        InputError: the state is that of another robot, or nothing is promised of forces.
        InfeasibleStateError: no plan begins in this state.
    """
    limits = forces_of(settings)
    begin = Begin.of(robot, start, footholds)
    accelerations = settings.joint_accelerations(robot)
    landing = landed(begin, limits, accelerations, settings.swing_height, settings.reach_fraction)
    if landing is None:
        limits = at_rest(limits)
    base = begin.base[0] if landing is None else landing.base
    centre = base[:3] + rpy_to_matrix(base[3:]) @ robot.body_axes @ robot.centre
    return entered(walk(begin.footholds, centre), begin, landing, limits)


def forces_of(settings: PlanSettings, what: str = "start") -> ForceLimits:
    """The limits on forces that a plan from a state, or to one, promises.

    Args:
        settings: of the plan.
        what: the argument that asks for the state.

    Raises:
        InputError: the settings promise none.
    """
    if settings.promised_forces is None:
        side = {"start": "from", "end": "to"}[what]
        raise InputError(
            f"a plan {side} a state is timed by contact forces: leave out {what}, or "
            'timing="velocity"'
        )
    return settings.promised_forces


Kind = TypeVar("Kind", bound=FootholdSettings)


def walk_from_near(walk: Callable[[Footholds, Kind], Plan], settings: Kind) -> WalkFrom:
    """A walk over footholds whose body begins above where it comes to rest, if it can.

    Args:
        walk: plans it over footholds, with settings.
        settings: of the walk. Where they, postures or places of the body say where it begins, that
            holds.
    """

    def plan(footholds: Footholds, centre: FloatArray) -> Plan:
        told = (settings.cog_start, footholds.postures, footholds.body_places)
        if any(each is not None for each in told):
            return walk(footholds, settings)
        here = replace(settings, cog_start=(float(centre[0]), float(centre[1])))
        try:
            return walk(footholds, here)
        except InfeasibleStepError:
            return walk(footholds, settings)

    return plan
