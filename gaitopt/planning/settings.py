"""What a planner was asked for. A plan carries its settings, so that it can be checked."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any, ClassVar, Literal

import numpy as np

from gaitopt.errors import InputError
from gaitopt.gait.crawl import WANG_SEQUENCE, check_sequence

Speed = float | Literal["max"]


@dataclass(frozen=True)
class CrawlSettings:
    """Settings of :func:`gaitopt.plan_crawl`, which describes each."""

    planner: ClassVar[str] = "crawl"

    objective: str = "distance"
    speed: Speed = "max"
    stability_margin: float = 0.02
    body_height: float = 0.40
    swing_height: float = 0.07
    sequence: tuple[str, ...] = WANG_SEQUENCE
    swing: str = "box"
    reach_fraction: float = 1.0
    heading: float = 0.0
    follow_terrain: bool = False

    def __post_init__(self) -> None:
        _one_of("objective", self.objective, ("distance", "margin"))
        _one_of("swing", self.swing, ("box",))
        if self.speed != "max":
            object.__setattr__(self, "speed", _number("speed", self.speed, 1e-6, 1e3, "m/s"))
        _set(self, "stability_margin", 0.0, 10.0, "m")
        _set(self, "body_height", 1e-3, 100.0, "m")
        _set(self, "swing_height", 0.0, 100.0, "m")
        _set(self, "reach_fraction", 1e-3, 1.0, "")
        _set(self, "heading", -1e3, 1e3, "rad")
        object.__setattr__(self, "sequence", check_sequence(self.sequence))
        if not isinstance(self.follow_terrain, (bool, np.bool_)):
            raise InputError(f"follow_terrain must be True or False, got {self.follow_terrain!r}")
        object.__setattr__(self, "follow_terrain", bool(self.follow_terrain))

    def to_dict(self) -> dict[str, Any]:
        """The settings as plain JSON values."""
        return {**asdict(self), "sequence": list(self.sequence)}


def _one_of(name: str, value: object, known: tuple[str, ...]) -> None:
    if value not in known:
        raise InputError(f"{name} must be one of {', '.join(map(repr, known))}, got {value!r}")


def _number(name: str, value: object, low: float, high: float, unit: str) -> float:
    try:
        number = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        number = np.nan
    if isinstance(value, bool) or not low <= number <= high:
        raise InputError(
            f"{name} must be a number from {low:g} to {high:g} {unit}".rstrip()
            + f", got {value!r}"
            + (" (or 'max')" if name == "speed" else "")
        )
    return number


def _set(settings: CrawlSettings, name: str, low: float, high: float, unit: str) -> None:
    value = _number(name, getattr(settings, name), low, high, unit)
    object.__setattr__(settings, name, value)
