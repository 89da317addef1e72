"""Small pictures for notebooks, as SVG: they need no plotting library and take a few kilobytes."""

from __future__ import annotations

import base64
from collections.abc import Iterable
from html import escape
from io import BytesIO
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from gaitopt.conventions import LEGS, FloatArray
from gaitopt.plan.plan import Plan
from gaitopt.robots.quadruped import Quadruped
from gaitopt.terrain.footholds import Footholds
from gaitopt.terrain.height_map import HeightMap
from gaitopt.viewing.colours import BACKGROUND, LEG_COLOURS

WIDTH: Final = 420.0
"""Width of a picture [px]: a notebook's cell has room for two."""
MOST_HEIGHT: Final = 260.0
"""Most height of a picture [px]."""
MOST_POINTS: Final = 400
"""Most points of a line: more cannot be seen."""
MOST_PIXELS: Final = 300
"""Most pixels of a map in either direction."""


class Drawing:
    """Lines and dots in metres, seen from one side, as an SVG picture."""

    def __init__(self, points: ArrayLike, label: str, border: float = 0.06) -> None:
        """Make room for some points.

        Args:
            points: that have to be inside ``(N, 2)`` [m].
            label: what is to be seen, for those who do not see it.
            border: room around them [m].
        """
        table = np.asarray(points, dtype=float).reshape(-1, 2)
        low, high = table.min(axis=0) - border, table.max(axis=0) + border
        size = high - low
        self.scale = float(min(WIDTH / size[0], MOST_HEIGHT / size[1]))
        self.low, self.high = low, high
        self.width, self.height = (size * self.scale).tolist()
        self.label = label
        self.parts: list[str] = []

    def place(self, points: ArrayLike) -> FloatArray:
        """Where points are in the picture ``(N, 2)`` [px]."""
        table = np.asarray(points, dtype=float).reshape(-1, 2)
        return np.stack([table[:, 0] - self.low[0], self.high[1] - table[:, 1]], 1) * self.scale

    def line(self, points: ArrayLike, colour: str, width: float = 1.5, dash: str = "") -> None:
        """Draw a line through points."""
        table = self.place(points)
        if len(table) > MOST_POINTS:
            table = table[np.linspace(0, len(table) - 1, MOST_POINTS).astype(int)]
        path = " ".join(f"{x:.1f},{y:.1f}" for x, y in table)
        dashed = f' stroke-dasharray="{dash}"' if dash else ""
        self.parts.append(
            f'<polyline points="{path}" fill="none" stroke="{colour}" stroke-width="{width}" '
            f'stroke-linejoin="round"{dashed}/>'
        )

    def dots(self, points: ArrayLike, colour: str, radius: float = 3.0) -> None:
        """Draw a dot at each point; the radius is in pixels."""
        self.parts += [
            f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{radius:.1f}" fill="{colour}"/>'
            for x, y in self.place(points)
        ]

    def image(self, url: str, low: ArrayLike, high: ArrayLike) -> None:
        """Draw an image between two corners."""
        (left, bottom), (right, top) = self.place(np.array([low, high], dtype=float))
        self.parts.append(
            f'<image href="{url}" x="{left:.1f}" y="{top:.1f}" width="{right - left:.1f}" '
            f'height="{bottom - top:.1f}" preserveAspectRatio="none"/>'
        )

    def svg(self) -> str:
        """The picture."""
        return (
            f'<svg xmlns="http://www.w3.org/2000/svg" role="img" aria-label="{escape(self.label)}" '
            f'width="{self.width:.0f}" height="{self.height:.0f}" '
            f'viewBox="0 0 {self.width:.1f} {self.height:.1f}" style="background:{BACKGROUND}">'
            + "".join(self.parts)
            + "</svg>"
        )


def footholds_picture(footholds: Footholds) -> str:
    """Footholds from above, in the colours of their legs."""
    drawing = Drawing(
        footholds.array[:, :, :2][np.isfinite(footholds.array[:, :, 0])],
        f"map of {footholds}, seen from above",
    )
    _draw_ground(drawing, footholds.ground)
    _draw_footholds(drawing, footholds)
    return drawing.svg()


def plan_picture(plan: Plan) -> str:
    """Footholds from above, and the paths of the body centre and of the feet."""
    motion = plan.knots()
    places = [motion.cog[:, :2], motion.feet[..., :2].reshape(-1, 2)]
    drawing = Drawing(np.concatenate(places), f"paths of {plan}, seen from above")
    _draw_ground(drawing, plan.footholds.ground)
    for leg, colour in LEG_COLOURS.items():
        drawing.line(motion.feet[:, LEGS.index(leg), :2], colour, 1.0, "3 2")
    _draw_footholds(drawing, plan.footholds)
    drawing.line(motion.cog[:, :2], "#222222", 2.0)
    return drawing.svg()


def robot_picture(robot: Quadruped) -> str:
    """The robot in its standing pose from the left: trunk, legs, and the ground."""
    from gaitopt.viewing.notebook.standing import standing_lines

    trunk, legs = standing_lines(robot)
    points = np.concatenate([trunk, *legs.values()])
    drawing = Drawing(points[:, [0, 2]], f"{robot}, standing, seen from its left side", 0.08)
    ground = float(min(line[-1, 2] for line in legs.values())) - robot.foot_radius
    left, right = drawing.low[0], drawing.high[0]
    drawing.line([[left, ground], [right, ground]], "#9aa5b1", 1.5)
    for leg in ("RH", "RF", "LH", "LF"):
        near = leg.startswith("L")
        drawing.line(legs[leg][:, [0, 2]], LEG_COLOURS[leg], 4.0 if near else 2.0)
        radius = max(robot.foot_radius * drawing.scale, 2.0)
        drawing.dots(legs[leg][-1:, [0, 2]], LEG_COLOURS[leg], radius)
    drawing.line(trunk[:, [0, 2]], "#222222", 5.0)
    return drawing.svg()


def ground_picture(ground: HeightMap) -> str:
    """A height map from above: light heights, dark depths, unknown ground hatched away."""
    (x0, x1), (y0, y1) = ground.extent
    drawing = Drawing([[x0, y0], [x1, y1]], f"{ground}, seen from above", 0.0)
    _draw_ground(drawing, ground)
    return drawing.svg()


def _draw_footholds(drawing: Drawing, footholds: Footholds) -> None:
    for leg, colour in LEG_COLOURS.items():
        drawing.dots(footholds[leg][:, :2], colour)


def _draw_ground(drawing: Drawing, ground: HeightMap | None) -> None:
    if ground is None:
        return
    (x0, x1), (y0, y1) = ground.extent
    drawing.image(_shaded(ground.z), (x0, y0), (x1, y1))


def _shaded(z: FloatArray) -> str:
    """A PNG image of heights as a data URL: light is high, white is unknown."""
    from PIL import Image

    steps = [max(1, -(-size // MOST_PIXELS)) for size in z.shape]
    coarse = z[:: steps[0], :: steps[1]]
    known = np.isfinite(coarse)
    low, high = (coarse[known].min(), coarse[known].max()) if known.any() else (0.0, 1.0)
    share = np.where(known, (coarse - low) / max(high - low, 1e-9), 1.0)
    grey = np.where(known, 90.0 + 140.0 * share, 255.0).astype(np.uint8)
    stream = BytesIO()
    Image.fromarray(grey.T[::-1]).save(stream, format="PNG", optimize=True)
    return "data:image/png;base64," + base64.b64encode(stream.getvalue()).decode()


def table(rows: Iterable[tuple[str, ...]], header: tuple[str, ...] = ()) -> str:
    """Rows of texts as an HTML table; all texts are escaped."""

    def line(cells: tuple[str, ...], kind: str) -> str:
        inside = "".join(
            f'<{kind} style="text-align:left;padding:1px 10px 1px 0">{escape(c)}</{kind}>'
            for c in cells
        )
        return f"<tr>{inside}</tr>"

    head = line(header, "th") if header else ""
    return f"<table>{head}{''.join(line(row, 'td') for row in rows)}</table>"
