"""The course of a walk over a map: where the body is to be, and how it is turned, on its way."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from gaitopt.conventions import FloatArray, frozen
from gaitopt.errors import InputError
from gaitopt.inputs import as_text, check_array

SPACING = 0.01
"""Distance between the points of a course [m]."""
LONGEST = 1e4
"""Longest course that is planned [m]."""


@dataclass(frozen=True, eq=False)
class Course:
    """A path of the body over the ground.

    Attributes:
        poses: x, y [m] and yaw [rad], without jumps of whole turns ``(n, 3)``.
        progress: how far the feet have to go to get there ``(n,)`` [m]: the way of the body, and
            what feet at the given distance go when it turns.
        blocked: whether something is in its way that no way round was found for.
        marks: progress at the ends of all cycles, with that at the start ``(cycles + 1,)`` [m];
            ``None`` for cycles that share the way evenly.
    """

    poses: FloatArray
    progress: FloatArray
    blocked: bool = False
    marks: FloatArray | None = None

    def beside(self, aside: float, over: float) -> Course:
        """The course that lies beside this one, from near its start to near its end.

        Args:
            aside: how far to the left [m]; to the right where negative.
            over: progress over which it goes there, and back [m]; at most a quarter of the length.
        """
        over = min(over, self.length / 4.0)
        ends = np.minimum(self.progress, self.length - self.progress)
        share = np.clip(ends / over, 0.0, 1.0)
        left = np.column_stack([-np.sin(self.poses[:, 2]), np.cos(self.poses[:, 2])])
        poses = self.poses.copy()
        poses[:, :2] += aside * share[:, None] * left
        return replace(self, poses=frozen(poses))

    @property
    def length(self) -> float:
        """Progress at its end [m]."""
        return float(self.progress[-1])

    def after(self, made: float | FloatArray, cycles: int) -> FloatArray:
        """Progress after a number of cycles, of which there are ``cycles`` in all [m]."""
        if self.marks is None:
            return np.asarray(self.length * np.asarray(made) / max(cycles, 1))
        return np.asarray(np.interp(made, np.arange(len(self.marks)), self.marks))

    def at(self, progress: float | FloatArray) -> FloatArray:
        """Poses ``(..., 3)`` at values of the progress ``(...)`` [m]."""
        return np.stack(
            [np.interp(progress, self.progress, column) for column in self.poses.T], axis=-1
        )


def course_through(start: ArrayLike, goal: ArrayLike, *, feet: float, smoothing: float) -> Course:
    """The course from a pose through places or poses to the last of them.

    Between two places it is straight. Where no yaw is given the body faces along its way, and turns
    over ``smoothing`` about corners; at the start it turns on the spot where it has to.

    Args:
        start: x, y [m], yaw [rad] ``(3,)``.
        goal: a place ``(2,)``, a pose ``(3,)``, or several: ``(n, 2)`` or ``(n, 3)``.
        feet: distance of the feet from the body centre, which turning moves them by [m].
        smoothing: length along which the yaw changes at a corner [m].

    Raises:
        InputError: the goal is none of these, or the same place as the start.
    """
    begin = _numbers("start", start)
    if begin.shape != (3,):
        raise InputError(f"start must be x, y and yaw (3,), got the shape {begin.shape}")
    ends = _numbers("goal", goal)
    ends = ends[None] if ends.ndim == 1 else ends
    if ends.ndim != 2 or ends.shape[1] not in (2, 3) or not len(ends):
        raise InputError(
            "goal must be a place (x, y), a pose (x, y, yaw), or a list of either, got an array of "
            f"the shape {np.shape(goal)}"
        )
    corners = np.vstack([begin[:2], ends[:, :2]])
    lengths = np.linalg.norm(np.diff(corners, axis=0), axis=1)
    if lengths.sum() > LONGEST:
        raise InputError(
            f"the goal is {lengths.sum():.3g} m away; at most {LONGEST:g} m are planned"
        )
    if ends.shape[1] == 3:
        yaws = np.unwrap(np.append(begin[2], ends[:, 2]))
        poses = _with_yaws(corners, yaws, lengths, feet)
    else:
        if not lengths.sum() > 0.0:
            raise InputError("the goal is where the walk starts")
        poses = _facing_ahead(corners[np.append(True, lengths > 0.0)], begin[2], smoothing, feet)
    moved = np.diff(poses, axis=0)
    steps = np.hypot(moved[:, 0], moved[:, 1]) + feet * np.abs(moved[:, 2])
    if not steps.sum() > 0.0:
        raise InputError("the goal is the pose at which the walk starts")
    return Course(frozen(poses), frozen(np.append(0.0, np.cumsum(steps))))


def _with_yaws(
    corners: FloatArray, yaws: FloatArray, lengths: FloatArray, feet: float
) -> FloatArray:
    """Poses along straight lines, along each of which the yaw changes evenly."""
    out = [np.append(corners[0], yaws[0])[None]]
    for k, length in enumerate(lengths):
        turn = abs(yaws[k + 1] - yaws[k])
        count = max(int(np.ceil((length + feet * turn) / SPACING)), 1)
        share = np.arange(1, count + 1)[:, None] / count
        first = np.append(corners[k], yaws[k])
        out.append(first + share * (np.append(corners[k + 1], yaws[k + 1]) - first))
    return np.concatenate(out)


def _facing_ahead(corners: FloatArray, yaw: float, smoothing: float, feet: float) -> FloatArray:
    """Poses along straight lines, facing along them, after turning on the spot at the start."""
    lengths = np.linalg.norm(np.diff(corners, axis=0), axis=1)
    ends = np.append(0.0, np.cumsum(lengths))
    count = max(int(np.ceil(ends[-1] / SPACING)), 1)
    along = np.linspace(0.0, ends[-1], count + 1)
    places = np.column_stack([np.interp(along, ends, c) for c in corners.T])
    directions = np.unwrap(np.arctan2(*np.diff(corners, axis=0).T[::-1]))
    # The mean direction over a stretch about each place: the yaw changes evenly about a corner.
    turned = np.append(0.0, np.cumsum(directions * lengths))
    half = min(smoothing, ends[-1]) / 2.0
    low, high = np.clip(along - half, 0.0, ends[-1]), np.clip(along + half, 0.0, ends[-1])
    yaws = (np.interp(high, ends, turned) - np.interp(low, ends, turned)) / (high - low)
    yaws += 2.0 * np.pi * np.round((yaw - yaws[0]) / (2.0 * np.pi))
    steps = max(int(np.ceil(abs(yaws[0] - yaw) * feet / SPACING)), 0)
    turning = np.column_stack([
        np.tile(corners[0], (steps, 1)), np.linspace(yaw, yaws[0], steps, endpoint=False)
    ])  # fmt: skip
    return np.concatenate([turning, np.column_stack([places, yaws])])


def _numbers(name: str, values: ArrayLike) -> FloatArray:
    array = check_array(name, values, "m, rad")
    if not np.isfinite(array).all():
        raise InputError(f"{name} must be finite numbers, got {as_text(values)}")
    return array
