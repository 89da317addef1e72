"""Limits of joints and legs that a gait exceeds, and the largest velocity that keeps them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from gaitopt.conventions import LEGS, BoolArray, FloatArray
from gaitopt.errors import GaitoptError, InfeasibleSpeedError
from gaitopt.motion.bounds import derivative_range, largest_sizes
from gaitopt.motion.path import BASE_COLUMNS, MotionPath
from gaitopt.plan.settings.by_velocity import GaitSettings
from gaitopt.planners.by_velocity.motion import GaitMotion
from gaitopt.robots.leg import REACH_TOLERANCE
from gaitopt.robots.whole_body import into_body

STRAIGHT = 1e-3
"""A leg that lacks less to its full length counts as straight [m]. Chosen: between two samples,
7 ms apart, a leg's length changes by some 0.01 mm about its largest."""
LEAST_SHARE = 1e-5
"""Least share of the velocity at which one that works is looked for; chosen here."""
HALVINGS = 10
"""Bisections for the fastest velocity: it is found to a thousandth."""
FORCE_HALVINGS = 5
"""The same with contact forces, where each try takes a second: to a thirtieth."""
LONGER_CYCLES = (1.5, 2.0, 3.0, 5.0, 8.0, 12.0, 20.0)
"""Multiples of the cycle time that are tried where no velocity works; chosen here."""
VELOCITY_JUMP = 1e-6
"""Jump of a joint velocity at a knot that counts as none, for rounding [rad/s]."""
BALANCE = "balance"
"""The limit of a gait for whose body no path has contact forces."""
KINEMATIC = ("velocity", "acceleration", "reach", "position")
"""Kinds of limits on joints and legs; all other kinds are those of contact forces."""
SHORTER = "a shorter transfer_time, a larger duty factor, "
"""What helps where feet that change at one instant cannot hand over their loads."""
POSITION_TOLERANCE = 1e-9
"""By how much a joint may be beyond a position limit, for rounding [rad]."""


class Violation(NamedTuple):
    """A limit that a motion exceeds.

    Attributes:
        limit: its kind and joint or leg, ``"velocity LF_KFE"`` for instance.
        use: share of the limit that is needed, above 1; infinite where a share makes no sense.
        time: when the violation is largest [s].
        words: a sentence with the numbers.
    """

    limit: str
    use: float
    time: float
    words: str

    @property
    def kind(self) -> str:
        """The first word of the limit, ``"velocity"`` for instance."""
        return self.limit.split()[0]


class LegLengths(NamedTuple):
    """How long the legs are at samples of a motion.

    Attributes:
        times: ``(N,)`` [s].
        lengths: from each leg's first pitch axis to its foot ``(N, 4)`` [m].
        reached: whether the leg reaches its foot ``(N, 4)``.
    """

    times: FloatArray
    lengths: FloatArray
    reached: BoolArray


def leg_lengths(motion: GaitMotion, times: FloatArray) -> LegLengths:
    """Lengths of the legs of a motion at ``times (N,)`` [s]."""
    robot = motion.robot
    base, feet = motion.base(times)[0], motion.feet(times)[0]
    local = into_body(robot, base[:, :3], base[:, 3:], feet)
    lengths, reached = np.empty(feet.shape[:2]), np.empty(feet.shape[:2], dtype=np.bool_)
    for i, name in enumerate(LEGS):
        leg, points = robot.legs[name], local[:, i]
        lengths[:, i] = leg.length(points)
        reached[:, i] = leg.shortfall(points) <= REACH_TOLERANCE
    return LegLengths(times, lengths, reached)


def straightest(motion: GaitMotion, lengths: LegLengths) -> LegLengths | None:
    """The same lengths; the leg that is nearest to straight or folded counts as one too short.

    ``None`` where no leg is nearer to it than :data:`STRAIGHT`.
    """
    ends = np.array(
        [[leg.least_reach, leg.reach] for leg in (motion.robot.legs[name] for name in LEGS)]
    )
    slack = np.minimum(lengths.lengths - ends[:, 0], ends[:, 1] - lengths.lengths)
    if slack.min() > STRAIGHT:
        return None
    reached = lengths.reached.copy()
    reached[np.unravel_index(int(slack.argmin()), slack.shape)] = False
    return lengths._replace(reached=reached)


def find_violations(
    motion: GaitMotion, lengths: LegLengths, path: MotionPath | None, settings: GaitSettings
) -> list[Violation]:
    """All limits that a motion exceeds, the largest share first.

    Args:
        motion: the gait.
        lengths: of its legs, at samples. Where a leg is too long, no other limit is checked.
        path: of the motion; ``None`` where a foot is out of reach.
        settings: with the limits.
    """
    reach = _reach(motion, lengths, settings)
    if path is None or reach:
        return reach
    robot = motion.robot
    found = _positions(motion, path)
    limits = robot.velocity_limits
    found += _derivatives(path, 1, limits, robot.joint_names, "velocity", "rad/s")
    most = settings.joint_accelerations(robot)
    if np.isfinite(most).any():
        found += _derivatives(path, 2, most, robot.joint_names, "acceleration", "rad/s^2")
        jumps = np.where(np.isfinite(most), path.jumps(1)[:, BASE_COLUMNS:], 0.0)
        if jumps.size and jumps.max() > VELOCITY_JUMP:
            knot, joint = np.unravel_index(int(jumps.argmax()), jumps.shape)
            found.append(
                Violation(
                    f"acceleration {robot.joint_names[joint]}", np.inf,
                    float(path.times[knot + 1]),
                    f"the velocity of joint {robot.joint_names[joint]} would jump by "
                    f"{jumps.max():.3g} rad/s, as that of a foot on the {settings.swing!r} swing "
                    "curve does: take 'polynomial'",
                )
            )  # fmt: skip
    return sorted(found, key=lambda v: -v.use)


def _reach(motion: GaitMotion, legs: LegLengths, settings: GaitSettings) -> list[Violation]:
    """Legs that are longer than the reach fraction allows, or do not reach their feet."""
    found = []
    for name, lengths, reached in zip(LEGS, legs.lengths.T, legs.reached.T, strict=True):
        leg = motion.robot.legs[name]
        allowed = settings.reach_fraction * leg.reach
        bad = (lengths > allowed + REACH_TOLERANCE) | ~reached
        if bad.any():
            k = int(np.where(bad, lengths, -np.inf).argmax())
            found.append(
                Violation(
                    f"reach {name}", np.inf, float(legs.times[k]),
                    f"the foot of {name} would be {lengths[k]:.4g} m from the hip's pitch axis, or "
                    f"beside its leg's plane; the leg allows {leg.least_reach:.4g} to "
                    f"{allowed:.4g} m",
                )
            )  # fmt: skip
    return found


def _positions(motion: GaitMotion, path: MotionPath) -> list[Violation]:
    """Joints that leave their position limits."""
    low, high = motion.robot.position_limits
    least, most = (bound[:, BASE_COLUMNS:] for bound in derivative_range(path))
    over, names = np.maximum(low - least, most - high), motion.robot.joint_names
    return [
        Violation(
            f"position {names[joint]}", np.inf, float(path.times[k]),
            f"joint {names[joint]} would turn to between {least[k, joint]:.4f} and "
            f"{most[k, joint]:.4f} rad, and its limits are {low[joint]:.4f} to "
            f"{high[joint]:.4f} rad",
        )
        for joint, k in _worst(over, POSITION_TOLERANCE)
    ]  # fmt: skip


def _derivatives(
    path: MotionPath, order: int, limits: FloatArray, names: tuple[str, ...], what: str, unit: str
) -> list[Violation]:
    """Joints whose derivative of some order exceeds its limit."""
    size = largest_sizes(path, order)[:, BASE_COLUMNS:]
    use = size / limits
    return [
        Violation(
            f"{what} {names[joint]}", float(use[k, joint]), float(path.times[k]),
            f"joint {names[joint]} would need {size[k, joint]:.4g} {unit}, and its limit is "
            f"{limits[joint]:.4g} {unit}",
        )
        for joint, k in _worst(use, 1.0)
    ]  # fmt: skip


def _worst(use: FloatArray, most: float) -> list[tuple[int, int]]:
    """Joints that exceed ``most`` in ``use (K - 1, nj)``, each with its worst segment."""
    joints = np.flatnonzero(use.max(axis=0) > most).tolist()
    return [(joint, int(use[:, joint].argmax())) for joint in joints]


def explain(
    settings: GaitSettings, violations: list[Violation], works: Callable[[GaitSettings], bool]
) -> InfeasibleSpeedError:
    """The error for a motion that exceeds limits, with a velocity or cycle time that works instead.

    Args:
        settings: of the motion.
        violations: of its limits, the largest share first.
        works: tells whether a motion with other settings keeps all limits.
    """
    worst = violations[0]
    fastest = _fastest(settings, works)
    kinematic = worst.kind in KINEMATIC
    cycle = _longer_cycle(settings, works) if kinematic and fastest is None else None
    vx, vy = settings.velocity
    if fastest is not None:
        way = (
            f"with this gait {fastest:.3g} of it works: ({fastest * vx:.4g}, {fastest * vy:.4g}) "
            f"m/s, {fastest * settings.yaw_rate:.4g} rad/s"
            if fastest > 0.0
            else "stepping on the spot works, and a hundred thousandth of the velocity does not"
        )
    elif not kinematic:
        jumps = settings.forces is None or settings.forces.transfer_time == 0.0
        way = (
            "stepping on the spot does not work either: take another cycle or gait, a longer lead, "
            f"more friction or torque, less reserve, {'' if jumps else SHORTER}or "
            'timing="velocity"'
        )
    elif cycle is not None:
        way = (
            f"not even stepping on the spot works with a cycle of {settings.schedule.cycle_time:g} "
            f"s; it does with {cycle:.3g} s. Take a longer cycle or a smaller swing_height"
        )
    else:
        way = "not even slow steps on the spot work: change body_height, swing_height or the robot"
    return InfeasibleSpeedError(
        f"({vx:g}, {vy:g}) m/s and {settings.yaw_rate:g} rad/s in a {settings.schedule.name} of "
        f"{settings.schedule.cycle_time:g} s a cycle are too much: {worst.words} (at "
        f"{worst.time:.3f} s); {way}",
        limit=worst.limit, needed=worst.use, time=worst.time, fastest=fastest,
        velocity=None if fastest is None else (fastest * vx, fastest * vy),
        yaw_rate=None if fastest is None else fastest * settings.yaw_rate,
        cycle_time=cycle,
    )  # fmt: skip


def scaled(settings: GaitSettings, share: float) -> GaitSettings:
    """The same steps at a share of the velocity."""
    vx, vy = settings.velocity
    return replace(settings, velocity=(share * vx, share * vy), yaw_rate=share * settings.yaw_rate)


def _fastest(settings: GaitSettings, works: Callable[[GaitSettings], bool]) -> float | None:
    """The largest share of the velocity that works, rounded down; ``None`` when 0 does not."""

    def good(share: float) -> bool:
        try:
            return works(scaled(settings, share))
        except GaitoptError:
            return False

    if not good(0.0):
        return None
    low, high = 0.0, 1.0
    while high > LEAST_SHARE and not low:
        low, high = (0.1 * high, high) if good(0.1 * high) else (0.0, 0.1 * high)
    for _ in range(HALVINGS if settings.forces is None else FORCE_HALVINGS):
        middle = (low + high) / 2.0
        low, high = (middle, high) if good(middle) else (low, middle)
    # Three digits, rounded down.
    unit = 10.0 ** (np.floor(np.log10(low)) - 2.0) if low > 0.0 else 1.0
    return float(np.floor(low / unit) * unit)


def _longer_cycle(settings: GaitSettings, works: Callable[[GaitSettings], bool]) -> float | None:
    """The first cycle time of a few with which stepping on the spot works; ``None`` for none."""
    for factor in LONGER_CYCLES:
        cycle = settings.schedule.cycle_time * factor
        longer = replace(
            scaled(settings, 0.0), schedule=settings.schedule.with_cycle_time(cycle),
            cycle_times=(), plateau=0.0, cycles=1, lead=settings.lead * factor,
        )  # fmt: skip
        try:
            if works(longer):
                return cycle
        except GaitoptError:
            continue
    return None
