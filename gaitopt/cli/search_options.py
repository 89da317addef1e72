"""Options of the search for footholds on a map: the fields of ``TerrainSettings``."""

from __future__ import annotations

import re
from typing import Annotated, Any

import typer


def _way(text: str, metavar: str | None = "METRES", **limits: Any) -> Any:
    """An option of the search, with its help."""
    return typer.Option(
        help=text, metavar=metavar, rich_help_panel="How footholds are searched for",
        show_default=False, **limits,
    )  # fmt: skip


def search_options(
    step_length: Annotated[
        float | None, _way("How far each leg moves on in a cycle; 0.55 of the standing height.")
    ] = None,
    stance: Annotated[
        float | None,
        _way("How far front and hind feet usually are from one another, as a share of the distance "
             "of the standing robot; 1, and shorter ones where no way is found.", "SHARE"),
    ] = None,
    freedom: Annotated[
        float | None,
        _way("How far a foot may step from its usual place; 0.4 of the standing height."),
    ] = None,
    body_height: Annotated[
        float | None,
        _way("Height of the hips above the mean of the feet; 1.15 of the standing height."),
    ] = None,
    swing_height: Annotated[
        float | None,
        _way("Least height of a swing above its higher end; 0.12 of the standing height."),
    ] = None,
    clearance: Annotated[
        float | None,
        _way("Clearance of flying feet above the ground; 0.05 of the standing height."),
    ] = None,
    limb_clearance: Annotated[
        float | None,
        _way("Clearance of limbs and trunk from the ground; 0.03 of the standing height."),
    ] = None,
    stability_margin: Annotated[
        float | None,
        _way("How far inside the polygon of the standing feet the centre of mass stays; 0.07 of "
             "the standing height."),
    ] = None,
    reach_fraction: Annotated[
        float | None, _way("Share of the legs' reach that is used; 0.98.", "SHARE")
    ] = None,
    follow: Annotated[
        float | None,
        _way("Share of the ground's slope that the body takes, 0 for a level body; 1.", "SHARE"),
    ] = None,
    friction: Annotated[
        float | None, _way("Coefficient of friction of the ground; 0.6.", "NUMBER")
    ] = None,
    edge_margin: Annotated[
        float | None, _way("Least distance of a foothold from an edge; 0.02.")
    ] = None,
    width: Annotated[
        int | None, _way("States that are kept after each step; more take longer.", "NUMBER")
    ] = None,
    width_limit: Annotated[
        int | None, _way("Width up to which the search is repeated at a dead end.", "NUMBER")
    ] = None,
    time_budget: Annotated[
        float | None,
        _way("Time from the search's begin on in which it looks for a better walk; 0.", "SECONDS"),
    ] = None,
    time_limit: Annotated[
        float | None,
        _way("Processor time after which the search ends without a way; 32 s and 16 s a metre.",
             "SECONDS"),
    ] = None,
    detours: Annotated[
        bool | None,
        _way("Whether the course goes round what the robot cannot cross; not for a goal with YAW.",
             None),
    ] = None,
    exhaustive: Annotated[
        bool | None,
        _way("Whether steps are looked at as finely as there is a way to, with more ways of "
             "walking: a check of refusals, which takes 2.5 times as long.", None),
    ] = None,
) -> dict[str, Any]:  # fmt: skip
    """Fields of ``TerrainSettings`` by name; only those that were given."""
    return {name: value for name, value in locals().items() if value is not None}


def in_search_options(text: str) -> str:
    """A message of the search with the options of the command line in place of settings."""
    own = [name for name in search_options.__annotations__ if name != "return"]
    names = "|".join(name for name in own if "_" in name)
    text = re.sub(rf"\b({names})\b", lambda found: "--" + found[1].replace("_", "-"), text)
    # Names that are words, too, are settings where something is asked of them.
    words = "|".join(name for name in own if "_" not in name)
    text = re.sub(rf"\b(larger|smaller) ({words})\b", r"\1 --\2", text)
    text = re.sub(rf"^({words}) (?=must|is )", r"--\1 ", text)
    told = {"(waypoints)": "(--waypoint)", "(exhaustive)": "(--exhaustive)",
            "(filled)": "(--fill nearest)", "(resampled)": "(--grid)",
            "(resolution, heights, unit)": "(--resolution, --heights, --unit)"}  # fmt: skip
    for setting, option in told.items():
        text = text.replace(setting, option)
    return text
