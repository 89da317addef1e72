"""Where figures are drawn: into axes that the caller gives, or into a new figure."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from gaitopt.errors import InputError
from gaitopt.viewing.figures.common import BESIDE, SMALL, add_legend

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Panels: TypeAlias = NDArray[np.object_]
"""The axes of a figure with several panels: an array of ``matplotlib.axes.Axes``."""

_FOR_FILES: ContextVar[bool] = ContextVar("for files", default=False)


@contextmanager
def figures_for_files() -> Iterator[None]:
    """New figures are for files only: pyplot does not know them, and no notebook shows them."""
    token = _FOR_FILES.set(True)
    try:
        yield
    finally:
        _FOR_FILES.reset(token)


def new_figure(
    width: float, height: float, layout: Literal["compressed"] | None = "compressed"
) -> Figure:
    """An empty figure of ``width`` times ``height`` [inch].

    It is one of pyplot's in a notebook, which then shows it, and where the program has imported
    pyplot, so that ``pyplot.show`` finds it. Else no window can open, and nothing has to be closed.
    """
    from matplotlib.figure import Figure

    # "compressed" is the "constrained" layout for axes in true proportions.
    pyplot = None if _FOR_FILES.get() else _pyplot()
    made = Figure if pyplot is None else pyplot.figure
    figure: Figure = made(figsize=(width, height), layout=layout)
    return figure


def _pyplot() -> Any:
    """Pyplot, if someone uses it: a notebook, or the program that imported it."""
    ipython = sys.modules.get("IPython")
    if ipython is not None and hasattr(ipython.get_ipython(), "kernel"):
        from matplotlib import pyplot

        return pyplot
    return sys.modules.get("matplotlib.pyplot")


def panel(ax: Axes | None, width: float, height: float) -> Axes:
    """``ax``; without ``ax`` the one panel of a new figure of this size [inch].

    Raises:
        InputError: ``ax`` are no axes, or belong to no figure.
    """
    if ax is None:
        return new_figure(width, height).add_subplot()
    return _checked(ax)


def panels(
    axes: Sequence[Axes] | Panels | None, shape: tuple[int, ...], width: float, height: float,
    **options: Any,
) -> Panels:  # fmt: skip
    """``axes`` as an array of a ``shape``; without ``axes`` the panels of a new figure.

    Args:
        axes: of the caller; ``None`` for a new figure.
        shape: of the array: rows, or rows and columns.
        width, height: of a new figure [inch].
        options: of its ``subplots``.

    Raises:
        InputError: there are more axes or fewer, or they belong to no figure.
    """
    if axes is None:
        rows, columns = (*shape, 1)[:2]
        made = new_figure(width, height).subplots(rows, columns, squeeze=False, **options)
        return np.asarray(made).reshape(shape)
    try:
        given = np.asarray(axes, dtype=object)
    except Exception as error:  # Objects that say how they become arrays may raise anything.
        raise InputError(f"axes must be an array of axes, got a {type(axes).__name__}") from error
    if given.shape != shape:
        count = " x ".join(map(str, shape))
        raise InputError(
            f"axes must be an array of {count} axes, got shape {given.shape}; "
            f"make them with figure.subplots({', '.join(map(str, shape))})"
        )
    for ax in given.flat:
        _checked(ax)
    return given


def _checked(ax: Any) -> Axes:
    """Axes of a figure.

    Raises:
        InputError: they are something else.
    """
    if not hasattr(ax, "plot") or getattr(ax, "figure", None) is None:
        raise InputError(
            f"ax must be axes of a figure, got {type(ax).__name__}; make them with "
            "figure.add_subplot()"
        )
    axes: Axes = ax
    return axes


def figure_of(drawn: Axes | Panels) -> Figure:
    """The whole figure of some axes."""
    ax: Axes = np.asarray(drawn, dtype=object).flat[0]
    # ax.figure may be a subfigure; its own figure is the whole one.
    return ax.figure.figure


def legend_below(drawn: Panels, keys: list[Any], *, own: bool, **options: Any) -> None:
    """Add a legend below all panels of a new figure, or beside the last of a caller's axes.

    Args:
        drawn: the panels.
        keys: entries of the legend.
        own: whether the figure is new.
        options: of :meth:`matplotlib.figure.Figure.legend`.
    """
    if own:
        figure_of(drawn).legend(handles=keys, fontsize=SMALL, frameon=False,
                                **{"loc": "outside lower center", **options})  # fmt: skip
    else:
        kept = {name: value for name, value in options.items() if name not in ("loc", "ncols")}
        add_legend(drawn.flat[-1], keys, **{**kept, **BESIDE})
