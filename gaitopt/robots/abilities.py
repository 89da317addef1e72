"""What a robot's joints can do: hold it standing, and set the pace of its walks."""

from __future__ import annotations

from typing import Final
from xml.etree import ElementTree

import numpy as np

from gaitopt.conventions import GRAVITY
from gaitopt.errors import RobotError
from gaitopt.robots.files.notes import first_of
from gaitopt.robots.quadruped import Quadruped

TURN = np.radians(17.0)
"""A rotation of a joint in a step [rad]: what the joints of wang2020 turn in a second ([Wang2020],
Table I)."""
FORCE_TIME_SHARE = 0.5
"""Share of the time in which a pendulum as long as a leg turns by one radian: in less than this
time forces hardly let a body change its velocity."""

PLACEHOLDER_TORQUE: Final = 1000.0
"""Effort limits from here on may be placeholders [N m]: solo12, solo8 and quadruped of
example-robot-data state exactly this number, and 80 to 160 are the largest of its other robots."""

PLACEHOLDER_FACTOR: Final = 10.0
"""An effort limit is a placeholder only if it is also this many times the weight times the length
of a leg, a torque that no leg needs: the factor is 127 for solo12, and at most 0.75 for the robots
with real limits."""

LARGEST_INERTIA_SHARE: Final = 0.2
"""Inertia of a motor, seen at its joint, from which on it is warned about, as a share of the
robot's mass times the square of its leg's reach. It is 1.5 for the Bittle of a public set, which
falls in physics, and at most 0.017 for some 30 other robots whose files have armatures."""

LARGEST_FRICTION_SHARE: Final = 0.5
"""Dry friction of a joint from which on it is warned about, as a share of the robot's weight times
its leg's reach. It is 2.3 for the Bittle of a public set, which falls in physics, and at most 0.05
for the other robots whose files state one."""

LEAST_CATCH: Final = 2.0
"""Acceleration of a foot without ground under all the torque of its leg, in multiples of gravity,
below which a leg with heavy motors does not catch the body that falls. Feet of a public Bittle have
0.2 by its file; it falls, and also with a third or a sixth of its motors' inertia (0.7 and 1.4).
With 6.9 it walks, and 40 other robots whose files have armatures have 12 and more."""
WHOLE_WEIGHT: Final = 1.0
"""Dry friction of a joint from which on it holds the robot whatever its motors do, as a share of
the robot's weight times its leg's reach. See :data:`LARGEST_FRICTION_SHARE`."""


def has_quick_joints(robot: Quadruped) -> bool:
    """Whether forces, and not joints, set the pace of a robot's walks.

    So it is where the slowest joint turns by :data:`TURN` in less than a share of the time in which
    a pendulum as long as a leg turns by one radian.
    """
    legs = robot.legs.values()
    slowest = min(float(leg.velocity_limits.min()) for leg in legs)
    reach = max(leg.upper + leg.lower for leg in legs)
    return bool(TURN / slowest < FORCE_TIME_SHARE * float(np.sqrt(reach / GRAVITY)))


def placeholder_torque(robot: Quadruped) -> float:
    """Effort limit from which on it is taken for a placeholder, as no leg can need it [N m].

    It is :data:`PLACEHOLDER_TORQUE`, or more: :data:`PLACEHOLDER_FACTOR` times the robot's weight
    times the reach of its longest leg.
    """
    reach = max(leg.reach for leg in robot.legs.values())
    return max(PLACEHOLDER_TORQUE, PLACEHOLDER_FACTOR * robot.mass * GRAVITY * reach)


def torque_warnings(robot: Quadruped) -> list[str]:
    """Warnings of torque limits that are placeholders, or too small to stand."""
    columns = robot.leg_joint_columns
    high = [
        f"{robot.joint_names[k]} {robot.effort_limits[k]:g}"
        for k in columns
        if placeholder_torque(robot) <= robot.effort_limits[k] < np.inf
    ]
    if not high:
        return strength_warnings(robot)
    return [
        f"effort limits that look like placeholders [N m]: {first_of(high)}; these torques are not "
        "limited: give effort_limits= in N m",
        *strength_warnings(robot),
    ]


def inertia_warnings(robot: Quadruped) -> list[str]:
    """A warning, if motors have more inertia than they can turn quickly.

    They are compared with the whole robot's mass at the distance of a leg's reach. Models have such
    numbers where they were written for a larger robot, or to keep a simulator stable.
    """
    high = []
    for name, leg in robot.legs.items():
        robots = robot.mass * leg.reach**2
        inertias = robot.motor_inertia[list(robot.leg_columns[name])]
        high += [
            f"{joint} {inertia:.3g} of {robots:.3g}"
            for joint, inertia in zip(leg.joints, inertias, strict=True)
            if inertia > LARGEST_INERTIA_SHARE * robots > 0.0
        ]
    if not high:
        return []
    return [
        "motors that have about as much inertia as the whole robot at a leg's length [kg m^2]: "
        f"{first_of(high)}; such joints turn too slowly to walk by; if the file's armature is "
        "wrong, give motor_inertia= in kg m^2"
    ]


def friction_warnings(robot: Quadruped) -> list[str]:
    """A warning, if joints rub with more torque than the robot's weight turns them by.

    Models have such numbers to keep a simulator's servos quiet.
    """
    high = _rubbing(robot, LARGEST_FRICTION_SHARE)
    if not high:
        return []
    return [
        "joints that rub with about the torque of the whole robot's weight at a leg's length "
        f"[N m]: {first_of(high)}; what moves such joints hardly feels the ground, and physics may "
        "throw the robot over; correct friction= in <dynamics> (frictionloss= in an MJCF)"
    ]


def _rubbing(robot: Quadruped, share: float) -> list[str]:
    """Joints that rub with more than a share of the weight at their leg's reach, in words."""
    rubbing: dict[str, float] = {}
    for joint in ElementTree.fromstring(robot.urdf).findall("joint"):
        dynamics = joint.find("dynamics")
        if dynamics is not None:
            rubbing[joint.get("name", "")] = float(dynamics.get("friction", 0.0))
    high = []
    for leg in robot.legs.values():
        weight = robot.mass * GRAVITY * leg.reach
        high += [f"{joint} {rubbing[joint]:.3g} of {weight:.3g}" for joint in leg.joints
                 if rubbing.get(joint, 0.0) > share * weight > 0.0]  # fmt: skip
    return high


def require_joints_that_feel(robot: Quadruped) -> None:
    """Refuse a robot whose joints cannot make the contact forces that a plan promises.

    Its file may be right: servos with large gears walk by the places of their feet. Forces at these
    feet do not follow the torques of their joints, though, and in physics such robots fell.

    Raises:
        RobotError: joints rub with more than the robot's weight at a leg's length, or motors are so
            heavy that a foot without ground falls more slowly than the body. The message has the
            joints, the numbers and the way out.
    """
    otherwise = "or plan with timing='velocity', which promises no forces"
    rubbing = _rubbing(robot, WHOLE_WEIGHT)
    if rubbing:
        raise RobotError(
            f"{robot.name}: no contact forces can be planned: joints rub with more than the torque "
            f"of the whole robot's weight at a leg's length [N m]: {first_of(rubbing)}; correct "
            f"friction= in <dynamics> (frictionloss= in an MJCF), {otherwise}"
        )
    if not inertia_warnings(robot):
        return
    slowest = min(_catches(robot), key=lambda found: found[1])
    if slowest[1] < LEAST_CATCH:
        raise RobotError(
            f"{robot.name}: no contact forces can be planned: the motors of leg {slowest[0]} are "
            f"so heavy that all their torque moves its foot down at {slowest[1]:.2g} times gravity "
            f"({LEAST_CATCH:g} are needed to catch the body); if the file's armature or torque "
            "limits are wrong, give motor_inertia= in kg m^2 or effort_limits= in N m, "
            f"{otherwise}"
        )


def _catches(robot: Quadruped) -> list[tuple[str, float]]:
    """Downward acceleration of each foot under all torques of its leg, in multiples of gravity.

    The robot stands, and the body does not move.
    """
    import pinocchio as pin

    model, found = robot.model, []
    data, q = model.createData(), pin.neutral(model)
    q[7:] = robot.standing_joints()
    inertia = np.triu(pin.crba(model, data, q))  # with the model's armature
    inertia += np.triu(inertia, 1).T
    pin.computeJointJacobians(model, data, q)
    pin.updateFramePlacements(model, data)
    for name, leg in robot.legs.items():
        columns = np.array(robot.leg_columns[name])
        frame = model.getFrameId(leg.foot)
        jacobian = pin.getFrameJacobian(model, data, frame, pin.LOCAL_WORLD_ALIGNED)
        up = robot.body_axes[:, 2] @ jacobian[:3, 6 + columns]
        ease = np.abs(np.linalg.solve(inertia[np.ix_(6 + columns, 6 + columns)], up))
        # A joint without a limit moves as fast as it likes, if it moves the foot at all.
        moving = ease > 0.0
        torques = robot.effort_limits[columns][moving]
        found.append((name, float(ease[moving] @ torques) / GRAVITY))
    return found


def strength_warnings(robot: Quadruped) -> list[str]:
    """A warning, if joints are too weak to hold the robot standing with a quarter on each foot.

    The weight of the legs' own links is left out. Files have such limits where their writer did not
    know them.
    """
    weak = []
    angles = robot.standing_joints()
    for name, leg in robot.legs.items():
        columns = list(robot.leg_columns[name])
        push = np.array([0.0, 0.0, robot.mass * GRAVITY / len(robot.legs)])
        needed = np.abs(push @ leg.jacobian(angles[columns]))
        limits = robot.effort_limits[columns]
        weak += [
            f"{joint} {torque:.3g} of {limit:.3g}"
            for joint, torque, limit in zip(leg.joints, needed, limits, strict=True)
            if torque > limit
        ]
    if not weak:
        return []
    more = f" and {len(weak) - 4} more" if len(weak) > 4 else ""
    return [
        f"torque limits are too small to stand [N m]: {', '.join(weak[:4])}{more}; if they are "
        "placeholders, give effort_limits= in N m"
    ]
