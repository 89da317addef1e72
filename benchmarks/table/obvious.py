"""The same walk the obvious way: IPOPT for every COG, a linear program for every sample.

Written as one would at a first go, from the equations of [Wang2020] and none of
gaitopt's planner: the half-planes, discs, swings and inverse kinematics here are its own. It serves
legs without offsets, on a body that keeps its height and faces along x, which is the main job.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise
from typing import Any, NamedTuple

import casadi as ca
import numpy as np
import pinocchio as pin
from scipy.optimize import linprog

from gaitopt import LEGS, Footholds, Leg, Quadruped
from gaitopt.conventions import FloatArray

MARGIN, BODY_HEIGHT, SWING_HEIGHT = 0.02, 0.40, 0.07
SEQUENCE = ("RH", "RF", "LH", "LF")
_IPOPT: dict[str, Any] = {"print_time": False, "ipopt.print_level": 0, "ipopt.sb": "yes"}


class Step(NamedTuple):
    """One step: which leg swings, from which feet (by leg), onto what."""

    leg: str
    feet: dict[str, FloatArray]
    target: FloatArray


class Areas(NamedTuple):
    """Areas A and B of one step.

    Attributes:
        normals, offsets: the support triangle ``{p : normals p >= offsets}``, ``(3, 2)``, ``(3,)``.
        centres, radii: the discs, ``(5, 2)``, ``(5,)``.
    """

    normals: FloatArray
    offsets: FloatArray
    centres: FloatArray
    radii: FloatArray


CogSolver = Callable[[Areas, FloatArray], FloatArray]


def steps_of(footholds: Footholds) -> list[Step]:
    """All steps of a walk."""
    feet = {leg: footholds[leg][0] for leg in LEGS}
    steps = []
    for k in range(1, len(footholds)):
        for leg in SEQUENCE:
            steps.append(Step(leg, dict(feet), footholds[leg][k]))
            feet[leg] = footholds[leg][k]
    return steps


def areas_of(robot: Quadruped, step: Step, height: float) -> Areas:
    """Half-planes and discs of a step, the body centre at ``height``."""
    a, b, c = (step.feet[leg][:2] for leg in LEGS if leg != step.leg)
    normals, offsets = [], []
    for start, end, other in ((a, b, c), (b, c, a), (c, a, b)):
        along = (end - start) / np.linalg.norm(end - start)
        normal = np.array([-along[1], along[0]])
        normal = normal if normal @ (other - start) > 0 else -normal
        normals.append(normal)
        offsets.append(normal @ start)
    centres, radii = [], []
    for leg, foot in [*step.feet.items(), (step.leg, step.target)]:
        hip = robot.legs[leg].hip - robot.centre
        centres.append(foot[:2] - hip[:2])
        radii.append(math.sqrt(robot.legs[leg].reach ** 2 - (height + hip[2] - foot[2]) ** 2))
    return Areas(np.array(normals), np.array(offsets), np.array(centres), np.array(radii))


def cog_anew(areas: Areas, start: FloatArray) -> FloatArray:
    """The COG target, from an Opti problem built for this one step."""
    opti = ca.Opti()
    place = opti.variable(2)
    opti.minimize(ca.sumsqr(place - start))
    for normal, offset in zip(areas.normals, areas.offsets, strict=True):
        opti.subject_to(ca.dot(normal, place) >= offset + MARGIN)
    for centre, radius in zip(areas.centres, areas.radii, strict=True):
        opti.subject_to(ca.sumsqr(place - centre) <= radius**2)
    opti.set_initial(place, start)
    opti.solver("ipopt", _IPOPT)
    return np.asarray(opti.solve().value(place))


def parametric_cog() -> CogSolver:
    """A COG solver that is built once, with the step's numbers as parameters."""
    place, start = ca.SX.sym("place", 2), ca.SX.sym("start", 2)
    normals, offsets = ca.SX.sym("normals", 3, 2), ca.SX.sym("offsets", 3)
    centres, radii = ca.SX.sym("centres", 5, 2), ca.SX.sym("radii", 5)
    discs = [radii[i] ** 2 - ca.sumsqr(place - centres[i, :].T) for i in range(5)]
    problem = {
        "x": place,
        "f": ca.sumsqr(place - start),
        "g": ca.vertcat(normals @ place - offsets - MARGIN, *discs),
        "p": ca.veccat(start, normals, offsets, centres, radii),
    }
    solver = ca.nlpsol("cog", "ipopt", problem, _IPOPT)

    def solve(areas: Areas, start: FloatArray) -> FloatArray:
        parameters = np.concatenate([start, *(np.ravel(a, order="F") for a in areas)])
        return np.asarray(solver(x0=start, p=parameters, lbg=0.0, ubg=np.inf)["x"]).ravel()

    return solve


def walk_cogs(robot: Quadruped, steps: list[Step], solve: CogSolver) -> FloatArray:
    """COG places before the walk and at every step ``(S + 1, 3)``, one solve after the other."""
    feet = np.array(list(steps[0].feet.values()))
    height = feet[:, 2].mean() + BODY_HEIGHT
    places = [feet[:, :2].mean(axis=0)]
    for step in steps:
        places.append(solve(areas_of(robot, step, height), places[-1]))
    return np.column_stack([places, np.full(len(places), height)])


def walk_time(
    robot: Quadruped, steps: list[Step], cogs: FloatArray, samples: list[tuple[int, int]]
) -> float:
    """Duration of the walk [s], its speeds from linear programs.

    Args:
        robot, steps: what is walked.
        cogs: from :func:`walk_cogs`.
        samples: intervals in which each stance phase and each swing is cut.
    """
    speeds = _Speeds(robot)
    total = 0.0
    for s, (step, (in_stance, in_swing)) in enumerate(zip(steps, samples, strict=True)):
        total += _stance_time(speeds, step, cogs[s], cogs[s + 1], in_stance)
        total += _swing_time(speeds, step, cogs[s + 1], in_swing)
    return total


def _stance_time(
    speeds: _Speeds, step: Step, start: FloatArray, end: FloatArray, samples: int
) -> float:
    """The body goes straight from ``start`` to ``end``, as fast as the slowest leg allows."""
    total = 0.0
    for a, b in _pieces(start, end, samples):
        body, way = (a + b) / 2.0, b - a
        q = speeds.configuration(body, step.feet)
        # Seen from the body, the feet move backward.
        speed = min(speeds.foot_speed(q, leg, -way) for leg in LEGS)
        total += float(np.linalg.norm(way)) / speed
    return total


def _swing_time(speeds: _Speeds, step: Step, body: FloatArray, samples: int) -> float:
    """The foot goes up, across and down."""
    up = np.array([0.0, 0.0, SWING_HEIGHT])
    corners = [step.feet[step.leg], step.feet[step.leg] + up, step.target + up, step.target]
    total = 0.0
    for start, end in pairwise(corners):
        for a, b in _pieces(start, end, samples // 3):
            q = speeds.configuration(body, {**step.feet, step.leg: (a + b) / 2.0})
            total += float(np.linalg.norm(b - a)) / speeds.foot_speed(q, step.leg, b - a)
    return total


def _pieces(start: FloatArray, end: FloatArray, count: int) -> list[tuple[FloatArray, FloatArray]]:
    """A straight way cut into pieces, shorter at its ends, where a straight leg is slow."""
    shares = (1.0 - np.cos(np.pi * np.arange(count + 1) / count)) / 2.0 if count else np.zeros(1)
    points = [start + share * (end - start) for share in shares]
    return list(pairwise(points))


class _Speeds:
    """Largest foot speeds of a robot at a configuration, from Pinocchio's Jacobians."""

    def __init__(self, robot: Quadruped) -> None:
        self._robot, self._data = robot, robot.model.createData()
        self._frames = {leg: robot.model.getFrameId(robot.legs[leg].foot) for leg in LEGS}

    def configuration(self, body: FloatArray, feet: dict[str, FloatArray]) -> FloatArray:
        """Pinocchio's configuration with the body centre and the feet at these places."""
        q: FloatArray = pin.neutral(self._robot.model)
        base = body - self._robot.centre
        q[:3] = base
        for leg, columns in self._robot.leg_columns.items():
            angles = leg_angles(self._robot.legs[leg], *(feet[leg] - base).tolist())
            for column, angle in zip(columns, angles, strict=True):
                q[7 + column] = angle
        return q

    def foot_speed(self, q: FloatArray, leg: str, direction: FloatArray) -> float:
        """Largest speed of a foot along ``direction``, seen from the body [m/s]: one LP."""
        jacobian = pin.computeFrameJacobian(
            self._robot.model, self._data, q, self._frames[leg], pin.LOCAL_WORLD_ALIGNED
        )
        mine = jacobian[:3, [6 + c for c in self._robot.leg_columns[leg]]]
        return program(mine, direction, self._robot.legs[leg].velocity_limits)


def program(jacobian: FloatArray, direction: FloatArray, limits: FloatArray) -> float:
    """The LP: the largest speed of a foot along ``direction`` within the joints' limits [m/s]."""
    unit = direction / np.linalg.norm(direction)
    found = linprog(
        c=[0.0, 0.0, 0.0, -1.0],
        A_eq=np.column_stack([jacobian, -unit]),
        b_eq=np.zeros(3),
        bounds=[*((-w, w) for w in limits), (0.0, None)],
        method="highs",
    )
    return float(found.x[3])


def leg_angles(leg: Leg, x: float, y: float, z: float) -> tuple[float, float, float]:
    """Joint angles with the foot at ``(x, y, z)`` in the body frame, for a leg without offsets."""
    x, y, z = x - float(leg.hip[0]), y - float(leg.hip[1]), z - float(leg.hip[2])
    roll, hang = math.atan2(y, -z), math.hypot(y, z)
    cosine = (x * x + hang * hang - leg.upper**2 - leg.lower**2) / (2.0 * leg.upper * leg.lower)
    bend = leg.knee * math.acos(max(-1.0, min(1.0, cosine)))
    thigh = math.atan2(-x, hang) - math.atan2(
        leg.lower * math.sin(bend), leg.upper + leg.lower * math.cos(bend)
    )
    return (
        leg.signs[0] * roll,
        leg.signs[1] * (thigh - leg.zeros[0]),
        leg.signs[2] * (bend - leg.zeros[1]),
    )
