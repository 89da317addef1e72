"""A walk in physics as a plan of what happened, so that whatever draws plans draws it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from dataclasses import replace as changed
from typing import Protocol

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.errors import InputError
from gaitopt.inputs import check_kind
from gaitopt.motion.path import MotionPath
from gaitopt.plan.plan import Plan
from gaitopt.plan.trajectory import Trajectory
from gaitopt.robots.rotations import quaternion_to_rpy
from gaitopt.viewing.replay.physics.contacts import phases_of

SIMULATED_EVERY = 0.05
"""Least time between two samples of a simulated motion that are shown [s]: a page stays small."""
EARLY = 0.1
"""A motion without a result that ends this much before its plan did not finish [s]."""


class MissedStep(Protocol):
    """A foothold that was missed, as :class:`gaitopt.simulation.result.MissedFoothold`."""

    @property
    def step(self) -> int: ...


class SimulatedWalk(Protocol):
    """What a replay takes of the result of :func:`gaitopt.simulate`."""

    @property
    def motion(self) -> Trajectory: ...
    @property
    def plan_times(self) -> FloatArray: ...
    @property
    def torques(self) -> FloatArray: ...
    @property
    def forces(self) -> FloatArray: ...
    @property
    def finished(self) -> bool: ...
    @property
    def verdict(self) -> str: ...
    @property
    def missed(self) -> Sequence[MissedStep]: ...


@dataclass(frozen=True, eq=False)
class Happened:
    """A walk in physics.

    Attributes:
        walk: the plan with the motion and the phases that happened in place of its own.
        ghost: the plan at the plan's times of the simulation, for which a controller may wait.
        motion: what was simulated, with all its samples.
        result: all that was recorded; ``None`` where only a motion was given.
        fell: when the robot fell, or the simulation ended before the plan [s]; ``None`` where it
            walked to the end.
    """

    walk: Plan
    ghost: Plan
    motion: Trajectory
    result: SimulatedWalk | None
    fell: float | None

    @property
    def told(self) -> str:
        """How it ended, in words."""
        if self.result is not None:
            return f"physics: {self.result.verdict}"
        return "" if self.fell is None else f"physics ended at {self.fell:.1f} s, before the plan"

    @property
    def missed(self) -> tuple[int, ...]:
        """Steps whose footholds were missed."""
        return () if self.result is None else tuple(m.step for m in self.result.missed)


def what_happened(plan: Plan, simulated: Trajectory | SimulatedWalk) -> Happened:
    """A walk in physics of ``plan``'s robot.

    Args:
        plan: what was simulated.
        simulated: the result of :func:`gaitopt.simulate`, or its ``motion`` alone.

    Raises:
        InputError: the motion is another robot's, or has no samples.
    """
    result = None if isinstance(simulated, Trajectory) else simulated
    motion = simulated if isinstance(simulated, Trajectory) else simulated.motion
    check_kind("simulated", motion, Trajectory)
    if motion.joint_names != plan.robot.joint_names:
        raise InputError(
            f"the simulated motion has the joints {', '.join(motion.joint_names)}, the plan's "
            f"robot has {', '.join(plan.robot.joint_names)}"
        )
    if not len(motion):
        raise InputError("the simulated motion has no samples")
    times = motion.t - motion.t[0]
    clock = times if result is None else np.asarray(result.plan_times)
    early = bool(times[-1] < plan.duration - EARLY)
    return Happened(
        walk=changed(plan, path=_path(times, motion.q), phases=phases_of(plan, motion)),
        ghost=changed(plan, path=_path(times, plan.at(np.clip(clock, 0.0, plan.duration)).q)),
        motion=motion,
        result=result,
        fell=float(times[-1]) if (early if result is None else not result.finished) else None,
    )


def _path(times: FloatArray, q: FloatArray) -> MotionPath:
    """Configurations ``(N, nq)`` as straight lines between some of them."""
    end = times[-1]
    wanted = np.append(np.arange(0.0, end, SIMULATED_EVERY), end)
    keep = np.unique(np.searchsorted(times, wanted).clip(0, len(times) - 1))
    turned = np.unwrap(quaternion_to_rpy(q[keep, 3:7]), axis=0)
    return MotionPath.polyline(
        times[keep], np.concatenate([q[keep, :3], turned, q[keep, 7:]], axis=1)
    )
