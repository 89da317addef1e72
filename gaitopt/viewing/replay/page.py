"""A scene as one HTML page that plays in any browser, without a server or a network."""

from __future__ import annotations

import base64
import html
import json
from dataclasses import asdict, dataclass, field
from functools import lru_cache
from importlib import resources
from typing import Any, Literal

from gaitopt.viewing.colours import LEG_COLOURS
from gaitopt.viewing.meshcat_parts import meshcat_folder
from gaitopt.viewing.replay.curves.curves import Curves, curve_data
from gaitopt.viewing.replay.ground.encoding import GroundData, ground_data
from gaitopt.viewing.replay.passing import passing_data, passing_paths
from gaitopt.viewing.replay.scene import Scene

SPEEDS = (0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20)
"""Speeds to choose from, as multiples of real time."""

COMFORTABLE = 35.0
"""Duration of a replay at its default speed, about [s]. Chosen here: long enough to see each step
of a cycle, and short enough to watch to the end."""

POLICY = (
    "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; "
    "img-src data: blob:; base-uri 'none'; form-action 'none'"
)
"""Content security policy, which browsers enforce: the page may load nothing but itself."""


SCRIPTS = (
    "numbers.js",
    "motion.js",
    "solids.js",
    "ground.js",
    "passing.js",
    "camera.js",
    "labels.js",
    "curves.js",
    "switches.js",
    "keys.js",
    "page.js",
)
"""The page's own scripts; the last one uses the others."""


@dataclass(frozen=True)
class Caption:
    """A text below the scene, from some time until that of the next caption.

    Attributes:
        start: its time [s].
        label: the text.
        colour: of the time bar during this time; ``""`` for none.
        mark: colour of a dot beside the text; ``""`` for no dot, ``None`` for ``colour``.
    """

    start: float
    label: str
    colour: str = ""
    mark: str | None = None


@dataclass(frozen=True)
class Label:
    """A name above a frame of the scene.

    That of a ``"runner"`` has the number of steps that are done below it, a ``"foot"`` has a short
    name, and an ``"event"`` is there from its time on.

    Attributes:
        frame: the frame, for instance ``"/robot/base"``.
        lift: height of the name above it [m].
        name: plain text.
        colour: of a dot beside the name.
        landings: touchdown of each step, ascending [s].
        result: text that replaces the number of steps from ``since`` on, in one line or more.
        since: time [s].
        kind: what the name is of.
    """

    frame: str
    lift: float
    name: str
    colour: str
    landings: tuple[float, ...] = ()
    result: str = ""
    since: float = 0.0
    kind: Literal["runner", "foot", "event"] = "runner"


@dataclass(frozen=True)
class Switch:
    """A button that shows and hides a frame with all below it.

    Attributes:
        name: on the button.
        title: what it does, shown when the mouse rests on it.
        key: small letter that does the same.
        frame: names from the root of the scene, joined by slashes.
        shown: whether the frame is shown at first.
        legend: names with their colours, which are shown with the frame.
    """

    name: str
    title: str
    key: str
    frame: str
    shown: bool = True
    legend: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True)
class Page:
    """A scene with its title, legend, captions and camera.

    Attributes:
        scene: the scene.
        title: heading, plain text.
        facts: lines below the heading, plain text.
        legend: names with their colours.
        captions: texts by time, in the order of their starts.
        centre, radius: ball that is visible in the first view [m].
        heading: direction of the walk about z [rad].
        follow: frame that the camera can follow, for instance ``"/robot/base"``; ``""`` for none.
        follow_radius: radius of the ball around it that is visible then [m].
        follow_drop: how far below it the camera looks then [m]; without it, at the height of
            ``centre``.
        speeds: to choose from, as multiples of real time.
        labels: names above frames.
        view_from: direction from the scene to the camera: along the heading, to the left, up.
        in_view: points that are visible in the first view, instead of the ball [m].
        switches: buttons that show and hide frames.
        curves: below the time bar; ``None`` for none.
    """

    scene: Scene
    title: str
    facts: tuple[str, ...] = ()
    legend: tuple[tuple[str, str], ...] = ()
    captions: tuple[Caption, ...] = ()
    centre: tuple[float, float, float] = (0.0, 0.0, 0.0)
    radius: float = 1.0
    heading: float = 0.0
    follow: str = ""
    follow_radius: float = 0.5
    follow_drop: float | None = None
    speeds: tuple[float, ...] = field(default=SPEEDS)
    labels: tuple[Label, ...] = ()
    view_from: tuple[float, float, float] = (0.75, 0.8, 0.62)
    in_view: tuple[tuple[float, float, float], ...] = ()
    switches: tuple[Switch, ...] = ()
    curves: Curves | None = None


def comfortable_speed(duration: float, speeds: tuple[float, ...] = SPEEDS) -> float:
    """The speed with which ``duration`` [s] takes about :data:`COMFORTABLE` seconds to watch.

    Longer and shorter times are compared by their ratios.
    """
    return min(speeds, key=lambda s: max(duration / s, 1e-9) / COMFORTABLE
               + COMFORTABLE / max(duration / s, 1e-9))  # fmt: skip


def render(page: Page) -> str:
    """The page as HTML. Text and data are escaped, so that they cannot become part of a script."""
    from gaitopt.viewing.replay.encoding import commands

    packed = [base64.b64encode(c).decode("ascii") for c in commands(page.scene)]
    facts = "".join(f"<div>{html.escape(line)}</div>" for line in page.facts)
    legend = "".join(
        f'<span><i style="background:{html.escape(colour)}"></i>{html.escape(name)}</span>'
        for name, colour in page.legend
    )
    options = "".join(f'<option value="{s:g}">{s:g}×</option>' for s in page.speeds)
    return _with_values(
        _text("page.html"),
        POLICY=html.escape(POLICY),
        TITLE=html.escape(page.title),
        FACTS=facts,
        LEGEND=legend,
        SPEEDS=options,
        STYLE=_text("page.css"),
        LICENCES=_licences(),
        VIEWER=_viewer(),
        DATA=_safe_json(_data(page)),
        COMMANDS=_safe_json(packed),
        SCRIPT="".join(map(_text, SCRIPTS)),
    )


def _data(page: Page) -> dict[str, Any]:
    """What the page's script reads, beside the commands."""
    from gaitopt.viewing.replay.encoding import track_data

    maps = GroundData()
    passing = passing_data(page.scene, maps)
    return {
        "duration": page.scene.duration,
        "speed": comfortable_speed(page.scene.duration, page.speeds),
        "captions": [
            [m.start, m.label, m.colour, m.colour if m.mark is None else m.mark]
            for m in page.captions
        ],
        "centre": list(page.centre),
        "radius": page.radius,
        "heading": page.heading,
        "follow": page.follow,
        "followRadius": page.follow_radius,
        "followDrop": page.follow_drop,
        "labels": [asdict(label) for label in page.labels],
        "viewFrom": list(page.view_from),
        "inView": [list(point) for point in page.in_view],
        "switches": [asdict(switch) for switch in page.switches],
        "tracks": [track_data(t) for t in page.scene.tracks if t.kind != "visible"],
        "passing": passing,
        "curves": curve_data(page.curves),
        "legColours": LEG_COLOURS,
        "ground": ground_data(page.scene, maps, passing_paths(page.scene)),
    }


def _safe_json(value: Any) -> str:
    """A value as JSON without letters that mean something in HTML."""
    text = json.dumps(value, separators=(",", ":"), allow_nan=False)
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def _with_values(template: str, **values: str) -> str:
    """A template in which each ``@NAME@`` is replaced once; values are not searched for names."""
    out, rest = [], template
    for name, value in values.items():
        before, _, rest = rest.partition(f"@{name}@")
        out += [before, value]
    return "".join([*out, rest])


def _text(name: str) -> str:
    """The content of a file of the page."""
    return (resources.files("gaitopt.viewing.replay") / "scripts" / name).read_text("utf-8")


@lru_cache(maxsize=1)
def _viewer() -> str:
    """The script of meshcat's viewer."""
    script = meshcat_folder() / "viewer" / "dist" / "main.min.js"
    return script.read_text("utf-8").replace("</script", "<\\/script")


@lru_cache(maxsize=1)
def _licences() -> str:
    """The licences of the viewer and its libraries, which each copy of them must contain."""
    viewer = meshcat_folder() / "viewer"
    found = [viewer / "LICENSE", viewer / "dist" / "main.min.js.THIRD_PARTY_LICENSES.json"]
    texts = [file.read_text("utf-8") for file in found if file.is_file()]
    return "\n".join(texts).replace("<", "(").replace(">", ")")
