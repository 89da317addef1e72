"""States of the search: where four feet stand and where the body is, after a number of steps."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from gaitopt.conventions import FloatArray
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
        cost: of the way so far ``(N,)``.
        parent: the state of the layer before ``(N,)``.
        leg: index of the leg that stepped last ``(N,)``.
        rise: height of its swing above its higher end ``(N,)`` [m].
        rolled: how far the feet have rolled on their footholds ``(N, 4, 3, 2)`` [m]
            (:func:`gaitopt.planners.over_terrain.links.rolling.rolled_on`).
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
        late: whether it ended because its time was over.
    """

    layers: tuple[Layer, ...]
    steps: int
    refused: dict[Cause, int]
    tried: np.ndarray
    width: int
    work: int
    late: bool = False

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


class Kept:
    """States of the next layer, while pairs are judged."""

    def __init__(self, width: int) -> None:
        self.width, self.each = width, max(-(-width // CHILDREN), 1)
        self.rows: list[tuple[float, int, int, int, FloatArray, FloatArray, float, FloatArray]]
        self.rows = []
        self.of_state: Counter[int] = Counter()

    @property
    def full(self) -> bool:
        """Whether there are enough."""
        return len(self.rows) >= 2 * self.width

    def add(
        self, state: int, stand: int, leg: int, cost: float, target: FloatArray, body: FloatArray,
        rise: float, rolled: FloatArray,
    ) -> None:  # fmt: skip
        self.rows.append((cost, state, stand, leg, target, body, rise, rolled))

    def layer(self, before: Layer, legs: np.ndarray) -> Layer | None:
        """The cheapest of them, few of each state."""
        if not self.rows:
            return None
        several = len({row[1] for row in self.rows}) > 1
        chosen = []
        for row in sorted(self.rows, key=lambda r: (r[0], r[1], r[2])):
            if several and self.of_state[row[1]] >= self.each:
                continue
            self.of_state[row[1]] += 1
            chosen.append(row)
            if len(chosen) == self.width:
                break
        state = np.array([row[1] for row in chosen])
        leg = np.array([row[3] for row in chosen])
        own = np.arange(len(chosen))
        feet, stands, made = before.feet[state], before.stands[state], before.made[state]
        feet[own, leg] = [row[4] for row in chosen]
        stands[own, leg] = [row[2] for row in chosen]
        made[own, leg] += 1
        return Layer(
            feet, stands, np.array([row[5] for row in chosen]), made,
            np.array([row[0] for row in chosen]), state, leg,
            np.array([row[6] for row in chosen]), np.array([row[7] for row in chosen]),
        )  # fmt: skip
