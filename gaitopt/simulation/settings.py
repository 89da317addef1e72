"""Settings of a simulation: the physics, the ground, the servos, and disturbances."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np

from gaitopt.errors import InputError
from gaitopt.inputs import (
    as_text,
    check_array,
    check_kind,
    check_number,
    check_shape,
    check_tuple,
    is_real,
    is_whole,
)

TIMESTEPS = (1e-4, 0.02)
"""Smallest and largest timestep of the physics [s]: shorter ones are slower than real time, with
longer ones the servos are unstable."""

ROUNDING = 1e-9
"""Rounding of the quotient of two timesteps."""

MAP_TIMESTEP = 0.001
"""Longest timestep of the physics on a height map [s]. Feet that land on slopes and edges jump
aside in steps of 2 ms: over rubble and stairs the largest landing errors of go2 and anymal_c were
10 to 12 mm, and in steps of 1 ms 5 to 9 mm."""

LARGEST = float(np.finfo(np.float64).max)
"""Largest number that is finite; whole numbers may be larger."""

SMALL = 0.18
"""Reach of legs below which a robot counts as small [m]. All that it does is quicker, by the root
of its size, and what it stands on gives way by as much as that of a large one. In steps of 2 ms
LittleDog (0.177 m) missed footholds by up to 12 mm and Petoi's Bittle (0.088 m) fell; with what
follows both walk, with landing errors of 3.1 and 0.6 mm."""
SMALL_TIMESTEP, SMALL_CONTROL_INTERVAL, SMALL_CONTACT_TIME = 0.001, 0.003, 0.005
"""Longest timestep, control interval and time constant of contacts for small robots [s]. The
timestep and the time constant are those of a reach of :data:`SMALL`, and in proportion to shorter
ones: at 1 ms and 5 ms two of Petoi's robots (0.094 m) missed four footholds each, which they left
for a step of the physics, and none in proportion."""
LEAST_SHARE = 0.25
"""Least of this proportion. Chosen: robots of a reach of 5 cm and less are simulated alike."""

LEAST_STEPS = 2.3
"""Steps of the physics, at least, in which a foot that has lost the ground is seen before it has
moved far (:func:`gaitopt.simulation.light_feet.time_to_give_way`). A light leg without its motors'
inertia is thrown by the torque that is fed forward for its load as soon as its foot leaves the
ground for one step. In steps of 2 ms such legs of mors (1.9 by this measure) and of a Spot of
pybullet (1.6) missed a foothold and turned a joint at 188 % of its limit; in steps of 1 ms and less
they do not. hyq (2.4) and all other robots of example-robot-data walk alike in both."""


@dataclass(frozen=True)
class Push:
    """A constant force on the body for a certain time.

    Attributes:
        time: when it begins, on the plan's clock [s].
        duration: how long it lasts [s].
        force: at the body's centre of mass, in the world's axes ``(x, y, z)`` [N].
    """

    time: float
    duration: float
    force: tuple[float, float, float]

    def __post_init__(self) -> None:
        force = check_shape("force of a push", self.force, 3)
        values = np.append(check_array("times of a push", [self.time, self.duration]), force)
        if values.shape != (5,) or not np.isfinite(values).all() or (values[:2] < 0).any():
            raise InputError(
                "a push needs a time and a duration of at least 0 s and three finite forces, got "
                f"{as_text(self.time)}, {as_text(self.duration)}, {as_text(self.force)}"
            )
        for name, value in (("time", values[0]), ("duration", values[1])):
            object.__setattr__(self, name, float(value))
        object.__setattr__(self, "force", tuple(force.tolist()))


@dataclass(frozen=True)
class SimulationSettings:
    """Settings of :func:`gaitopt.simulate`.

    Where an attribute names no reason for its default, the default was chosen.

    Attributes:
        timestep: of the physics [s]; on a height map :data:`MAP_TIMESTEP` at most, and for robots
            with legs shorter than :data:`SMALL` :data:`SMALL_TIMESTEP`. Legs that are light for
            their load get shorter ones, too (:data:`LEAST_STEPS`).
        control_every: steps of this length between two calls of the controller. The servos run at
            every step of the physics. Small robots are controlled about every
            :data:`SMALL_CONTROL_INTERVAL` (in whole steps), or sooner, and robots whose body would
            shake sooner, too (:mod:`gaitopt.simulation.body_loop`).
        friction: coefficient between feet and ground. On footholds with less friction than the
            plan's limits it is less in proportion.
        sensing_delay: age of the measurements that the controller gets of body, joints and
            contacts, rounded up to whole calls of the controller [s]. The servos' own encoders are
            not delayed.
        pushes: forces on the body.
        column_errors: ``(leg, foothold, error)``: that column is higher by ``error`` [m] than the
            plan knows; on open ground a plate lies there.
        body_mass_factor, leg_mass_factor: factors on the masses and inertias of the body, and of
            everything that hangs on it. The controller goes on using those of the URDF.
        torque_limits: whether the servos keep to the URDF's effort limits.
        rate_limits: whether the servos clip their wanted speeds to the URDF's velocity limits. The
            ground may still turn a joint faster.
        own_shapes: whether the shapes of a robot that was read from an MJCF touch the ground and
            one another as that file says. Otherwise, and for all other robots, the feet are balls.
            Friction and stiffness of contacts are those of these settings in any case.
        limbs: whether limbs and trunk of a robot whose feet are balls touch the ground: plane,
            columns, or height map. They do not touch one another. Where feet are points nobody
            knows where legs end, and limbs touch nothing.
        contact_time: MuJoCo's time constant of contacts (``solref``) [s]. At 10 ms feet and ground
            give way by less than 1 mm, and steps of 2 ms are stable; MuJoCo asks for twice the
            timestep at least. For small robots it is :data:`SMALL_CONTACT_TIME` at most.
        impratio: MuJoCo's ratio of the stiffness of friction to that of the contact; larger values
            let feet creep less.
        noslip_iterations: MuJoCo's iterations that reduce creeping.
        column_height: how far the lowest column stands out of the ground [m].
        stand_time: how long the robot stands before the plan begins, for the feet to come to rest
            on the ground [s]; it is not in the report.
        watch_time: how long the robot is watched after the end of the plan [s].
        landing_time: how long after the plan's touch-down a foot may take until it stands [s].
        fall_tilt: a body that is tilted further than this from the plan has fallen [rad].
        fall_error: a body that is further than this from the plan has fallen, or is lost, as a
            share of the base's height above the feet.
        servo_tolerance: by what share of their limits joint velocities may exceed them: the servos'
            wanted speeds do not, but the ground and the other legs move a joint as well.
        record_every: time between the samples of the recorded motion [s].

    Raises:
        InputError: a value is out of range; the message names it.
    """

    timestep: float = 0.002
    control_every: int = 3
    friction: float = 1.0
    sensing_delay: float = 0.0
    pushes: tuple[Push, ...] = ()
    column_errors: tuple[tuple[str, int, float], ...] = ()
    body_mass_factor: float = 1.0
    leg_mass_factor: float = 1.0
    torque_limits: bool = True
    rate_limits: bool = True
    own_shapes: bool = True
    limbs: bool = True
    contact_time: float = 0.01
    impratio: float = 10.0
    noslip_iterations: int = 3
    column_height: float = 0.08
    stand_time: float = 0.3
    watch_time: float = 0.5
    landing_time: float = 0.3
    fall_tilt: float = 0.5
    fall_error: float = 0.5
    servo_tolerance: float = 0.3
    record_every: float = 0.02

    def __post_init__(self) -> None:
        positive = ("timestep", "friction", "body_mass_factor", "leg_mass_factor", "contact_time",
                    "impratio", "column_height", "fall_tilt", "fall_error",
                    "record_every")  # fmt: skip
        for item in fields(self):
            value = getattr(self, item.name)
            if item.name in ("pushes", "column_errors"):
                object.__setattr__(self, item.name, check_tuple(item.name, value))
            elif not (isinstance(value, (bool, int, float)) and 0 <= value <= LARGEST):
                raise InputError(
                    f"{item.name} must be a number of at least 0, got {as_text(value)}"
                )
            elif item.name in positive and not value > 0:
                raise InputError(f"{item.name} must be positive, got {as_text(value)}")
        for push in self.pushes:
            check_kind("pushes: each", push, Push)
        for error in self.column_errors:
            each = check_tuple("column_errors: each", error)
            if not (len(each) == 3 and isinstance(each[0], str) and is_whole(each[1])
                    and is_real(each[2]) and abs(each[2]) <= LARGEST):  # fmt: skip
                raise InputError(
                    f"column_errors: each is (leg, foothold, error in metres), got {as_text(error)}"
                )
        if not TIMESTEPS[0] <= self.timestep <= TIMESTEPS[1]:
            raise InputError(
                f"timestep must be from {TIMESTEPS[0]:g} to {TIMESTEPS[1]:g} s, got "
                f"{as_text(self.timestep)}"
            )
        for name in ("control_every", "noslip_iterations"):
            if getattr(self, name) != int(getattr(self, name)):
                raise InputError(
                    f"{name} must be a whole number, got {as_text(getattr(self, name))}"
                )
        if self.control_every < 1:
            raise InputError(f"control_every must be at least 1, got {as_text(self.control_every)}")

    def on_height_map(self) -> SimulationSettings:
        """The same with steps of the physics that are short enough for a height map."""
        return self._in_steps_of(MAP_TIMESTEP)

    def for_feet(self, time: float) -> SimulationSettings:
        """The same, fine enough for feet that give way within a ``time`` [s] without ground."""
        return self._in_steps_of(max(time / LEAST_STEPS, TIMESTEPS[0]))

    def _in_steps_of(self, longest: float) -> SimulationSettings:
        """The same with steps of the physics of at most so long [s], and the same control.

        They are not shorter than the shortest of :data:`TIMESTEPS`, though.
        """
        wanted = int(np.ceil(self.timestep / longest - ROUNDING))
        most = int(np.floor(self.timestep / TIMESTEPS[0] + ROUNDING))
        parts = max(min(wanted, most), 1)
        timestep = max(self.timestep / parts, TIMESTEPS[0])
        return replace(self, timestep=timestep, control_every=self.control_every * parts)

    def for_reach(self, reach: float) -> SimulationSettings:
        """The same, fine enough for a robot whose legs reach so far [m]."""
        if check_number("reach", reach, 0.0, 1e6, "m") >= SMALL:
            return self
        share = max(reach / SMALL, LEAST_SHARE)
        timestep = min(self.timestep, share * SMALL_TIMESTEP)
        interval = min(self.control_interval, SMALL_CONTROL_INTERVAL)
        return replace(
            self, timestep=timestep, control_every=max(round(interval / timestep), 1),
            contact_time=min(self.contact_time, share * SMALL_CONTACT_TIME),
        )  # fmt: skip

    @property
    def control_interval(self) -> float:
        """Time between two calls of the controller [s]."""
        return self.timestep * self.control_every
