"""The COG problem of [Wang2020], eq. (10), written in CasADi for one robot and one swing leg."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any, Literal

import numpy as np

from gaitopt.conventions import LEGS
from gaitopt.optimize.cog.half_planes import SIDES
from gaitopt.robots.quadruped import Quadruped

Objective = Literal["distance", "margin", "reach"]

LINEAR_WEIGHT = 10.0
"""Weight of the linear objectives ``"margin"`` and ``"reach"`` against a proximal term
``|step|^2 / 2``, which makes the Hessian of each QP positive definite. Chosen here: the heavier
the objective, the larger the steps, and multipliers of order ten are still well scaled."""


@dataclass(frozen=True, eq=False)
class CogFormulation:
    """The symbolic problem of one robot, swing leg and objective.

    Attributes:
        objective: ``"distance"``, ``"margin"`` or ``"reach"``.
        swing: the leg that swings next; ``None`` for standing on four feet (no triangle).
        further: number of half-planes beside those of the triangle.
        turned: whether the body's axes are turned against the frame.
        straight: whether the body keeps the y of its start, as legs have no roll joint.
        reaching: the leg of each reach constraint.
        width: upper bound on the width of the area within the legs' reach [m].
        expressions: CasADi function ``(w, parameters) -> (cost, constraints)``, for inspection.
        derivatives: CasADi function ``(w, parameters, multipliers) -> (gradient, hessian,
            constraints, jacobian)`` that the solver calls.
    """

    objective: str
    swing: str | None
    further: int
    turned: bool
    straight: bool
    reaching: tuple[str, ...]
    width: float
    expressions: Any
    derivatives: Any

    @cached_property
    def planes(self) -> int:
        """Number of half-planes."""
        return 0 if self.swing is None else SIDES + self.further

    @cached_property
    def constraints(self) -> int:
        """Number of constraints."""
        return self.planes + len(self.reaching)

    @cached_property
    def place(self) -> int:
        """Number of unknowns that place the body centre: x and y, or x alone."""
        return 1 if self.straight else 2

    @cached_property
    def variables(self) -> int:
        """Number of unknowns: the body centre's, and the margin or squared reach fraction."""
        return self.place if self.objective == "distance" else self.place + 1


@lru_cache(maxsize=256)
def build_cog_formulation(
    robot: Quadruped,
    swing: str | None,
    objective: Objective,
    further: int = 0,
    turned: bool = False,
) -> CogFormulation:
    """Write eqs. (1)-(10) in CasADi for one robot, swing leg and objective.

    The unknowns ``w`` are the body centre's x and y in a frame turned to the walk's heading; a
    further one is the margin for ``"margin"``, and the squared reach fraction for ``"reach"``.
    Without roll joints y is no unknown, but that of the start, since feet stay in the planes of
    their legs (:func:`gaitopt.robots.leg_planes.foot_planes`).

    The parameters are the start (2 numbers), the half-planes (3 each: normal, offset; those of the
    triangle, then ``further`` others), the margin, the reach fraction, the feet (n x 3, with
    heights relative to the body centre), and where the body is ``turned`` the rotation from its
    axes to the frame's (9, row by row). Every constraint has the form ``g(w) >= 0``, with ``g`` in
    metres. Squared leg lengths are convex in the foot's place in the body, which is affine in
    ``w``, so that the reach stays convex however the body is turned.
    """
    import casadi as ca

    ca.GlobalOptions.setNumpyMode(1)
    reaching = LEGS if swing is None else (*LEGS, swing)
    planes = 0 if swing is None else SIDES + further
    straight = not all(leg.has_roll for leg in robot.legs.values())
    place = 1 if straight else 2
    w = ca.SX.sym("w", place if objective == "distance" else place + 1)
    prm = ca.SX.sym("parameters", 2 + 3 * planes + 2 + 3 * len(reaching) + (9 if turned else 0))
    cost = {
        "distance": ca.sumsqr(w[:place] - prm[:place]) / 2.0,
        "margin": -LINEAR_WEIGHT * w[-1],
        "reach": LINEAR_WEIGHT * w[-1],
    }[objective]
    centre = (w[0], prm[1] if straight else w[1])
    rows = _rows(robot, objective, reaching, planes, turned, centre, w, prm)
    g = ca.vertcat(*rows)
    multipliers = ca.SX.sym("multipliers", len(rows))
    hessian, _ = ca.hessian(cost - ca.dot(multipliers, g), w)
    outputs = [ca.gradient(cost, w), hessian, g, ca.jacobian(g, w)]
    names = ["gradient", "hessian", "constraints", "jacobian"]
    return CogFormulation(
        objective=objective,
        swing=swing,
        further=further,
        turned=turned,
        straight=straight,
        reaching=reaching,
        width=2.0 * max(float(np.hypot(x.reach, x.lateral)) for x in robot.legs.values()),
        expressions=ca.Function("cog", [w, prm], [cost, g], ["w", "p"], ["cost", "g"]),
        derivatives=ca.Function(
            "cog_derivatives", [w, prm, multipliers], [ca.densify(o) for o in outputs],
            ["w", "p", "multipliers"], names,
        ),
    )  # fmt: skip


def _rows(
    robot: Quadruped,
    objective: str,
    reaching: tuple[str, ...],
    planes: int,
    turned: bool,
    centre: tuple[Any, Any],
    w: Any,
    prm: Any,
) -> list[Any]:
    """The constraints as CasADi expressions: ``planes`` half-planes, then the legs' reach.

    The first three half-planes keep the margin. ``centre`` is where the body centre is, and the
    last unknown the margin or the squared reach fraction.
    """
    margin = w[-1] if objective == "margin" else prm[2 + 3 * planes]
    square = w[-1] if objective == "reach" else prm[3 + 3 * planes] ** 2
    feet = prm[4 + 3 * planes :]
    rows = []
    for i in range(planes):
        nx, ny, offset = (prm[2 + 3 * i + k] for k in range(3))
        rows.append(nx * centre[0] + ny * centre[1] - offset - (margin if i < SIDES else 0.0))
    turn = feet[3 * len(reaching) :]
    for i, leg in enumerate(reaching):
        x, y, z = feet[3 * i] - centre[0], feet[3 * i + 1] - centre[1], feet[3 * i + 2]
        if turned:
            x, y, z = (turn[k] * x + turn[3 + k] * y + turn[6 + k] * z for k in range(3))
        distance2 = robot.legs[leg].straightness(
            x + robot.centre[0], y + robot.centre[1], z + robot.centre[2]
        )
        reach = robot.legs[leg].reach
        # Divided by 2 reach, the row has the unit metre and a gradient of length 1 at most.
        rows.append((square * reach**2 - distance2) / (2.0 * reach))
    return rows
