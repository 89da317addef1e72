"""The COG problem of [Wang2020], eq. (10): where the body centre goes before a leg swings.

The body centre must be in two areas. Area A is the support triangle shrunken by the stability
margin (three half-planes). Further half-planes may bound where contact forces hold the robot; they
keep no margin. Area B holds the places from which the legs reach four feet and the
next foothold (five discs; ovals where a leg's pitch axis lies below its roll axis). The paper
prints the union of both; it must be their intersection (``docs/papers.md``). Three objectives
share these constraints:

* ``"distance"``: the nearest point of the area (the paper's method);
* ``"margin"``: the point of the largest stability margin (the SSM baseline);
* ``"reach"``: the least reach fraction with which the step is possible (for error messages).

Problems are only built here; :mod:`gaitopt.optimize.cog.solver` solves them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import get_args

import numpy as np
from numpy.typing import ArrayLike

from gaitopt.conventions import LEGS, FloatArray, made
from gaitopt.errors import InputError
from gaitopt.inputs import check_choice, check_kind, check_number, check_numbers, check_shape
from gaitopt.optimize.cog.formulation import (
    CogFormulation,
    Objective,
    build_cog_formulation,
)
from gaitopt.optimize.cog.half_planes import SIDES, constraint_names, padded, triangle_planes
from gaitopt.robots.leg_names import as_leg, by_leg
from gaitopt.robots.leg_planes import foot_planes
from gaitopt.robots.quadruped import Quadruped

FARTHEST = 1e6
"""Coordinates beyond this are taken for a mistake [m]."""
FURTHER = 2 + 3 * SIDES
"""Where half-planes beside those of the triangle stand among the parameters."""


@dataclass(frozen=True, eq=False)
class CogProblem:
    """The COG problem of one step: a formulation with values of its parameters.

    Attributes:
        formulation: the symbolic problem.
        parameters: values of the formulation's parameters, relative to ``origin``; the first two
            are the start.
        origin: middle of the feet ``(2,)`` [m]. Coordinates relative to it are small, so that they
            are precise.
        names: a name for each constraint, such as ``"margin LF-RH"`` and ``"reach LH"``.
        stability_margin: ``S0`` [m].
        reach_fraction: share of the legs' reach that may be used.
    """

    formulation: CogFormulation
    parameters: FloatArray
    names: tuple[str, ...]
    origin: FloatArray
    stability_margin: float
    reach_fraction: float

    @property
    def start(self) -> FloatArray:
        """Where the COG is before the step ``(2,)`` [m]."""
        return self.parameters[:2] + self.origin

    def starting_at(self, start: FloatArray) -> CogProblem:
        """The same problem with the COG at ``start (2,)`` [m] before the step.

        Without roll joints the feet say where the body is sideways, and only x counts.
        """
        parameters, count = self.parameters.copy(), self.formulation.place
        parameters[:count] = (start - self.origin)[:count]
        return made(
            CogProblem, formulation=self.formulation, parameters=parameters, names=self.names,
            origin=self.origin, stability_margin=self.stability_margin,
            reach_fraction=self.reach_fraction,
        )  # fmt: skip

    def constraint_values(self, place: ArrayLike) -> FloatArray:
        """Slack of every constraint ``(m,)`` [m] at a COG position ``(2,)`` [m].

        Margin and reach fraction are those that were asked for, with every objective.
        """
        form = self.formulation
        w = np.zeros(form.variables)
        w[: form.place] = (np.asarray(place) - self.origin)[: form.place]
        if form.objective == "margin":
            w[-1] = self.stability_margin
        if form.objective == "reach":
            w[-1] = self.reach_fraction**2
        return np.asarray(form.expressions(w, self.parameters)[1]).ravel()


def build_cog_problem(
    robot: Quadruped,
    feet: Mapping[str, ArrayLike],
    height: float,
    start: ArrayLike,
    *,
    swing: str | None = None,
    foothold: ArrayLike | None = None,
    stability_margin: float = 0.02,
    reach_fraction: float = 1.0,
    objective: Objective = "distance",
    shifts: ArrayLike | None = None,
    further: FloatArray | None = None,
    turn: FloatArray | None = None,
) -> CogProblem:
    """The COG problem of one step, eq. (10).

    Args:
        robot: the robot; its body axes are parallel to the frame's, if nothing else is said.
        feet: where the four feet stand, ``(3,)`` each [m].
        height: height of the body centre [m].
        start: where the COG is before the step ``(2,)`` [m].
        swing: the leg that swings next; ``None`` asks for a place to stand on four feet.
        foothold: where it will touch down ``(3,)`` [m].
        stability_margin: ``S0`` [m].
        reach_fraction: share of the legs' reach that may be used, in (0, 1].
        objective: ``"distance"``, ``"margin"`` or ``"reach"``.
        shifts: how much nearer to each side of the triangle than the body centre the point is that
            keeps the margin ``(3,)`` [m]; by default it is the body centre.
        further: other half-planes that the body centre keeps, without a margin, as rows of x and y
            of the inward normal and of the offset [m] ``(k, 3)``.
        turn: rotation from the body's axes to the frame's ``(3, 3)``.

    Raises:
        InputError: the feet of the support triangle stand in one line, or ``swing`` and
            ``foothold`` are not given together.
    """
    check_kind("robot", robot, Quadruped)
    if (swing is None) != (foothold is None):
        raise InputError("swing and foothold go together: give both, or neither")
    named, swing = by_leg("feet", feet), as_leg(swing)
    if swing is not None:
        check_choice("swing", swing, LEGS)
    check_choice("objective", objective, get_args(Objective))
    place = check_shape("start", start, 2)
    if place.shape != (2,):
        raise InputError(f"start must be (2,), got {place.shape}")
    check_number("height", height, -FARTHEST, FARTHEST, "m")
    missing = [leg for leg in LEGS if leg not in named]
    if missing:
        raise InputError(f"feet: there is no place of {', '.join(missing)}; give all four legs'")
    stance = check_numbers("feet", [[named[leg] for leg in LEGS]], -FARTHEST, FARTHEST, "m")
    target = None
    if foothold is not None:
        target = check_numbers("foothold", foothold, -FARTHEST, FARTHEST, "m")[None]
    for name, rows, shape in (("feet", stance, (1, 4, 3)), ("foothold", target, (1, 3))):
        if rows is not None and rows.shape != shape:
            raise InputError(f"{name} must be {shape[-1]} numbers a leg, got {rows.shape[1:]}")
    (problem,) = build_cog_problems(
        robot, stance, np.array([height]), [swing], target,
        stability_margin=stability_margin, reach_fraction=reach_fraction, objective=objective,
        shifts=None if shifts is None else np.array([shifts], dtype=np.float64),
        further=None if further is None else [further],
        turns=None if turn is None else turn[None],
    )  # fmt: skip
    return problem.starting_at(place)


def build_cog_problems(
    robot: Quadruped,
    feet: FloatArray,
    heights: FloatArray,
    swings: Sequence[str | None],
    footholds: FloatArray | None,
    *,
    stability_margin: float,
    reach_fraction: float,
    objective: Objective,
    shifts: FloatArray | None = None,
    further: Sequence[FloatArray | None] | None = None,
    turns: FloatArray | None = None,
) -> list[CogProblem]:
    """The COG problems of many steps, each beginning in the middle of its feet.

    Args:
        feet: where the feet stand before each step ``(S, 4, 3)`` [m].
        heights: heights of the body centre ``(S,)`` [m].
        swings: the leg that swings at each step; all ``None`` for standing only.
        footholds: where it touches down ``(S, 3)`` [m]; ``None`` for standing only.
        robot, stability_margin, reach_fraction, objective: as in :func:`build_cog_problem`.
        shifts: as there, of every step ``(S, 3)`` [m].
        further: as there, of every step before which a leg is to swing; ``None`` for none.
        turns: as there, of every step ``(S, 3, 3)``.

    Raises:
        InputError: the feet of a support triangle stand in one line.
    """
    count = len(feet)
    blocks = [np.zeros((count, 2))]
    origins = feet[..., :2].mean(axis=1)
    if (sideways := foot_planes(robot)) is not None:
        blocks[0][:, 1] = (feet[..., 1] - sideways).mean(axis=1) - origins[:, 1]
    shift = np.concatenate([origins, np.zeros((count, 1))], axis=1)
    feet = feet - shift[:, None]
    places = feet
    if footholds is not None:
        planes = triangle_planes(feet[..., :2], swings, origins)
        if shifts is not None:
            planes[:, 2::3] += shifts
        blocks.append(planes)
        places = np.concatenate([feet, (footholds - shift)[:, None]], axis=1)
    below = places - np.array([0.0, 0.0, 1.0]) * heights[:, None, None]
    blocks.append(np.tile([stability_margin, reach_fraction], (count, 1)))
    blocks.append(below.reshape(count, -1))
    if turns is not None:
        blocks.append(turns.reshape(count, -1))
    parameters = np.concatenate(blocks, axis=1)
    forms: dict[tuple[str | None, int], CogFormulation] = {}
    problems = []
    for i, swing in enumerate(swings):
        values = parameters[i]
        if further is not None and (others := further[i]) is not None:
            values = np.insert(values, FURTHER, padded(others, origins[i]).ravel())
        extra = (len(values) - parameters.shape[1]) // 3
        if (swing, extra) not in forms:
            forms[swing, extra] = build_cog_formulation(
                robot, swing, objective, extra, turns is not None
            )
        problems.append(
            made(
                CogProblem, formulation=forms[swing, extra], parameters=values,
                names=constraint_names(swing, extra), origin=origins[i],
                stability_margin=stability_margin, reach_fraction=reach_fraction,
            )
        )  # fmt: skip
    return problems
