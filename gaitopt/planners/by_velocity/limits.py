"""What a gait asks of joints and legs, against what they can; and what to do about too much."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from gaitopt.conventions import LEGS, BoolArray, FloatArray
from gaitopt.errors import GaitoptError, InfeasibleSpeedError
from gaitopt.motion.bounds import derivative_range, largest_sizes
from gaitopt.motion.path import MotionPath
from gaitopt.plan.settings.by_velocity import GaitSettings
from gaitopt.planners.by_velocity.motion import GaitMotion
from gaitopt.robots.rotations import rpy_to_matrix
from gaitopt.robots.whole_body import REACH_TOLERANCE

HALVINGS = 10
"""Bisections for the fastest velocity: it is found to a thousandth of the command."""
LONGER_CYCLES = (1.5, 2.0, 3.0, 5.0, 8.0, 12.0, 20.0)
"""Multiples of the cycle time that are tried where velocity alone does not help."""


class Violation(NamedTuple):
    """A limit that a motion exceeds.

    Attributes:
        limit: what it is, ``"velocity LF_KFE"`` for instance.
        use: how much of it is needed, above 1; infinite where a ratio makes no sense.
        time: when it is worst [s].
        words: the numbers.
    """

    limit: str
    use: float
    time: float
    words: str


class Stretch(NamedTuple):
    """How far the legs are stretched.

    Attributes:
        times: ``(N,)`` [s].
        lengths: from each leg's first pitch axis to its foot ``(N, 4)`` [m].
        reached: whether the leg reaches its foot ``(N, 4)``.
    """

    times: FloatArray
    lengths: FloatArray
    reached: BoolArray


def stretch_of(motion: GaitMotion, times: FloatArray) -> Stretch:
    """How far a motion stretches the legs at ``times (N,)`` [s]."""
    robot = motion.robot
    base, feet = motion.base(times)[0], motion.feet(times)[0]
    local = (feet - base[:, None, :3]) @ (rpy_to_matrix(base[:, 3:]) @ robot.body_axes)
    lengths, reached = np.empty(feet.shape[:2]), np.empty(feet.shape[:2], dtype=np.bool_)
    for i, name in enumerate(LEGS):
        leg, points = robot.legs[name], local[:, i]
        lengths[:, i] = np.sqrt(leg.straightness(*points.T))
        reached[:, i] = leg.shortfall(points) <= REACH_TOLERANCE
    return Stretch(times, lengths, reached)


def find_violations(
    motion: GaitMotion, stretch: Stretch, path: MotionPath | None, settings: GaitSettings
) -> list[Violation]:
    """All limits that are exceeded, reach first, then the worst first."""
    reach = _reach(motion, stretch, settings)
    if path is None or reach:
        return reach
    robot = motion.robot
    found = _positions(motion, path)
    limits = robot.velocity_limits
    found += _rates(path, 1, limits, robot.joint_names, "velocity", "rad/s")
    if settings.acceleration_limit is not None:
        most = np.full(len(robot.joint_names), settings.acceleration_limit)
        found += _rates(path, 2, most, robot.joint_names, "acceleration", "rad/s^2")
        jumps = path.jumps(1)[:, 6:]
        if jumps.size and jumps.max() > 1e-6:
            knot, joint = np.unravel_index(int(jumps.argmax()), jumps.shape)
            found.append(
                Violation(
                    f"acceleration {robot.joint_names[joint]}", np.inf,
                    float(path.times[knot + 1]),
                    f"joint {robot.joint_names[joint]} would jump by {jumps.max():.3g} rad/s, as "
                    f"feet do that follow the {settings.swing!r} swing: take 'polynomial'",
                )
            )  # fmt: skip
    return sorted(found, key=lambda v: -v.use)


def _reach(motion: GaitMotion, stretch: Stretch, settings: GaitSettings) -> list[Violation]:
    """Feet that are further away than the reach fraction allows."""
    found = []
    for name, lengths, reached in zip(LEGS, stretch.lengths.T, stretch.reached.T, strict=True):
        leg = motion.robot.legs[name]
        allowed = settings.reach_fraction * leg.reach
        bad = (lengths > allowed + REACH_TOLERANCE) | ~reached
        if bad.any():
            k = int(np.where(bad, lengths, -np.inf).argmax())
            found.append(
                Violation(
                    f"reach {name}", np.inf, float(stretch.times[k]),
                    f"the foot of {name} would be {lengths[k]:.4g} m from the hip's pitch axis, or "
                    f"beside its leg's plane; the leg allows {leg.least_reach:.4g} to "
                    f"{allowed:.4g} m",
                )
            )  # fmt: skip
    return found


def _positions(motion: GaitMotion, path: MotionPath) -> list[Violation]:
    low, high = motion.robot.position_limits
    least, most = derivative_range(path, 0)
    over = np.maximum(low - least[:, 6:], most[:, 6:] - high)
    found = []
    for joint in np.flatnonzero(over.max(axis=0) > 1e-9).tolist():
        k = int(over[:, joint].argmax())
        name = motion.robot.joint_names[joint]
        found.append(
            Violation(
                f"position {name}", np.inf, float(path.times[k]),
                f"joint {name} would turn to between {least[k, 6 + joint]:.4f} and "
                f"{most[k, 6 + joint]:.4f} rad, and its limits are {low[joint]:.4f} to "
                f"{high[joint]:.4f} rad",
            )
        )  # fmt: skip
    return found


def _rates(
    path: MotionPath, order: int, limits: FloatArray, names: tuple[str, ...], what: str, unit: str
) -> list[Violation]:
    size = largest_sizes(path, order)[:, 6:]
    use = size / limits
    found = []
    for joint in np.flatnonzero(use.max(axis=0) > 1.0).tolist():
        k = int(use[:, joint].argmax())
        found.append(
            Violation(
                f"{what} {names[joint]}", float(use[k, joint]), float(path.times[k]),
                f"joint {names[joint]} would need {size[k, joint]:.4g} {unit}, and its limit is "
                f"{limits[joint]:.4g} {unit}",
            )
        )  # fmt: skip
    return found


def explain(
    settings: GaitSettings, violations: list[Violation], works: Callable[[GaitSettings], bool]
) -> InfeasibleSpeedError:
    """The error for a motion with these violations, with what would work instead.

    Args:
        settings: what was asked for.
        violations: of it, the worst first.
        works: whether other settings do.
    """
    worst = violations[0]
    fastest = _fastest(settings, works)
    cycle = None if fastest is not None else _longer_cycle(settings, works)
    vx, vy = settings.velocity
    if fastest is not None:
        way = (
            f"with this gait {fastest:.3f} of it works: ({fastest * vx:.4g}, {fastest * vy:.4g}) "
            f"m/s, {fastest * settings.yaw_rate:.4g} rad/s"
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
    """The largest share of the velocity that works, rounded down; ``None`` when not even 0 does."""

    def good(share: float) -> bool:
        try:
            return works(scaled(settings, share))
        except GaitoptError:
            return False

    if not good(0.0):
        return None
    low, high = 0.0, 1.0
    for _ in range(HALVINGS):
        middle = (low + high) / 2.0
        low, high = (middle, high) if good(middle) else (low, middle)
    return float(np.floor(low * 1000.0) / 1000.0)


def _longer_cycle(settings: GaitSettings, works: Callable[[GaitSettings], bool]) -> float | None:
    """A cycle time with which stepping on the spot works; the first of a few that are tried."""
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
