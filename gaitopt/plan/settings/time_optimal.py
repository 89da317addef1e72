"""What :func:`gaitopt.planners.time_optimal.planner.plan_route` was asked for."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import ClassVar, Final

from gaitopt.errors import InputError
from gaitopt.gait.crawl import WANG_SEQUENCE, check_order, swing_order
from gaitopt.inputs import check_count
from gaitopt.plan.settings.base import PlanSettings, one_of, set_flag, set_number

FREEDOMS: Final[tuple[str, ...]] = ("overlap", "swing", "height", "posture", "dynamic")
"""What can be freed beyond the body's targets, by name."""

ROWS: Final[dict[str, tuple[str, ...]]] = {
    "route": (),
    "overlap": FREEDOMS[:1],
    "swing": FREEDOMS[:2],
    "height": FREEDOMS[:3],
    "posture": FREEDOMS[:4],
    "dynamic": FREEDOMS,
}
"""The rows of the table of gains, and what each frees."""


@dataclass(frozen=True)
class RouteSettings(PlanSettings):
    """Settings of a time-optimal route; :func:`plan_route` describes each."""

    planner: ClassVar[str] = "route"

    free: tuple[str, ...] = ROWS["swing"]
    sequence: tuple[str, ...] = WANG_SEQUENCE
    clearance: float = 0.02
    follow_terrain: bool = False
    stance_knots: int = 2
    swing_knots: int = 8
    margin_reserve: float = 2e-5
    clearance_reserve: float = 5e-4
    com: str = "body"

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "free", check_free(self.free))
        object.__setattr__(self, "sequence", check_order(self.sequence))
        set_flag(self, "follow_terrain")
        one_of("com", self.com, ("body", "model"))
        set_number(self, "clearance", 0.0, 100.0, "m")
        set_number(self, "margin_reserve", 0.0, 1.0, "m")
        set_number(self, "clearance_reserve", 0.0, 1.0, "m")
        for name, least in (("stance_knots", 1), ("swing_knots", 4)):
            object.__setattr__(self, name, check_count(name, getattr(self, name), least, 64))
        if self.acceleration_limit is None and not self.static:
            raise InputError("free: a dynamic walk needs an acceleration_limit")
        if self.true_com and self.smooth:
            raise InputError(
                "com='model' keeps static stability at the joints' velocity limits only: leave "
                "'dynamic' and acceleration_limit out, or take com='body'"
            )

    @property
    def static(self) -> bool:
        """Whether static stability is promised; the dynamic row keeps its ZMP inside instead."""
        return "dynamic" not in self.free

    @property
    def true_com(self) -> bool:
        """Whether the margin is promised of the true centre of mass, and not of the body's."""
        return self.com == "model"

    @property
    def zmp_margin(self) -> float | None:
        """The stability margin, in the dynamic row."""
        return None if self.static else self.stability_margin

    @property
    def smooth(self) -> bool:
        """Whether joint accelerations are bounded."""
        return self.acceleration_limit is not None

    def swing_legs(self, footholds: int) -> list[str]:
        """The sequence, over and over."""
        return [leg for leg, _ in swing_order(self.sequence, footholds)]

    @property
    def row(self) -> str:
        """The name of the row of the table of gains, or the freed things joined by ``+``."""
        names = {free: name for name, free in ROWS.items()}
        return names.get(self.free, "+".join(self.free))


def check_free(free: str | Iterable[str]) -> tuple[str, ...]:
    """The freed things in their order.

    Args:
        free: the name of a row (``"route"``, ``"overlap"``, ``"swing"``, ``"height"``,
            ``"posture"``, ``"dynamic"``), or any of the freed things by name.

    Raises:
        InputError: a name is unknown.
    """
    if isinstance(free, str):
        if free not in ROWS:
            raise InputError(f"free must be one of {', '.join(ROWS)}, got {free!r}")
        return ROWS[free]
    named = {str(name) for name in free} if isinstance(free, Iterable) else {repr(free)}
    unknown = sorted(named - set(FREEDOMS) - {"route"})
    if unknown:
        raise InputError(
            f"free names {unknown[0]!r}; what can be freed is {', '.join(FREEDOMS)} (the route "
            "itself always is)"
        )
    if "dynamic" in named and not {"overlap", "swing"} <= named:
        raise InputError("free: a dynamic walk needs 'overlap' and 'swing' to be free, too")
    return tuple(name for name in FREEDOMS if name in named)
