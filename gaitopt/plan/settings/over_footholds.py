"""What the settings of all walks over given footholds share."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal, TypeVar

from gaitopt.arguments import checked
from gaitopt.gait.crawl import FREE_ORDER, WANG_SEQUENCE, check_order, swing_order
from gaitopt.inputs import check_choice, check_kind
from gaitopt.plan.settings.base import (
    FORCES,
    PlanSettings,
    check_names,
    check_place,
    set_flag,
)
from gaitopt.robots.quadruped import Quadruped
from gaitopt.terrain.footholds import Footholds

FORCE_MARGIN_SHARE = 0.07
"""Stability margin of walks that are timed by forces, as a share of the standing height. With a
larger margin the body may accelerate more, and has farther to go: 16 steps of anymal_c take 6.44 s
with 0.05, 6.23 s with 0.07 and 6.41 s with 0.11; those of go2 3.66, 3.63 and 4.07 s (seed 0)."""

Kind = TypeVar("Kind", bound="FootholdSettings")


def force_margin(robot: Quadruped) -> float:
    """Stability margin with the timing ``"forces"`` where none is given [m]."""
    check_kind("robot", robot, Quadruped)
    return round(FORCE_MARGIN_SHARE * robot.standing_height, 4)


@dataclass(frozen=True)
class FootholdSettings(PlanSettings):
    """Settings of a walk over given footholds.

    Attributes:
        sequence: order of the legs in a cycle, or of all steps of the walk, in which legs may step
            unequally often; ``"free"`` searches for the fastest order that is possible, which need
            not be periodic, and the plan's settings name it. Footholds may have an order of their
            own, which holds where no sequence is asked for. Legs may have other names, and stand in
            one text: ``"RH, RF, LH, LF"``, ``("RR", "FR", "RL", "FL")``.
        follow_terrain: keep the body ``body_height`` above the mean of the four feet, instead of
            at a constant height.
        com: what keeps the stability margin: ``"body"``, the body's centre, as in [Wang2020];
            ``"model"``, the true centre of mass of the whole robot with its legs. By default it is
            ``"model"`` with the timing ``"forces"``, and else ``"body"``.
        cog_start: where the body centre is at the start ``(2,)`` [m]; by default above the middle
            of the first footholds, or as near to it as the legs reach.
    """

    timing: str = FORCES
    sequence: tuple[str, ...] | Literal["free"] = WANG_SEQUENCE
    follow_terrain: bool = False
    cog_start: tuple[float, float] | None = None
    com: str | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.com is None:
            object.__setattr__(self, "com", "body" if self.forces is None else "model")
        check_choice("com", self.com, ("body", "model"))
        text = self.sequence.strip().lower() if isinstance(self.sequence, str) else ""
        order = FREE_ORDER if text == FREE_ORDER else check_order(self.sequence)
        object.__setattr__(self, "sequence", order)
        set_flag(self, "follow_terrain")
        object.__setattr__(self, "cog_start", check_place("cog_start", self.cog_start))

    @classmethod
    def for_robot(cls: type[Kind], robot: Quadruped, **options: Any) -> Kind:
        """Settings that fit a robot, save for those that are given.

        The timing is by forces unless ``timing="velocity"`` is given, and then asks for a larger
        stability margin.

        Args:
            robot: from :func:`gaitopt.load_robot`.
            options: fields by name; ``None`` leaves one to be fitted.

        Raises:
            InputError: a field is unknown, or a value is out of range.
        """
        check_names(cls, options)
        kept = {k: v for k, v in options.items() if not (k == "timing" and v is None)}
        by_forces = kept.get("timing", FORCES) == FORCES
        if by_forces and kept.get("stability_margin") is None:
            kept["stability_margin"] = force_margin(robot)
        return super().for_robot(robot, **kept)

    @property
    def true_com(self) -> bool:
        """Whether the margin is promised of the true centre of mass, and not of the body's."""
        return self.com == "model"

    @checked
    def order_over(self, footholds: Footholds) -> tuple[str, ...]:
        """The order of the legs.

        Where it is still to be searched for, that of the footholds; or else that of [Wang2020].
        """
        if self.sequence == FREE_ORDER:
            return footholds.order or WANG_SEQUENCE
        return tuple(self.sequence)

    @checked
    def with_order_of(self: Kind, footholds: Footholds, asked: bool) -> Kind:
        """The settings with the order of the footholds, where no other is asked for.

        Args:
            footholds: of the walk.
            asked: whether the sequence was asked for by name; else one that is not the usual one
                counts as asked for.
        """
        if not footholds.order or asked or self.sequence != WANG_SEQUENCE:
            return self
        return replace(self, sequence=footholds.order)

    @checked
    def swing_legs(self, footholds: int | Mapping[str, int]) -> list[str] | None:
        """The legs in the order in which they lift off; ``None`` where any order will do."""
        if self.sequence == FREE_ORDER:
            return None
        return [leg for leg, _ in swing_order(self.sequence, footholds)]
