"""Sliders in a notebook that plan a walk again and show it at once."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict, fields, replace
from html import escape
from typing import TYPE_CHECKING, Any, Final

from numpy.typing import ArrayLike

from gaitopt.certificate.verify import verify
from gaitopt.conventions import Progress
from gaitopt.dynamics.contacts import ForceLimits
from gaitopt.errors import GaitoptError, InputError, MissingPackageError, TerrainError
from gaitopt.inputs import check_kind
from gaitopt.plan.plan import Plan
from gaitopt.plan.settings.base import check_place
from gaitopt.planners.crawl import plan_crawl
from gaitopt.planners.over_terrain.planner import plan_terrain
from gaitopt.planners.over_terrain.settings import TerrainSettings
from gaitopt.planners.over_terrain.setup import far_side
from gaitopt.robots.quadruped import Quadruped
from gaitopt.terrain.footholds import Footholds
from gaitopt.terrain.height_map import HeightMap
from gaitopt.viewing.notebook.cards import plan_card
from gaitopt.viewing.notebook.pictures import footholds_picture
from gaitopt.viewing.notebook.progress import bar

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
Planner = Callable[[Mapping[str, Any], Progress], Plan]
"""Plans with options by name, and tells how far it is."""


def explore(
    robot: Quadruped,
    terrain: Footholds | HeightMap,
    goal: ArrayLike | None = None,
    **options: Any,
) -> VBox:
    """Sliders for a walk: each change plans again, and shows paths, numbers and the verdict.

    It needs a notebook, and ipywidgets (``pip install 'gaitopt[notebook]'``). The sliders are the
    stability margin, the heights of body and swings, and the friction; a menu has ways of planning,
    and another one speeds. Over a height map footholds are searched for again, too; there are
    sliders for the length of the steps and the place of the goal, and where there is no way the
    picture shows how far it got.

    Args:
        robot: from :func:`gaitopt.load_robot`.
        terrain: where the feet go: footholds, or a height map.
        goal: on a height map, where the walk goes to ``(x, y)`` [m]; by default the middle of its
            far side in x. Not for footholds.
        options: more options of :func:`gaitopt.plan_crawl`, or of :func:`gaitopt.plan_terrain` on a
            height map, the same for all walks; those with a slider are where it stands first.

    Returns:
        The widget. Its attribute ``plan`` is the plan that it shows, or ``None`` where there is
        none.

    Raises:
        MissingPackageError: ipywidgets is not installed.
        InputError: robot, terrain or goal are something else, or an option has another type.
        InfeasibleStepError: no walk over the footholds is possible with the options that are given.
    """
    check_kind("robot", robot, Quadruped)
    if not isinstance(terrain, HeightMap):
        check_kind("terrain", terrain, Footholds)
    if isinstance(terrain, Footholds) and goal is not None:
        raise InputError("goal= is for a height map; a walk over footholds ends at the last ones")
    try:
        import ipywidgets
    except ImportError as error:
        raise MissingPackageError(
            "explore needs ipywidgets: pip install 'gaitopt[notebook]'"
        ) from error
    if isinstance(terrain, HeightMap):
        place = _goal(robot, terrain, goal)
        first = _first(lambda: plan_terrain(robot, terrain, place, **options))
        sliders = _ground_sliders(ipywidgets, robot, terrain, place, options)
        planner = _over_ground(robot, terrain, options)
    else:
        first = plan_crawl(robot, terrain, **options)
        sliders = _sliders(ipywidgets, robot, first.settings.to_dict(),
                           first.settings.promised_forces)  # fmt: skip
        planner = _over_footholds(robot, terrain, options)
    told, shown = ipywidgets.HTML(), ipywidgets.HTML()
    box = ipywidgets.VBox([*sliders.values(), told, shown])

    def update(change: object = None) -> None:
        told.value = "<i>planning ...</i>"
        chosen = {name: slider.value for name, slider in sliders.items()}

        def tell(done: int, total: int) -> None:
            told.value = bar("planning", done, total)

        try:
            box.plan, shown.value = _shown(planner(chosen, tell))
        except GaitoptError as error:
            box.plan, shown.value = _shown(error)
        finally:
            told.value = ""

    box.plan, shown.value = _shown(first)
    for slider in sliders.values():
        slider.observe(update, names="value")
    return box


def _goal(robot: Quadruped, ground: HeightMap, goal: ArrayLike | None) -> tuple[float, float]:
    """The place of the goal [m].

    Raises:
        InputError: it is no place.
    """
    return check_place("goal", goal) or far_side(robot, ground)


def _slider(ipywidgets: Any, text: str, value: float, low: float, high: float, step: float) -> Any:
    return ipywidgets.FloatSlider(
        value=value, min=min(low, value), max=max(high, value), step=step, description=text,
        continuous_update=False, readout_format=".3f", style={"description_width": "11em"},
        layout={"width": "30em"},
    )  # fmt: skip


def _menu(ipywidgets: Any, text: str, names: list[str]) -> Any:
    return ipywidgets.Dropdown(options=names, description=text,
                               style={"description_width": "11em"})  # fmt: skip


def _first(make: Callable[[], Plan]) -> Plan | TerrainError:
    """The first walk over a height map, or why there is none: sliders may find one."""
    try:
        return make()
    except TerrainError as error:
        return error


def _sliders(
    ipywidgets: Any, robot: Quadruped, settings: Mapping[str, Any], limits: ForceLimits | None
) -> dict[str, Any]:
    """Widgets by name, which stand where settings are."""
    standing = robot.standing_height
    margin, height = float(settings["stability_margin"]), float(settings["body_height"])
    swing = float(settings["swing_height"])
    friction = 0.6 if limits is None else limits.friction
    return {
        "stability_margin": _slider(ipywidgets, "stability margin [m]", margin, 0.0,
                                    0.2 * standing, 0.001),
        "body_height": _slider(ipywidgets, "body height [m]", height, 0.7 * standing,
                               1.25 * standing, 0.005),
        "swing_height": _slider(ipywidgets, "swing height [m]", swing, 0.02 * standing,
                                0.5 * standing, 0.005),
        "friction": _slider(ipywidgets, "friction", friction, 0.1, 1.2, 0.05),
        "row": _menu(ipywidgets, "planned", list(ROWS)),
        "speed": _menu(ipywidgets, "speed", [FASTEST, "0.02 m/s", "0.05 m/s", "0.1 m/s",
                                             "0.2 m/s"]),
    }  # fmt: skip


def _ground_sliders(
    ipywidgets: Any, robot: Quadruped, ground: HeightMap, goal: tuple[float, float],
    options: Mapping[str, Any],
) -> dict[str, Any]:  # fmt: skip
    """Widgets of walks over a height map."""
    own = {field.name for field in fields(TerrainSettings)}
    settings = TerrainSettings.for_robot(robot, **{k: v for k, v in options.items() if k in own})
    limits = options.get("forces") or ForceLimits(friction=settings.friction)
    standing = robot.standing_height
    (x0, x1), (y0, y1) = ground.extent
    return {
        **_sliders(ipywidgets, robot, asdict(settings), limits),
        "step_length": _slider(ipywidgets, "step length [m]", settings.step_length,
                               0.15 * standing, standing, 0.005),
        "goal_x": _slider(ipywidgets, "goal x [m]", goal[0], x0, x1, 0.05),
        "goal_y": _slider(ipywidgets, "goal y [m]", goal[1], y0, y1, 0.05),
    }  # fmt: skip


def _asked(options: Mapping[str, Any], chosen: Mapping[str, Any]) -> dict[str, Any]:
    """Options of the walk that the sliders ask for."""
    names = ("stability_margin", "body_height", "swing_height")
    asked = {**options, **{name: chosen[name] for name in names}, **ROWS[chosen["row"]]}
    if chosen["speed"] != FASTEST:
        if asked.get("objective") == "time":
            raise InputError("a time-optimal walk is as fast as possible: choose another planning")
        asked["speed"] = float(chosen["speed"].split()[0])
    return asked


def _over_footholds(robot: Quadruped, footholds: Footholds, options: Mapping[str, Any]) -> Planner:
    """Plans walks over footholds."""

    def plan(chosen: Mapping[str, Any], progress: Progress) -> Plan:
        asked = _asked(options, chosen)
        if asked.get("timing", "forces") == "forces":
            limits = options.get("forces") or ForceLimits()
            asked["forces"] = replace(limits, friction=chosen["friction"])
        return plan_crawl(robot, footholds, progress=progress, **asked)

    return plan


def _over_ground(robot: Quadruped, ground: HeightMap, options: Mapping[str, Any]) -> Planner:
    """Plans walks over a height map."""

    def plan(chosen: Mapping[str, Any], progress: Progress) -> Plan:
        asked = _asked(options, chosen)
        asked |= {"step_length": chosen["step_length"], "friction": chosen["friction"]}
        limits = options.get("forces")
        if limits is not None or "objective" in asked:
            asked["forces"] = replace(limits or ForceLimits(), friction=chosen["friction"])
        goal = chosen["goal_x"], chosen["goal_y"]
        return plan_terrain(robot, ground, goal, progress=progress, **asked)

    return plan


def _shown(plan: Plan | GaitoptError) -> tuple[Plan | None, str]:
    """A plan and what is shown of it; or no plan, and why there is none."""
    if isinstance(plan, GaitoptError):
        error = plan
        got = footholds_picture(error.search.footholds) if isinstance(error, TerrainError) else ""
        return None, f'{got}<div><b style="color:#b3261e">no walk:</b> {escape(str(error))}</div>'
    verdict = verify(plan, collisions=False)
    missing = ", ".join(check.name for check in verdict.violations)
    told = f"{verdict.outcome} (self-collisions were not looked at)"
    if str(verdict.outcome) == "not all checked" and not missing:
        told = "all checks hold (self-collisions were not looked at)"
    return plan, f"{plan_card(plan)}<b>{escape(missing or told)}</b>"
