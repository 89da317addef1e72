"""The course of a plan: where base, joints and feet go, whatever the timing.

A course is a curve in pieces, over a parameter ``s``. There are two kinds:

* of a path whose velocities jump (a polyline of joint angles, as walks without acceleration limits
  have): straight lines of base and feet (:mod:`gaitopt.retiming.straight`). The joints follow by
  inverse kinematics. At the end of each line the motion stops, but for corners of a foot's flight
  that are rounded.
* of a smooth path: the path itself, with its own time as the parameter
  (:mod:`gaitopt.retiming.smooth`).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from gaitopt.conventions import BoolArray, FloatArray
from gaitopt.motion.pieces import States
from gaitopt.robots.quadruped import Quadruped

AT_REST = 1e-6
"""Largest velocity of base and joints at which a course counts as at rest [m/s, rad/s]."""


@dataclass(frozen=True, eq=False)
class Grid:
    """Places of a course, between which the acceleration along it is constant.

    Attributes:
        begin, end: of the intervals ``(K,)``, in the course's parameter.
        piece: the piece of the course that each interval lies on ``(K,)``.
        first: first interval of each chain, and ``K`` ``(C + 1,)``. Between chains the motion
            stops.
    """

    begin: FloatArray
    end: FloatArray
    piece: np.ndarray
    first: np.ndarray


class GridPlaces(NamedTuple):
    """Both ends of all intervals of a grid; neighbours may share theirs.

    Attributes:
        s: of the places ``(N,)``.
        piece: the piece of the course on which they are taken ``(N,)``.
        begin, end: place at which each interval begins and ends ``(K,)``.
    """

    s: FloatArray
    piece: np.ndarray
    begin: np.ndarray
    end: np.ndarray

    @classmethod
    def of(cls, grid: Grid, shared: BoolArray) -> GridPlaces:
        """The places of a grid.

        Args:
            grid: the intervals.
            shared: which intervals begin at the place where the one before ends, if that is one of
                their chain ``(K,)``.
        """
        begins = ~shared
        begins[grid.first[:-1]] = True
        end = np.cumsum(1 + begins) - 1
        s, piece = np.empty(end[-1] + 1), np.empty(end[-1] + 1, dtype=int)
        s[end - 1], piece[end - 1] = grid.begin, grid.piece
        s[end], piece[end] = grid.end, grid.piece
        return cls(s, piece, end - 1, end)


class Course(ABC):
    """A curve of base, joints and feet in pieces."""

    robot: Quadruped
    standing: BoolArray
    """Which feet stand on each piece ``(P, 4)``."""
    moments: FloatArray
    """An instant of the old plan at which it is on each piece ``(P,)`` [s]."""
    continuous: BoolArray
    """Which pieces begin as the one before ends, if that is one of their chain: two derivatives do
    not jump there ``(P,)``."""

    @abstractmethod
    def states(self, s: FloatArray, piece: np.ndarray) -> States:
        """Columns of a path ``(N, 6 + nj)``, and two derivatives by ``s``, on given pieces."""

    @abstractmethod
    def feet(self, s: FloatArray, piece: np.ndarray) -> FloatArray:
        """All feet ``(N, 4, 3)`` [m], in the world."""

    @abstractmethod
    def way(self, piece: np.ndarray) -> FloatArray:
        """How far the body or a foot goes on given pieces ``(N,)`` [m], whichever is farther.

        By a unit of ``s``; 0 where a course does not know.
        """

    @abstractmethod
    def grid(self) -> Grid:
        """The intervals of the timing."""

    @property
    @abstractmethod
    def marks(self) -> tuple[FloatArray, FloatArray]:
        """Times of the old plan that stand for places of the course: times, and ``s``."""
