"""Gains of the tracking controller, scaled to a robot's weight and size."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from gaitopt.conventions import GRAVITY
from gaitopt.errors import InputError
from gaitopt.robots.quadruped import Quadruped


@dataclass(frozen=True)
class ControlGains:
    """What the controller and the joint servos are tuned to.

    Attributes:
        joint_stiffness: of every joint servo [N m/rad].
        joint_damping: of every joint servo [N m s/rad].
        body_stiffness: force on the body for an error of its position [N/m].
        body_damping: force on the body for an error of its velocity [N s/m].
        turn_stiffness: torque on the body for an error of its orientation [N m/rad].
        turn_damping: torque on the body for an error of its angular velocity [N m s/rad].
        largest_error: errors of position are counted up to this [m].
        largest_turn: errors of orientation are counted up to this [rad].
        friction: friction coefficient that the contact forces are planned for.
        smoothing: the reference is averaged over this time, so that its velocities do not jump
            [s].
        body_smoothing: the same for the body of walks in which its velocity jumps, on its standing
            legs: accelerations of a body move its ZMP, and one that jumps to full speed takes the
            load off a foot for a moment [s].
        load_time: a foot gives up its load over this time before it lifts off [s].
        firm_time: a foot that has found ground takes up its load over this time, and stands firm
            after it: only then may another lift off [s].
        handover: a static walk stands still until a foot has stood for so long before another
            lifts off [s].
        force_smoothing: time constant within which the contact forces that are wanted come about:
            ground and feet give a little, and a load that jumps makes knees jerk [s].
        press: the set-point of a foot that has just landed lies so far below its place [m], so
            that it stays in touch while its load grows.
        contact_loss: a standing foot may be without contact for so long before it counts as being
            in the air [s].
        blend_time: time constant within which a flying foot follows the body's errors, and the
            set-point of a foot that lands goes over from its target to its place [s].
        probe_speed: a foot that should stand but has found no ground goes down so fast [m/s].
        probe_depth: and so far [m].
        patience: how long the plan's clock may stand still at a time because a foot that should
            stand has found no ground yet [s].
        grace: so late may a foot be before the clock stands still for it [s], unless another is
            about to lift off: then it waits at once.
    """

    joint_stiffness: float
    joint_damping: float
    body_stiffness: float
    body_damping: float
    turn_stiffness: float
    turn_damping: float
    largest_error: float = 0.03
    largest_turn: float = 0.2
    friction: float = 0.5
    smoothing: float = 0.04
    body_smoothing: float = 0.16
    load_time: float = 0.1
    firm_time: float = 0.05
    handover: float = 0.14
    force_smoothing: float = 0.01
    press: float = 0.001
    contact_loss: float = 0.03
    blend_time: float = 0.2
    probe_speed: float = 0.06
    probe_depth: float = 0.03
    patience: float = 0.6
    grace: float = 0.1

    def __post_init__(self) -> None:
        for item in fields(self):
            value = getattr(self, item.name)
            if not (isinstance(value, (int, float)) and np.isfinite(value) and value >= 0):
                raise InputError(f"{item.name} must be a number of at least 0, got {value!r}")
        if not (self.friction > 0 and self.firm_time > 0):
            raise InputError("friction and firm_time must be positive")

    @classmethod
    def for_robot(cls, robot: Quadruped, **changes: float) -> ControlGains:
        """Gains in proportion to a robot's weight and the length of its legs.

        The joints are springs that its own weight on a stretched leg would bend by half a radian,
        the body hangs in springs of 8 rad/s, all close to critically damped.

        Args:
            robot: the robot.
            changes: attributes to set otherwise.
        """
        length = float(np.mean([leg.reach for leg in robot.legs.values()]))
        mass, weight = robot.mass, robot.mass * GRAVITY
        inertia = mass * (0.5 * max(robot.stance_size)) ** 2
        stiffness = 2.0 * weight * length
        values = {
            "joint_stiffness": stiffness,
            "joint_damping": 0.045 * stiffness,
            "body_stiffness": mass * 8.0**2,
            "body_damping": mass * 2.0 * 0.8 * 8.0,
            "turn_stiffness": inertia * 10.0**2,
            "turn_damping": inertia * 2.0 * 0.8 * 10.0,
        }
        unknown = sorted(set(changes) - {f.name for f in fields(cls)})
        if unknown:
            raise InputError(
                f"unknown gain {unknown[0]!r}; known are {', '.join(f.name for f in fields(cls))}"
            )
        return cls(**{**values, **changes})
