"""Phases of a plan, and what holds them back."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields, replace
from types import MappingProxyType
from typing import Any, Literal

import numpy as np

from gaitopt.conventions import LEGS, ByValue, FloatArray, frozen, is_frozen
from gaitopt.errors import InputError
from gaitopt.inputs import (
    as_text,
    check_choice,
    check_count,
    check_kind,
    check_known,
    check_number,
    check_tuple,
    is_real,
)

LONGEST = 1e9
"""Largest time [s] and margin [m] of a phase: more is a mistake."""
MOST_STEPS = 10**9
"""Largest number of a step that a phase may have: more is a mistake."""
PLACES = ("cog_start", "cog_end", "foot_start", "foot_end")
"""Fields of a phase that are places."""


def are_floats(numbers: Iterable[object]) -> bool:
    """Whether all of some values are Python's own numbers with a point."""
    return all([type(number) is float for number in numbers])


def _is_place(value: object) -> bool:
    """Whether a value is three numbers that nobody can change, none of which is NaN."""
    if type(value) is not np.ndarray or value.dtype != np.float64 or value.shape != (3,):
        return False
    x, y, z = value.tolist()
    return x == x and y == y and z == z and is_frozen(value)


@dataclass(frozen=True)
class Limit:
    """Something that holds a phase back.

    Attributes:
        kind: ``"margin"`` (a side of the shrunken support triangle), ``"forces"`` (a side of the
            region in which contact forces hold the robot), ``"reach"`` (a leg's reach),
            ``"joint velocity"`` or ``"speed"`` (the speed that was asked for).
        name: the side (``"LF-RH"`` or ``"side 1"``), the leg, or the joint.
        value: multiplier of a constraint, or the share of the phase's duration that a joint or
            speed is at its limit.
        spans: for ``"joint velocity"`` and ``"speed"`` the times of the plan during which the
            limit holds, ``((start, end), ...)`` [s].
    """

    kind: str
    name: str
    value: float
    spans: tuple[tuple[float, float], ...] = ()

    def __post_init__(self) -> None:
        if self._is_plain:
            return
        check_kind("kind of a limit", self.kind, str)
        check_kind("name of a limit", self.name, str)
        spans = tuple(
            check_tuple("span of a limit", span)
            for span in check_tuple("spans of a limit", self.spans)
        )
        if not all(len(span) == 2 for span in spans):
            raise InputError(
                f"spans of a limit must be pairs (start, end) in seconds, got {as_text(self.spans)}"
            )
        numbers = [self.value, *(time for span in spans for time in span)]
        if not all(is_real(number) for number in numbers):
            raise InputError(f"a limit's value and times must be numbers, got {as_text(numbers)}")
        object.__setattr__(self, "spans", spans)

    @property
    def _is_plain(self) -> bool:
        """Whether all is of the types that planners give: a walk has hundreds of limits."""
        numbers = [self.value]
        if type(self.spans) is not tuple:
            return False
        for span in self.spans:
            if type(span) is not tuple or len(span) != 2:
                return False
            numbers += span
        return type(self.kind) is type(self.name) is str and are_floats(numbers)


@dataclass(frozen=True)
class CogEvidence:
    """How one knows that a phase's COG target is the right one.

    Attributes:
        status: ``"solved"`` when all residuals are within tolerance.
        objective: ``"distance"`` or ``"margin"``.
        multipliers: multiplier of each constraint by name.
        primal: largest violation of a constraint [m].
        stationarity: largest entry of the Lagrangian's gradient.
        complementarity: sum of multipliers times slacks.
        error_bound: bound on the distance from the true optimum (``"distance"``), or on the
            margin's distance from the largest (``"margin"``) [m].
        iterations: QPs solved.
    """

    status: str
    objective: str
    multipliers: Mapping[str, float]
    primal: float
    stationarity: float
    complementarity: float
    error_bound: float
    iterations: int

    def __post_init__(self) -> None:
        check_kind("multipliers", self.multipliers, Mapping)
        numbers = (*self.multipliers.values(), self.primal, self.stationarity,
                   self.complementarity, self.error_bound)  # fmt: skip
        if not (are_floats(numbers) or all(map(is_real, numbers))) or not is_real(self.iterations):
            numbers = (*numbers, self.iterations)
            raise InputError(f"evidence of a phase must be numbers, got {as_text(numbers)}")
        for name in ("status", "objective"):
            check_kind(name, getattr(self, name), str)
        object.__setattr__(self, "multipliers", MappingProxyType(dict(self.multipliers)))

    def __reduce__(self) -> tuple[object, ...]:
        values = {**vars(self), "multipliers": dict(self.multipliers)}
        return (type(self), tuple(values.values()))


@dataclass(frozen=True, eq=False)
class Phase(ByValue):
    """A stretch of the plan with one set of supporting feet.

    Attributes:
        kind: ``"stance"`` (four feet stand) or ``"swing"`` (at least one foot flies).
        leg: the leg that swings now, or next; the first of them by time of lift-off where several
            do, and ``""`` for a stance after which none does.
        step: index of that swing, from 0 over the whole walk (:attr:`Plan.swings`).
        start, duration: [s]; a stance phase in which nothing needs to move lasts 0 s.
        cog_start, cog_end: body centre at its ends ``(3,)`` [m].
        support: the legs that stand.
        foot_start, foot_end: where the leg's foot is before and after ``(3,)`` [m].
        margin: smallest stability margin during the phase [m]: static, of the body centre or, where
            the settings say so, of the true COM; of the ZMP where the plan is not static. Minus
            infinity where no foot stands; files say ``null``.
        limited_by: what holds the phase back.
        evidence: of the COG target, for stance phases that were optimised.
    """

    kind: Literal["stance", "swing"]
    leg: str
    step: int
    start: float
    duration: float
    cog_start: FloatArray
    cog_end: FloatArray
    support: tuple[str, ...]
    foot_start: FloatArray
    foot_end: FloatArray
    margin: float
    limited_by: tuple[Limit, ...] = ()
    evidence: CogEvidence | None = None

    def __post_init__(self) -> None:
        for name in PLACES:
            if _is_place(given := getattr(self, name)):
                continue
            object.__setattr__(self, name, frozen(check_known(name, given)))
            if getattr(self, name).shape != (3,):
                raise InputError(f"a phase's {name} must have the shape (3,)")
        check_choice("kind of a phase", self.kind, ("stance", "swing"))
        check_choice("leg of a phase", self.leg, LEGS if self.kind == "swing" else (*LEGS, ""))
        legs = check_tuple("support of a phase", self.support)
        if legs is not LEGS:
            for leg in legs:
                check_choice("support of a phase", leg, LEGS)
        if len(set(legs)) < len(legs):
            raise InputError(f"support of a phase names a leg twice: {', '.join(legs)}")
        check_number("start of a phase", self.start, -LONGEST, LONGEST, "s")
        check_number("duration of a phase", self.duration, 0.0, LONGEST, "s")
        check_number("margin of a phase", self.margin, -np.inf, LONGEST, "m")
        check_count("step of a phase", self.step, -1, MOST_STEPS)
        limits = check_tuple("limited_by", self.limited_by)
        if not all(isinstance(x, Limit) for x in limits):
            raise InputError(f"limited_by must be limits, got {as_text(self.limited_by)}")
        # A list that somebody gave could be changed later.
        object.__setattr__(self, "support", legs)
        object.__setattr__(self, "limited_by", limits)
        if self.evidence is not None:
            check_kind("evidence", self.evidence, CogEvidence)

    def __repr__(self) -> str:
        whose = f" {self.leg}" if self.leg else ""
        return (
            f"Phase({self.kind}{whose}, step {self.step}, {self.start:.3f} to {self.end:.3f} s, on "
            f"{' '.join(self.support) or 'no foot'}, margin {1e3 * self.margin:.1f} mm)"
        )

    @property
    def end(self) -> float:
        """``start + duration`` [s]."""
        return self.start + self.duration

    def slowed(self, factor: float) -> Phase:
        """The phase of a plan that takes ``factor`` times as long.

        What set its old pace, a joint's velocity or a speed, no longer holds it back.
        """
        check_number("factor", factor, 1e-6, 1e6)
        kept = self.limited_by
        if factor > 1.0:
            kept = tuple(x for x in kept if x.kind not in ("joint velocity", "speed"))
        return replace(
            self, start=self.start * factor, duration=self.duration * factor, limited_by=kept
        )

    @property
    def flying(self) -> tuple[str, ...]:
        """The legs that do not stand."""
        return tuple(leg for leg in LEGS if leg not in self.support)


def _phase_to_dict(phase: Phase) -> dict[str, Any]:
    out: dict[str, Any] = {f.name: getattr(phase, f.name) for f in fields(phase)}
    for key in PLACES:
        out[key] = out[key].tolist()
    out["margin"] = None if phase.margin == float("-inf") else phase.margin
    out["limited_by"] = [[x.kind, x.name, x.value, x.spans] for x in phase.limited_by]
    if phase.evidence is not None:
        out["evidence"] = {**vars(phase.evidence), "multipliers": dict(phase.evidence.multipliers)}
    return out


def _phase_from_dict(stored: dict[str, Any]) -> Phase:
    limits = tuple(
        Limit(kind, name, value, tuple((a, b) for a, b in spans))
        for kind, name, value, spans in stored["limited_by"]
    )
    evidence = stored["evidence"]
    return Phase(**{
        **stored,
        "support": tuple(stored["support"]),
        "margin": float("-inf") if stored["margin"] is None else stored["margin"],
        "limited_by": limits,
        "evidence": None if evidence is None else CogEvidence(**evidence),
    })  # fmt: skip
