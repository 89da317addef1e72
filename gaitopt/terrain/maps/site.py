"""What all made grounds share: where they are, how large, and how their sizes follow a robot."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.robots.quadruped import Quadruped


@dataclass(frozen=True)
class RobotSize:
    """Lengths of a robot that grounds are made to [m].

    Attributes:
        standing_height: of the hips.
        stance_length, stance_width: between the feet below the hips.
    """

    standing_height: float = 0.40
    stance_length: float = 0.40
    stance_width: float = 0.30

    @classmethod
    def of(cls, robot: Quadruped | None) -> RobotSize:
        """That of a robot; without one, that of wang2020 (the defaults above)."""
        return cls() if robot is None else cls(robot.standing_height, *robot.stance_size)


@dataclass(frozen=True, eq=False)
class Site:
    """The grid of a ground that is made, and its random numbers.

    Attributes:
        x, y: of the points ``(nx, 1)`` and ``(1, ny)`` [m].
        start, end: x between which the ground is not flat [m].
        robot: size of the robot.
        rng: source of random numbers.
    """

    x: FloatArray
    y: FloatArray
    start: float
    end: float
    robot: RobotSize
    rng: np.random.Generator

    @property
    def shape(self) -> tuple[int, int]:
        """Number of points along x and y."""
        return self.x.shape[0], self.y.shape[1]

    @property
    def flat(self) -> FloatArray:
        """Heights of level ground ``(nx, ny)``."""
        return np.zeros(self.shape)

    def jittered(self, pitch: float, jitter: float) -> FloatArray:
        """Places ``(n, 2)`` near the points of a square grid that covers the site [m].

        Args:
            pitch: of the grid [m].
            jitter: how far they are moved at random along x and y, as a share of the pitch.
        """
        x = np.arange(self.start - pitch, self.end + pitch, pitch)
        y = np.arange(self.y[0, 0] - pitch, self.y[0, -1] + pitch, pitch)
        # Where the grid begins is random, too, or else its first row would always be the same.
        shift = self.rng.uniform(0.0, pitch, 2)
        places = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2) + shift
        return np.asarray(places + pitch * self.rng.uniform(-jitter, jitter, places.shape))

    def nearest(self, places: FloatArray, norm: float = 2.0) -> FloatArray:
        """Which of ``places (n, 2)`` is nearest to each point of the grid: numbers ``(nx, ny)``."""
        from scipy.spatial import cKDTree

        points = np.stack(np.broadcast_arrays(self.x, self.y), axis=-1)
        return np.asarray(cKDTree(places).query(points, p=norm)[1])


@dataclass(frozen=True)
class Size:
    """One size of a ground, and how it follows difficulty and robot.

    Attributes:
        name: the keyword that gives it.
        text: what it is, in words.
        easy, hard: its value at difficulty 0 and 1, as a share of ``scale``.
        scale: the length of :class:`RobotSize` that it is a share of; ``""`` for none.
        unit: ``"m"``, ``"rad"`` or ``""``.
        low, high: range that is allowed.
    """

    name: str
    text: str
    easy: float
    hard: float
    scale: str = "standing_height"
    unit: str = "m"
    low: float = 0.0
    high: float = 100.0

    def value(self, difficulty: float, robot: RobotSize) -> float:
        """Its value at a difficulty from 0 to 1, for a robot."""
        share = self.easy + (self.hard - self.easy) * difficulty
        return share * (getattr(robot, self.scale) if self.scale else 1.0)


Build = Callable[[Site, Mapping[str, float]], FloatArray]
"""Makes heights ``(nx, ny)`` [m] of a site with sizes by name. The ground before and after is made
flat by the caller, at the heights 0 and that of :data:`GroundKind.level`."""


@dataclass(frozen=True)
class GroundKind:
    """A kind of ground that can be made.

    Attributes:
        text: what it is, in words.
        build: makes it.
        sizes: what can be given, and the defaults.
        rises: whether the end lies at another height than the start: that of the ground at its end.
    """

    text: str
    build: Build
    sizes: tuple[Size, ...]
    rises: bool = False
