"""States of the search: where four feet stand and where the body is, after a number of steps."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from gaitopt.conventions import BoolArray, FloatArray
from gaitopt.planners.over_terrain.beam.ending import Ending
from gaitopt.planners.over_terrain.pairs import Cause

CHILDREN = 3
"""Of a beam's states at most one in so many comes from one state before."""


class Layer(NamedTuple):
    """States after a number of steps.

    Attributes:
        feet: where the feet stand ``(N, 4, 3)`` [m].
        stands: numbers of the feet's stands, -1 for a place at the start ``(N, 4)``.
        body: x, y, z, roll, pitch, yaw of the body centre ``(N, 6)``.
        made: how many steps each leg has made ``(N, 4)``.
        cost: of the way so far, with penalties ``(N,)`` [s].
        parent: the state of the layer before ``(N,)``.
        leg: index of the leg that stepped last ``(N,)``.
        rise: height of its swing above its higher end ``(N,)`` [m].
        rolled: how far the feet have rolled on their footholds ``(N, 4, 3, 2)`` [m]
            (:func:`gaitopt.planners.over_terrain.links.rolling.rolled_on`).
        seconds: estimate of the time that the way so far takes ``(N,)`` [s].
    """

    feet: FloatArray
    stands: np.ndarray
    body: FloatArray
    made: np.ndarray
    cost: FloatArray
    parent: np.ndarray
    leg: np.ndarray
    rise: FloatArray
    rolled: FloatArray
    seconds: FloatArray


@dataclass(frozen=True, eq=False)
class Found:
    """What one search found.

    Attributes:
        layers: the states after each step.
        steps: how many steps get to the goal.
        refused: how many pairs of the last step that was tried each cause refused.
        tried: numbers of the stands that were tried ``(n,)``.
        width: of the beam at the end.
        work: tries of steps that it took.
        ended: how it ended.
    """

    layers: tuple[Layer, ...]
    steps: int
    refused: dict[Cause, int]
    tried: np.ndarray
    width: int
    work: int
    ended: Ending

    @property
    def late(self) -> bool:
        """Whether it ended because its time was over."""
        return self.ended is Ending.TIME

    @property
    def complete(self) -> bool:
        """Whether the goal is reached."""
        return len(self.layers) > self.steps

    def best(self) -> list[tuple[Layer, int]]:
        """The cheapest way, as a layer and the number of a state in it, from the start on."""
        state = int(self.layers[-1].cost.argmin())
        out = []
        for layer in reversed(self.layers):
            out.append((layer, state))
            state = int(layer.parent[state])
        return out[::-1]


class Candidate(NamedTuple):
    """A step that was found possible.

    Attributes:
        cost: of the way with it [s].
        state: number of the state in the layer before.
        stand: number of the stand that the foot goes to.
        leg: index of the leg that steps.
        target: where the foot goes ``(3,)`` [m].
        body: x, y, z, roll, pitch, yaw of the body centre during the swing ``(6,)``.
        rise: height of the swing above its higher end [m].
        rolled: how far the feet have rolled ``(4, 3, 2)`` [m].
        seconds: estimate of the time that it takes [s].
    """

    cost: float
    state: int
    stand: int
    leg: int
    target: FloatArray
    body: FloatArray
    rise: float
    rolled: FloatArray
    seconds: float


class Kept:
    """States of the next layer, while pairs are judged.

    Args:
        width: states that are kept at most.
        look: a last look at steps, which tells the possible ones; it costs much, so only those
            that would be kept are looked at.
    """

    def __init__(self, width: int, look: Callable[[Sequence[Candidate]], BoolArray]) -> None:
        self.width, self.each = width, max(-(-width // CHILDREN), 1)
        self.look = look
        self.new: list[Candidate] = []
        self.good: list[Candidate] = []

    @property
    def full(self) -> bool:
        """Whether there are enough."""
        return len(self.new) + len(self.good) >= 2 * self.width

    def add(self, step: Candidate) -> None:
        """Put in a possible step."""
        self.new.append(step)

    def settled(self) -> list[Candidate]:
        """The cheapest, few of each state, after a last look; others are dropped."""
        while True:
            chosen = self._cheapest()
            known = {id(step) for step in self.good}
            asked = [step for step in chosen if id(step) not in known]
            if not asked:
                return chosen
            possible = self.look(asked)
            self.good += [step for step, good in zip(asked, possible, strict=True) if good]
            numbers = {id(step) for step in asked}
            self.new = [step for step in self.new if id(step) not in numbers]

    def layer(self, before: Layer) -> Layer | None:
        """The states of the next layer; ``None`` for none."""
        chosen = self.settled()
        if not chosen:
            return None
        state = np.array([step.state for step in chosen])
        leg = np.array([step.leg for step in chosen])
        own = np.arange(len(chosen))
        feet, stands, made = before.feet[state], before.stands[state], before.made[state]
        feet[own, leg] = [step.target for step in chosen]
        stands[own, leg] = [step.stand for step in chosen]
        made[own, leg] += 1
        return Layer(
            feet, stands, np.array([step.body for step in chosen]), made,
            np.array([step.cost for step in chosen]), state, leg,
            np.array([step.rise for step in chosen]), np.array([step.rolled for step in chosen]),
            before.seconds[state] + [step.seconds for step in chosen],
        )  # fmt: skip

    def _cheapest(self) -> list[Candidate]:
        """The cheapest of them, few of each state."""
        both = self.new + self.good
        several = len({step.state for step in both}) > 1
        chosen: list[Candidate] = []
        of_state: Counter[int] = Counter()
        for step in sorted(both, key=lambda s: s[:3]):
            if several and of_state[step.state] >= self.each:
                continue
            of_state[step.state] += 1
            chosen.append(step)
            if len(chosen) == self.width:
                break
        return chosen
