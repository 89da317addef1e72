"""Figures take axes and return axes."""

from __future__ import annotations

import sys
from collections.abc import Callable
from io import BytesIO
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from PIL import Image, ImageChops

import gaitopt
from gaitopt import InputError, Plan
from gaitopt.viewing.figures.files import DPI, pixels_of, write_figures
from gaitopt.viewing.figures.panels import figure_of, new_figure

SEVERAL: dict[str, tuple[tuple[int, ...], Callable[..., Any]]] = {
    "velocities": ((4, 2), lambda plan, axes: gaitopt.plot_joint_velocities(plan, axes=axes)),
    "curves": ((2, 3), lambda plan, axes: gaitopt.plot_joint_curves(
        plan, derivatives=(0, 1), axes=axes)),
    "snapshots": ((2,), lambda plan, axes: gaitopt.plot_snapshots(plan, 2, axes)),
    "zmp": ((2,), gaitopt.plot_zmp),
    "swing curves": ((8,), lambda plan, axes: gaitopt.plot_swing_curves(axes=axes)),
}  # fmt: skip
"""Figures of several panels: their shape, and how they are drawn."""


@pytest.mark.parametrize("name", SEVERAL)
def test_several_panels_are_drawn_where_they_are_asked_for(name: str, short_plan: Plan) -> None:
    shape, draw = SEVERAL[name]
    mine = Figure().subplots(*shape)
    drawn = draw(short_plan, mine)
    assert drawn.shape == shape and all(a is b for a, b in zip(drawn.flat, mine.flat, strict=True))
    assert all(ax.has_data() for ax in mine.flat)
    assert len(figure_of(drawn).axes) == mine.size and not figure_of(drawn).legends
    own = draw(short_plan, None)
    assert own.shape == shape and own.flat[0].figure is figure_of(own)
    # The same lines, wherever they are drawn.
    for ax, other in zip(own.flat, mine.flat, strict=True):
        assert len(ax.lines) == len(other.lines)
    with pytest.raises(InputError, match=r"figure\.subplots\(" + str(shape[0])):
        draw(short_plan, Figure().subplots(3, 7))


def test_a_new_figure_of_two_views_returns_both(short_plan: Plan) -> None:
    above, space = gaitopt.plot_paths(short_plan)
    whole, close = gaitopt.plot_feasible_area(short_plan, 1)
    assert space.name == "3d" and above.figure is space.figure
    assert "where the COG may be" in whole.get_title("left") and "from O to O'" in (
        close.get_title("left")
    )
    assert [len(gaitopt.plot_margin(short_plan)), whole.figure] == [2, close.figure]


@pytest.mark.parametrize("wrong", ["ax", Figure(), None])
def test_what_are_no_axes_is_refused(wrong: object) -> None:
    with pytest.raises(InputError, match="add_subplot"):
        gaitopt.plot_cycloids(wrong if wrong is not None else Figure().add_subplot())  # type: ignore[arg-type]
    if wrong is not None:
        with pytest.raises(InputError, match="ax must be axes of a figure"):
            gaitopt.plot_gait_diagram(gaitopt.trot(0.5), ax=wrong)  # type: ignore[arg-type]


def test_subfigures_share_a_page() -> None:
    page = Figure()
    left, right = page.subfigures(1, 2)
    ax = gaitopt.plot_gait_diagram(gaitopt.trot(0.5), ax=right.add_subplot())
    assert isinstance(ax, Axes) and figure_of(ax) is page and not left.axes


@pytest.fixture
def pyplot(monkeypatch: pytest.MonkeyPatch) -> list[Figure]:
    """Figures that pyplot was asked for, as if the program had imported it."""
    made: list[Figure] = []

    def figure(**options: Any) -> Figure:
        made.append(Figure(**options))
        return made[-1]

    module = ModuleType("matplotlib.pyplot")
    module.figure = figure  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "matplotlib.pyplot", module)
    monkeypatch.setattr("matplotlib.pyplot", module, raising=False)
    return made


def test_pyplot_knows_figures_where_it_is_used_but_not_those_for_files(
    pyplot: list[Figure], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def draw() -> Axes:
        return gaitopt.plot_gait_diagram(gaitopt.trot(0.5))

    assert figure_of(draw()) is pyplot[0]
    assert write_figures({"gait": draw}, tmp_path) == [tmp_path / "gait.png"]
    assert len(pyplot) == 1 and figure_of(draw()) is pyplot[1]
    # A notebook shows figures of pyplot, whether or not its cells import it.
    monkeypatch.delitem(sys.modules, "matplotlib.pyplot")
    assert new_figure(1.0, 1.0) not in pyplot
    monkeypatch.setitem(sys.modules, "IPython", SimpleNamespace(  # type: ignore[misc]
        get_ipython=lambda: SimpleNamespace(kernel=object())))  # fmt: skip
    assert new_figure(1.0, 1.0) is pyplot[2]


def test_a_file_shows_what_matplotlib_would_save_and_the_figure_stays_as_it_was() -> None:
    figure = figure_of(gaitopt.plot_gait_diagram(gaitopt.trot(0.5)))
    engine, dpi = figure.get_layout_engine(), figure.dpi
    mine = pixels_of(figure)
    assert figure.get_layout_engine() is engine and figure.dpi == dpi
    file = BytesIO()
    figure.savefig(file, format="png", dpi=DPI)
    assert ImageChops.difference(mine, Image.open(file).convert("RGB")).getbbox() is None
