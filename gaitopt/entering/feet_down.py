"""``feet_down``: a robot that lies on its belly puts its feet on the ground, before it stands up.

A plan has forces on feet only, so that none begins while the trunk carries the robot. Before it the
joints go evenly from where they are to where all feet touch the ground, and the trunk stays. That
is kinematics, and a look at the balance on the trunk: it is no plan, and has no certificate.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from gaitopt.conventions import LEGS, FloatArray, frozen
from gaitopt.dynamics.whole_body import motion_of_path
from gaitopt.entering.begin import check_apart
from gaitopt.entering.one_foot_down import put_down
from gaitopt.errors import InfeasibleStateError, InputError
from gaitopt.inputs import check_array, check_kind
from gaitopt.plan.state import State
from gaitopt.robots.at_many_poses.outlines import lowest_points, outlines
from gaitopt.robots.quadruped import Quadruped
from gaitopt.robots.whole_body import feet_from_joints
from gaitopt.stability.support import support_half_planes
from gaitopt.stability.zmp import whole_body_zmp

STILL = 0.02
"""Largest velocity of a robot that lies [m/s, rad/s]; joints may turn at ten times as much."""
FLAT = 5e-3
"""Parts of the trunk that are so much higher than its lowest point carry it, too [m]: estimators
know the roll and the pitch to about a hundredth of a radian."""
SAMPLES = 41
"""Postures on the way that are looked at."""
JOINT_PACE = 0.25
"""Largest share of a joint's velocity limit on the way."""
SHORTEST = 0.5
"""Shortest time of the way [s]."""
SLOWER = 6
"""How often the time is doubled until the trunk rests safely."""


@dataclass(frozen=True, eq=False)
class FeetDown:
    """How a robot that lies puts its feet on the ground, and the state in which they are there.

    Attributes:
        state: at rest, with four feet on the ground, from which a plan may begin.
        postures: angles of the joints ``(K + 1, nj)`` [rad]: where they are, and after each motion.
            They rest in each posture, and turn evenly to the next.
        times: when they are there ``(K + 1,)`` [s]; slower is good, too.
        margin: least distance of the ZMP of the whole robot from the border of ``polygon``, in that
            time [m].
        polygon: what carries the robot meanwhile: undersides of the trunk, and feet that stand
            already ``(n, 2)`` [m].
        ground: height of the ground [m].
    """

    state: State
    postures: FloatArray
    times: FloatArray
    margin: float
    polygon: FloatArray
    ground: float

    def __repr__(self) -> str:
        return (f"FeetDown({len(self.times) - 1} motions in {self.times[-1]:.2f} s, ZMP "
                f"{1e3 * self.margin:.0f} mm inside what the robot lies on)")  # fmt: skip

    def joints(self, times: ArrayLike) -> FloatArray:
        """Angles of the joints at instants ``(N, nj)`` [rad].

        Args:
            times: ``(N,)`` [s]; before the begin and after the end the joints rest.
        """
        t = np.clip(check_array("times", times), 0.0, self.times[-1])
        k = np.clip(np.searchsorted(self.times, t, side="right") - 1, 0, len(self.times) - 2)
        share = ((t - self.times[k]) / (self.times[k + 1] - self.times[k]))[:, None]
        here, there = self.postures[k], self.postures[k + 1]
        return np.asarray(here + _evenly(share)[0] * (there - here))


def _evenly(t: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """A motion from 0 to 1 from rest to rest, and two derivatives, at shares of its time."""
    return (
        t**3 * (10.0 - 15.0 * t + 6.0 * t**2),
        30.0 * t**2 * (1.0 - t) ** 2,
        60.0 * t * (1.0 - t) * (1.0 - 2.0 * t),
    )


def feet_down(robot: Quadruped, state: State) -> FeetDown:
    """Where a robot that lies on its trunk puts the feet that are in the air.

    The trunk lies on level ground, which is at the height of its lowest point. Each foot goes to
    the place nearest to below its hip that the leg reaches within its limits, one foot after
    another. The joints of its leg turn there all at once, or, where links would go through the
    ground or touch others, one after another. Links stay above the ground and apart. The trunk
    stays where it is: the ZMP of the whole robot is inside the polygon of the trunk's underside and
    the feet that stand. Servos do this, before the plan.

    Args:
        robot: from :func:`gaitopt.load_robot`, with collision shapes.
        state: at rest; ``support`` names the feet that are on the ground, or none.

    Returns:
        The state to begin in, for :func:`gaitopt.plan_stand_up`, and the way there. How well the
        real trunk rests, and what it weighs on, nobody judges.

    Raises:
        InputError: this is no robot or no state, the state is that of another robot, or the shapes
            of the robot are not known.
        InfeasibleStateError: the robot moves, it does not rest on its trunk, or a foot cannot be
            put down; tells which, and why.
    """
    check_kind("robot", robot, Quadruped)
    check_kind("state", state, State)
    if state.joint_names != robot.joint_names:
        raise InputError(f"the state is that of another robot: {robot.name} has other joints")
    robot.require_masses()
    shapes = outlines(robot)
    if shapes is None or not any(shape.joint == 1 for shape in shapes):
        raise InputError(
            f"{robot.name}: the shape of the trunk is not known, so nobody can say on what it "
            "lies; give its URDF collision shapes, or put the feet down by hand"
        )
    _check_still(state)
    trunk = [shape for shape in shapes if shape.joint == 1]
    under = np.concatenate(lowest_points(robot, trunk, np.array(state.q)))
    ground = float(under[:, 2].min())
    polygon = _carrying(robot, state, under[under[:, 2] <= ground + FLAT], ground)
    limbs = [shape for shape in shapes if shape.joint > 1]
    postures, left = [np.array(state.q[7:])], [leg for leg in LEGS if leg not in state.support]
    while left:
        for leg in left:
            way = put_down(robot, state, postures[-1], leg, ground, limbs)
            if not isinstance(way, str):
                postures += list(way)
                left.remove(leg)
                break
        else:
            raise _stays_up(left[0], str(way))
    times, margin = _rested(robot, state, postures, polygon, ground)
    there = State.of(robot, state.q[:3], state.columns[3:6], postures[-1])
    return FeetDown(
        there, frozen(np.array(postures)), frozen(times), margin, frozen(polygon), ground
    )


def _check_still(state: State) -> None:
    """Refuse a robot that moves.

    Raises:
        InfeasibleStateError: it does.
    """
    speed = max(float(np.abs(state.v[:6]).max()), 0.1 * float(np.abs(state.v[6:]).max()))
    if speed > STILL:
        raise InfeasibleStateError(
            f"start: a robot that lies does not move, and this one does, at {speed:.3f} m/s or "
            f"rad/s, at most {STILL} count as still; wait until it lies",
            "rest", speed, STILL, "m/s",
        )  # fmt: skip


def _carrying(robot: Quadruped, state: State, under: FloatArray, ground: float) -> FloatArray:
    """The points on which the robot lies ``(n, 2)`` [m].

    Raises:
        InfeasibleStateError: they do not hold it: the centre of mass is outside their polygon.
    """
    import pinocchio as pin

    feet = feet_from_joints(robot, state.q[:3], state.columns[3:6], state.q[7:])
    standing = [feet[LEGS.index(leg)][None] for leg in state.support]
    points = np.concatenate([under, *standing])[:, :2]
    wide = len(points) > 2 and np.linalg.matrix_rank(points - points[0], tol=FLAT) == 2
    centre = np.array(pin.centerOfMass(robot.model, robot.model.createData(), state.q))[:2]
    margin = _inside(points, centre[None]) if wide else -np.inf
    if margin <= 0.0:
        off = f"{-margin:.4f} m outside of" if wide else "not held by"
        raise InfeasibleStateError(
            f"start: the robot does not lie on its trunk: the centre of mass is {off} what the "
            f"trunk and standing feet have on the ground at {ground:.3f} m; lay it down flat, or "
            "put its feet down by hand",
            "rest on the trunk", float(margin), 0.0, "m",
        )  # fmt: skip
    return np.asarray(points)


def _inside(points: FloatArray, places: FloatArray) -> float:
    """Least distance of places ``(N, 2)`` from the border of the hull of points [m]."""
    from scipy.spatial import ConvexHull

    planes = support_half_planes(points[ConvexHull(points).vertices])
    return float((places @ planes.normals.T - planes.offsets).min())


def _stays_up(leg: str, why: str) -> InfeasibleStateError:
    return InfeasibleStateError(
        f"start: foot {leg} cannot be put on the ground while the trunk lies on it: {why}; turn "
        "the robot's legs by hand, or raise the trunk on something",
        f"contact {leg}", 0.0, 0.0, "m",
    )  # fmt: skip


def _rested(
    robot: Quadruped, state: State, postures: list[FloatArray], polygon: FloatArray, ground: float
) -> tuple[FloatArray, float]:
    """When the joints are in the postures ``(K + 1,)`` [s], and the margin of the ZMP [m].

    Raises:
        InfeasibleStateError: links touch on the way, or the trunk does not rest in any time.
    """
    place, rate, bend = _evenly(np.linspace(0.0, 1.0, SAMPLES)[:, None])
    base = np.zeros((SAMPLES, 6))
    times, least = [0.0], np.inf
    for here, there in pairwise(postures):
        change = there - here
        for k in range(0, SAMPLES, 4):
            check_apart(robot, here + place[k] * change)
        values = np.column_stack([base + state.columns[:6], here + place * change])
        pace = JOINT_PACE * robot.velocity_limits
        duration = max(SHORTEST, float((1.875 * np.abs(change) / pace).max()))
        for _ in range(SLOWER):
            first = np.column_stack([base, rate * change / duration])
            second = np.column_stack([base, bend * change / duration**2])
            motion = motion_of_path(robot, values, first, second)
            margin = _inside(polygon, whole_body_zmp(robot.model, *motion, ground))
            if margin > 0.0:
                break
            duration *= 2.0
        else:
            raise InfeasibleStateError(
                f"start: while the feet go down the ZMP leaves what the robot lies on by "
                f"{-margin:.4f} m, also in {duration / 2.0:.1f} s: it would tip over; put the feet "
                "down by hand", "rest on the trunk", margin, 0.0, "m", times[-1],
            )  # fmt: skip
        times.append(times[-1] + duration)
        least = min(least, margin)
    return np.array(times), least
