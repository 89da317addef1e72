"""Settings by the name of their planner, as a plan file stores them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from typing import Any, Final

from gaitopt.errors import InputError
from gaitopt.plan.settings.base import PlanSettings
from gaitopt.plan.settings.by_velocity import GaitSettings
from gaitopt.plan.settings.crawl import CrawlSettings
from gaitopt.plan.settings.over_obstacle import StrideSettings
from gaitopt.plan.settings.time_optimal import RouteSettings

SETTINGS: Final[Mapping[str, type[PlanSettings]]] = {
    kind.planner: kind for kind in (CrawlSettings, GaitSettings, RouteSettings, StrideSettings)
}
"""The settings of every planner, by its name in plan files."""


def settings_from_dict(planner: str, values: Mapping[str, Any]) -> PlanSettings:
    """The settings of a planner's plan, from what :meth:`PlanSettings.to_dict` gave.

    Raises:
        InputError: the planner is unknown, or a value is missing, unknown or out of range.
    """
    if planner not in SETTINGS:
        raise InputError(
            f"the planner {planner!r} is unknown here; known are {', '.join(sorted(SETTINGS))}"
        )
    kind = SETTINGS[planner]
    unknown = sorted(set(values) - {f.name for f in fields(kind)})
    if unknown:
        raise InputError(f"settings of {planner} have no field {unknown[0]!r}")
    # Plans from before there were timings promised forces only where they stored limits of them.
    old = "forces" if values.get("forces") else "velocity"
    return kind(**{"timing": old, **values})
