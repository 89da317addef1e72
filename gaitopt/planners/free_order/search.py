"""The free gait: which leg steps next is found, not given.

A state is how many steps each leg has taken. Whether a step is possible depends on its state and
not on how the body came there: on four feet it may go straight from any place of the last step's to
any of the next one's. So a search over all states, layer by layer, finds an order of steps wherever
there is one. Most walks do not need all states: the search is tried with the fastest few of each
layer first. ([Wang2020], Section II, names the free gait and plans none.)
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from gaitopt.conventions import LEGS, FloatArray, Progress, rotation_z
from gaitopt.plan.settings.crawl import CrawlSettings
from gaitopt.planners.free_order.steps import StepPlanner, Steps
from gaitopt.planners.phase_by_phase.targets import start_for_any_order
from gaitopt.robots.quadruped import Quadruped
from gaitopt.terrain.footholds import Footholds

WIDTHS = (64, 512, 100_000)
"""Most ways that a search keeps in a layer; the next is tried where one finds no order."""
KEPT = 4
"""Most ways that it keeps into one state."""


@dataclass(frozen=True)
class FreeOrder:
    """What the search found.

    Attributes:
        legs: the leg of each step ``(S,)``; of the first ``S`` steps only, where no order gets to
            the end.
        complete: whether all steps are there.
        duration: of the walk phase by phase, estimated [s].
        states: ways that were looked at.
    """

    legs: tuple[str, ...]
    complete: bool
    duration: float
    states: int


class _Layer(NamedTuple):
    """Ways of taking so many steps.

    Attributes:
        taken: steps of each leg ``(N, 4)``.
        place: body centre ``(N, 3)`` [m].
        time: so far ``(N,)`` [s].
        parent, leg: the way in the layer before, and the leg that stepped ``(N,)``.
    """

    taken: np.ndarray
    place: FloatArray
    time: FloatArray
    parent: np.ndarray
    leg: np.ndarray


def find_order(
    robot: Quadruped,
    footholds: Footholds,
    settings: CrawlSettings,
    *,
    progress: Progress | None = None,
) -> FreeOrder:
    """The fastest order of steps that was found to keep margin and reach at every one of them.

    Args:
        robot, footholds, settings: as for :func:`gaitopt.plan_crawl`; the settings'
            sequence is not looked at.
        progress: called with (steps done, steps in all).

    Raises:
        InfeasibleStepError: the body cannot stand over the first footholds.
    """
    start = start_for_any_order(robot, footholds, settings)
    points = footholds.array @ rotation_z(settings.heading)
    planner = planner_of(robot, footholds, settings)
    states = 0
    for width in WIDTHS:
        layers = _searched(planner, points, start, width, progress)
        states += sum(len(layer.time) for layer in layers)
        if len(layers) > footholds.steps or max(len(layer.time) for layer in layers) < width:
            break
    return FreeOrder(
        _traced(layers), len(layers) > footholds.steps, float(layers[-1].time.min()), states
    )


def planner_of(robot: Quadruped, footholds: Footholds, settings: CrawlSettings) -> StepPlanner:
    """What plans single steps of a walk."""
    return StepPlanner(robot, settings, float(footholds.array[..., 2].mean()))


def _searched(
    planner: StepPlanner,
    points: FloatArray,
    start: FloatArray,
    width: int,
    progress: Progress | None,
) -> list[_Layer]:
    """Layers from the start on, as far as any order gets."""
    nowhere = np.array([-1])
    layers = [_Layer(np.zeros((1, 4), dtype=int), start[None], np.zeros(1), nowhere, nowhere)]
    steps = 4 * (points.shape[1] - 1)
    for done in range(steps):
        following = _following(planner, points, layers[-1], width)
        if not len(following.time):
            break
        layers.append(following)
        if progress is not None:
            progress(done + 1, steps)
    return layers


def _following(planner: StepPlanner, points: FloatArray, layer: _Layer, width: int) -> _Layer:
    """The fastest ways on from a layer."""
    parent, leg = (a.ravel() for a in np.indices((len(layer.time), len(LEGS))))
    after = layer.taken[parent] + np.eye(len(LEGS), dtype=int)[leg]
    left = np.flatnonzero(after.max(axis=1) < points.shape[1])
    parent, leg, after = parent[left], leg[left], after[left]
    each = np.arange(len(LEGS))
    steps = Steps(
        leg, points[each, layer.taken[parent]], points[each, after], layer.place[parent],
        layer.place[parent],
    )  # fmt: skip
    kept = np.flatnonzero(planner.standing(steps))
    steps = planner.placed(steps.chosen(kept))
    solved = np.flatnonzero(np.isfinite(steps.place[:, 0]))
    kept, steps = kept[solved], steps.chosen(solved)
    time = layer.time[parent[kept]] + planner.durations(steps)
    best = _best(planner, steps, after[kept], time, width)
    kept = kept[best]
    return _Layer(after[kept], steps.place[best], time[best], parent[kept], leg[kept])


def _best(
    planner: StepPlanner, steps: Steps, after: np.ndarray, time: FloatArray, width: int
) -> np.ndarray:
    """The fastest steps that keep the legs apart, :data:`KEPT` into each state."""
    counts: dict[tuple[int, ...], int] = {}
    chosen: list[int] = []
    for i in np.argsort(time, kind="stable").tolist():
        state = tuple(after[i].tolist())
        if not np.isfinite(time[i]) or len(chosen) == width:
            break
        if counts.get(state, 0) < KEPT and planner.apart(steps.chosen(np.array([i]))):
            counts[state] = counts.get(state, 0) + 1
            chosen.append(i)
    return np.array(chosen, dtype=int)


def _traced(layers: list[_Layer]) -> tuple[str, ...]:
    """The legs of the fastest way to the last layer."""
    at = int(layers[-1].time.argmin())
    legs = []
    for layer in layers[:0:-1]:
        legs.append(LEGS[layer.leg[at]])
        at = int(layer.parent[at])
    return tuple(reversed(legs))
