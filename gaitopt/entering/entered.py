"""A walk with an entry in front: one plan from a state to the walk's end."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gaitopt.conventions import LEGS, FloatArray
from gaitopt.dynamics.contacts import ForceLimits
from gaitopt.entering.begin import Begin
from gaitopt.entering.landing import Landed
from gaitopt.entering.moving import moved
from gaitopt.motion.path import BASE_COLUMNS, MotionPath
from gaitopt.motion.pieces import joined
from gaitopt.plan.com_margin import margins_over, times_of_margins, true_com
from gaitopt.plan.phase import Limit, Phase
from gaitopt.plan.plan import Plan

FULL_TURN = 2.0 * np.pi
"""[rad]."""
LEAST_PAUSE = 0.01
"""Shortest rest on the way to a walk [s]."""


def entered(walk: Plan, begin: Begin, landing: Landed | None, limits: ForceLimits) -> Plan:
    """A walk that begins in a state.

    Args:
        walk: over the footholds of ``begin``, from rest on four feet.
        begin: the state.
        landing: from there to rest on four feet; ``None`` where the robot rests on them.
        limits: on forces and torques.

    Raises:
        InfeasibleStateError: the body cannot move to where the walk begins.
    """
    first = walk.path.evaluate([0.0])[0, :BASE_COLUMNS]
    rest = begin.base[0] if landing is None else landing.base
    # The entry's yaw counts as many whole turns as that of the walk.
    turns = FULL_TURN * np.round((first[5] - rest[5]) / FULL_TURN)
    move = moved(walk.robot, begin.footholds, rest + turns * (np.arange(6) == 5), first, limits,
                 walk.settings.joint_accelerations(walk.robot))  # fmt: skip
    parts = [] if landing is None else [_turned(landing.path, float(turns))]
    parts += [] if move is None else [move]
    if not parts:
        return walk
    if limits.transfer_time > 0.0:
        parts = _with_pauses(parts, walk, landing, limits.transfer_time)
    path = joined([*parts, walk.path] if walk.path.duration > 0.0 else parts)
    ends = np.cumsum([part.duration for part in parts]).tolist()
    landings = {} if landing is None else landing.landings
    phases = _entry_phases(walk, landings, ends[-1])
    later = [_later(phase, ends[-1], len(landings)) for phase in walk.phases]
    plan = replace(walk, phases=(*phases, *later), path=path, entry=len(phases))
    return _with_margins(plan)


def _with_pauses(
    parts: list[MotionPath], walk: Plan, landing: Landed | None, transfer_time: float
) -> list[MotionPath]:
    """The way to a walk with rests on four feet, for loads that go over slowly.

    Feet stand for the transfer time before the robot moves on from where it came to rest, and
    before the first foot of the walk lifts off. So no load of the move is limited by it, nor one of
    the walk by a landing.

    Args:
        parts: from the state to rest, and from there to where the walk begins; one of them, or
            both.
        walk: that follows.
        landing: the first of them, if there is one.
        transfer_time: [s].
    """
    last = max(landing.landings.values(), default=-np.inf) if landing is not None else -np.inf
    lift_off = walk.swings[0].start if walk.swings else np.inf
    missing = [0.0] * len(parts)
    missing[0] = transfer_time - (parts[0].duration - last)
    missing[-1] = max(missing[-1], transfer_time - lift_off)
    out = []
    for part, pause in zip(parts, missing, strict=True):
        out.append(part)
        if pause > 0.0:
            there = part.evaluate(part.times[-1:])[None]
            out.append(MotionPath(np.array([0.0, max(pause, LEAST_PAUSE)]), there))
    return out


def shifted(plan: Plan, by: FloatArray) -> Plan:
    """The plan elsewhere, on footholds without a height map.

    Args:
        plan: any plan.
        by: how far ``(3,)`` [m].
    """
    coefficients = np.array(plan.path.coefficients)
    coefficients[-1, :, :3] += by
    points = {leg: plan.footholds[leg] + by for leg in LEGS}
    phases = tuple(
        replace(phase, cog_start=phase.cog_start + by, cog_end=phase.cog_end + by,
                foot_start=phase.foot_start + by, foot_end=phase.foot_end + by)
        for phase in plan.phases
    )  # fmt: skip
    return replace(plan, footholds=plan.footholds.with_(points=points), phases=phases,
                   path=MotionPath(plan.path.times, coefficients))  # fmt: skip


def _turned(path: MotionPath, turns: float) -> MotionPath:
    """The path with another number of whole turns of the yaw [rad]."""
    if turns == 0.0:
        return path
    coefficients = np.array(path.coefficients)
    coefficients[-1, :, 5] += turns
    return MotionPath(path.times, coefficients)


def _entry_phases(walk: Plan, landings: dict[str, float], end: float) -> list[Phase]:
    """The phases of an entry: one with each set of standing feet, the last one on all four.

    Args:
        walk: that follows.
        landings: when each foot lands that is in the air at the begin [s].
        end: of the entry [s].
    """
    edges = [0.0, *sorted(set(landings.values()))]
    places = {leg: walk.footholds[leg][0] for leg in LEGS}
    phases = []
    nowhere = np.zeros(3)
    for start, stop in zip(edges, [*edges[1:], end], strict=True):
        flying = [leg for leg in LEGS if landings.get(leg, 0.0) > start]
        leg = flying[0] if flying else walk.phases[0].leg if walk.phases else ""
        step = list(landings).index(leg) if flying else len(landings)
        place = places.get(leg, places[LEGS[0]])
        phases.append(
            Phase("swing" if flying else "stance", leg, step, start, stop - start, nowhere, nowhere,
                  tuple(name for name in LEGS if name not in flying), place, place, 0.0)
        )  # fmt: skip
    return phases


def _later(phase: Phase, shift: float, steps: int) -> Phase:
    """A phase of a walk that begins later, after some steps.

    Args:
        phase: of the walk.
        shift: how much later it begins [s].
        steps: flights of the entry.
    """
    limits = tuple(
        Limit(x.kind, x.name, x.value, tuple((a + shift, b + shift) for a, b in x.spans))
        for x in phase.limited_by
    )
    return replace(phase, start=phase.start + shift, step=phase.step + steps, limited_by=limits)


def _with_margins(plan: Plan) -> Plan:
    """The plan with body centres, places of feet and margins in the phases of its entry.

    The margins are static ones of the true centre of mass; minus infinity where fewer than three
    feet stand.
    """
    times = times_of_margins(plan)
    times = times[times <= plan.phases[plan.entry - 1].end]
    motion = plan.at(times)
    margins = np.nan_to_num(margins_over(motion, true_com(plan.robot, motion.q)), nan=-np.inf)
    phases = list(plan.phases)
    for i in range(plan.entry):
        phase = phases[i]
        ends = plan.at([phase.start, phase.end])
        first, last = np.searchsorted(times, [phase.start, phase.end])
        own: FloatArray = margins[first : max(last, first + 1)]
        leg = LEGS.index(phase.leg) if phase.leg else 0
        places = [phase.foot_start, phase.foot_end]
        if phase.kind == "swing":
            places[0] = ends.feet[0, leg] if i == 0 else plan.at([0.0]).feet[0, leg]
        phases[i] = replace(phase, cog_start=ends.cog[0], cog_end=ends.cog[1],
                            foot_start=places[0], margin=float(own.min()))  # fmt: skip
    return replace(plan, phases=tuple(phases))
