"""The posture problem, written in CasADi for one robot and the legs that reach.

:mod:`gaitopt.optimize.posture.problem` says what is asked.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from gaitopt.robots.quadruped import Quadruped
from gaitopt.robots.rotations import rpy_matrix_rows

PLANES = 4
"""Most sides of a support polygon: that of four feet."""
MARGIN_WEIGHT = 10.0
"""Weight of the margin, which is linear, when the largest margin is asked for.

The quadratic motion stays in the objective, so that the solution is unique. Chosen here: with 10
it costs at most a twentieth of the weighted squared motion in margin.
"""


@dataclass(frozen=True, eq=False)
class PostureFormulation:
    """The symbolic problem for one robot and a list of legs that reach places, built once.

    Unknowns: the pose (6), the margin (1), and for each place the angles of its leg. Parameters:
    the pose before (6), weights (6), the weight of the height, half-planes (4 x 3: normal, offset),
    places (n x 3), and 1 when the largest margin is asked for, else 0.

    Attributes:
        reaching: the leg of each place.
        nlp: CasADi's ``x``, ``p``, ``f``, ``g``.
        rows: what each constraint is: ``"closed"`` and ``"plane"`` [m], ``"mean plane"`` [m],
            ``"margin"`` [m].
        gradient: CasADi function ``(x, p, multipliers) -> (gradient of the Lagrangian,
            constraints)``.
    """

    reaching: tuple[str, ...]
    nlp: dict[str, Any]
    rows: tuple[str, ...]
    gradient: Any


@lru_cache(maxsize=64)
def posture_formulation(robot: Quadruped, reaching: tuple[str, ...]) -> PostureFormulation:
    """The problem in CasADi for one robot and the legs that reach."""
    import casadi as ca

    ca.GlobalOptions.setNumpyMode(1)
    pose, margin = ca.SX.sym("pose", 6), ca.SX.sym("margin")
    angles = [ca.SX.sym(f"q{i}", len(robot.legs[leg].joints)) for i, leg in enumerate(reaching)]
    before, weights, height = ca.SX.sym("before", 6), ca.SX.sym("weights", 6), ca.SX.sym("height")
    planes, places = ca.SX.sym("planes", 3 * PLANES), ca.SX.sym("places", 3 * len(reaching))
    for_margin = ca.SX.sym("for_margin")
    rows: list[Any] = []
    names: list[str] = []
    aside: list[Any] = []
    for i, (leg, q) in enumerate(zip(reaching, angles, strict=True)):
        gap = _gap(robot, leg, pose, q, places[3 * i : 3 * i + 3])
        plane = not robot.legs[leg].has_roll
        rows += [gap[0], gap[1], gap[2]]
        names += ["closed", "plane" if plane else "closed", "closed"]
        aside += [gap[1]] if plane else []
    # One equation for all feet together; bounds decide whether it is in force.
    rows.append(sum(aside) / len(aside) if aside else ca.SX(0))
    names.append("mean plane")
    for k in range(PLANES):
        normal, offset = planes[3 * k : 3 * k + 2], planes[3 * k + 2]
        # A triangle has no fourth side: its normal is zero, and the row is not in force.
        exists = ca.sumsqr(normal)
        rows.append(ca.dot(normal, pose[:2]) - offset - exists * margin)
        names.append("margin")
    moved = pose - before
    cost = (ca.dot(weights, moved**2) + height * moved[2] ** 2) / 2.0
    cost -= for_margin * MARGIN_WEIGHT * margin
    x = ca.vertcat(pose, margin, *angles)
    p = ca.vertcat(before, weights, height, planes, places, for_margin)
    g = ca.vertcat(*rows)
    multipliers = ca.SX.sym("multipliers", len(rows))
    lagrangian = cost + ca.dot(multipliers, g)
    gradient = ca.Function("posture_gradient", [x, p, multipliers], [ca.gradient(lagrangian, x), g])
    return PostureFormulation(reaching, {"x": x, "p": p, "f": cost, "g": g}, tuple(names), gradient)


def _gap(robot: Quadruped, leg: str, pose: Any, q: Any, place: Any) -> Any:
    """Difference between the foot by its joints and its place, in the leg frame (3) [m]."""
    import casadi as ca

    one = robot.legs[leg]
    rows = rpy_matrix_rows(pose[3], pose[4], pose[5])
    body = ca.vertcat(*[ca.horzcat(*row) for row in rows])
    wanted = ca.mtimes(body.T, place - pose[:3]) + ca.DM(robot.centre)
    found = ca.vertcat(*one.forward_columns(*[q[k] for k in range(len(one.joints))]))
    return ca.mtimes(ca.DM(one.axes).T, found - wanted)
