"""Gains of the tracking controller, scaled to a robot's weight and size.

The numbers of this module were chosen in simulation: the walks of docs/trust.md and
docs/physics_table.md succeed with them. None of them comes from a paper.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Final

import numpy as np

from gaitopt.conventions import GRAVITY
from gaitopt.errors import InputError
from gaitopt.inputs import as_text
from gaitopt.plan.plan import Plan
from gaitopt.robots.abilities import has_quick_joints
from gaitopt.robots.quadruped import Quadruped

BODY_FREQUENCY = 8.0
"""Natural frequency of the body's position, as a mass on a spring [rad/s]."""
ROTATION_FREQUENCY = 10.0
"""Natural frequency of the body's orientation [rad/s]."""
DAMPING_RATIO = 0.8
"""Damping of both, as a share of critical damping: a body that hardly overshoots."""
SERVO_SAG = 0.5
"""Angle by which a servo without torque fed forward would give way under the robot's whole weight
at the end of a stretched leg [rad]."""
SERVO_TIME = 0.045
"""Damping of the joint servos over their stiffness: the time constant with which they approach a
set-point [s]."""
FED_FORWARD_SERVO_TIME = 0.015
"""The same where planned forces and accelerations are fed forward [s]: errors are small then.
Chosen when contact forces of the physics did not know the damping, and stiffer servos let the feet
of anymal_c leave their footholds in steps of 2 ms."""
FED_FORWARD: Final = {
    "unloading_time": 0.05,
    "handover_time": 0.06,
    "force_smoothing": 0.0,
    "landing_depth": 0.0005,
    "blend_time": 0.08,
    "swing_blend_time": 0.03,
}
"""Gains that are different where planned forces are fed forward: loads are handed over in half the
time, nothing is smoothed, and errors fade sooner."""

JUMP_SHARE = 0.25
"""For robots with slow joints, whose joints turn at their velocity limits most of the time. Where
the acceleration along the path changes its sign, forces jump by a third of the weight, and where
feet land or lift off by more. In one tick of 6 ms that turned knees of wang2020 at up to 180 % of
their limits. Those of robots with quick joints are not near their limits then; without it a body of
go2 was nearer to its plan by 1 mm."""
SMALL_REACH = 0.18
"""Reach of legs below which feet land less deep, in proportion [m]. At half a millimetre below the
ground feet of Petoi's Bittles (0.094 m) slid off their footholds, 3.3 mm wide, in 5 of 7 walks."""
SLOW_JOINTS: Final = {"landing_depth": 0.001, "loading_time": 0.02, "growth_time": 0.024}
"""Gains that are different for these robots, too. Their stances between two swings take as little
as 10 ms. A foot that landed 5 ms late bore 26 N of 101 N when another lifted off, and 140 N in the
next tick: its knee reached 141 % of its velocity limit (``height``, 64 steps, seed 0). With the
first two it reached 133 %, and with all three 123 %."""
SIDES: Final = ({"LF", "LH"}, {"RH", "RF"})
"""The feet of each side. On them alone errors grow, and the next line is parallel to this one."""
SHIFT_SHARE = 0.5
"""How far feet may land beside their footholds in a pace, as a share of the landing radius: the
rest is for errors of landing and for balls that roll. Paces of seven robots pass with 6 and with
10 mm; with 15 mm a foot of b1, whose balls have a radius of 40 mm, lands beside its radius of
20 mm."""


@dataclass(frozen=True)
class ControlGains:
    """What the controller and the joint servos are tuned to.

    Attributes:
        joint_stiffness: of every joint servo [N m/rad].
        joint_damping: of every joint servo [N m s/rad].
        body_stiffness: force on the body for an error of its position [N/m].
        body_damping: force on the body for an error of its velocity [N s/m].
        rotation_stiffness: torque on the body for an error of its orientation [N m/rad].
        rotation_damping: torque on the body for an error of its angular velocity [N m s/rad].
        largest_error: larger errors of position count as this one [m].
        largest_rotation: larger errors of orientation count as this one [rad].
        friction: friction coefficient that the contact forces are planned for.
        smoothing: time over which the reference is averaged, so that its velocities do not jump
            [s].
        body_smoothing: the same for the body, with its standing legs, in walks in which the body's
            velocity jumps [s]: the acceleration of a body that jumps to full speed would take the
            load off a foot for a moment.
        unloading_time: time over which a foot gives up its load before it lifts off [s].
        loading_time: time over which a foot that has found the ground takes up its load [s]. Only
            after it may another foot lift off.
        handover_time: how long a foot has stood at least, in a static walk, before another lifts
            off [s].
        force_smoothing: time constant with which the contact forces follow what is wanted [s]:
            ground and feet are not rigid, and a load that jumps makes knees jerk.
        landing_depth: how far below its place the set-point of a foot lies that has just landed
            [m], so that it keeps touching the ground while its load grows.
        contact_loss: how long a standing foot may be without contact before it counts as being in
            the air [s].
        blend_time: time constant with which the set-point of a foot that lands moves from its
            target to its place [s].
        swing_blend_time: time constant with which a flying foot follows the body's errors, and goes
            from where it stood to its path [s].
        probe_speed: how fast a foot goes down that should stand and has found no ground [m/s].
        probe_depth: how far it goes down at most [m].
        longest_wait: how long the plan's clock may stand still at a time because a foot that
            should stand has found no ground yet [s].
        jump_share: what is taken of planned forces and accelerations from the tick before and from
            the one after, six times in turn, so that a jump of them takes about five ticks; 0 for
            none, up to 0.25. Not where feet that bear more than a fifth of the weight land or lift
            off.
        growth_time: time in which the force on a foot may grow by the robot's weight [s]; 0 for no
            limit. A force that jumps lets the foot sink into ground that gives way, and turns its
            knee.
        foothold_shift: how far flying feet may land beside their footholds, so that a body on two
            feet does not fall over the line through them [m]; for plans that promise contact
            forces.
        tolerated_delay: how late a foot may be before the clock stands still for it [s]. Where
            another is about to lift off, the clock stands still at once.
    """

    joint_stiffness: float
    joint_damping: float
    body_stiffness: float
    body_damping: float
    rotation_stiffness: float
    rotation_damping: float
    largest_error: float = 0.03
    largest_rotation: float = 0.2
    friction: float = 0.5
    smoothing: float = 0.04
    body_smoothing: float = 0.16
    unloading_time: float = 0.1
    loading_time: float = 0.05
    handover_time: float = 0.14
    force_smoothing: float = 0.01
    landing_depth: float = 0.001
    contact_loss: float = 0.03
    blend_time: float = 0.2
    swing_blend_time: float = 0.2
    probe_speed: float = 0.06
    probe_depth: float = 0.03
    longest_wait: float = 0.6
    tolerated_delay: float = 0.1
    jump_share: float = 0.0
    growth_time: float = 0.0
    foothold_shift: float = 0.0

    def __post_init__(self) -> None:
        for item in fields(self):
            value = getattr(self, item.name)
            if not (isinstance(value, (int, float)) and np.isfinite(value) and value >= 0):
                raise InputError(
                    f"{item.name} must be a number of at least 0, got {as_text(value)}"
                )
        if not (self.friction > 0 and self.loading_time > 0):
            raise InputError("friction and loading_time must be positive")
        if not self.jump_share <= 0.25:
            raise InputError(f"jump_share must be at most 0.25, got {self.jump_share:g}")

    @classmethod
    def for_robot(cls, robot: Quadruped, **changes: float) -> ControlGains:
        """Gains in proportion to a robot's weight and the length of its legs.

        Args:
            robot: the robot.
            changes: attributes to set otherwise, by name.

        Raises:
            InputError: an attribute is unknown, or a value is out of range.
        """
        length = float(np.mean([leg.reach for leg in robot.legs.values()]))
        mass, weight = robot.mass, robot.mass * GRAVITY
        # The body's moment of inertia about a horizontal axis, as of masses at the feet.
        inertia = mass * (0.5 * max(robot.stance_size)) ** 2
        stiffness = weight * length / SERVO_SAG
        values = {
            "joint_stiffness": stiffness,
            "joint_damping": SERVO_TIME * stiffness,
            "body_stiffness": mass * BODY_FREQUENCY**2,
            "body_damping": mass * 2.0 * DAMPING_RATIO * BODY_FREQUENCY,
            "rotation_stiffness": inertia * ROTATION_FREQUENCY**2,
            "rotation_damping": inertia * 2.0 * DAMPING_RATIO * ROTATION_FREQUENCY,
        }
        unknown = sorted(set(changes) - {f.name for f in fields(cls)})
        if unknown:
            raise InputError(
                f"unknown gain {unknown[0]!r}; known are {', '.join(f.name for f in fields(cls))}"
            )
        return cls(**{**values, **changes})

    @classmethod
    def for_plan(cls, plan: Plan, **changes: float) -> ControlGains:
        """Gains for the plan's robot, and for how its plan is followed.

        A plan that promises contact forces is followed with these forces fed forward, and needs
        less damping and smoothing. Where both feet of one side stand alone, in a pace, feet may
        land beside their footholds.

        Args:
            plan: what is to be followed.
            changes: attributes to set otherwise, by name.

        Raises:
            InputError: an attribute is unknown, or a value is out of range.
        """
        if plan.settings.promised_forces is None:
            return cls.for_robot(plan.robot, **changes)
        stiffness = cls.for_robot(plan.robot).joint_stiffness
        quick = {"joint_damping": FED_FORWARD_SERVO_TIME * stiffness, **FED_FORWARD}
        if not has_quick_joints(plan.robot):
            quick |= {"jump_share": JUMP_SHARE, **SLOW_JOINTS}
        reach = max(leg.reach for leg in plan.robot.legs.values())
        quick["landing_depth"] *= min(reach / SMALL_REACH, 1.0)
        if any(set(phase.support) in SIDES for phase in plan.phases):
            quick["foothold_shift"] = SHIFT_SHARE * plan.footholds.landing_radius
        return cls.for_robot(plan.robot, **{**quick, **changes})
