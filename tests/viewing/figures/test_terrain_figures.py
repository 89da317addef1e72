"""The figures of walks over height maps show map, footholds and search as they are."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from ground_walks import bumps, bumpy_search, bumpy_walk
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import gaitopt
from gaitopt import LEGS, HeightMap, InputError, Plan
from gaitopt.conventions import FloatArray
from gaitopt.viewing.colours import LEG_COLOURS
from gaitopt.viewing.figures import crawl_figures
from gaitopt.viewing.figures.files import write_figures
from gaitopt.viewing.figures.gait_cycle import plot_swing
from gaitopt.viewing.figures.panels import figure_of
from gaitopt.viewing.figures.paths import plot_terrain
from gaitopt.viewing.figures.terrain_map import plot_terrain_map
from gaitopt.viewing.figures.terrain_profile import plot_terrain_profile


def found(ax: Axes, gid: str) -> list[Any]:
    """All that is drawn with a name."""
    return [artist for artist in ax.get_children() if artist.get_gid() == gid]


def line(ax: Axes, gid: str) -> FloatArray:
    """Points of the one line with a name ``(n, 2)``."""
    (only,) = found(ax, gid)
    return np.asarray(only.get_xydata())


def image(ax: Axes, gid: str) -> Any:
    (only,) = found(ax, gid)
    return only


def labels(figure: Figure) -> list[str]:
    return [text.get_text() for legend in figure.legends for text in legend.get_texts()]


def over(plan: Plan, ground: HeightMap) -> Plan:
    return replace(plan, footholds=plan.footholds.with_(ground=ground))


def ground_of(plan: Plan) -> HeightMap:
    assert plan.footholds.ground is not None
    return plan.footholds.ground


# ---------------------------------------------------------------- the map


def test_each_point_of_the_map_has_its_colour_in_its_place() -> None:
    ground = bumps()
    figure = figure_of(plot_terrain_map(ground))
    ax, bar = figure.axes
    heights = image(ax, "heights")
    shown = np.ma.filled(heights.get_array().astype(float), np.nan)
    assert np.array_equal(shown, ground.z.T, equal_nan=True)
    half = ground.resolution / 2.0
    (x0, x1), (y0, y1) = ground.extent
    assert heights.get_extent() == pytest.approx([x0 - half, x1 + half, y0 - half, y1 + half])
    assert heights.origin == "lower"
    assert bar.get_ylabel() == "height [m]"
    assert heights.get_clim() == pytest.approx(ground.height_range)


def test_unknown_ground_is_hatched_and_named() -> None:
    figure = figure_of(plot_terrain_map(bumps()))
    ax = figure.axes[0]
    (hatched,) = found(ax, "unknown")
    assert hatched.get_hatch() and hatched.get_zorder() < image(ax, "heights").get_zorder()
    assert labels(figure) == ["unknown"]
    known = figure_of(plot_terrain_map(bumps().with_heights(np.nan_to_num(bumps().z))))
    assert found(known.axes[0], "unknown") == [] and labels(known) == []


def test_the_map_of_a_plan_has_its_footholds_with_the_order_of_the_steps() -> None:
    plan = bumpy_walk()
    figure = figure_of(plot_terrain_map(plan))
    ax = figure.axes[0]
    for leg in LEGS:
        assert np.allclose(line(ax, f"footholds {leg}"), plan.footholds[leg][:, :2])
    for swing in plan.swings:
        (number,) = found(ax, f"step {swing.step + 1}")
        assert number.get_text() == str(swing.step + 1)
        assert np.allclose(number.xy, swing.foot_end[:2])
    arrows = found(ax, "swing")
    assert len(arrows) == plan.footholds.steps == 9
    for arrow, swing in zip(arrows, plan.swings, strict=True):
        start, end = arrow._posA_posB
        assert np.allclose([start, end], [swing.foot_start[:2], swing.foot_end[:2]])
    assert {*LEGS, "body centre", "true centre of mass"} <= set(labels(figure))


def test_the_map_of_a_plan_has_the_paths_of_body_and_centre_of_mass() -> None:
    import pinocchio as pin

    plan = bumpy_walk()
    ax = figure_of(plot_terrain_map(plan)).axes[0]
    ends = plan.at([0.0, plan.duration])
    assert np.allclose(line(ax, "cog")[[0, -1]], ends.cog[:, :2])
    data = plan.robot.model.createData()
    com = [pin.centerOfMass(plan.robot.model, data, q)[:2].copy() for q in ends.q]
    assert np.allclose(line(ax, "com")[[0, -1]], com, atol=1e-9)


def test_a_large_map_is_drawn_around_the_walk_only() -> None:
    rng = np.random.default_rng(0)
    wide = HeightMap(rng.uniform(0.0, 0.01, (1001, 801)), 0.02, (-10.0, -8.0))
    plan = over(bumpy_walk(), wide)
    ax = figure_of(plot_terrain_map(plan)).axes[0]
    heights = image(ax, "heights")
    x0, x1, y0, y1 = heights.get_extent()
    feet = np.concatenate([plan.footholds[leg] for leg in LEGS])
    assert -1.0 < x0 < feet[:, 0].min() - 0.4 and feet[:, 0].max() + 0.4 < x1 < 1.2
    assert y1 - y0 < 2.0
    # What is drawn is where it was: the colours of cells against the map.
    i, j = 7, 11
    place = [x0 + (i + 0.5) * 0.02, y0 + (j + 0.5) * 0.02]
    assert heights.get_array()[j, i] == pytest.approx(float(wide.height(place)), abs=1e-9)


# ---------------------------------------------------------------- searches


def test_a_search_that_failed_tells_how_far_it_got_and_why() -> None:
    search = bumpy_search(complete=False)
    figure = figure_of(plot_terrain_map(search))
    ax = figure.axes[0]
    title = ax.get_title(loc="left")
    # The middle of the last footholds is next to x = 0.21 of a way from 0 to 0.4.
    middle = search.footholds.array[:, -1, 0].mean()
    assert title.startswith(f"Goal not reached: 9 steps, {middle:.2f} m of 0.40 m;")
    assert title.endswith("12 because a limb <would> touch the ground\n3 because out of reach")
    (last,) = found(ax, "last")
    corners = {tuple(np.round(c, 9)) for c in last.get_xy()}
    assert corners == {tuple(np.round(p, 9)) for p in search.footholds.array[:, -1, :2]}
    assert np.allclose(line(ax, "tried"), search.tried[:, :2])
    assert np.allclose(line(ax, "goal"), [[0.4, 0.0]])


def test_causes_that_refused_nothing_are_not_told() -> None:
    search = replace(bumpy_search(False), refused={"out of reach": 2, "too near": 0})
    title = figure_of(plot_terrain_map(search)).axes[0].get_title(loc="left")
    assert "2 because out of reach" in title and "too near" not in title


def test_places_where_no_foot_may_stand_are_coloured_by_the_reason() -> None:
    search = bumpy_search(complete=False)
    figure = figure_of(plot_terrain_map(search))
    codes = search.layers.codes
    colours = np.asarray(image(figure.axes[0], "refused").get_array())
    opaque = colours[..., 3].T > 0.0
    assert np.array_equal(opaque, codes != 0)
    different = {tuple(c) for c in colours.transpose(1, 0, 2)[codes != 0]}
    assert len(different) == len(set(codes[codes != 0].tolist()))
    shares = [f"{f} ({n / codes.size:.1%})" for f, n in search.layers.counts.items() if n]
    assert [text for text in labels(figure) if text.endswith("%)")] == shares[1:]


def test_a_search_that_reached_its_goal_has_no_end_before_it() -> None:
    figure = figure_of(plot_terrain_map(bumpy_search()))
    assert figure.axes[0].get_title(loc="left") == "Footholds to the goal: 9 steps over 0.40 m"
    assert found(figure.axes[0], "last") == []


def test_a_plan_with_its_search_shows_both() -> None:
    ax = figure_of(plot_terrain_map(bumpy_walk(), search=bumpy_search())).axes[0]
    assert len(line(ax, "tried")) == len(bumpy_search().tried)
    assert found(ax, "cog") and not found(ax, "refused")


# ---------------------------------------------------------------- from the side


def test_feet_are_never_below_the_ground_that_is_drawn() -> None:
    plan = bumpy_walk()
    figure = figure_of(plot_terrain_profile(plan))
    assert len(figure.axes) == 4
    for leg, ax in zip(LEG_COLOURS, figure.axes, strict=True):
        foot, ground = line(ax, "foot"), line(ax, "ground")
        below = np.interp(foot[:, 0], ground[:, 0], ground[:, 1])
        # A ball that touches a slope beside its lowest point is less than 1 mm above the ground.
        assert (foot[:, 1] - below).min() > -1e-5
        index = LEGS.index(leg)
        count = plan.footholds.counts[leg]
        touches = plan.footholds.touching(plan.robot.foot_radius)[index, :count]
        assert np.allclose(line(ax, "footholds")[:, 1], touches[:, 2])
        lengths = np.linalg.norm(np.diff(plan.footholds[leg][:, :2], axis=0), axis=1)
        assert np.allclose(np.diff(line(ax, "footholds")[:, 0]), lengths, atol=1e-6)


def test_steps_have_their_numbers_under_their_own_leg() -> None:
    plan = bumpy_walk()
    axes = dict(zip(LEG_COLOURS, figure_of(plot_terrain_profile(plan)).axes,
                    strict=True))  # fmt: skip
    for swing in plan.swings:
        assert len(found(axes[swing.leg], f"step {swing.step + 1}")) == 1


def test_ground_below_a_swing_is_drawn_and_its_own_height_is_written() -> None:
    plan = bumpy_walk()
    rises = {leg: np.full(n - 1, 0.11) for leg, n in plan.footholds.counts.items()}
    own = replace(plan, footholds=plan.footholds.with_(swing_heights=rises))
    ax = figure_of(plot_swing(own, 2)).axes[0]
    swing = own.swings[2]
    top = 1e3 * (0.11 + max(0.0, swing.foot_end[2] - swing.foot_start[2]))
    assert f"{top:.0f} mm" in [text.get_text() for text in ax.texts]
    shown = line(ax, "ground")
    start = np.interp(0.0, *shown.T)
    height = float(ground_of(plan).height(swing.foot_start[:2]))
    assert start == pytest.approx(1e3 * (height - swing.foot_start[2]), abs=0.5)


# ---------------------------------------------------------------- files and mistakes


def test_both_figures_are_saved_where_there_is_a_map(
    tmp_path: Path, short_plan: Plan, monkeypatch: pytest.MonkeyPatch
) -> None:
    def only_of_terrain(figures: dict[str, Any], folder: Path) -> list[Path]:
        mine = {name: draw for name, draw in figures.items() if name.startswith("terrain_")}
        return write_figures(mine, folder)

    monkeypatch.setattr(crawl_figures, "write_figures", only_of_terrain)
    files = gaitopt.save_figures(bumpy_walk(), tmp_path / "map", search=bumpy_search())
    assert [file.name for file in files] == ["terrain_map.png", "terrain_profile.png"]
    assert all(5_000 < file.stat().st_size < 300_000 for file in files)
    assert gaitopt.save_figures(short_plan, tmp_path / "flat") == []


def test_unequal_numbers_of_footholds_are_told() -> None:
    title = figure_of(plot_terrain(bumpy_walk().footholds)).axes[0].get_title(loc="left")
    assert title == "3 to 4 footholds for each leg, height map"


def test_what_has_no_map_is_refused(short_plan: Plan) -> None:
    for draw in (plot_terrain_map, plot_terrain_profile):
        with pytest.raises(InputError, match=r"no height map.*with_\(ground"):
            draw(short_plan)
    with pytest.raises(InputError, match="got str"):
        plot_terrain_map("map.png")  # type: ignore[arg-type]


def test_the_map_is_drawn_where_it_is_asked_for() -> None:
    figure = Figure()
    left, right = figure.subplots(1, 2)
    assert plot_terrain_map(bumpy_walk(), ax=right) is right
    assert not left.has_data() and found(right, "heights")
