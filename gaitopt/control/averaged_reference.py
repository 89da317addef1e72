"""The reference of a plan that promises no forces: its motion, averaged over short times.

Velocities of such a plan may jump, which no force can make a body do.
"""

from __future__ import annotations

import numpy as np

from gaitopt.control.clock import WalkClock
from gaitopt.control.gains import ControlGains
from gaitopt.control.reference import Reference, legs_in_base, ramped, standing_feet
from gaitopt.conventions import LEGS, BoolArray, FloatArray
from gaitopt.plan.contact_ground import ground_below
from gaitopt.plan.plan import Plan
from gaitopt.robots.quadruped import Quadruped
from gaitopt.robots.rotations import quaternion_to_matrix

LARGEST_JUMP = 1e-3
"""A body whose velocity jumps by more than this is smoothed more [m/s, rad/s]. Smooth plans jump by
rounding alone, others by centimetres a second: anything in between tells them apart."""


def averaged_reference(plan: Plan, clock: WalkClock, gains: ControlGains, dt: float) -> Reference:
    """The plan as it is at the ticks, averaged over times around them.

    Joints are averaged over ``gains.smoothing``, which keeps their velocities within the limits; a
    body whose velocity jumps is averaged over ``gains.body_smoothing``. The rates of standing legs
    follow from the body's motion, those of flying legs from the joints'.

    Args:
        plan: the motion.
        clock: which of its instants is followed at which time.
        gains: the times over which it is averaged, among others.
        dt: time between ticks [s].
    """
    # Windows of an odd number of ticks lie evenly around each.
    width, wide = (2 * round(t / dt / 2.0) + 1 for t in _windows(plan, clock, gains))
    lead = wide // 2 + 2
    grid = np.arange(-lead, int(np.ceil((plan.duration + clock.paused) / dt)) + lead + 1) * dt
    times, pausing = np.clip(clock.plan_time(grid), 0.0, plan.duration), clock.pausing(grid)
    motion, standing = plan.at(times), standing_feet(plan, times, pausing)
    ground = ground_below(plan, times, gains.friction)
    moving = ((grid >= 0.0) & (times < plan.duration) & ~pausing)[:, None]
    joints = smoothed(motion.q[:, 7:], width)
    values = smoothed(plan.path.evaluate(times)[:, :3], wide)
    rotation = quaternion_to_matrix(motion.q[:, 3:7])
    feet, inverse = legs_in_base(plan.robot, joints)
    velocity = smoothed(motion.v * moving, width)
    velocity[:, :6] = smoothed(motion.v[:, :6] * moving, wide)
    linear = np.einsum("nij,nj->ni", rotation, motion.v[:, :3] * moving)
    angular = np.einsum("nij,nj->ni", rotation, motion.v[:, 3:6] * moving)
    linear, angular = smoothed(linear, wide), smoothed(angular, wide)
    rates = velocity[:, 6:].copy()
    _set_standing_rates(plan.robot, rates, standing, velocity[:, :6], feet, inverse)
    return Reference(
        dt=dt,
        lead=lead,
        clock=clock,
        position=values,
        rotation=rotation,
        linear=linear,
        angular=angular,
        joints=joints,
        rates=rates,
        velocity=np.zeros_like(velocity),
        acceleration=np.gradient(velocity, dt, axis=0),
        forces=np.zeros((len(times), len(LEGS), 3)),
        normals=np.broadcast_to(ground.normals, (*standing.shape, 3)),
        friction=np.broadcast_to(gains.friction * ground.grip, standing.shape),
        feet=smoothed(motion.feet.reshape(len(times), -1), width).reshape(-1, len(LEGS), 3),
        feet_in_base=feet,
        inverse=inverse,
        standing=standing,
        load=ramped(standing, max(gains.unloading_time / dt, 1.0)),
        # A robot that is not stable at rest cannot stop in the middle of its motion.
        patient=np.full(len(times), plan.settings.static),
    )


def _windows(plan: Plan, clock: WalkClock, gains: ControlGains) -> tuple[float, float]:
    """Times over which joints and body are averaged [s]."""
    jumps = float(plan.path.jumps(1)[:, :6].max(initial=0.0))
    # A clock that stops makes a smooth path jump.
    wide = gains.body_smoothing if jumps > LARGEST_JUMP or clock.paused > 0.0 else 0.0
    return gains.smoothing, max(gains.smoothing, wide)


def _set_standing_rates(
    robot: Quadruped,
    rates: FloatArray,
    standing: BoolArray,
    twist: FloatArray,
    feet: FloatArray,
    inverse: FloatArray,
) -> None:
    """Write into ``rates (N, nj)`` those of standing legs under a body with ``twist (N, 6)``.

    A foot that stands moves against the body in the base frame. All rates are clipped to the
    joints' limits.
    """
    for i, name in enumerate(LEGS):
        rows = np.flatnonzero(standing[:, i])
        foot_velocity = -twist[rows, :3] - np.cross(twist[rows, 3:], feet[rows, i])
        columns = list(robot.leg_columns[name])
        rates[rows[:, None], columns] = np.einsum("nij,nj->ni", inverse[rows, i], foot_velocity)
    np.clip(rates, -robot.velocity_limits, robot.velocity_limits, out=rates)


def smoothed(values: FloatArray, width: int) -> FloatArray:
    """Mean of ``values (N, c)`` over ``width`` (odd) samples around each; the ends are held."""
    if width <= 1:
        return np.array(values)
    half = width // 2
    padded = np.concatenate(
        [np.repeat(values[:1], half + 1, axis=0), values, np.repeat(values[-1:], half, axis=0)]
    )
    # Sums of differences from the start: walks are long, rounding must not grow with them.
    total = np.cumsum(padded - padded[0], axis=0)
    return np.asarray((total[width:] - total[:-width]) / width + padded[0])
