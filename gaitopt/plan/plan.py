"""The plan: the one result type of every planner, and the one input of every consumer."""

from __future__ import annotations

import json
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from gaitopt.conventions import LEGS, BoolArray, ByValue, FloatArray, frozen
from gaitopt.errors import InputError
from gaitopt.files import StrPath, written_whole
from gaitopt.inputs import check_array, check_count, check_kind, check_number, check_tuple
from gaitopt.motion.path import MotionPath
from gaitopt.plan.archive import FORMAT, version_of
from gaitopt.plan.foothold_archive import packed_footholds
from gaitopt.plan.phase import Phase, _phase_to_dict
from gaitopt.plan.record import PlanRecord
from gaitopt.plan.settings.base import PlanSettings
from gaitopt.plan.state import State
from gaitopt.plan.swings import Swing, find_swings
from gaitopt.plan.trajectory import Trajectory, sample_times
from gaitopt.robots.quadruped import Quadruped
from gaitopt.robots.rotations import rpy_to_matrix
from gaitopt.robots.whole_body import configuration, feet_in_body
from gaitopt.robots.whole_body_rates import base_twist
from gaitopt.terrain.footholds import Footholds

AT_REST = 1e-6
"""Largest rate of base and joints at which a plan begins at rest [m/s, rad/s]."""
ROUNDING = 1e-9
"""How far a time may lie outside of a plan by rounding [s]."""
SLOWEST = 1000.0
"""Largest factor of :meth:`Plan.slowed`: more is a mistake in the unit."""


@dataclass(frozen=True, eq=False)
class Plan(ByValue):
    """A planned motion with all that is needed to check it.

    Attributes:
        robot: the robot, with its URDF.
        footholds: the footholds that were asked for, or that the planner chose.
        settings: what the planner was asked for.
        phases: the phases, in order; their durations add up to :attr:`duration`.
        path: body and joints over time.
        record: what the planner tells of its work.
        entry: how many of the first phases lead from a given state, in which the robot may move and
            feet may fly, to rest on four feet; 0 for a plan that begins where it rests. In them
            contact forces are promised, and no static margin.
    """

    robot: Quadruped
    footholds: Footholds
    settings: PlanSettings
    phases: tuple[Phase, ...]
    path: MotionPath
    record: PlanRecord = field(default_factory=PlanRecord)
    entry: int = 0

    def __post_init__(self) -> None:
        for name, kind in (("robot", Quadruped), ("footholds", Footholds),
                           ("settings", PlanSettings), ("path", MotionPath),
                           ("record", PlanRecord)):  # fmt: skip
            check_kind(name, getattr(self, name), kind)
        object.__setattr__(self, "phases", check_tuple("phases", self.phases))
        for phase in self.phases:
            check_kind("each of phases", phase, Phase)
        check_count("entry", self.entry, 0, len(self.phases))
        columns = self.path.coefficients.shape[2]
        if columns != 6 + len(self.robot.joint_names):
            raise InputError(
                f"the path has {columns} columns where {self.robot.name} needs "
                f"{6 + len(self.robot.joint_names)}"
            )

    def __reduce__(self) -> tuple[object, ...]:
        return (Plan, (self.robot, self.footholds, self.settings, self.phases, self.path,
                       self.record, self.entry))  # fmt: skip

    def __repr__(self) -> str:
        return (
            f"Plan({self.robot.name!r}, {len(self.phases)} phases, {self.duration:.1f} s, "
            f"{1e3 * self.mean_speed:.2f} mm/s)"
        )

    @property
    def duration(self) -> float:
        """How long the motion takes [s]."""
        return self.path.duration

    @property
    def distance(self) -> float:
        """Horizontal distance from the middle of the first to that of the last footholds [m]."""
        ends = self.footholds.array[:, [0, -1], :2].mean(axis=0)
        return float(np.hypot(*(ends[1] - ends[0])))

    @property
    def mean_speed(self) -> float:
        """:attr:`distance` over :attr:`duration` [m/s]; 0 for a plan that does not move."""
        return self.distance / self.duration if self.duration > 0 else 0.0

    @property
    def margin(self) -> float:
        """Smallest margin of all phases [m]: static, of the body centre or the true COM; or ZMP's.

        Judged on the horizontal projection, whatever the heights of the feet.
        """
        return min((p.margin for p in self.phases), default=float("inf"))

    @property
    def cog_distance(self) -> float:
        """Length of the body centre's path [m]."""
        return float(sum(np.linalg.norm(p.cog_end - p.cog_start) for p in self.phases))

    @cached_property
    def swings(self) -> tuple[Swing, ...]:
        """Every foot's every flight, by time of lift-off."""
        return find_swings(self.phases, self.footholds, self._in_the_air)

    @cached_property
    def phase_starts(self) -> FloatArray:
        """Start of every phase [s]."""
        return frozen([p.start for p in self.phases])

    @property
    def begins_moving(self) -> bool:
        """Whether the robot moves, or a foot is in the air, when the plan begins."""
        if not self.entry:
            return False
        moves = np.abs(self.path.evaluate([0.0], 1)).max() > AT_REST
        return bool(moves or self.phases[0].flying)

    @property
    def _in_the_air(self) -> dict[str, FloatArray]:
        """Where the feet are that fly when the plan begins ``(3,)`` each [m]."""
        if not self.entry:
            return {}
        feet = self.at([0.0]).feet[0]
        return {leg: feet[LEGS.index(leg)] for leg in self.phases[0].flying}

    def phase_at(self, time: float) -> Phase:
        """The phase at ``time`` [s]; at a boundary the later one that lasts.

        Raises:
            InputError: the time lies outside the plan.
        """
        time = check_number("time", time, -ROUNDING, self.duration + ROUNDING, "s")
        return self.phases[int(self._phase_index(np.array([time]))[0])]

    def sample(self, dt: float) -> Trajectory:
        """The motion every ``dt`` seconds from 0, and at its very end.

        Raises:
            InputError: ``dt`` is not a positive time, or asks for too many samples.
        """
        return self.at(sample_times(self.duration, dt))

    def to_dataframe(self, dt: float = 0.01) -> Any:
        """The motion every ``dt`` seconds as a ``pandas.DataFrame``; see
        :meth:`Trajectory.to_dataframe`.

        Raises:
            InputError: as for :meth:`sample`.
            MissingPackageError: pandas is not installed.
        """
        return self.sample(dt).to_dataframe()

    def knots(self) -> Trajectory:
        """The motion at the path's own knots.

        Between them a path of degree one moves every joint in a straight line, so these are all
        that a robot needs to follow it exactly.
        """
        return self.at(self.path.times)

    def at(self, times: ArrayLike) -> Trajectory:
        """The motion at given ``times (N,)`` [s], which need not be equally spaced.

        Raises:
            InputError: a time lies outside the plan or is not finite.
        """
        t = np.atleast_1d(np.array(check_array("times", times)))
        if t.ndim != 1 or not (np.isfinite(t).all() and (t >= 0).all()
                               and (t <= self.duration).all()):  # fmt: skip
            raise InputError(f"times must be (N,) and within 0 and {self.duration:.6g} s")
        values, rates = self.path.evaluate(t), self.path.evaluate(t, derivative=1)
        position, rpy, joints = values[:, :3], values[:, 3:6], values[:, 6:]
        twist = base_twist(rpy, rates[:, :3], rates[:, 3:6])
        to_world = rpy_to_matrix(rpy) @ self.robot.body_axes
        feet = feet_in_body(self.robot, joints)
        return Trajectory(
            t=t,
            q=configuration(self.robot, position, rpy, joints),
            v=np.concatenate([twist, rates[:, 6:]], axis=1),
            contacts=self._contacts(t),
            cog=position + to_world @ self.robot.centre,
            feet=position[:, None, :] + np.einsum("nij,nlj->nli", to_world, feet),
            legs=LEGS,
            joint_names=self.robot.joint_names,
        )

    def slowed(self, factor: float) -> Plan:
        """The same path, everywhere ``factor`` times as slow; :func:`gaitopt.verify` certifies it.

        Inertial forces shrink with the square of the factor: contact forces are a mixture of the
        plan's and those of standing still, which a static walk has, too.

        Args:
            factor: how many times as long the motion takes, from 1 to :data:`SLOWEST`.

        Raises:
            InputError: ``factor`` is out of range, the plan begins in motion, or it promises no
                static margin: a trot falls when it is slow.
        """
        slower = check_number("factor", factor, 1.0, SLOWEST, hint="; retimed makes plans faster")
        if self.begins_moving:
            raise InputError("a plan that begins in motion keeps its velocity: it is never slower")
        if not self.settings.static:
            raise InputError(
                "a gait by velocity falls where it is slow; plan it anew with plan_gait, with a "
                "lower velocity"
            )
        phases = tuple(phase.slowed(slower) for phase in self.phases)
        return replace(self, phases=phases, path=self.path.slowed(slower))

    def state(self, time: float) -> State:
        """The robot's state at an instant: a plan may begin there.

        Args:
            time: within the plan [s].

        Raises:
            InputError: it is no such instant.
        """
        motion = self.at([check_number("time", time, 0.0, self.duration, "s")])
        support = tuple(leg for leg, on in zip(LEGS, motion.contacts[0], strict=True) if on)
        return State(motion.q[0], motion.v[0], support, self.robot.joint_names)

    def footholds_ahead(self, time: float) -> Footholds:
        """The footholds of the rest of the walk, for a plan that begins in :meth:`state`.

        The first of each leg is where its foot stands, or where it lands next.

        Args:
            time: within the plan [s].

        Raises:
            InputError: it is no such instant.
        """
        instant = check_number("time", time, 0.0, self.duration, "s")
        begun = [swing for swing in self.swings if swing.start <= instant]
        first = dict.fromkeys(LEGS, 0) | {swing.leg: swing.index + 1 for swing in begun}
        order = [swing.leg for swing in self.swings[len(begun) :]]
        return self.footholds.after(first, order)

    def save(self, path: StrPath) -> None:
        """Write the plan to an ``.npz`` file, whole or not at all.

        :func:`gaitopt.load_plan` gets it back without loss.
        """
        save_plan(self, path)

    def _phase_index(self, times: FloatArray) -> np.ndarray:
        return np.clip(np.searchsorted(self.phase_starts, times, side="right") - 1, 0, None)

    def _contacts(self, times: FloatArray) -> BoolArray:
        if not self.phases:
            return np.ones((len(times), len(LEGS)), dtype=np.bool_)
        table = np.array([[leg in p.support for leg in LEGS] for p in self.phases])
        # At the last instant the foot that flew in the last phase has touched down.
        table = np.vstack([table, np.ones(len(LEGS), dtype=np.bool_)])
        index = np.where(times < self.duration, self._phase_index(times), len(self.phases))
        return np.asarray(table[index])


def save_plan(plan: Plan, path: StrPath) -> None:
    """Write ``plan`` to ``path``, whole or not at all.

    The file holds the robot's URDF, so that whoever receives it needs nothing else.

    Raises:
        InputError: the file cannot be written.
    """
    further, arrays = packed_footholds(plan.footholds)
    header = {
        "format": FORMAT,
        "version": version_of(bool(further or arrays), plan.entry > 0),
        "robot": {
            "name": plan.robot.name,
            "sha256": plan.robot.sha256,
            "knees": dict(plan.robot.knees),
            "urdf": plan.robot.urdf,
        },
        "planner": plan.settings.planner,
        "settings": plan.settings.to_dict(),
        "column_radius": plan.footholds.radius,
        **({"footholds": further} if further or arrays else {}),
        "phases": [_phase_to_dict(phase) for phase in plan.phases],
        "info": plan.record.to_dict(),
        **({"entry": plan.entry} if plan.entry else {}),
    }
    text = json.dumps(header, allow_nan=False).encode()
    with written_whole(path, binary=True) as stream:
        parts: dict[str, Any] = {
            "header": np.frombuffer(text, dtype=np.uint8),
            "footholds": plan.footholds.array,
            "times": plan.path.times,
            "coefficients": plan.path.coefficients,
            **arrays,
        }
        np.savez_compressed(stream, **parts)
