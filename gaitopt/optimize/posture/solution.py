"""A solution of the posture problem, with its residuals and what it says of the robot.

Source: [Shao2011], Section IV, eq. (11).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from gaitopt.conventions import GRAVITY, LEGS, FloatArray, TextEnum
from gaitopt.optimize.posture.problem import BodyPose, PostureProblem
from gaitopt.stability.energy import energy_stability_margin
from gaitopt.stability.margins import static_stability_margin


@dataclass(frozen=True)
class PostureResiduals:
    """By how much a solution violates its constraints, computed from its pose alone.

    Attributes:
        margin: missing stability margin [m].
        reach: how far a place is out of the used share of a leg's reach [m].
        plane: how far a foot is beside the plane of its leg, beyond the tolerance [m].
        joints: how far a joint is beyond its limits [rad].
        stationarity: largest entry of the Lagrangian's gradient where variables are free.
        message: IPOPT's own status, which is not used.
        iterations: number of IPOPT's iterations.
    """

    margin: float
    reach: float
    plane: float
    joints: float
    stationarity: float
    message: str
    iterations: int

    @property
    def violation(self) -> float:
        """The largest violation of a constraint [m, rad]: the largest of the first four."""
        return max(self.margin, self.reach, self.plane, self.joints)


class PostureStatus(TextEnum):
    """How :func:`solve_posture` ended."""

    SOLVED = "solved"
    """All residuals are within tolerance."""
    INFEASIBLE = (
        "no posture keeps margin, reach and joint limits; lessen the stability margin, free more "
        "of the body, or take another body height"
    )
    """The pose breaks a constraint, and its residuals say which."""


@dataclass(frozen=True, eq=False)
class PostureSolution:
    """The solution of a posture problem.

    Attributes:
        problem: the problem.
        pose: the pose that was found.
        status: whether all residuals are within tolerance.
        residuals: violations of the constraints, and of optimality.
    """

    problem: PostureProblem
    pose: BodyPose
    status: PostureStatus
    residuals: PostureResiduals

    @property
    def solved(self) -> bool:
        """Whether all residuals are within tolerance."""
        return self.status is PostureStatus.SOLVED

    @cached_property
    def margin(self) -> float:
        """Static stability margin of the body centre over the standing feet [m]."""
        return float(static_stability_margin(self._standing, self.pose.centre))

    @property
    def energy_margin(self) -> float:
        """Energy that tips the robot over the nearest side of its support [J] (NESM).

        It is the weight times the height by which the body centre must rise to be above the side
        about which the robot turns: :func:`gaitopt.stability.energy.energy_stability_margin`.
        """
        robot = self.problem.robot
        return float(energy_stability_margin(self._standing, self.pose.centre, robot.mass))

    @property
    def diagonal_energy(self) -> float:
        """Energy ``m g dh`` of eq. (11) for the diagonal beside the leg that swings [J].

        When the robot turns about the diagonal (Fig. 4), its body centre is highest right above it:
        ``dh`` higher than it is now. A fall towards the lifted leg must pass that height. The value
        is negative when the body centre is on the diagonal's wrong side, and NaN when no leg
        swings.
        """
        return self.problem.robot.mass * GRAVITY * self._drop

    @property
    def height_change(self) -> float:
        """How much higher the body centre is than in the pose before [m]."""
        return float(self.pose.centre[2] - self.problem.start.centre[2])

    @property
    def potential_energy_change(self) -> float:
        """Weight times :attr:`height_change` [J]."""
        return self.problem.robot.mass * GRAVITY * self.height_change

    @property
    def joints(self) -> dict[str, FloatArray]:
        """Angles of each leg that put its foot where it is now ``(nj,)`` [rad]."""
        problem = self.problem
        local = self.pose.in_body(problem.robot, problem.feet)
        return {leg: problem.robot.legs[leg].inverse(local[i]) for i, leg in enumerate(LEGS)}

    @property
    def _standing(self) -> FloatArray:
        return self.problem.feet[[LEGS.index(leg) for leg in self.problem.support]]

    @property
    def _drop(self) -> float:
        lifted = [leg for leg in LEGS if leg not in self.problem.support]
        if not lifted:
            return float("nan")
        i = LEGS.index(lifted[0])
        # In the order of LEGS neighbours around the body follow one another.
        first, second = self.problem.feet[(i + 1) % 4], self.problem.feet[(i + 3) % 4]
        away, along = self.pose.centre - first, second - first
        unit = along / np.linalg.norm(along)
        arm = away - (away @ unit) * unit
        top = np.array([0.0, 0.0, 1.0]) - unit[2] * unit
        rise = float(np.linalg.norm(arm) * np.linalg.norm(top) - arm[2])
        lifted_side = _side(along, self.problem.feet[i] - first)
        return -rise if _side(along, away) * lifted_side > 0.0 else rise


def _side(along: FloatArray, point: FloatArray) -> float:
    return float(along[0] * point[1] - along[1] * point[0])
