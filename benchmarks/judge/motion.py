"""A plan, sampled by Pinocchio: every millisecond, at both sides of every knot and between them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import pinocchio as pin

from gaitopt import LEGS, Plan, Quadruped
from gaitopt.conventions import BoolArray, FloatArray

STEP = 1e-3
"""Time between samples [s]."""
MOST_SAMPLES = 6000
"""About the most samples of a plan; longer plans are looked at in longer steps."""
INSTANT = 1e-9
"""Times that are nearer than this are the same [s]."""


@dataclass(frozen=True)
class Finding:
    """What a check found.

    Attributes:
        check: its name, that of the table in ``docs/trust.md``.
        value, limit: the worst number and what it is held against.
        violated: whether it is beyond the limit.
        where: when, which leg.
    """

    check: str
    value: float
    limit: float
    violated: bool
    where: str = ""

    def __str__(self) -> str:
        word = "violated" if self.violated else "ok"
        return f"{self.check}: {word}, {self.value:.6g} against {self.limit:.6g} ({self.where})"


def at_most(check: str, values: Any, limit: float, where: Any = "") -> Finding:
    """A finding about numbers that must not be above a limit; NaN violates it."""
    array = np.atleast_1d(np.asarray(values, dtype=np.float64)).ravel()
    if array.size == 0:
        return Finding(check, -math.inf, limit, False, "nothing to look at")
    k = int(np.argmax(np.where(np.isnan(array), np.inf, array)))
    place = where if isinstance(where, str) else f"{where[k]}"
    return Finding(check, float(array[k]), limit, not array[k] <= limit, place)


def at_least(check: str, values: Any, limit: float, where: Any = "") -> Finding:
    """A finding about numbers that must not be below a limit; NaN violates it."""
    found = at_most(check, -np.asarray(values, dtype=np.float64), -limit, where)
    return Finding(check, -found.value, limit, found.violated, found.where)


def polynomials(
    coefficients: FloatArray, segments: np.ndarray, local: FloatArray, order: int
) -> FloatArray:
    """A derivative of the path ``(N, n)`` on given segments, by Horner's rule.

    Args:
        coefficients: of the path, the highest power first.
        segments: index of the segment of each sample ``(N,)``.
        local: time since its begin ``(N,)`` [s].
        order: of the derivative; 0 for the values.
    """
    degree = len(coefficients) - 1
    out = np.zeros((len(segments), coefficients.shape[2]))
    for row, power in enumerate(range(degree, order - 1, -1)):
        factor = math.prod(range(power - order + 1, power + 1))
        out = out * local[:, None] + factor * coefficients[row, segments]
    return out


def rotation(rpy: FloatArray) -> FloatArray:
    """``Rz Ry Rx`` of roll, pitch and yaw."""
    return np.asarray(pin.rpy.rpyToMatrix(*rpy.tolist()))


class Motion:
    """All that checks need to know of a plan's motion at its samples.

    Args:
        plan: the plan.
        closer: how many times as many samples are taken as usual.

    Attributes:
        plan: the plan.
        robot: read anew from the plan's URDF.
        model, data: Pinocchio's, built here from the same text.
        segments, local, times: of the samples ``(N,)``: index, time in it and time of the plan [s].
        values, rates: of the path at the samples ``(N, 6 + nj)``.
    """

    def __init__(self, plan: Plan, closer: int = 1) -> None:
        self.plan = plan
        old = plan.robot
        self.robot = Quadruped.from_urdf(old.urdf, old.name, dict(old.knees) or None)
        self.model = pin.buildModelFromXML(old.urdf, pin.JointModelFreeFlyer())
        self.model.armature[6:] = self.robot.motor_inertia
        self.data = self.model.createData()
        self.frames = [self.model.getFrameId(self.robot.legs[leg].foot) for leg in LEGS]
        step = max(STEP, plan.duration / MOST_SAMPLES) / closer
        lengths = np.diff(plan.path.times) if len(plan.path.times) > 1 else np.zeros(1)
        counts = np.maximum(np.ceil(lengths / step).astype(int), 2) + 1
        self.segments = np.repeat(np.arange(len(counts)), counts)
        self.local = np.concatenate([
            np.linspace(0.0, length, count) for length, count in zip(lengths, counts, strict=True)
        ])  # fmt: skip
        self.times = plan.path.times[self.segments] + self.local
        self.values, self.rates = (self.derivative(order) for order in (0, 1))
        self.feet, self.centre, self.com = self.places(self.values)

    def derivative(self, order: int) -> FloatArray:
        """A derivative of the path at the samples ``(N, 6 + nj)``."""
        return polynomials(self.plan.path.coefficients, self.segments, self.local, order)

    def configuration(self, values: FloatArray) -> FloatArray:
        """Pinocchio's ``q`` of one row of the path."""
        turn = pin.Quaternion(rotation(values[3:6])).coeffs()
        return np.concatenate([values[:3], turn, values[6:]])

    def places(self, values: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Feet ``(N, 4, 3)``, body centre and true centre of mass ``(N, 3)`` [m]."""
        feet = np.empty((len(values), 4, 3))
        centre, com = np.empty((len(values), 3)), np.empty((len(values), 3))
        middle = self.robot.body_axes @ self.robot.centre
        for k, row in enumerate(values):
            q = self.configuration(row)
            com[k] = pin.centerOfMass(self.model, self.data, q)
            centre[k] = row[:3] + self.data.oMi[1].rotation @ middle
            for i, frame in enumerate(self.frames):
                feet[k, i] = pin.updateFramePlacement(self.model, self.data, frame).translation
        return feet, centre, com

    def during(self, start: float, end: float) -> BoolArray:
        """Which samples lie in a closed span of time."""
        return np.asarray((self.times >= start - INSTANT) & (self.times <= end + INSTANT))

    @cached_property
    def inner(self) -> FloatArray:
        """Times of the samples, those at knots moved a little into their own segment ``(N,)``."""
        return self.times + np.where(self.local > 0.0, -INSTANT, INSTANT)

    @cached_property
    def standing(self) -> BoolArray:
        """Which feet stand at each sample, by the phase that holds the sample ``(N, 4)``.

        At an instant between two phases a foot counts as standing in the phase to which the
        sample's segment belongs; the closed spans of flights and stances are used elsewhere.
        """
        ends = np.array([phase.end for phase in self.plan.phases])
        index = np.minimum(np.searchsorted(ends, self.inner), len(ends) - 1)
        flags = np.array([[leg in p.support for leg in LEGS] for p in self.plan.phases])
        return np.asarray(flags[index])

    def stances(self, leg: str) -> list[tuple[float, float, int]]:
        """Spans in which a foot stands, and the index of the foothold it stands on."""
        own = sorted((s for s in self.plan.swings if s.leg == leg), key=lambda s: s.start)
        out, begin = [], 0.0
        index = 0
        for swing in own:
            if swing.index < 0:  # the plan begins with this foot in the air
                begin = swing.end
                continue
            out.append((begin, swing.start, index))
            begin, index = swing.end, index + 1
        out.append((begin, self.plan.duration, index))
        return out
