"""One description of a motion for every format: joints, body, feet and forces over time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

import numpy as np

from gaitopt.conventions import FloatArray, frozen
from gaitopt.dynamics.whole_body import Motion, motion_of_path
from gaitopt.errors import InputError
from gaitopt.exporting.at_rest import REST
from gaitopt.exporting.joint_order import JointOrder
from gaitopt.inputs import check_number
from gaitopt.plan.contact_forces import contact_forces
from gaitopt.plan.plan import SLOWEST, Plan
from gaitopt.plan.trajectory import MAX_SAMPLES, Trajectory


@dataclass(frozen=True, eq=False)
class Exported:
    """What was written, and what it is worth.

    Attributes:
        files: that were written.
        numbers: by name, in SI units: what was measured of them.
        notes: sentences for the user.
    """

    files: tuple[Path, ...]
    numbers: Mapping[str, float] = field(default_factory=dict)
    notes: tuple[str, ...] = ()


class Forces(NamedTuple):
    """Contact forces ``(N, 4, 3)`` [N] and torques of the plan's joints ``(N, nj)`` [N m]."""

    forces: FloatArray
    torques: FloatArray


def forces_at(plan: Plan, times: FloatArray) -> Forces:
    """Contact forces and torques at times of a plan; after its end, those of standing still.

    A plan may brake until its last instant. What holds there afterwards are the forces of the same
    motion, so slow that nothing accelerates.
    """
    found = contact_forces(plan, times=np.minimum(times, plan.duration))
    forces, torques = found.forces.copy(), found.torques.copy()
    ended = times >= plan.duration
    if ended.any():
        slow = replace(
            plan,
            path=plan.path.slowed(SLOWEST),
            phases=tuple(p.slowed(SLOWEST) for p in plan.phases),
        )
        still = contact_forces(slow, times=[slow.duration])
        forces[ended], torques[ended] = still.forces[0], still.torques[0]
    return Forces(forces, torques)


@dataclass(frozen=True, eq=False)
class Source:
    """A plan that begins and ends at rest, and the joints that are told of it.

    Attributes:
        plan: the plan.
        order: the joints of the file.
        with_forces: whether the file has torques and contact forces.
        ramp: time in which the motion stops and starts, where it has to be made to [s].
        notes: what was changed of the plan that was given, in sentences.
    """

    plan: Plan
    order: JointOrder
    with_forces: bool
    ramp: float
    notes: tuple[str, ...] = ()

    def joints(self, times: FloatArray, derivative: int = 0) -> FloatArray:
        """Joints of the file, or their derivative, at times of the plan ``(N, n)``."""
        return np.asarray(self.plan.path.evaluate(times, derivative)[:, 6 + self.order.columns])

    @property
    def velocity_limits(self) -> FloatArray:
        """Of the joints of the file ``(n,)`` [rad/s]."""
        return np.asarray(self.plan.robot.velocity_limits[self.order.columns])

    def samples(self, dt: float) -> Samples:
        """The motion every ``dt`` seconds from 0 to the end, where it stands still.

        Raises:
            InputError: ``dt`` is not positive, or asks for too many samples.
        """
        step = check_number("dt", dt, 1e-6, 1e6, "s")
        count = int(np.ceil(self.plan.duration / step - 1e-9))
        if count > MAX_SAMPLES:
            raise InputError(
                f"dt = {step:g} s asks for {count} samples; at most {MAX_SAMPLES} are made"
            )
        return Samples(self, frozen(np.arange(count + 1) * step))


@dataclass(frozen=True, eq=False)
class Samples:
    """A motion at equal steps of time. After the plan's end it stands still.

    Attributes:
        source: what is sampled.
        times: ``(N,)`` [s].
    """

    source: Source
    times: FloatArray

    def __len__(self) -> int:
        return len(self.times)

    @cached_property
    def inside(self) -> FloatArray:
        """The times, none after the plan's end ``(N,)`` [s]."""
        return np.minimum(self.times, self.source.plan.duration)

    @cached_property
    def motion(self) -> Trajectory:
        """The motion in Pinocchio's vectors, with the plan's own order of joints."""
        return self.source.plan.at(self.inside)

    @cached_property
    def vectors(self) -> Motion:
        """Pinocchio's ``q``, ``v`` and ``a``; at rest at both ends."""
        path = self.source.plan.path
        q, v, a = motion_of_path(
            self.source.plan.robot, *(path.evaluate(self.inside, k) for k in range(3))
        )
        v, a = v.copy(), a.copy()
        ended = self.times >= self.source.plan.duration
        v[ended | (np.abs(v).max(axis=1) <= REST)] = 0.0
        a[ended] = 0.0
        return Motion(q, v, a)

    @property
    def positions(self) -> FloatArray:
        """Of the joints of the file ``(N, n)`` [rad]."""
        return self.vectors.q[:, 7 + self.source.order.columns]

    @property
    def velocities(self) -> FloatArray:
        """Of the joints of the file ``(N, n)`` [rad/s]."""
        return self.vectors.v[:, 6 + self.source.order.columns]

    @cached_property
    def forces(self) -> Forces | None:
        """Contact forces and torques; ``None`` where the file is to have none."""
        return forces_at(self.source.plan, self.times) if self.source.with_forces else None

    @property
    def torques(self) -> FloatArray | None:
        """Feed-forward torques of the joints of the file ``(N, n)`` [N m], or ``None``."""
        return None if self.forces is None else self.forces.torques[:, self.source.order.columns]
