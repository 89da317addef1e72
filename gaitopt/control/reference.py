"""What a controller follows: a plan on a fine grid of times, computed once and vectorised."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gaitopt.control.clock import WalkClock, walk_clock
from gaitopt.control.gains import ControlGains
from gaitopt.conventions import GRAVITY, LEGS, BoolArray, FloatArray
from gaitopt.errors import InputError
from gaitopt.plan.plan import Plan
from gaitopt.robots.quadruped import Quadruped
from gaitopt.robots.rotations import quaternion_to_matrix

LEAST_LOAD = 0.02
"""Least share of a full load that a standing foot carries: a foot that carries nothing would lose
its contact, and with it its place."""

LARGEST_JUMP = 1e-3
"""A body whose velocity jumps by more than this is smoothed more [m/s, rad/s]. Smooth plans jump by
rounding alone, others by centimetres a second: anything in between tells them apart."""

MOST_TICKS = 1_000_000
"""Most ticks of a reference, which takes about 1 kB each: 100 minutes at 6 ms."""

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
        joints, rates: ``(N, nj)`` [rad], [rad/s], in the order of ``robot.joint_names``. The rates
            of standing legs are those that move the body as :attr:`linear` and :attr:`angular`
            say, clipped to the joints' limits.
        acceleration: Pinocchio's, of the smoothed motion: of the base in its own frame, and of
            the joints ``(N, nv)``.
        feet: foot frames in the world ``(N, 4, 3)`` [m].
        feet_in_base: foot frames at ``joints``, in the base frame ``(N, 4, 3)`` [m].
        inverse: inverse Jacobians: joint angles of a leg for a displacement of its foot in the
            base frame ``(N, 4, 3, 3)`` [rad/m], damped near the straight leg.
        standing: which feet stand ``(N, 4)``.
        load: share of a full load that each foot may carry ``(N, 4)``: 0 in the air, and falling
            before lift-off.
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
    acceleration: FloatArray
    feet: FloatArray
    feet_in_base: FloatArray
    inverse: FloatArray
    standing: BoolArray
    load: FloatArray

    def __len__(self) -> int:
        return len(self.position)

    @property
    def before(self) -> float:
        """How long before the plan's start the reference begins [s]."""
        return self.lead * self.dt

    def tick(self, time: float) -> int:
        """Index of the tick at ``time`` [s] since the walk's start; the first or last beyond."""
        return min(max(round(time / self.dt) + self.lead, 0), len(self) - 1)


def build_reference(plan: Plan, gains: ControlGains, dt: float) -> Reference:
    """Sample ``plan`` for a controller that runs every ``dt`` seconds.

    A static walk stands still where one foot lifts off as another lands (:func:`walk_clock`).
    Joints are averaged over ``gains.smoothing``, which keeps their velocities within the limits; a
    body whose velocity jumps is averaged over ``gains.body_smoothing``. The rates of standing legs
    follow from the body's motion, those of flying legs from the joints'.

    Args:
        plan: the motion.
        gains: the times over which it is smoothed, among others.
        dt: time between ticks [s].

    Raises:
        InputError: ``dt`` is no positive time or makes too many ticks, or a leg has no roll joint.
    """
    if not (np.isfinite(dt) and dt > 0 and plan.duration / dt < MOST_TICKS):
        raise InputError(
            f"the control interval must be a positive time, got {dt!r}; it makes at most "
            f"{MOST_TICKS:.0e} ticks of {plan.duration:.1f} s (a longer walk goes in parts)"
        )
    for name, leg in plan.robot.legs.items():
        if not leg.has_roll:
            raise InputError(
                f"{plan.robot.name}: leg {name} has two joints; the tracking controller needs three"
            )
    clock = walk_clock(plan, gains.handover_time)
    # Windows of an odd number of ticks lie evenly around each.
    width, wide = (2 * round(t / dt / 2.0) + 1 for t in _windows(plan, clock, gains))
    lead = wide // 2 + 2
    grid = np.arange(-lead, int(np.ceil((plan.duration + clock.paused) / dt)) + lead + 1) * dt
    times, pausing = np.clip(clock.plan_time(grid), 0.0, plan.duration), clock.pausing(grid)
    motion, standing = plan.at(times), _standing(plan, times, pausing)
    moving = ((grid >= 0.0) & (times < plan.duration) & ~pausing)[:, None]
    joints = smoothed(motion.q[:, 7:], width)
    values = smoothed(plan.path.evaluate(times)[:, :3], wide)
    rotation = quaternion_to_matrix(motion.q[:, 3:7])
    feet, inverse = _legs(plan.robot, joints)
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
        acceleration=np.gradient(velocity, dt, axis=0),
        feet=smoothed(motion.feet.reshape(len(times), -1), width).reshape(-1, len(LEGS), 3),
        feet_in_base=feet,
        inverse=inverse,
        standing=standing,
        load=ramped(standing, max(gains.unloading_time / dt, 1.0)),
    )


def _windows(plan: Plan, clock: WalkClock, gains: ControlGains) -> tuple[float, float]:
    """Times over which joints and body are averaged [s]."""
    if plan.settings.promised_forces and plan.settings.static:
        # Its body accelerates and brakes as hard as forces allow. Contact forces that jump are not
        # there at once in the feet, so they are spread over the time of a pendulum as tall as it.
        pendulum = float(np.sqrt(plan.robot.standing_height / GRAVITY))
        return gains.smoothing, max(gains.smoothing, gains.body_smoothing, pendulum)
    jumps = float(plan.path.jumps(1)[:, :6].max(initial=0.0))
    # A clock that stops makes a smooth path jump.
    wide = gains.body_smoothing if jumps > LARGEST_JUMP or clock.paused > 0.0 else 0.0
    return gains.smoothing, max(gains.smoothing, wide)


def _standing(plan: Plan, times: FloatArray, pausing: BoolArray) -> BoolArray:
    """Which feet stand ``(N, 4)``; in a pause those that stand on either side of it."""
    standing = np.array(plan.at(times).contacts)
    sides = np.clip(times[pausing] + [[-BESIDE], [BESIDE]], 0.0, plan.duration)
    standing[pausing] = plan.at(sides[0]).contacts | plan.at(sides[1]).contacts
    return standing


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


def _legs(robot: Quadruped, joints: FloatArray) -> tuple[FloatArray, FloatArray]:
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
