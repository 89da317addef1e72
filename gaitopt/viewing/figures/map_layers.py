"""Heights of a map in colours, unknown ground hatched, and where no foot may stand."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from gaitopt.terrain.height_map import HeightMap
from gaitopt.terrain.layers import FOOTINGS, GroundLayers
from gaitopt.viewing.colours import FOOTING_COLOURS
from gaitopt.viewing.figures.common import INK, MUTED, SMALL

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Limits = tuple[tuple[float, float], tuple[float, float]]
"""Lowest and highest x, lowest and highest y of a drawing [m]."""

HEIGHTS = ("#93a5b2", "#c9d1d4", "#f3ecdb")
"""Colours from low to high: pale, so that the legs' colours are seen on them. Their brightness only
grows."""
MOST_PIXELS = 1500
"""Most points of a map along each side that are drawn: as many as a figure has pixels."""


def draw_heights(ax: Axes, ground: HeightMap, limits: Limits) -> list[Any]:
    """Draw heights with a colour bar, and unknown ground hatched; entries of a legend."""
    from matplotlib.colors import LinearSegmentedColormap
    from matplotlib.patches import Rectangle

    z, extent = _seen(ground, ground.z, limits)
    palette = LinearSegmentedColormap.from_list("heights", HEIGHTS)
    image = ax.imshow(z.T, origin="lower", extent=extent, cmap=palette, interpolation="nearest",
                      zorder=1, gid="heights")  # fmt: skip
    bar = ax.figure.colorbar(image, ax=ax, pad=0.015, fraction=0.03, aspect=20, shrink=0.9)
    bar.set_label("height [m]", fontsize=SMALL, color=INK)
    bar.ax.tick_params(labelsize=SMALL, colors=INK, width=0.6, length=3)
    bar.outline.set_visible(False)
    if np.isfinite(z).all():
        return []
    x0, x1, y0, y1 = extent
    hatched = Rectangle((x0, y0), x1 - x0, y1 - y0, facecolor="white", edgecolor=MUTED,
                        hatch="////", linewidth=0.0, zorder=0.5)  # fmt: skip
    hatched.set_gid("unknown")
    ax.add_patch(hatched)
    return [patch_key("unknown", "white", hatch="////")]


def draw_refused(ax: Axes, layers: GroundLayers, limits: Limits) -> list[Any]:
    """Colour where no foot may stand, by the reason; entries of a legend with shares of the map."""
    from matplotlib.colors import to_rgba

    palette = np.array([to_rgba(FOOTING_COLOURS[footing.value], 0.75) for footing in FOOTINGS])
    palette[0, 3] = 0.0
    codes, extent = _seen(layers.ground, layers.codes, limits)
    ax.imshow(palette[np.swapaxes(codes, 0, 1)], origin="lower", extent=extent,
              interpolation="nearest", zorder=2, gid="refused")  # fmt: skip
    share = {footing.value: count / layers.codes.size for footing, count in layers.counts.items()}
    return [
        patch_key(f"{name} ({share[name]:.1%})", FOOTING_COLOURS[name])
        for name in list(share)[1:] if share[name] > 0.0
    ]  # fmt: skip


def patch_key(label: str, colour: str, hatch: str | None = None) -> Any:
    """A coloured area as an entry of a legend."""
    from matplotlib.patches import Patch

    edge = MUTED if hatch else "none"
    return Patch(facecolor=colour, edgecolor=edge, hatch=hatch, linewidth=0.0, label=label)


def _seen(
    ground: HeightMap, values: np.ndarray, limits: Limits
) -> tuple[np.ndarray, tuple[float, float, float, float]]:
    """The values of the points within ``limits``, and the sides of the area of their cells [m]."""
    slices, sides = [], []
    for axis, (low, high) in enumerate(limits):
        first = (low - ground.origin[axis]) / ground.resolution
        last = (high - ground.origin[axis]) / ground.resolution
        start = max(int(np.floor(first + 1e-9)), 0)
        stop = min(int(np.ceil(last - 1e-9)), ground.shape[axis] - 1)
        every = max(1, -(-(stop - start + 1) // MOST_PIXELS))
        count = (stop - start) // every
        slices.append(slice(start, stop + 1, every))
        cell = ground.resolution * every
        middle = ground.origin[axis] + ground.resolution * start
        sides += [middle - cell / 2.0, middle + cell * (count + 0.5)]
    x0, x1, y0, y1 = sides
    return values[tuple(slices)], (x0, x1, y0, y1)
