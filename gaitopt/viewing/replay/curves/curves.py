"""Curves over a replay's time, and how the page's script is given them."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.viewing.replay.curves.clearance import Clearance
from gaitopt.viewing.replay.numbers import packed

TIME_UNIT, SHARE_UNIT, MARGIN_UNIT, FORCE_UNITS = 1e-5, 2e-3, 1e-4, 500.0
"""Units of the numbers in the page [s], [1], [m]; and how many units of force the weight has.
Chosen: a pixel of a curve that is 60 pixels high is more."""
NOTHING = -1e3
"""In place of a margin where there is none."""


class Joints(NamedTuple):
    """Of each joint its name, its leg, and the frame of the scene that moves with it."""

    names: tuple[str, ...]
    legs: tuple[str, ...]
    frames: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Curves:
    """What is drawn over time at ``N`` instants.

    Attributes:
        times: of the instants ``(N,)`` [s], not decreasing.
        standing: for each leg, when it stands: ``((start, end), ...)`` [s].
        joints: the robot's.
        velocity_use: joint velocities as shares of their limits ``(N, nj)``.
        torque_use: joint torques as shares of theirs ``(N, nj)``; ``None`` where they are not
            known.
        margin: stability margin of the instant ``(N,)`` [m], NaN where there is none: where fewer
            than three feet stand, or for the ZMP, whose margin over two feet is minus its distance
            from the line between them, fewer than two. ``None`` for no curve.
        margin_name: what it is the margin of.
        promised: margin that the plan promises [m].
        pressing: vertical force of the ground on each foot ``(N, 4)`` [N]; ``None`` where it is not
            known.
        weight: of the robot [N].
        clearance: how far legs and trunk are above the ground, straight down; ``None`` where there
            is no map.
        notes: what is left out, and why.
    """

    times: FloatArray
    standing: dict[str, tuple[tuple[float, float], ...]]
    joints: Joints
    velocity_use: FloatArray
    torque_use: FloatArray | None = None
    margin: FloatArray | None = None
    margin_name: str = ""
    promised: float = 0.0
    pressing: FloatArray | None = None
    weight: float = 0.0
    clearance: Clearance | None = None
    notes: tuple[str, ...] = field(default=())


def curve_data(curves: Curves | None) -> dict[str, Any] | None:
    """The curves for the page's script ``curves.js``."""
    if curves is None:
        return None
    force_unit = curves.weight / FORCE_UNITS or 1.0
    return {
        "times": packed(curves.times, TIME_UNIT),
        "standing": {leg: [[round(t, 5) for t in span] for span in spans]
                     for leg, spans in curves.standing.items()},
        "joints": list(curves.joints.names),
        "legs": list(curves.joints.legs),
        "frames": list(curves.joints.frames),
        "velocity": _shares(curves.velocity_use),
        "torque": None if curves.torque_use is None else _shares(curves.torque_use),
        "margin": _lengths(curves.margin),
        "marginName": curves.margin_name,
        "promised": curves.promised,
        "forces": None if curves.pressing is None else packed(curves.pressing, force_unit),
        "weight": curves.weight,
        "clearance": None if curves.clearance is None else _lengths(curves.clearance.gap),
        "nearest": None if curves.clearance is None
        else packed(curves.clearance.place, MARGIN_UNIT),
        "notes": list(curves.notes),
    }  # fmt: skip


def _shares(use: FloatArray) -> dict[str, Any]:
    """Shares of limits; joints without a known limit have none of it in use."""
    return packed(np.where(np.isfinite(use), use, 0.0), SHARE_UNIT)


def _lengths(values: FloatArray | None) -> dict[str, Any] | None:
    if values is None or not np.isfinite(values).any():
        return None
    return packed(np.where(np.isfinite(values), values, NOTHING), MARGIN_UNIT)
