"""Sliders in a notebook that plan a walk again and show it at once."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from html import escape
from typing import TYPE_CHECKING, Any, Final

from gaitopt.certificate.verify import verify
from gaitopt.dynamics.contacts import ForceLimits
from gaitopt.errors import GaitoptError, InputError, MissingPackageError
from gaitopt.inputs import check_kind
from gaitopt.plan.plan import Plan
from gaitopt.planners.crawl import plan_crawl
from gaitopt.robots.quadruped import Quadruped
from gaitopt.terrain.footholds import Footholds
from gaitopt.viewing.notebook.cards import plan_card

if TYPE_CHECKING:
    from ipywidgets import VBox

ROWS: Final[Mapping[str, Mapping[str, Any]]] = {
    "phase by phase": {},
    "largest margin": {"objective": "margin"},
    "time-optimal: route": {"objective": "time", "free": "route"},
    "time-optimal: swing": {"objective": "time", "free": "swing"},
    "time-optimal: height": {"objective": "time", "free": "height"},
    "time-optimal: posture": {"objective": "time", "free": "posture"},
}
"""Ways of planning that can be chosen, and their options of :func:`gaitopt.plan_crawl`."""
FASTEST: Final = "the fastest"


def explore(robot: Quadruped, footholds: Footholds, **options: Any) -> VBox:
    """Sliders for a walk: each change plans again, and shows paths, numbers and the verdict.

    It needs a notebook, and ipywidgets (``pip install 'gaitopt[notebook]'``). The sliders are the
    stability margin, the heights of body and swings, and the friction; a menu has ways of planning,
    and another one speeds.

    Args:
        robot: from :func:`gaitopt.load_robot`.
        footholds: where the feet go.
        options: more options of :func:`gaitopt.plan_crawl`, the same for all walks; those with a
            slider are where it stands first.

    Returns:
        The widget. Its attribute ``plan`` is the plan that it shows, or ``None`` where there is
        none.

    Raises:
        MissingPackageError: ipywidgets is not installed.
        InputError: robot or footholds are something else, or an option has another type.
        InfeasibleStepError: no walk is possible with the options that are given.
    """
    check_kind("robot", robot, Quadruped)
    check_kind("footholds", footholds, Footholds)
    try:
        import ipywidgets
    except ImportError as error:
        raise MissingPackageError(
            "explore needs ipywidgets: pip install 'gaitopt[notebook]'"
        ) from error
    first = plan_crawl(robot, footholds, **options)
    sliders = _sliders(ipywidgets, first)
    shown = ipywidgets.HTML()
    box = ipywidgets.VBox([*sliders.values(), shown])

    def update(change: object = None) -> None:
        shown.value = "<i>planning ...</i>"
        chosen = {name: slider.value for name, slider in sliders.items()}
        box.plan, shown.value = _walk(lambda: _planned(robot, footholds, options, chosen))

    box.plan, shown.value = _walk(lambda: first)
    for slider in sliders.values():
        slider.observe(update, names="value")
    return box


def _sliders(ipywidgets: Any, plan: Plan) -> dict[str, Any]:
    """Widgets by name, which stand where a plan is."""
    settings = plan.settings.to_dict()
    standing, limits = plan.robot.standing_height, plan.settings.promised_forces

    def slider(text: str, value: float, low: float, high: float, step: float) -> Any:
        return ipywidgets.FloatSlider(
            value=value, min=min(low, value), max=max(high, value), step=step, description=text,
            continuous_update=False, readout_format=".3f", style={"description_width": "11em"},
            layout={"width": "30em"},
        )  # fmt: skip

    def menu(text: str, names: list[str]) -> Any:
        return ipywidgets.Dropdown(options=names, description=text,
                                   style={"description_width": "11em"})  # fmt: skip

    margin, height = float(settings["stability_margin"]), float(settings["body_height"])
    swing = float(settings["swing_height"])
    friction = 0.6 if limits is None else limits.friction
    return {
        "stability_margin": slider("stability margin [m]", margin, 0.0, 0.2 * standing, 0.001),
        "body_height": slider("body height [m]", height, 0.7 * standing, 1.25 * standing, 0.005),
        "swing_height": slider("swing height [m]", swing, 0.02 * standing, 0.5 * standing, 0.005),
        "friction": slider("friction", friction, 0.1, 1.2, 0.05),
        "row": menu("planned", list(ROWS)),
        "speed": menu("speed", [FASTEST, "0.02 m/s", "0.05 m/s", "0.1 m/s", "0.2 m/s"]),
    }


def _planned(
    robot: Quadruped, footholds: Footholds, options: Mapping[str, Any], chosen: Mapping[str, Any]
) -> Plan:
    """The walk that the sliders ask for."""
    names = ("stability_margin", "body_height", "swing_height")
    asked = {**options, **{name: chosen[name] for name in names}, **ROWS[chosen["row"]]}
    if chosen["speed"] != FASTEST:
        if asked.get("objective") == "time":
            raise InputError("a time-optimal walk is as fast as possible: choose another planning")
        asked["speed"] = float(chosen["speed"].split()[0])
    if asked.get("timing", "forces") == "forces":
        limits = options.get("forces") or ForceLimits()
        asked["forces"] = replace(limits, friction=chosen["friction"])
    return plan_crawl(robot, footholds, **asked)


def _walk(make: Callable[[], Plan]) -> tuple[Plan | None, str]:
    """A plan and what is shown of it; or no plan, and why there is none."""
    try:
        plan = make()
    except GaitoptError as error:
        return None, f'<b style="color:#b3261e">no walk:</b> {escape(str(error))}'
    verdict = verify(plan, collisions=False)
    missing = ", ".join(check.name for check in verdict.violations)
    told = f"{verdict.outcome} (self-collisions were not looked at)"
    if str(verdict.outcome) == "not all checked" and not missing:
        told = "all checks hold (self-collisions were not looked at)"
    return plan, f"{plan_card(plan)}<b>{escape(missing or told)}</b>"
