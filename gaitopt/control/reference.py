"""What a controller follows: a plan on a fine grid of times, computed once and vectorised."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gaitopt.control.clock import WalkClock
from gaitopt.conventions import LEGS, BoolArray, FloatArray
from gaitopt.plan.plan import Plan
from gaitopt.robots.quadruped import Quadruped

LEAST_LOAD = 0.02
"""Least share of a full load that a standing foot carries: a foot that carries nothing would lose
its contact, and with it its place."""

DAMPING = 2.5e-4
"""Damping of the inverse Jacobians, as a share of the leg's squared reach. Near the straight leg it
limits the angles that a foot's displacement asks for. Where the Jacobian's singular values are
above a sixth of the reach, it changes the angles by less than one per cent."""

BESIDE = 1e-6
"""How long before and after a pause the plan is looked at, to see which feet stand [s]."""


@dataclass(frozen=True, eq=False)
class Reference:
    """A plan every ``dt`` seconds; arrays over ``N`` ticks and the legs of :data:`gaitopt.LEGS`.

    It begins and ends at rest, a little before and after the plan.

    Attributes:
        dt: time between ticks [s].
        lead: how many ticks lie before the plan's start, and after its end.
        clock: which instant of the plan is followed at which time.
        position: of the base ``(N, 3)`` [m].
        rotation: of the base ``(N, 3, 3)``.
        linear, angular: velocity of the base in the world's axes ``(N, 3)`` [m/s], [rad/s].
        joints, rates: ``(N, nj)`` [rad], [rad/s], in the order of ``robot.joint_names``.
        velocity: Pinocchio's, with which inverse dynamics are computed ``(N, nv)``; zero where
            the motion is averaged.
        acceleration: Pinocchio's: of the base in its own frame, and of the joints ``(N, nv)``.
        forces: on the feet, fed forward ``(N, 4, 3)`` [N]; zero for plans that promise none.
        normals: of the ground below each foot, or where it will land ``(N, 4, 3)``.
        friction: coefficient of friction there ``(N, 4)``.
        feet: foot frames in the world ``(N, 4, 3)`` [m].
        feet_in_base: foot frames at ``joints``, in the base frame ``(N, 4, 3)`` [m].
        inverse: inverse Jacobians: joint angles of a leg for a displacement of its foot in the
            base frame ``(N, 4, 3, 3)`` [rad/m], damped near the straight leg.
        standing: which feet stand ``(N, 4)``.
        load: share of a full load that each foot may carry ``(N, 4)``: 0 in the air, and falling
            before lift-off.
        patient: at which ticks the clock may stand still for a foot that is late ``(N,)``.
        ahead: how long after its tick each entry is of [s].
    """

    dt: float
    lead: int
    clock: WalkClock
    position: FloatArray
    rotation: FloatArray
    linear: FloatArray
    angular: FloatArray
    joints: FloatArray
    rates: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    forces: FloatArray
    normals: FloatArray
    friction: FloatArray
    feet: FloatArray
    feet_in_base: FloatArray
    inverse: FloatArray
    standing: BoolArray
    load: FloatArray
    patient: BoolArray
    ahead: float = 0.0

    def __len__(self) -> int:
        return len(self.position)

    @property
    def before(self) -> float:
        """How long before the plan's start the reference begins [s]."""
        return self.lead * self.dt

    def tick(self, time: float) -> int:
        """Index of the tick at ``time`` [s] since the walk's start; the first or last beyond."""
        return min(max(round(time / self.dt) + self.lead, 0), len(self) - 1)


def standing_feet(plan: Plan, times: FloatArray, pausing: BoolArray) -> BoolArray:
    """Which feet stand ``(N, 4)``.

    In a pause those stand that do so on either side of it, and the foot that has just landed, even
    where it lifts off again at once.
    """
    standing = np.array(plan.at(times).contacts)
    sides = np.clip(times[pausing] + [[-BESIDE], [BESIDE]], 0.0, plan.duration)
    standing[pausing] = plan.at(sides[0]).contacts | plan.at(sides[1]).contacts
    paused, swings = np.flatnonzero(pausing), plan.swings
    ends = np.array([swing.end for swing in swings])
    legs = np.array([LEGS.index(swing.leg) for swing in swings], dtype=int)
    at, landed = np.nonzero(np.abs(times[paused, None] - ends) <= BESIDE)
    standing[paused[at], legs[landed]] = True
    return standing


def legs_in_base(robot: Quadruped, joints: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Feet in the base frame ``(N, 4, 3)`` and damped inverse Jacobians ``(N, 4, 3, 3)``."""
    feet, inverses = [], []
    for name in LEGS:
        leg = robot.legs[name]
        angles = joints[:, list(robot.leg_columns[name])]
        feet.append(leg.forward(angles) @ robot.body_axes.T)
        jacobian = robot.body_axes @ leg.jacobian(angles)
        transposed = np.swapaxes(jacobian, -1, -2)
        square = jacobian @ transposed + DAMPING * leg.reach**2 * np.eye(3)
        inverses.append(transposed @ np.linalg.inv(square))
    return np.stack(feet, axis=1), np.stack(inverses, axis=1)


def ramped(standing: BoolArray, ticks: float) -> FloatArray:
    """Loads ``(N, 4)``: 1 for feet that stand, falling to almost 0 before they lift off.

    A foot gives up its load only while all four feet stand, so that the others can take it. Where
    another foot lands at the very instant of its lift-off, its load does not fall here: the
    controller waits for the foot that lands.

    Args:
        standing: which feet stand ``(N, 4)``.
        ticks: over how many ticks before lift-off the load falls.
    """
    load = standing.astype(np.float64)
    together = np.concatenate([[0], np.cumsum(~standing.all(axis=1))])
    for leg in range(standing.shape[1]):
        for last in np.flatnonzero(np.diff(standing[:, leg].astype(np.int8)) < 0) + 1:
            first = max(last - round(ticks), 0)
            # Not earlier than the last tick before lift-off at which not all stood.
            first = max(first, int(np.searchsorted(together, together[last], side="left")))
            left = np.arange(last - first, 0, -1.0)
            load[first:last, leg] = np.maximum(left / (len(left) + 1.0), LEAST_LOAD)
    return load
