"""The figures show what the plan says."""

from __future__ import annotations

import itertools
import sys
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from drawing import without_pixels
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from gaitopt import ForceLimits, Plan, Quadruped
from gaitopt.conventions import LEGS, FloatArray, rotation_z
from gaitopt.errors import InputError
from gaitopt.motion.path import MotionPath
from gaitopt.planners.crawl import plan_crawl
from gaitopt.robots.catalog import load_robot
from gaitopt.terrain.columns import s_columns
from gaitopt.terrain.footholds import Footholds
from gaitopt.viewing.colours import LEG_COLOURS
from gaitopt.viewing.figures import crawl_figures as plots
from gaitopt.viewing.figures.area import (
    FeasibleArea,
    feasible_area,
    polygon_slack,
    reach_slack,
)
from gaitopt.viewing.figures.common import cycle_phases, thinned_to_pixels
from gaitopt.viewing.figures.joint_curves import curve_lines
from gaitopt.viewing.figures.margin import margin_line
from gaitopt.viewing.figures.panels import figure_of


@pytest.fixture(scope="module")
def plan(wang: Quadruped) -> Plan:
    """Four cycles of the paper's method."""
    return plan_crawl(wang, s_columns(0, columns=5, forward=0.4), timing="velocity")


@pytest.fixture(scope="module")
def ssm(plan: Plan) -> Plan:
    """The same with the largest margin."""
    return plan_crawl(plan.robot, plan.footholds, objective="margin", timing="velocity")


@pytest.fixture(scope="module")
def standing(wang: Quadruped) -> Plan:
    return plan_crawl(wang, s_columns(0, columns=1), timing="velocity")


@pytest.fixture(scope="module")
def areas(plan: Plan) -> list[FeasibleArea]:
    """The areas of all steps of ``plan``."""
    return [feasible_area(plan, step) for step in range(16)]


def below_hips(robot: Quadruped, heading: float, step: float, count: int = 3) -> Footholds:
    """Uneven open ground, walked over in a given heading."""
    rng = np.random.default_rng(1)
    points = {}
    for name, leg in robot.legs.items():
        first = leg.hip * [1, 1, 0] + [0, leg.lateral, 0]
        line = first + np.outer(np.arange(count), [step, 0, 0])
        points[name] = (line + rng.uniform(-0.01, 0.01, line.shape)) @ rotation_z(heading).T
    return Footholds(points)


@cache
def strange_plan(name: str) -> Plan:
    """Plans of robots with sideways hip offsets (discs off the hips) and pitch drops (ovals)."""
    height, step = {"a1": (0.27, 0.06), "anymal_c": (0.45, 0.1), "hyq": (0.62, 0.08)}[name]
    robot = load_robot(name)
    return plan_crawl(robot, below_hips(robot, 0.7, step), body_height=height, swing_height=0.04,
                      heading=0.7, follow_terrain=True, timing="velocity")  # fmt: skip


def by_gid(ax: Axes, gid: str) -> Any:
    """The one line or collection that is so named."""
    (found,) = [a for a in (*ax.lines, *ax.collections) if a.get_gid() == gid]
    return found


def legends(figure: Figure) -> list[Any]:
    return [*figure.legends, *(a.get_legend() for a in figure.axes if a.get_legend())]


def all_figures(plan: Plan) -> dict[str, Figure]:
    """All figures of a plan, by the names of the functions that draw them."""
    figures = {
        "terrain": figure_of(plots.plot_terrain(plan.footholds)),
        "gait cycle": figure_of(plots.plot_gait_cycle(plan)),
        "paths": figure_of(plots.plot_paths(plan)),
        "cog": figure_of(plots.plot_cog_over_time({"this plan": plan})),
        "joint velocities": figure_of(plots.plot_joint_velocities(plan)),
        "margin": figure_of(plots.plot_margin(plan)),
    }
    if plan.swings:
        figures["swing"] = figure_of(plots.plot_swing(plan, 1))
        figures["feasible area"] = figure_of(plots.plot_feasible_area(plan, 1))
    return figures


def contains(outline: FloatArray, place: FloatArray, tolerance: float) -> bool:
    """Whether a place lies in a convex outline, or this near outside."""
    slack = polygon_slack(outline[:: max(len(outline) // 60, 1)], -tolerance)
    assert slack is not None
    return bool((slack(place[None]) >= 0).all())


def test_where_forces_hold_is_drawn_with_forces() -> None:
    """With a large reserve it is the triangle of the places that keep it, for the body centre."""
    robot = load_robot("a1")
    ground = s_columns(0, columns=2, robot=robot)
    plan = plan_crawl(robot, ground, forces=ForceLimits(reserve=0.1), body_height=0.25)
    area = feasible_area(plan, 0)
    assert area.active == ("forces side 1",) and len(area.held) == 3
    assert contains(area.held, area.target, 0.0) and contains(area.common, area.target, 1e-6)
    for place in area.common[::30]:
        assert contains(area.held, place, 1e-6) and contains(area.shrunken, place, 1e-6)
    # Each foot keeps a tenth of the weight: seven tenths of every side are left, or less, as the
    # centre of mass moves in the body.
    sides = [np.linalg.norm(np.roll(c, 1, axis=0) - c, axis=1).max()
             for c in (area.held, area.triangle)]  # fmt: skip
    assert 0.6 < sides[0] / sides[1] <= 0.7
    (drawn,) = [p for p in figure_of(plots.plot_feasible_area(plan, 0)).axes[0].patches
                if p.get_label() == "forces"]  # fmt: skip
    np.testing.assert_allclose(drawn.get_xy()[:3], area.held)
    by_speed = feasible_area(plan_crawl(robot, ground, timing="velocity"), 0)
    assert not len(by_speed.held)


def test_the_discs_are_the_columns_where_they_stand_and_as_wide() -> None:
    footholds = s_columns(3)
    (ax,) = figure_of(plots.plot_terrain(footholds)).axes
    for leg in LEGS:
        discs = by_gid(ax, leg)
        np.testing.assert_array_equal(discs.get_offsets(), footholds[leg][:, :2])
        np.testing.assert_allclose(discs.get_widths(), 0.04)
    assert ax.get_aspect() == 1.0
    colours = [by_gid(ax, leg).get_facecolor()[0, :3] for leg in LEGS]
    assert len(np.unique(np.round(colours, 6), axis=0)) == 4


def test_open_ground_is_drawn_as_crosses() -> None:
    footholds = Footholds(dict(s_columns(0).points))
    (ax,) = figure_of(plots.plot_terrain(footholds)).axes
    np.testing.assert_array_equal(by_gid(ax, "LF").get_xydata(), footholds["LF"][:, :2])


def test_a_walk_much_longer_than_wide_says_how_much_it_is_stretched() -> None:
    (ax,) = figure_of(plots.plot_terrain(s_columns(0, columns=400, forward=40.0))).axes
    assert ax.get_aspect() > 1 and f"drawn ×{ax.get_aspect():g}" in ax.get_ylabel()


def test_the_intersection_of_both_areas_holds_the_target(
    areas: list[FeasibleArea], ssm: Plan
) -> None:
    for area in (*areas, *(feasible_area(ssm, step) for step in (0, 5, 10, 15))):
        assert len(area.common) and contains(area.common, area.target, 1e-5)


def test_a_target_with_active_constraints_lies_on_the_border_of_the_intersection(
    areas: list[FeasibleArea],
) -> None:
    limited = [area for area in areas if area.active]
    assert len(limited) > 5
    for area in limited:
        assert np.hypot(*(area.common - area.target).T).min() < 1e-6


@pytest.mark.parametrize("step", [0, 9])
def test_the_intersection_is_shaded(plan: Plan, areas: list[FeasibleArea], step: int) -> None:
    shade = next(p for p in figure_of(plots.plot_feasible_area(plan, step)).axes[0].patches
                 if p.get_label() == "A and B")  # fmt: skip
    np.testing.assert_array_equal(shade.get_xy()[:-1], areas[step].common)


def test_a_place_beyond_a_side_is_not_in_the_intersection(areas: list[FeasibleArea]) -> None:
    area = areas[2]
    assert not contains(area.common, area.target + 2e-3 * (area.start - area.target), 1e-5)
    assert not contains(area.common, area.start, 1e-5)


def test_no_place_of_the_intersection_is_nearer_to_the_start_than_the_target(
    areas: list[FeasibleArea],
) -> None:
    for area in areas:
        nearest = np.hypot(*(area.common - area.start).T).min()
        assert np.hypot(*(area.target - area.start)) <= nearest + 1e-7


@pytest.mark.parametrize("name", ["a1", "anymal_c", "hyq"])
def test_outlines_are_straight_legs_and_the_area_meets_every_constraint(name: str) -> None:
    strange = strange_plan(name)
    for step in (0, 3, 6):
        area = feasible_area(strange, step)
        assert contains(area.common, area.target, 1e-5)
        stance = next(p for p in strange.phases if p.step == step)
        axes = rotation_z(0.7)
        feet = strange.at([stance.end]).feet[0]
        for leg, foot in zip(LEGS, feet, strict=True):
            slack = reach_slack(strange, leg, foot, axes, float(stance.cog_end[2]))
            np.testing.assert_allclose(slack(area.reach[leg]), 0.0, atol=1e-8)
            assert slack(area.common).min() > -1e-8
        corners = area.triangle
        assert polygon_slack(corners, strange.settings.stability_margin)(area.common).min() > -1e-8


def test_reach_of_a_leg_without_offsets_is_the_disc_of_eq_8(
    plan: Plan, areas: list[FeasibleArea]
) -> None:
    area, leg = areas[2], plan.robot.legs["RF"]
    radius = np.sqrt(leg.reach**2 - plan.settings.body_height**2)
    centre = area.feet[LEGS.index("RF")] - (leg.hip - plan.robot.centre)[:2]
    np.testing.assert_allclose(np.hypot(*(area.reach["RF"] - centre).T), radius, atol=1e-7)


def test_the_active_constraint_is_named_and_drawn_bold(
    plan: Plan, areas: list[FeasibleArea]
) -> None:
    step = next(p.step for p in plan.phases if p.evidence and p.limited_by[0].kind == "margin")
    figure = figure_of(plots.plot_feasible_area(plan, step))
    assert areas[step].active[0].replace("-", "–") in figure.axes[1].get_title(loc="left")
    assert max(line.get_linewidth() for line in figure.axes[0].lines) > 2.0


@pytest.mark.parametrize("wrong", [-1, 16, 1.0, True, None])
def test_a_step_that_does_not_exist_is_refused_with_the_range(plan: Plan, wrong: object) -> None:
    for draw in (plots.plot_feasible_area, plots.plot_swing):
        with pytest.raises(InputError, match="from 0 to 15"):
            draw(plan, wrong)


def test_a_plan_without_steps_has_no_step_to_draw(standing: Plan) -> None:
    with pytest.raises(InputError, match="no steps"):
        plots.plot_swing(standing, 0)


@pytest.mark.parametrize("wrong", [-1, 4, 0.5, True])
def test_a_cycle_that_does_not_exist_is_refused_with_the_range(plan: Plan, wrong: object) -> None:
    for draw in (plots.plot_gait_cycle, plots.plot_joint_velocities, plots.plot_margin):
        with pytest.raises(InputError, match="from 0 to 3"):
            draw(plan, cycle=wrong)


def test_the_cycles_share_out_all_phases(plan: Plan) -> None:
    phases = [p for cycle in range(4) for p in cycle_phases(plan, cycle)[1]]
    assert phases == list(plan.phases)


def test_every_cog_line_ends_at_its_plans_duration(plan: Plan, ssm: Plan) -> None:
    (ax,) = figure_of(plots.plot_cog_over_time({"ours": plan, "SSM": ssm})).axes
    lines = {line.get_label().split(" (")[0]: line for line in ax.lines}
    for name, each in (("ours", plan), ("SSM", ssm)):
        x, y = lines[name].get_data()
        assert x[-1] == each.duration
        ends = each.at([0.0, each.duration]).cog[:, 0]
        assert y[0] == 0.0 and y[-1] == pytest.approx(ends[1] - ends[0], abs=1e-12)
        assert any(f"{each.duration:.1f} s" in text.get_text() for text in ax.texts)


def test_forward_is_the_heading() -> None:
    strange = strange_plan("a1")
    (ax,) = figure_of(plots.plot_cog_over_time({"a1": strange})).axes
    cog = strange.at([0.0, strange.duration]).cog
    ahead = (cog[1] - cog[0])[:2] @ [np.cos(0.7), np.sin(0.7)]
    assert ax.lines[0].get_ydata()[-1] == pytest.approx(ahead, abs=1e-12)


def test_a_comparison_of_nothing_is_refused() -> None:
    with pytest.raises(InputError, match="one plan or more"):
        plots.plot_cog_over_time({})


def test_velocities_touch_the_limit_and_never_exceed_it(plan: Plan) -> None:
    figure = figure_of(plots.plot_joint_velocities(plan))
    peaks = []
    for ax in figure.axes:
        rates = [line.get_ydata() for line in ax.lines if line.get_gid()]
        assert len(rates) == 3
        peaks.append(max(np.abs(rate).max() for rate in rates))
        limits = {round(abs(line.get_ydata()[0]), 9) for line in ax.lines
                  if line.get_linestyle() == "--"}  # fmt: skip
        assert limits == {17.0}
    np.testing.assert_allclose(peaks, 17.0, rtol=1e-9)


def test_velocities_of_a_polyline_are_drawn_at_its_knots() -> None:
    path = MotionPath.polyline([0.0, 1.0, 3.0], [[0.0] * 7, [*[0.0] * 6, 2.0], [0.0] * 7])
    times, rates = curve_lines(path, (0,), (0.0, 3.0), derivative=1)
    np.testing.assert_array_equal(times, [0, 1, 1, 3])
    np.testing.assert_array_equal(rates[:, 0], [2, 2, -1, -1])
    np.testing.assert_array_equal(curve_lines(path, (0,), (1.5, 2.0), derivative=1)[0], [1, 3])


def test_thinning_keeps_order_ends_and_extremes() -> None:
    t = np.linspace(0.0, 5.0, 50_000)
    y = np.random.default_rng(0).normal(size=t.size)
    few_t, few_y = thinned_to_pixels(t, y, columns=100)
    assert len(few_t) <= 400 and (np.diff(few_t) > 0).all()
    assert few_t[0] == t[0] and few_t[-1] == t[-1]
    assert few_y.max() == y.max() and few_y.min() == y.min()
    assert np.isin(few_t, t).all()


def test_bars_of_the_gait_cycle_are_the_swing_phases(plan: Plan) -> None:
    (ax,) = figure_of(plots.plot_gait_cycle(plan, 1)).axes
    for phase in cycle_phases(plan, 1)[1]:
        bars = by_gid_all(ax, phase.leg if phase.kind == "swing" else "COG")
        spans = [b.get_paths()[0].get_extents().intervalx for b in bars]
        assert any(np.allclose(s, (phase.start, phase.end), atol=1e-12) for s in spans)
    for leg in LEGS:
        assert len(by_gid_all(ax, leg)) == 1


def by_gid_all(ax: Axes, gid: str) -> list[Any]:
    return [c for c in ax.collections if c.get_gid() == gid]


def test_the_swing_is_the_box_of_fig_5(plan: Plan) -> None:
    for step in (0, 9):
        (ax,) = figure_of(plots.plot_swing(plan, step)).axes
        phase = next(p for p in plan.phases if p.step == step and p.kind == "swing")
        x, z = by_gid(ax, "foot").get_data()
        length = 1e3 * np.hypot(*(phase.foot_end - phase.foot_start)[:2])
        np.testing.assert_allclose([x[0], z[0], x[-1], z[-1]], [0, 0, length, 0], atol=1e-6)
        assert z.max() == pytest.approx(70.0, abs=0.1) and x.max() <= length + 0.1
        assert [t.get_text() for t in ax.texts[:4]] == ["A", "B", "C", "D"]


def test_the_least_margin_drawn_is_the_plans(plan: Plan, ssm: Plan) -> None:
    for each in (plan, ssm):
        times, margins = margin_line(each, each.phases)
        assert margins.min() == pytest.approx(each.margin, abs=2e-5)
        assert times[0] == 0.0 and times[-1] == pytest.approx(each.duration)


def test_feet_that_stand_together_for_no_time_draw_no_spike(plan: Plan) -> None:
    (moment, after) = next(
        pair for pair in itertools.pairwise(plan.phases) if pair[0].duration == 0.0
    )
    whole, _ = plots.plot_margin(plan)
    times, margins = whole.lines[0].get_data()
    there = margins[np.abs(np.asarray(times) - moment.start) < 1e-9]
    _, standing = margin_line(plan, (moment,))
    _, flying = margin_line(plan, (after,))
    assert len(there) and there.max() < 1e3 * standing.min()
    assert flying.max() < standing.min()


def test_a_centre_of_mass_margin_is_drawn_when_given(plan: Plan) -> None:
    figure = figure_of(plots.plot_margin(plan, ([0.0, 1.0, 2.0], [0.01, 0.02, 0.03])))
    line = by_gid(figure.axes[0], "true centre of mass")
    np.testing.assert_allclose(line.get_ydata(), [10, 20, 30])
    with pytest.raises(InputError, match="com_margin"):
        plots.plot_margin(plan, ([0.0, 1.0], [0.01]))


def test_paths_end_where_the_feet_stand(plan: Plan) -> None:
    figure = figure_of(plots.plot_paths(plan))
    top = figure.axes[0]
    for i, leg in enumerate(LEGS):
        x, y = top.lines[i].get_data()
        np.testing.assert_allclose([x[-1], y[-1]], plan.footholds[leg][-1, :2], atol=1e-6)


@pytest.mark.parametrize("which", ["plan", "standing", "hyq"])
def test_every_panel_has_units_and_every_figure_a_legend(
    which: str, request: pytest.FixtureRequest
) -> None:
    chosen = strange_plan("hyq") if which == "hyq" else request.getfixturevalue(which)
    figures = all_figures(chosen)
    assert len(figures) == (6 if which == "standing" else 8)
    for name, figure in figures.items():
        assert legends(figure), name
        bottom = [ax for ax in figure.axes if ax.get_xlabel()]
        assert bottom and all("[" in ax.get_xlabel() for ax in bottom), name
        labelled = [ax for ax in figure.axes if ax.get_ylabel()]
        assert all("[" in ax.get_ylabel() for ax in labelled), name
        assert labelled or name == "gait cycle"


def test_figures_can_be_drawn_into_given_axes(plan: Plan) -> None:
    from matplotlib.figure import Figure

    figure = Figure()
    axes = figure.subplots(7)
    for draw, ax in zip(
        (
            lambda ax: plots.plot_terrain(plan.footholds, ax),
            lambda ax: plots.plot_feasible_area(plan, 1, ax),
            lambda ax: plots.plot_paths(plan, ax),
            lambda ax: plots.plot_cog_over_time({"ours": plan}, ax),
            lambda ax: plots.plot_gait_cycle(plan, 1, ax),
            lambda ax: plots.plot_swing(plan, 1, ax),
            lambda ax: plots.plot_margin(plan, ax=ax),
        ),
        axes,
        strict=True,
    ):
        assert draw(ax) is ax and ax.get_title(loc="left")
    assert len(figure.axes) == 7


def test_files_are_small_and_pyplot_is_left_alone(plan: Plan, ssm: Plan, tmp_path: Path) -> None:
    pyplot = sys.modules.get("matplotlib.pyplot")
    before = None if pyplot is None else pyplot.get_fignums()
    paths = plots.save_figures(plan, tmp_path / "a" / "b", comparison={"ours": plan, "SSM": ssm})
    assert {p.name for p in (tmp_path / "a" / "b").iterdir()} == {p.name for p in paths}
    for path in paths:
        assert path.read_bytes().startswith(b"\x89PNG") and path.stat().st_size < 300_000
    if pyplot is None:
        assert "matplotlib.pyplot" not in sys.modules
    else:
        assert pyplot.get_fignums() == before


def test_a_plan_without_steps_is_drawn_without_the_steps_figures(
    standing: Plan, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Only names are looked at.
    monkeypatch.setattr("gaitopt.viewing.figures.files.pixels_of", without_pixels)
    names = {p.stem for p in plots.save_figures(standing, tmp_path)}
    assert names == {"fig03_terrain", "fig04_gait_cycle", "fig11_paths", "fig12_14_15_cog",
                     "fig13_joint_velocities", "stability_margin"}  # fmt: skip


def test_a_folder_that_cannot_be_made_is_refused(plan: Plan, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("x")
    with pytest.raises(InputError, match="cannot make the folder"):
        plots.save_figures(plan, tmp_path / "file" / "figures")
    assert [p.name for p in tmp_path.iterdir()] == ["file"]


def test_nothing_is_left_in_a_folder_that_cannot_be_written_to(
    standing: Plan, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_args: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "replace", full)
    with pytest.raises(InputError, match="No space left"):
        plots.save_figures(standing, tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_leg_colours_name_all_legs_in_the_papers_order() -> None:
    assert tuple(LEG_COLOURS) == ("RH", "RF", "LH", "LF")
