"""Every error that gaitopt raises on purpose, and its warnings.

All derive from :class:`GaitoptError`, and most also from the built-in error that fits. A message
names the leg, step, field or line, gives the numbers, and ends with what to do.
"""

from __future__ import annotations

import sys
import warnings
from dataclasses import dataclass, field, fields
from types import FrameType
from typing import Any


class GaitoptError(Exception):
    """Base class: catch this to catch everything that gaitopt raises on purpose."""


class InputError(GaitoptError, ValueError):
    """A setting or an array is not valid: wrong name, shape or range, or not finite."""


class RobotError(GaitoptError, ValueError):
    """A URDF cannot be read, or is not a robot that gaitopt can plan for."""


class RobotWarning(UserWarning):
    """A robot was loaded, and something in its file is missing, guessed or hardly true."""


class StudyError(GaitoptError, RuntimeError):
    """Worker processes or the cluster of a study were lost; rows that are done are kept."""


class StudyWarning(UserWarning):
    """A study goes on, but lines of its table are damaged, or it waits for workers."""


def warn(message: str, category: type[Warning]) -> None:
    """Warn, and name the line outside of gaitopt that made the call."""
    level = 2
    frame: FrameType | None = sys._getframe(1)
    while frame is not None and frame.f_globals.get("__name__", "").split(".")[0] == "gaitopt":
        level, frame = level + 1, frame.f_back
    warnings.warn(message, category, stacklevel=level)


class FootholdsError(GaitoptError, ValueError):
    """Footholds, or the CSV file that holds them, are not valid."""


class FootholdsWarning(UserWarning):
    """A walk was planned on which legs touch, shanks go into columns, or balls roll off them."""


class GroundError(GaitoptError, ValueError):
    """A height map, or the file that holds it, is not valid."""


class PlanFileError(GaitoptError, ValueError):
    """A plan file cannot be read: it is incomplete, too large, of another version or no plan."""


class SolverError(GaitoptError, RuntimeError):
    """The residuals of a solver's result are too large, so the result is not used.

    Attributes:
        step: the step of a walk that was not solved, counted from 0; ``None`` where it is not
            known, or where there is none.
    """

    def __init__(self, *message: object, step: int | None = None) -> None:
        super().__init__(*message)
        self.step = step


class MissingPackageError(GaitoptError, ImportError):
    """An optional package is needed; the message holds the line that installs it."""


class UnknownNameError(GaitoptError, KeyError):
    """A collection of results was asked for a name that it does not hold."""

    def __str__(self) -> str:
        # KeyError itself would print the message in quotation marks.
        return str(self.args[0])


class _MessageAndFields(Exception):
    """Makes an exception of a dataclass whose first field is the message.

    It prints as its message, and pickling keeps all fields.
    """

    message: str

    def __post_init__(self) -> None:
        super().__init__(self.message)

    def __str__(self) -> str:
        return self.message

    def __reduce__(self) -> tuple[object, ...]:
        own = fields(self)  # type: ignore[arg-type]
        return (type(self), tuple(getattr(self, field.name) for field in own))


@dataclass
class InfeasibleStepError(_MessageAndFields, GaitoptError):
    """No body position allows this step.

    Attributes:
        message: what is wrong, with the numbers and what to do.
        step: index of the step, counted from 0 over the whole walk; -1 for the initial stance.
        leg: the leg that was to swing.
        conflicts: names of the constraints that exclude one another.
        margin: the stability margin that was asked for [m].
        largest_margin: the largest margin that this step allows with the reach fraction that was
            asked for [m]; ``None`` where no margin is possible, because the legs do not reach.
        reach_fraction: the reach fraction that was asked for.
        needed_reach_fraction: the smallest reach fraction that allows the step with the margin that
            was asked for; above 1 the robot's legs are too short for it. ``None`` where no reach
            helps.
    """

    message: str
    step: int
    leg: str
    conflicts: tuple[str, ...] = field(default=())
    margin: float | None = None
    largest_margin: float | None = None
    reach_fraction: float | None = None
    needed_reach_fraction: float | None = None

    __hash__ = GaitoptError.__hash__


@dataclass
class SingularLegError(_MessageAndFields, InputError):
    """A leg is straight or folded, or its foot is on the roll axis.

    Attributes:
        message: what is wrong, with the numbers and what to do.
        leg: its name.
    """

    message: str
    leg: str

    __hash__ = GaitoptError.__hash__


@dataclass
class InfeasibleStateError(_MessageAndFields, GaitoptError):
    """No plan begins in this state.

    Attributes:
        message: what is wrong, with the numbers and what to do.
        limit: which limit is in the way, for instance ``"joint velocity LF_KFE"``, ``"contact RH"``
            or ``"friction LF and torque LF_KFE"``, which contradict each other.
        value: what the state has, or what is needed at least.
        allowed: what the limit allows.
        unit: of both.
        time: when the limit is exceeded, from the state on [s].
    """

    message: str
    limit: str
    value: float
    allowed: float
    unit: str
    time: float = 0.0

    __hash__ = GaitoptError.__hash__


@dataclass(eq=False)
class TerrainError(_MessageAndFields, GaitoptError):
    """No way over the ground was found.

    Attributes:
        message: how far the search got, what was in the way, and what to do.
        step: the step that no state could make, counted from 0 over the whole walk.
        leg: the leg that was to step.
        refused: how many tries of this step were refused for what.
        search: the :class:`gaitopt.TerrainSearch`, which knows how far it got.
    """

    message: str
    step: int
    leg: str
    refused: Any = field(repr=False)
    search: Any = field(repr=False)


@dataclass
class InfeasibleSpeedError(_MessageAndFields, GaitoptError):
    """A joint, a leg's reach, or contact forces do not allow the commanded velocity.

    Attributes:
        message: what is wrong, with the numbers and what to do.
        limit: what is exceeded most, for instance ``"velocity LF_KFE"``, ``"reach RH"`` or
            ``"friction LF"``; ``"balance"`` where the body has no path with contact forces.
        needed: what the command needs as a multiple of the limit, above 1; ``inf`` out of reach.
        time: when it is exceeded most [s].
        fastest: the share of the commanded velocity that works with this gait; ``None`` where not
            even stepping on the spot works.
        velocity: the velocity that works, ``(forward, sideways)`` [m/s], with :attr:`yaw_rate`.
        yaw_rate: [rad/s].
        cycle_time: a cycle time that is long enough for the commanded velocity, or else for
            stepping on the spot [s]; ``None`` where none was found.
    """

    message: str
    limit: str
    needed: float
    time: float
    fastest: float | None = None
    velocity: tuple[float, float] | None = None
    yaw_rate: float | None = None
    cycle_time: float | None = None

    __hash__ = GaitoptError.__hash__


@dataclass(eq=False)
class RouteError(_MessageAndFields, SolverError):
    """The time-optimal route did not converge.

    Attributes:
        message: what is wrong, with the numbers and what to do.
        steps: the steps at which the residuals are largest, counted from 0 over the whole walk.
        plan: the :class:`gaitopt.Plan` of the same walk planned phase by phase, which is feasible;
            ``None`` where that failed, too.
        report: the solver's iterations, one line each.
    """

    message: str
    steps: tuple[int, ...]
    plan: Any = field(repr=False)
    report: str = field(repr=False)


@dataclass(eq=False)
class UnsolvedSplineError(_MessageAndFields, SolverError):
    """No joint spline was verified to be the fastest one.

    Attributes:
        message: what is wrong, with the numbers and what to do.
        spline: a feasible :class:`gaitopt.JointSpline` through the same knots, all of whose
            intervals are stretched by one factor until every limit holds.
    """

    message: str
    spline: Any = field(repr=False)


@dataclass(eq=False)
class CertificateError(_MessageAndFields, GaitoptError):
    """A plan violates what was to be certified; the message lists the violations.

    Attributes:
        message: the violations, with their numbers.
        certificate: the :class:`gaitopt.Certificate` with all checks.
    """

    message: str
    certificate: Any = field(repr=False)


@dataclass(eq=False)
class StrideFault(_MessageAndFields, GaitoptError):
    """One attempt at a walk over an obstacle failed.

    It never leaves :func:`gaitopt.plan_stride`, which changes what it asks for and tries again, or
    raises one of the errors above.

    Attributes:
        message: what is wrong, with the numbers.
        leg: the leg to blame.
        step: index of its step, counted from 0 over the whole walk; -1 where no step is to blame.
        cause: ``"posture"``, ``"obstacle"``, ``"body"``, ``"swing"``, ``"short"`` or
            ``"forces"``.
        posture: the unsolved ``PostureSolution``, where a posture was not found.
    """

    message: str
    leg: str = ""
    step: int = -1
    cause: str = "posture"
    posture: Any = field(default=None, repr=False)
