"""The figures of a gait show what its plan says, and what the paper says of a trot."""

from __future__ import annotations

import sys
from dataclasses import replace
from functools import partial
from itertools import pairwise
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from drawing import without_pixels
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from gaitopt.conventions import LEGS, FloatArray
from gaitopt.errors import InputError
from gaitopt.gait.gaits import trot, walk, wave
from gaitopt.motion.path import MotionPath
from gaitopt.plan.plan import Plan
from gaitopt.planners.by_velocity import planner
from gaitopt.planners.crawl import plan_crawl
from gaitopt.robots.catalog import load_robot
from gaitopt.swing.catalogue import SWING_CURVES
from gaitopt.terrain.columns import s_columns
from gaitopt.viewing.figures.gait_figures import save_gait_figures
from gaitopt.viewing.figures.joint_curves import curve_lines, plot_joint_curves
from gaitopt.viewing.figures.panels import figure_of
from gaitopt.viewing.figures.snapshots import POSES, leg_points, plot_snapshots, side_axis
from gaitopt.viewing.figures.swing_curves import (
    WALK_OFFSET,
    as_printed,
    paper_cycloid,
    plot_cycloids,
    plot_swing_curves,
)
from gaitopt.viewing.figures.zmp import centre_motion, plot_zmp, zmp_line

FAST = load_robot("wang2020-fast")
plan_gait = partial(planner.plan_gait, timing="velocity")


@pytest.fixture(scope="module")
def trotting() -> Plan:
    """The paper's run, shortened: a straight trot at 0.3 m/s."""
    return plan_gait(FAST, trot(0.5), velocity=0.3, distance=0.6, swing="cycloid")


@pytest.fixture(scope="module")
def trotting_a1() -> Plan:
    """A robot whose knees all bend to the same side."""
    return plan_gait(load_robot("a1"), trot(0.5), velocity=0.3, distance=0.6, swing="cycloid")


@pytest.fixture(scope="module")
def flying() -> Plan:
    return plan_gait(FAST, trot(0.5, 0.4), velocity=0.2, distance=0.2)


@pytest.fixture(scope="module")
def walking() -> Plan:
    return plan_gait(FAST, walk(1.6), velocity=0.1, distance=0.1)


@pytest.fixture(scope="module")
def standing() -> Plan:
    return plan_crawl(load_robot("wang2020"), s_columns(0, columns=1), timing="velocity")


def drawn(ax: Axes, gid: str) -> FloatArray:
    """The points ``(n, 2)`` of the one line with a name, without its gaps."""
    (line,) = (line for line in ax.lines if line.get_gid() == gid)
    points = np.asarray(line.get_xydata(), dtype=np.float64)
    return points[np.isfinite(points).all(axis=1)]


def panels(figure: Figure, rows: int, columns: int) -> list[list[Axes]]:
    return [figure.axes[row * columns : (row + 1) * columns] for row in range(rows)]


def words(figure: Figure) -> str:
    """All text that a figure shows, legends included."""
    parts = [t.get_text() for ax in figure.axes for t in ax.texts]
    legends = [*figure.legends, *(ax.get_legend() for ax in figure.axes if ax.get_legend())]
    for legend in legends:
        parts += [legend.get_title().get_text(), *(t.get_text() for t in legend.get_texts())]
    return "\n".join(parts)


# --- joint curves -----------------------------------------------------------------------------


@pytest.mark.parametrize("derivative", [0, 1, 2, 3])
def test_curves_are_the_derivatives_of_the_path_on_both_sides_of_every_knot(
    derivative: int,
) -> None:
    path = MotionPath([0.0, 0.4, 1.0, 1.5], np.random.default_rng(0).normal(size=(6, 3, 8)))
    times, values = curve_lines(path, (1, 0), (0.0, 1.5), derivative)
    assert values.shape == (len(times), 2) and (np.diff(times) >= 0.0).all()
    for knot in path.times[1:-1]:
        before, after = values[times == knot]
        for side, value in ((-1.0, before), (1.0, after)):
            near = path.evaluate([knot + side * 1e-9], derivative)[0, [7, 6]]
            np.testing.assert_allclose(value, near, rtol=1e-5, atol=1e-5)
    inside = ~np.isin(times, path.times)
    expected = path.evaluate(times[inside], derivative)[:, [7, 6]]
    np.testing.assert_allclose(values[inside], expected, atol=1e-10)


def test_velocity_and_acceleration_that_are_drawn_integrate_to_what_is_drawn_above_them(
    trotting: Plan,
) -> None:
    """Judged by the trapezoidal rule, which does not use the polynomials."""
    columns = trotting.robot.leg_columns["LF"]
    lines = [curve_lines(trotting.path, columns, (0.0, trotting.duration), k) for k in range(3)]
    for (t, low), (_, high) in pairwise(lines):
        gained = np.cumsum(np.diff(t)[:, None] * (high[1:] + high[:-1]) / 2.0, axis=0)
        np.testing.assert_allclose(low[0] + gained, low[1:], atol=2e-3 * np.ptp(low))


def test_on_a_straight_line_roll_joints_rest_and_diagonal_legs_have_identical_curves(
    trotting_a1: Plan,
) -> None:
    """Source: [Wang2024], Section 6."""
    plan, span = trotting_a1, (0.0, trotting_a1.duration)
    for order in range(3):
        curves = {leg: curve_lines(plan.path, plan.robot.leg_columns[leg], span, order)[1]
                  for leg in LEGS}  # fmt: skip
        scale = np.abs(curves["LF"]).max()
        np.testing.assert_allclose(curves["RH"], curves["LF"], atol=1e-12 * scale)
        np.testing.assert_allclose(curves["LH"], curves["RF"], atol=1e-12 * scale)
        assert np.abs(curves["LF"] - curves["RF"]).max() > 0.1 * scale
        assert max(np.abs(curve[:, 0]).max() for curve in curves.values()) < 1e-12 * scale


@pytest.mark.parametrize("derivative", [0, 1, 2])
def test_every_point_that_is_drawn_lies_on_the_path(trotting_a1: Plan, derivative: int) -> None:
    axes = figure_of(plot_joint_curves(trotting_a1, derivatives=(derivative,))).axes
    assert [ax.get_ylabel().split()[0] for ax in axes] == ["roll", "hip", "knee"]
    for leg in LEGS:
        for ax, column in zip(axes, trotting_a1.robot.leg_columns[leg], strict=True):
            times, values = drawn(ax, leg).T
            at_knot = np.isin(times, trotting_a1.path.times)
            expected = np.degrees(trotting_a1.path.evaluate(times, derivative)[:, 6 + column])
            np.testing.assert_allclose(values[~at_knot], expected[~at_knot], atol=1e-8)
            assert times[0] == 0.0 and times[-1] == trotting_a1.duration


def test_with_knees_to_opposite_sides_diagonal_hips_are_mirror_images_in_time(
    trotting: Plan,
) -> None:
    """The paper's claim holds for knees of the same kind; for others only the knees' curves agree.

    The foot's path is its own mirror image about the middle of a stance. A leg with its knee on the
    other side turns in the opposite direction, and curves are drawn with that sign.
    """
    figure = figure_of(plot_joint_curves(trotting, ("LF", "RH"), derivatives=(0,)))
    _, hip, knee = figure.axes
    every = np.linspace(0.0, trotting.duration, 500)
    np.testing.assert_allclose(at(knee, "RH", every), at(knee, "LF", every), atol=1e-3)
    assert np.abs(at(hip, "RH", every) - at(hip, "LF", every)).max() > 5.0
    swing = next(s for s in trotting.swings if s.leg == "LF" and s.start > trotting.duration / 2)
    middle = swing.start - trotting.settings.schedule.stance_time / 2.0  # type: ignore[attr-defined]
    t = np.linspace(-0.25, 0.25, 101)
    np.testing.assert_allclose(at(hip, "RH", middle + t), at(hip, "LF", middle - t), atol=1e-2)
    actual = trotting.path.evaluate(middle + t)[:, 6 + trotting.robot.leg_columns["RH"][1]]
    np.testing.assert_allclose(at(hip, "RH", middle + t), -np.degrees(actual), atol=1e-2)
    assert "RH: knees on the other side; hip and knee drawn times −1" in words(figure)


def at(ax: Axes, gid: str, times: FloatArray) -> FloatArray:
    """A line without jumps at given times."""
    return np.interp(times, *drawn(ax, gid).T)


def test_limits_near_the_curves_are_drawn_and_the_others_named(trotting: Plan) -> None:
    limited = replace(trotting.settings, acceleration_limit=200.0)
    rows = panels(figure_of(plot_joint_curves(replace(trotting, settings=limited))), 3, 3)

    def heights(ax: Axes) -> list[float]:
        return sorted(line.get_ydata()[0] for line in ax.lines if line.get_gid() == "limit")

    for row, limit in ((rows[1], 300.0), (rows[2], np.degrees(200.0))):
        np.testing.assert_allclose(heights(row[2]), [-limit, limit], rtol=1e-6)
        for leg in LEGS:
            assert np.abs(drawn(row[2], leg)[:, 1]).max() < limit
        low, high = row[2].get_ylim()
        assert low < -limit and high > limit
    assert heights(rows[1][0]) == [] and "limits ±300" in words(rows[1][0].figure.figure)
    assert heights(rows[0][2]) == [] and "limits −160.4, 0" in words(rows[0][0].figure.figure)


def test_joint_curves_of_legs_without_roll_have_two_columns() -> None:
    solo = plan_gait(load_robot("solo8"), trot(0.5), velocity=0.1, distance=0.1)
    figure = figure_of(plot_joint_curves(solo, derivatives=(0, 1)))
    assert [ax.get_title(loc="left").split()[0] for ax in figure.axes[:2]] == ["hip", "knee"]
    assert len(figure.axes) == 4


def test_one_derivative_is_drawn_over_a_wide_time_axis_and_a_span_is_kept_to(
    trotting: Plan,
) -> None:
    figure = figure_of(plot_joint_curves(trotting, ["RF"], span=(1.0, 2.0), derivatives=(1,)))
    assert [ax.get_ylabel().split()[0] for ax in figure.axes] == ["roll", "hip", "knee"]
    for ax in figure.axes:
        assert ax.get_xlim() == (1.0, 2.0) and {"RF"} == {line.get_gid() for line in ax.lines} - {
            "limit"
        }
        times = drawn(ax, "RF")[:, 0]
        assert times.min() <= 1.0 and times.max() >= 2.0 and np.ptp(times) < 1.2


@pytest.mark.parametrize("wrong, message", [
    ({"legs": ("LF", "XY")}, "legs must be some of LF, LH, RH, RF, got 'XY'"),
    ({"legs": ()}, "got none"),
    ({"span": (2.0, 1.0)}, "two increasing times within 0"),
    ({"span": (0.0, 1e3)}, "two increasing times within 0"),
    ({"span": 3.0}, "two increasing times"),
    ({"derivatives": (3,)}, "one or more of 0, 1 and 2"),
    ({"derivatives": (True,)}, "one or more of 0, 1 and 2"),
    ({"derivatives": ()}, "one or more of 0, 1 and 2"),
])  # fmt: skip
def test_wrong_legs_spans_and_derivatives_are_refused(
    trotting: Plan, wrong: dict[str, object], message: str
) -> None:
    with pytest.raises(InputError, match=message):
        plot_joint_curves(trotting, **wrong)  # type: ignore[arg-type]


# --- snapshots --------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["trotting", "trotting_a1", "short_plan"])
def test_stick_figures_are_the_robots_joints_by_pinocchio(
    name: str, request: pytest.FixtureRequest
) -> None:
    plan: Plan = request.getfixturevalue(name)
    robot, times = plan.robot, np.linspace(0.0, plan.duration, 7)
    data = robot.model.createData()
    walk_ = plan.at(times)
    points = leg_points(plan, times)
    for row, q in zip(points, walk_.q, strict=True):
        pin.framesForwardKinematics(robot.model, data, q)
        for leg, line in zip(LEGS, row, strict=True):
            spots = [data.oMi[robot.model.getJointId(j)].translation
                     for j in robot.legs[leg].joints]  # fmt: skip
            foot = data.oMf[robot.model.getFrameId(robot.legs[leg].foot)].translation
            np.testing.assert_allclose(line, [spots[0], *spots[1:], foot][-4:], atol=1e-9)
    np.testing.assert_allclose(points[:, :, 3], walk_.feet, atol=1e-12)


def test_snapshots_are_in_true_proportions_and_stand_on_the_ground(trotting: Plan) -> None:
    along, apart = figure_of(plot_snapshots(trotting, 5)).axes
    for ax, count in ((along, 5), (apart, POSES)):
        assert ax.get_aspect() == 1.0
        feet = np.array([line.get_ydata()[-1] for line in ax.lines if line.get_gid() in LEGS])
        assert len(feet) == 4 * count
        assert sum(line.get_gid() == "body" for line in ax.lines) == count
        ground = drawn(ax, "ground")[:, 1]
        np.testing.assert_allclose(ground, -trotting.robot.foot_radius)
        assert feet.min() == pytest.approx(0.0, abs=2e-6)
    dots = np.array([line.get_ydata()[0] for line in apart.lines if line.get_gid() == "stands"])
    assert len(dots) == 2 * POSES, "two feet of a trot stand at every instant"
    np.testing.assert_allclose(dots, 0.0, atol=2e-6)


def test_snapshots_are_where_the_robot_is(trotting: Plan) -> None:
    along = figure_of(plot_snapshots(trotting, 4)).axes[0]
    expected = trotting.at(np.linspace(0.0, trotting.duration, 4)).feet
    for i, leg in enumerate(LEGS):
        feet = [line.get_xydata()[-1] for line in along.lines if line.get_gid() == leg]
        np.testing.assert_allclose(feet, expected[:, i][:, [0, 2]], atol=1e-12)


def test_a_walk_to_the_side_is_seen_from_ahead() -> None:
    sideways = plan_gait(FAST, trot(0.5), velocity=(0.0, 0.2), distance=0.3)
    np.testing.assert_allclose(side_axis(sideways), [0.0, 1.0], atol=1e-9)
    turning = plan_gait(FAST, trot(0.5), velocity=0.0, yaw_rate=0.5, duration=0.5, heading=0.3)
    np.testing.assert_allclose(side_axis(turning), [np.cos(0.3), np.sin(0.3)], atol=1e-9)


@pytest.mark.parametrize("wrong", [0, 101, 2.0, True])
def test_a_strange_number_of_snapshots_is_refused(trotting: Plan, wrong: object) -> None:
    with pytest.raises(InputError, match="whole number from 1 to 100"):
        plot_snapshots(trotting, wrong)  # type: ignore[arg-type]


# --- swing curves -----------------------------------------------------------------------------


def test_cycloids_have_the_numbers_of_fig_11() -> None:
    (ax,) = figure_of(plot_cycloids()).axes
    lines = {line.get_gid(): np.array(line.get_data_3d()).T for line in ax.lines if line.get_gid()}
    for gait, aside, dots in (("trot", 0.0, 21), ("walk", -WALK_OFFSET, 11)):
        line = lines[gait]
        np.testing.assert_allclose(line[0], [-10, -10 + aside, 0], atol=1e-9)
        np.testing.assert_allclose(line[-1], [40, 40 + aside, 0], atol=1e-9)
        assert line[:, 2].max() == pytest.approx(20.0, abs=2e-2)
        assert len(lines[f"{gait} dots"]) == dots
    np.testing.assert_allclose(lines["walk"] - [0.0, -WALK_OFFSET, 0.0], lines["trot"], atol=1e-9)
    assert float(paper_cycloid("walk").duration) == 0.25
    assert float(paper_cycloid("trot").duration) == 0.5


def test_the_cycloid_as_printed_overshoots_by_a_ninth_of_the_step() -> None:
    """[Wang2024], eq. (17) as printed: 10.9 % at each end, where ours stays between the ends."""
    printed = as_printed()[:, 0]
    assert (-10.0 - printed.min()) / 50.0 == pytest.approx(0.109, abs=5e-4)
    assert (printed.max() - 40.0) / 50.0 == pytest.approx(0.109, abs=5e-4)
    ours = 1e3 * paper_cycloid("trot").position(np.linspace(0.0, 0.5, 500))[:, 0]
    assert (np.diff(ours) > 0.0).all() and ours.min() >= -10.0 and ours.max() <= 40.0


def test_all_swing_curves_are_drawn_with_their_heights_and_largest_speeds() -> None:
    figure = figure_of(plot_swing_curves(0.12, 0.05, 0.3))
    *sides, over, speed = figure.axes
    assert [ax.get_title(loc="left") for ax in sides] == list(SWING_CURVES)
    for ax in sides:
        line = drawn(ax, ax.get_title(loc="left"))
        np.testing.assert_allclose(line[[0, -1]], [[0.0, 0.0], [120.0, 0.0]], atol=1e-9)
        assert line[:, 1].max() == pytest.approx(50.0, abs=1e-2) and ax.get_aspect() == 1.0
    for name in SWING_CURVES:
        assert drawn(over, name)[:, 1].max() == pytest.approx(50.0, abs=1e-4)
        top = drawn(speed, name)[:, 1].max()
        assert f"{name}: {top:.2f} m/s" in words(figure)


def test_the_rise_of_a_swing_is_drawn() -> None:
    (*sides, over, _) = figure_of(plot_swing_curves(0.1, 0.05, 0.3, rise=0.02)).axes
    for ax, name in zip(sides, SWING_CURVES, strict=True):
        assert drawn(ax, name)[-1, 1] == pytest.approx(20.0)
        assert drawn(over, name)[:, 1].max() == pytest.approx(70.0, abs=1e-2)


# --- zero moment point ------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["trotting", "flying", "walking"])
def test_the_smallest_zmp_margin_drawn_is_the_plans(
    name: str, request: pytest.FixtureRequest
) -> None:
    plan: Plan = request.getfixturevalue(name)
    times, zmp, margins, standing = zmp_line(plan)
    assert np.nanmin(margins) == pytest.approx(plan.record.zmp_margin, abs=2e-6)
    np.testing.assert_array_equal(np.isnan(margins), ~standing.any(axis=1))
    np.testing.assert_array_equal(np.isnan(zmp).any(axis=1), ~standing.any(axis=1))
    assert (margins[standing.sum(axis=1) == 2] <= 1e-12).all()
    assert times[0] == 0.0 and times[-1] == pytest.approx(plan.duration)


def test_the_zmp_is_where_the_centres_second_differences_put_it(walking: Plan) -> None:
    times, zmp, _, _ = zmp_line(walking)
    inside = times[(times > 0.1) & (times < walking.duration - 0.1)]
    step = 1e-4
    before, at, after = (walking.at(inside + k * step).cog for k in (-1, 0, 1))
    acceleration = (before - 2.0 * at + after)[:, :2] / step**2
    height = walking.settings.body_height + walking.robot.foot_radius
    expected = at[:, :2] - height / 9.81 * acceleration
    kept = np.isin(times, inside)
    assert np.hypot(*(expected - at[:, :2]).T).max() > 0.01
    np.testing.assert_allclose(zmp[kept], expected, atol=2e-4)


def test_at_constant_speed_the_zmp_lies_below_the_centre(trotting: Plan) -> None:
    times, zmp, _, _ = zmp_line(trotting)
    middle = np.abs(times - trotting.duration / 2.0) < 0.5
    centre = trotting.at(times[middle]).cog[:, :2]
    np.testing.assert_allclose(zmp[middle], centre, atol=1e-6)


def test_the_centres_acceleration_contains_that_of_a_turning_body(standing: Plan) -> None:
    """A centre that is not the base's origin, judged by second differences."""
    coefficients = np.random.default_rng(1).normal(scale=0.3, size=(6, 2, 18))
    robot = replace(FAST, centre=np.array([0.10, -0.05, 0.07]))
    plan = replace(standing, robot=robot, phases=(), path=MotionPath([0.0, 0.5, 1.0], coefficients))
    t, step = np.array([0.1, 0.2, 0.3, 0.4, 0.7, 0.9]), 1e-4
    before, at, after = (plan.at(t + k * step).cog for k in (-1, 0, 1))
    place, acceleration = centre_motion(plan, t)
    np.testing.assert_allclose(place, at, atol=1e-12)
    np.testing.assert_allclose(acceleration, (before - 2.0 * at + after) / step**2, atol=1e-5)


def test_supports_of_a_trot_are_lines_between_footholds_and_flight_is_shaded(
    flying: Plan,
) -> None:
    above, over = figure_of(plot_zmp(flying)).axes
    collections = {c.get_gid(): c for c in above.collections}
    segments = collections["lines"].get_segments()
    pairs = [p for p in flying.phases if len(p.support) == 2]
    assert len(segments) == len(pairs) > 4 and not collections["areas"].get_paths()
    holds = flying.footholds.array[..., :2].reshape(-1, 2)
    for end in np.concatenate(segments):
        assert np.hypot(*(holds - end).T).min() < 2e-6
    shaded = [p for p in over.patches if p.get_gid() == "flight"]
    flights = [p for p in flying.phases if not p.support]
    assert len(shaded) == len(flights) > 2
    for patch, phase in zip(shaded, flights, strict=True):
        span = patch.get_x(), patch.get_x() + patch.get_width()
        np.testing.assert_allclose(span, (phase.start, phase.end), atol=1e-12)
    assert "flight: no ZMP" in words(over.figure.figure)


def test_supports_of_a_wave_are_areas_that_hold_the_zmp() -> None:
    from matplotlib.path import Path as Outline

    plan = plan_gait(FAST, wave(1.6), velocity=0.05, distance=0.05)
    above, over = figure_of(plot_zmp(plan)).axes
    areas = next(c for c in above.collections if c.get_gid() == "areas").get_paths()
    assert len(areas) == len(plan.phases)
    times, zmp, _, _ = zmp_line(plan)
    for phase, area in zip(plan.phases, areas, strict=True):
        mine = (times > phase.start + 1e-6) & (times < phase.end - 1e-6)
        assert Outline(area.vertices).contains_points(zmp[mine]).all()
    assert drawn(over, "in an area")[:, 1].min() == pytest.approx(1e3 * plan.record.zmp_margin,
                                                                  abs=1e-2)  # fmt: skip


# --- all of them ------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["trotting", "flying", "short_plan"])
def test_every_panel_has_units_and_every_figure_a_legend(
    name: str, request: pytest.FixtureRequest
) -> None:
    plan: Plan = request.getfixturevalue(name)
    drawn = [plot_joint_curves(plan), plot_joint_curves(plan, derivatives=(0,)),
             plot_snapshots(plan), plot_swing_curves(), plot_zmp(plan)]  # fmt: skip
    for figure in map(figure_of, drawn):
        assert words(figure)
        for label in (f() for ax in figure.axes for f in (ax.get_xlabel, ax.get_ylabel)):
            assert not label or "[" in label
        assert any(ax.get_xlabel() for ax in figure.axes)


def test_files_are_small_and_pyplot_is_left_alone(trotting: Plan, tmp_path: Path) -> None:
    known = "matplotlib.pyplot" in sys.modules
    paths = save_gait_figures(trotting, tmp_path / "a" / "b")
    assert [p.stem for p in paths] == [
        "fig02_03_05_gait_diagram", "fig11_cycloids", "swing_curves", "fig12_snapshots",
        "fig13_joint_angles", "fig14_joint_curves", "zmp",
    ]  # fmt: skip
    assert {p.name for p in (tmp_path / "a" / "b").iterdir()} == {p.name for p in paths}
    for path in paths:
        assert path.read_bytes().startswith(b"\x89PNG") and path.stat().st_size < 300_000
    assert known or "matplotlib.pyplot" not in sys.modules


def test_a_plan_without_schedule_or_swings_is_drawn_without_their_figures(
    standing: Plan, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Only names are looked at.
    monkeypatch.setattr("gaitopt.viewing.figures.files.pixels_of", without_pixels)
    names = {p.stem for p in save_gait_figures(standing, tmp_path)}
    assert names == {"fig11_cycloids", "fig12_snapshots", "fig13_joint_angles",
                     "fig14_joint_curves", "zmp"}  # fmt: skip


def test_a_folder_that_cannot_be_made_is_refused_by_gait_figures(
    trotting: Plan, tmp_path: Path
) -> None:
    (tmp_path / "file").write_text("x")
    with pytest.raises(InputError, match="cannot make the folder"):
        save_gait_figures(trotting, tmp_path / "file" / "figures")
    assert [p.name for p in tmp_path.iterdir()] == ["file"]
