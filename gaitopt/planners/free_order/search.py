"""The free gait: a search finds which leg steps next ([Wang2020], Section II, names it only).

A *state* says how many steps each leg has taken. Whether a step is possible depends on the state
and not on how the body came there: on four feet the body may go straight from any place of the last
step to any place of the next one. So a search over all states, one step after another, finds an
order of steps wherever there is one. A *candidate* is a state with a place of the body, and the
time that it took to get there. Most walks do not need all candidates, so only the fastest few of
each layer are kept at first (a beam search).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from gaitopt.conventions import LEGS, FloatArray, Progress, rotation_z
from gaitopt.plan.settings.crawl import CrawlSettings
from gaitopt.planners.free_order.steps import StepPlanner, Steps
from gaitopt.planners.phase_by_phase.steps import mean_height, swing_lifts
from gaitopt.planners.phase_by_phase.targets import start_for_any_order
from gaitopt.robots.quadruped import Quadruped
from gaitopt.terrain.footholds import Footholds

BEAM_WIDTHS = (64, 512, 100_000)
"""Most candidates that are kept after each step; the next is tried where one finds no order.

Chosen here. The last one keeps all candidates of walks over up to 33 footholds a leg: these have at
most 24,000 states after any number of steps."""
CANDIDATES_PER_STATE = 4
"""Most candidates that are kept in one state. They differ in the place of the body, which matters
for the time of the next step only."""


@dataclass(frozen=True)
class FreeOrder:
    """What the search found.

    Attributes:
        legs: the leg of each step ``(S,)``; of the first ``S`` steps only, where no order gets to
            the end.
        complete: whether all steps are there.
        duration: of the walk planned phase by phase, estimated [s].
        candidates: how many were kept in all.
    """

    legs: tuple[str, ...]
    complete: bool
    duration: float
    candidates: int


class _Ground(NamedTuple):
    """What feet may step onto.

    Attributes:
        points: footholds in the heading frame ``(4, n, 3)`` [m].
        steps: how often each leg steps ``(4,)``.
        lifts: how far the foot rises above the higher end of each swing ``(4, n - 1)`` [m]; ``n``
            is the number of the leg that has most footholds.
    """

    points: FloatArray
    steps: np.ndarray
    lifts: FloatArray

    @classmethod
    def of(cls, footholds: Footholds, settings: CrawlSettings) -> _Ground:
        """That of a walk."""
        steps = np.array([footholds.counts[leg] - 1 for leg in LEGS])
        lifts = np.zeros((len(LEGS), max(len(footholds) - 1, 1)))
        for i, leg in enumerate(LEGS):
            each = [(leg, k + 1) for k in range(int(steps[i]))]
            lifts[i, : len(each)] = swing_lifts(footholds, each, settings.swing_height)
        return cls(footholds.array @ rotation_z(settings.heading), steps, lifts)


class _Layer(NamedTuple):
    """The candidates after a number of steps.

    Attributes:
        taken: steps of each leg ``(N, 4)``.
        place: body centre ``(N, 3)`` [m].
        time: since the start ``(N,)`` [s].
        parent: the candidate of the layer before from which each comes ``(N,)``.
        leg: index of the leg that stepped last ``(N,)``.
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
    """The fastest order that the search finds in which every step keeps its margin and reach.

    Args:
        robot, footholds, settings: as for :func:`gaitopt.plan_crawl`; the settings' sequence does
            not matter.
        progress: called with (steps done, steps in all).

    Raises:
        InputError: legs cross in the first stance.
        InfeasibleStepError: the body cannot stand over the first footholds.
    """
    start = start_for_any_order(robot, footholds, settings)
    ground = _Ground.of(footholds, settings)
    planner = StepPlanner(robot, settings, mean_height(footholds))
    candidates = 0
    for width in BEAM_WIDTHS:
        layers = _search(planner, ground, start, width, progress)
        candidates += sum(len(layer.time) for layer in layers)
        # Where no layer was cut, a wider search finds nothing else.
        if len(layers) > footholds.steps or max(len(layer.time) for layer in layers) < width:
            break
    complete = len(layers) > footholds.steps
    return FreeOrder(_order_of(layers), complete, float(layers[-1].time.min()), candidates)


def _search(
    planner: StepPlanner,
    ground: _Ground,
    start: FloatArray,
    width: int,
    progress: Progress | None,
) -> list[_Layer]:
    """The layers from the start on, as far as any order gets.

    Args:
        planner: plans single steps.
        ground: what feet may step onto.
        start: body centre at the start ``(3,)`` [m].
        width: most candidates of a layer.
        progress: called with (steps done, steps in all).
    """
    none = np.array([-1])
    layers = [_Layer(np.zeros((1, 4), dtype=int), start[None], np.zeros(1), none, none)]
    steps = int(ground.steps.sum())
    for done in range(steps):
        layer = _next_layer(planner, ground, layers[-1], width)
        if not len(layer.time):
            break
        layers.append(layer)
        if progress is not None:
            progress(done + 1, steps)
    return layers


def _next_layer(planner: StepPlanner, ground: _Ground, layer: _Layer, width: int) -> _Layer:
    """The candidates one step later; arguments as for :func:`_search`."""
    parent, leg = (a.ravel() for a in np.indices((len(layer.time), len(LEGS))))
    taken = layer.taken[parent] + np.eye(len(LEGS), dtype=int)[leg]
    exists = np.flatnonzero((taken <= ground.steps).all(axis=1))
    parent, leg, taken = parent[exists], leg[exists], taken[exists]
    each, points = np.arange(len(LEGS)), ground.points
    steps = Steps(
        leg, points[each, layer.taken[parent]], points[each, taken], layer.place[parent],
        layer.place[parent], ground.lifts[leg, layer.taken[parent, leg]],
    )  # fmt: skip
    kept = np.flatnonzero(planner.can_stand(steps))
    steps = planner.with_places(steps.chosen(kept))
    solved = np.flatnonzero(np.isfinite(steps.place[:, 0]))
    kept, steps = kept[solved], steps.chosen(solved)
    time = layer.time[parent[kept]] + planner.durations(steps)
    best = _fastest(planner, steps, taken[kept], time, width)
    kept = kept[best]
    return _Layer(taken[kept], steps.place[best], time[best], parent[kept], leg[kept])


def _fastest(
    planner: StepPlanner, steps: Steps, taken: np.ndarray, time: FloatArray, width: int
) -> np.ndarray:
    """Numbers of the fastest steps that keep the legs apart, a few into each state.

    Args:
        planner: plans single steps.
        steps: the steps ``(E,)``.
        taken: steps of each leg after them ``(E, 4)``.
        time: since the start ``(E,)`` [s].
        width: most steps that are chosen.
    """
    counts: dict[tuple[int, ...], int] = {}
    chosen: list[int] = []
    for i in np.argsort(time, kind="stable").tolist():
        state = tuple(taken[i].tolist())
        if not np.isfinite(time[i]) or len(chosen) == width:
            break
        if counts.get(state, 0) < CANDIDATES_PER_STATE and planner.keeps_apart(
            steps.chosen(np.array([i]))
        ):
            counts[state] = counts.get(state, 0) + 1
            chosen.append(i)
    return np.array(chosen, dtype=int)


def _order_of(layers: list[_Layer]) -> tuple[str, ...]:
    """The legs of the steps to the fastest candidate of the last layer."""
    at = int(layers[-1].time.argmin())
    legs = []
    for layer in layers[:0:-1]:
        legs.append(LEGS[layer.leg[at]])
        at = int(layer.parent[at])
    return tuple(reversed(legs))
