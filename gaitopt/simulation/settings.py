"""What is simulated: the world, the servos, and what disturbs them."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from gaitopt.errors import InputError


@dataclass(frozen=True)
class Push:
    """A steady force on the body for a while.

    Attributes:
        time: when it begins, on the plan's clock [s].
        duration: how long it lasts [s].
        force: at the body's centre of mass, in the world's axes ``(x, y, z)`` [N].
    """

    time: float
    duration: float
    force: tuple[float, float, float]

    def __post_init__(self) -> None:
        values = np.array([self.time, self.duration, *self.force], dtype=np.float64)
        if values.shape != (5,) or not np.isfinite(values).all() or (values[:2] < 0).any():
            raise InputError(
                "a push needs a time and a duration of at least 0 s and three finite forces, got "
                f"{self.time!r}, {self.duration!r}, {self.force!r}"
            )


@dataclass(frozen=True)
class SimulationSettings:
    """Settings of :func:`gaitopt.simulate`.

    Attributes:
        timestep: of the physics [s].
        control_every: physics steps between two calls of the controller; the servos' own PD runs
            at every step.
        friction: coefficient between feet and ground.
        sensing_delay: age of what the controller is told, of body, joints and contacts, rounded
            up to whole calls of the controller [s]. The servos' own encoders are not delayed.
        pushes: forces on the body.
        column_errors: ``(leg, foothold, error)``: that column (or, on open ground, a plate in
            its place) stands higher by ``error`` [m] than the plan knows.
        body_mass, leg_mass: factors on the true masses and inertias of the body, and of all that
            hangs on it; the controller goes on believing in the URDF.
        torque_limits: whether the servos are held to the URDF's effort limits.
        rate_limits: whether the servos are held to the URDF's velocity limits in what they tell
            their motors. What the ground does to a joint is beyond them.
        contact_time: MuJoCo's time constant of contacts (``solref``); at 10 ms feet and ground give
            way by less than 1 mm, and steps of 2 ms stay stable [s].
        impratio: MuJoCo's ratio of frictional to normal stiffness, against creeping feet.
        noslip_iterations: MuJoCo's iterations against creeping feet.
        column_height: how far the lowest column stands out of the ground [m].
        stand: how long the robot stands before the plan begins; not in the report [s].
        settle: how long the robot is watched after the end of the plan [s].
        landing_time: how long after the plan's touch-down a foot may take to stand [s].
        fall_tilt: a body tilted further than this from the plan has fallen [rad].
        fall_error: a body further than this from the plan has fallen, or is lost [share of the
            base's height above the feet].
        servo_tolerance: joint velocities may exceed their limits by this share of the limit: what
            the servos tell their motors does not, but legs pull at one another, and the ground at
            them.
        record_every: time between the samples of the recorded motion [s].
    """

    timestep: float = 0.002
    control_every: int = 3
    friction: float = 1.0
    sensing_delay: float = 0.0
    pushes: tuple[Push, ...] = ()
    column_errors: tuple[tuple[str, int, float], ...] = ()
    body_mass: float = 1.0
    leg_mass: float = 1.0
    torque_limits: bool = True
    rate_limits: bool = True
    contact_time: float = 0.01
    impratio: float = 10.0
    noslip_iterations: int = 3
    column_height: float = 0.08
    stand: float = 0.3
    settle: float = 0.5
    landing_time: float = 0.3
    fall_tilt: float = 0.5
    fall_error: float = 0.5
    servo_tolerance: float = 0.3
    record_every: float = 0.02

    def __post_init__(self) -> None:
        positive = ("timestep", "friction", "body_mass", "leg_mass", "contact_time", "impratio",
                    "column_height", "fall_tilt", "fall_error", "record_every")  # fmt: skip
        for item in fields(self):
            value = getattr(self, item.name)
            if item.name in ("pushes", "column_errors"):
                object.__setattr__(self, item.name, tuple(value))
            elif not (isinstance(value, (bool, int, float)) and np.isfinite(value) and value >= 0):
                raise InputError(f"{item.name} must be a number of at least 0, got {value!r}")
            elif item.name in positive and not value > 0:
                raise InputError(f"{item.name} must be positive, got {value!r}")
        if not 1e-4 <= self.timestep <= 0.02:
            raise InputError(f"timestep must be from 0.0001 to 0.02 s, got {self.timestep!r}")
        for name in ("control_every", "noslip_iterations"):
            if getattr(self, name) != int(getattr(self, name)):
                raise InputError(f"{name} must be a whole number, got {getattr(self, name)!r}")
        if self.control_every < 1:
            raise InputError(f"control_every must be at least 1, got {self.control_every!r}")

    @property
    def control_interval(self) -> float:
        """Time between two calls of the controller [s]."""
        return self.timestep * self.control_every
