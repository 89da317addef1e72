"""A scene as one HTML file that plays in any browser, without a server or a network."""

from __future__ import annotations

import base64
import html
import json
from dataclasses import asdict, dataclass, field
from functools import lru_cache
from importlib import resources
from typing import Any

from gaitopt.viewing.replay.scene import Scene

SPEEDS = (0.1, 0.2, 0.5, 1, 2, 5, 10, 20)
"""Speeds that the page offers, times real time."""

COMFORTABLE = 35.0
"""How long a replay should last [s]: the default speed comes nearest."""

POLICY = (
    "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; "
    "img-src data: blob:; base-uri 'none'; form-action 'none'"
)
"""What the page may load: nothing but itself. Browsers enforce it."""


@dataclass(frozen=True)
class Moment:
    """What is written from ``start`` [s] on, beside a ``mark`` of its own colour.

    The bar has ``colour`` from there on; so has the mark where it is ``None``. ``""`` is no colour.
    """

    start: float
    label: str
    colour: str = ""
    mark: str | None = None


@dataclass(frozen=True)
class Label:
    """A name that floats above a frame of the scene.

    Attributes:
        frame: which frame, ``"/robot/base"``.
        lift: how far above it the name floats [m].
        name: plain text.
        colour: of the mark beside the name.
        landings: when each step ends, ascending [s]; below the name stands how many are done.
        result: what stands there instead from ``since`` [s] on.
        since: see ``result``.
    """

    frame: str
    lift: float
    name: str
    colour: str
    landings: tuple[float, ...]
    result: str
    since: float


@dataclass(frozen=True)
class Page:
    """A scene with all that stands around it.

    Attributes:
        scene: what is shown.
        title: heading, plain text.
        facts: lines below the heading, plain text.
        legend: names and colours.
        moments: the phases, in order of their starts.
        centre, radius: ball that the camera frames [m].
        heading: direction of walking about z [rad]; the camera looks from the front left.
        follow: frame that the camera may follow, ``"/robot/base"``; ``""`` for none.
        close: radius of the ball that the camera frames when it follows [m].
        speeds: what the page offers, times real time.
        labels: names that float above frames.
        look_from: where the camera stands, as so much ahead, to the left and above.
        held: points that the first view holds instead of the ball, as close as may be [m].
    """

    scene: Scene
    title: str
    facts: tuple[str, ...] = ()
    legend: tuple[tuple[str, str], ...] = ()
    moments: tuple[Moment, ...] = ()
    centre: tuple[float, float, float] = (0.0, 0.0, 0.0)
    radius: float = 1.0
    heading: float = 0.0
    follow: str = ""
    close: float = 0.5
    speeds: tuple[float, ...] = field(default=SPEEDS)
    labels: tuple[Label, ...] = ()
    look_from: tuple[float, float, float] = (0.75, 0.8, 0.62)
    held: tuple[tuple[float, float, float], ...] = ()


def comfortable_speed(duration: float, speeds: tuple[float, ...] = SPEEDS) -> float:
    """The speed at which ``duration`` [s] is nearest, as a ratio, to :data:`COMFORTABLE`."""
    return min(speeds, key=lambda s: max(duration / s, 1e-9) / COMFORTABLE
               + COMFORTABLE / max(duration / s, 1e-9))  # fmt: skip


def render(page: Page) -> str:
    """The page as HTML. Text is escaped; data cannot end the script that holds it."""
    from gaitopt.viewing.replay.encoding import commands

    packed = [base64.b64encode(c).decode("ascii") for c in commands(page.scene)]
    facts = "".join(f"<div>{html.escape(line)}</div>" for line in page.facts)
    legend = "".join(
        f'<span><i style="background:{html.escape(colour)}"></i>{html.escape(name)}</span>'
        for name, colour in page.legend
    )
    options = "".join(f'<option value="{s:g}">{s:g}×</option>' for s in page.speeds)
    return _filled(
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
        SCRIPT=_text("page.js"),
    )


def _data(page: Page) -> dict[str, Any]:
    return {
        "duration": page.scene.duration,
        "speed": comfortable_speed(page.scene.duration, page.speeds),
        "moments": [
            [m.start, m.label, m.colour, m.colour if m.mark is None else m.mark]
            for m in page.moments
        ],
        "centre": list(page.centre),
        "radius": page.radius,
        "heading": page.heading,
        "follow": page.follow,
        "close": page.close,
        "labels": [asdict(label) for label in page.labels],
        "lookFrom": list(page.look_from),
        "held": [list(point) for point in page.held],
    }


def _safe_json(value: Any) -> str:
    text = json.dumps(value, separators=(",", ":"), allow_nan=False)
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def _filled(template: str, **values: str) -> str:
    """The template with each ``@NAME@`` replaced once; what is put in is not looked at again."""
    out, rest = [], template
    for name, value in values.items():
        before, _, rest = rest.partition(f"@{name}@")
        out += [before, value]
    return "".join([*out, rest])


def _text(name: str) -> str:
    return (resources.files("gaitopt.viewing.replay") / name).read_text("utf-8")


@lru_cache(maxsize=1)
def _viewer() -> str:
    """meshcat's bundled viewer."""
    script = resources.files("meshcat") / "viewer" / "dist" / "main.min.js"
    return script.read_text("utf-8").replace("</script", "<\\/script")


@lru_cache(maxsize=1)
def _licences() -> str:
    """The licences of the viewer and what is bundled in it: copies of it must carry them."""
    viewer = resources.files("meshcat") / "viewer"
    found = [viewer / "LICENSE", viewer / "dist" / "main.min.js.THIRD_PARTY_LICENSES.json"]
    texts = [file.read_text("utf-8") for file in found if file.is_file()]
    return "\n".join(texts).replace("<", "(").replace(">", ")")
