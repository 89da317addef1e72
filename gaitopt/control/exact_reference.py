"""The reference of a plan that promises forces: its motion as it is, with the forces that make it.

Entries are of the middle of a tick. The acceleration is what brings the velocity from that at the
tick's begin to that at its end, so that also a tick with a jump of the acceleration does.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gaitopt.control.clock import AT_REST, SAME_INSTANT, WalkClock
from gaitopt.control.gains import ControlGains
from gaitopt.control.planned_forces import planned_forces
from gaitopt.control.reference import Reference, legs_in_base, ramped, standing_feet
from gaitopt.conventions import GRAVITY, LEGS, BoolArray, FloatArray
from gaitopt.dynamics.contacts import ForceLimits
from gaitopt.dynamics.whole_body import Motion
from gaitopt.motion.rolling import rolled_away
from gaitopt.plan.contact_ground import ground_below
from gaitopt.plan.load_transfer import most_normal_shares
from gaitopt.plan.plan import Plan
from gaitopt.robots.quadruped import Quadruped
from gaitopt.robots.rotations import quaternion_to_matrix

SINKING_TIME = 0.03
"""How long before its touch-down a foot begins to go below its place [s]. Chosen: a flying foot
follows its reference within this time (``swing_blend_time``)."""
NEWTON_STEPS = 3
"""Newton steps of inverse kinematics for feet that roll. Chosen: errors of two centimetres are less
than a micrometre after three, if the leg is not straight."""
EASING_ROUNDS = 6
"""How often a jump is eased: in ticks of 6 ms it then takes about 30 ms. Ground gives way: a load
that jumps lets a foot sink, and turns a knee. Over 16 steps of wang2020 along sharply turning paths
(``height``, seed 0) a knee reached 131 % of its velocity limit with one round, 123 % with three and
118 % with six."""
LIGHT_SHARE = 0.2
"""Share of the weight up to which a foot's load is left out where a jump is eased while it lands or
lifts off, as it bears nothing on the other side. With 0.1 a jump was not eased at one lift-off of
wang2020 (``posture``, seed 0), and a foot that bore next to nothing kicked: its knee reached 336 %
of its velocity limit."""
LEAD = EASING_ROUNDS + 2
"""Ticks before the plan's start and after its end. The first entry holds as long as the robot
stands before it walks, and the last one when it has walked: both are at rest, which jumps that are
eased do not reach. With two ticks wang2020 was pushed while it stood, and began its walks with its
body 6 to 9 mm beside its place."""


def exact_reference(
    plan: Plan, clock: WalkClock, gains: ControlGains, dt: float, limits: ForceLimits
) -> Reference:
    """The plan in the middle of every tick, with contact forces.

    Args:
        plan: the motion.
        clock: which of its instants is followed at which time.
        gains: the times over which feet take up and give up their loads, among others.
        dt: time between ticks [s].
        limits: what the plan promises of its forces.
    """
    robot, ahead = plan.robot, 0.5 * dt
    count = int(np.ceil((plan.duration + clock.paused) / dt)) + 1
    grid = dt * np.arange(-LEAD, count + LEAD, dtype=np.float64)
    times = np.clip(clock.plan_time(grid + ahead), 0.0, plan.duration)
    planned = plan.at(times)
    standing = standing_feet(plan, times, clock.pausing(grid + ahead))
    velocity = _velocities(plan, clock, grid + ahead)
    edges = _velocities(plan, clock, np.append(grid, grid[-1] + dt))
    motion = Motion(planned.q, velocity, np.diff(edges, axis=0) / dt)
    load = _loads(standing, gains, dt)
    most = _largest_shares(plan, clock, limits, grid + ahead)
    rotation = quaternion_to_matrix(planned.q[:, 3:7])
    ground = ground_below(plan, times, limits.friction)
    normals = np.broadcast_to(ground.normals, (*standing.shape, 3))
    forces = planned_forces(robot, motion, standing, load, limits, ground, most)
    eased = _Easing.of(forces, standing, gains.jump_share, robot.mass * GRAVITY)
    rolled = rolled_away(robot, planned.q, velocity, standing, dt, normals)
    at_rest = np.abs(velocity[:, :6]).max(axis=1) < AT_REST
    sunk = gains.landing_depth * _sinking(standing, SINKING_TIME / dt)[..., None] * normals
    joints = _with_feet_at(robot, planned.q[:, 7:], (rolled - sunk) @ rotation)
    feet, inverse = legs_in_base(robot, joints)
    return Reference(
        dt=dt,
        lead=LEAD,
        clock=clock,
        position=planned.q[:, :3],
        rotation=rotation,
        linear=np.einsum("nij,nj->ni", rotation, velocity[:, :3]),
        angular=np.einsum("nij,nj->ni", rotation, velocity[:, 3:6]),
        joints=joints,
        rates=velocity[:, 6:] + _rolling_rates(plan, rolled, rotation, inverse, dt),
        velocity=velocity,
        acceleration=eased.over(motion.a),
        forces=eased.forces(forces),
        normals=normals,
        friction=np.broadcast_to(limits.friction * ground.grip, standing.shape),
        feet=planned.feet + rolled - sunk,
        feet_in_base=feet,
        inverse=inverse,
        standing=standing,
        load=load,
        # Forces were planned for a body that does not stop in the middle of its motion.
        patient=at_rest & plan.settings.static,
        ahead=ahead,
    )


def _velocities(plan: Plan, clock: WalkClock, times: FloatArray) -> FloatArray:
    """Pinocchio's velocities ``(N, nv)`` at ``times`` since the walk's start [s].

    A plan that begins in motion has the same velocity before it begins.
    """
    instants = clock.plan_time(times)
    begun = (instants > 0.0) | plan.begins_moving
    moving = begun & (instants < plan.duration) & ~clock.pausing(times)
    return np.asarray(plan.at(np.clip(instants, 0.0, plan.duration)).v * moving[:, None])


def _largest_shares(
    plan: Plan, clock: WalkClock, limits: ForceLimits, times: FloatArray
) -> FloatArray:
    """Largest normal forces of standing feet, as shares of the weight ``(N, 4)``.

    Where the clock stands still a load goes over, too.

    Args:
        plan, clock, limits: as above.
        times: since the walk's start ``(N,)`` [s].
    """
    since, until = np.full((2, len(times), len(LEGS)), np.inf)
    for i, leg in enumerate(LEGS):
        own = [swing for swing in plan.swings if swing.leg == leg]
        landings = np.array([swing.end for swing in own])
        leaves = np.array([swing.start for swing in own])
        landings = landings + clock.paused_before(landings - SAME_INSTANT)
        leaves = leaves + clock.paused_before(leaves + SAME_INSTANT)
        landed = np.append(-np.inf, landings)[np.searchsorted(landings, times, side="right")]
        lifted = np.append(leaves, np.inf)[np.searchsorted(leaves, times, side="left")]
        since[:, i], until[:, i] = times - landed, lifted - times
    return most_normal_shares(limits, since, until)


def _sinking(standing: BoolArray, ticks: float) -> FloatArray:
    """How far down feet are that land or have landed, from 0 to 1 ``(N, 4)``."""
    out = standing.astype(np.float64)
    for leg in range(standing.shape[1]):
        landings = np.flatnonzero(np.diff(standing[:, leg].astype(np.int8)) > 0) + 1
        for landing in landings.tolist():
            first = max(landing - round(ticks), 0)
            part = slice(first, landing)
            out[part, leg] = np.where(
                standing[part, leg], 1.0, np.arange(1.0, landing - first + 1.0) / (landing - first)
            )
    return out


class _Easing(NamedTuple):
    """Values of ticks that take a share of both neighbours, some times.

    What a tick takes its neighbour gives, so sums over ticks stay the same, and nothing comes late.
    It is otherwise where feet land or lift off. Light ones: ticks in which they fly take no load of
    them. Those that bear more: only the tick on more feet takes a share, as the other one has no
    force of such a foot. So the load that is to go over begins to do so before a foot lifts off,
    and still does after a foot has landed.

    Attributes:
        of_next: what each tick takes of the one after it, nothing at the end ``(N,)``.
        of_last: what each tick takes of the one before it, nothing at the begin ``(N,)``.
        standing: which feet stand ``(N, 4)``.
    """

    of_next: FloatArray
    of_last: FloatArray
    standing: BoolArray

    @classmethod
    def of(
        cls, forces: FloatArray, standing: BoolArray, share: float, weight: float
    ) -> _Easing:  # fmt: skip
        """For forces ``(N, 4, 3)`` [N] on feet that stand ``(N, 4)``."""
        size = np.linalg.norm(forces, axis=2)
        before, after = standing[:-1], standing[1:]
        changing = np.where(before != after, np.maximum(size[1:], size[:-1]), 0.0)
        light = changing.max(axis=1) <= LIGHT_SHARE * weight
        of_next = share * (light | (before | ~after).all(axis=1))
        of_last = share * (light | (after | ~before).all(axis=1))
        return cls(np.append(of_next, 0.0), np.append(0.0, of_last), standing)

    def over(self, values: FloatArray) -> FloatArray:
        """Values ``(N, ...)`` without jumps."""
        return self._eased(values, 1.0)

    def forces(self, forces: FloatArray) -> FloatArray:
        """Forces ``(N, 4, 3)`` [N] without jumps; 0 for feet in the air."""
        return self._eased(forces, self.standing[..., None].astype(np.float64))

    def _eased(self, values: FloatArray, kept: FloatArray | float) -> FloatArray:
        """Values ``(N, ...)``, of which a share ``kept`` is left after each round."""
        shape = (-1, *(1,) * (values.ndim - 1))
        of_next, of_last = self.of_next.reshape(shape), self.of_last.reshape(shape)
        if not (of_next.any() or of_last.any()):
            return values
        for _ in range(EASING_ROUNDS):
            steps = np.diff(values, axis=0, prepend=values[:1], append=values[-1:])
            values = kept * (values + of_next * steps[1:] - of_last * steps[:-1])
        return values


def _with_feet_at(robot: Quadruped, joints: FloatArray, away: FloatArray) -> FloatArray:
    """Joint angles ``(N, nj)`` [rad] that have the feet beside where the plan's angles have them.

    Balls roll by centimetres where steps are long, and legs are nearly straight there: one Newton
    step from the plan's angles, as the controller makes for small errors, would miss by
    millimetres, and feet would land late.

    Args:
        robot: the robot.
        joints: the plan's angles ``(N, nj)`` [rad].
        away: how far beside, in the base frame ``(N, 4, 3)`` [m].
    """
    columns = np.array([robot.leg_columns[leg] for leg in LEGS])
    feet, inverse = legs_in_base(robot, joints)
    wanted, found = feet + away, np.array(joints)
    for _ in range(NEWTON_STEPS):
        found[:, columns] += np.einsum("nlij,nlj->nli", inverse, wanted - feet)
        feet, inverse = legs_in_base(robot, found)
    return found


def _loads(standing: BoolArray, gains: ControlGains, dt: float) -> FloatArray:
    """Share of a full load of each foot ``(N, 4)``: it rises after touch-down, too."""
    falling = ramped(standing, max(gains.unloading_time / dt, 1.0))
    # Backwards in time a touch-down is a lift-off.
    rising = ramped(standing[::-1], max(gains.loading_time / dt, 1.0))[::-1]
    return np.minimum(falling, rising)


def _rolling_rates(
    plan: Plan, rolled: FloatArray, rotation: FloatArray, inverse: FloatArray, dt: float
) -> FloatArray:
    """Joint rates ``(N, nj)`` [rad/s] that move the feet as they roll."""
    speed = np.gradient(rolled, dt, axis=0) @ rotation
    out = np.zeros((len(rolled), len(plan.robot.joint_names)))
    for i, leg in enumerate(LEGS):
        columns = list(plan.robot.leg_columns[leg])
        out[:, columns] = np.einsum("nij,nj->ni", inverse[:, i], speed[:, i])
    return out
