"""Fig. 7 shows what the plan does: nine points, and a body that moves back and forth."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest

from gaitopt import InputError, load_robot
from gaitopt.plan.plan import Plan
from gaitopt.planners.over_obstacle import planner
from gaitopt.terrain.obstacles import rectangular_obstacle
from gaitopt.viewing.figures.panels import figure_of
from gaitopt.viewing.figures.posture import (
    cog_cycle,
    front_strides,
    plot_posture,
    striding_cycle,
)
from gaitopt.viewing.figures.snapshots import plot_stride_snapshots

plan_stride = partial(planner.plan_stride, timing="velocity")


@pytest.fixture(scope="module")
def walk() -> Plan:
    return plan_stride(load_robot("frog1"), rectangular_obstacle(0.05, 0.04), leave=0)


def test_points_are_lift_offs_and_touchdowns(walk: Plan) -> None:
    cycle = cog_cycle(walk, 1)
    assert cycle.point_times.shape == (9,)
    assert (np.diff(cycle.point_times) >= 0.0).all()
    assert [s.leg for s in cycle.swings] == ["RF", "LH", "LF", "RH"]
    durations = cycle.point_times[2::2] - cycle.point_times[1::2]
    assert durations == pytest.approx([s.duration for s in cycle.swings])


def test_the_body_of_a_pitch_pitch_robot_keeps_to_its_line(walk: Plan) -> None:
    """Back before RF lifts off, forward before LH does; nothing moves sideways, not even masses."""
    cycle = cog_cycle(walk, 0)
    assert np.abs(cycle.centre[:, 1]).max() < 1e-8
    ahead = np.interp(cycle.point_times, cycle.times, cycle.centre[:, 0])
    assert ahead[1] < ahead[0] < ahead[3]
    assert np.abs(cycle.com[:, 1]).max() < 1e-8
    assert np.ptp(cycle.com[:, 2]) > 1e-3


def test_the_striding_cycle_is_that_of_the_front_legs(walk: Plan) -> None:
    cycle = striding_cycle(walk)
    swings = walk.swings[4 * cycle : 4 * cycle + 4]
    over = [s.leg for s in swings if s.foot_start[0] < 0.0 < s.foot_end[0]]
    assert over == ["RF", "LF"]


def test_a_robot_that_sways_is_seen_from_above_and_one_that_does_not_from_the_side(
    walk: Plan,
) -> None:
    swaying = plan_stride(load_robot("anymal_c"), rectangular_obstacle(0.05, 0.03), approach=0,
                          leave=0)  # fmt: skip
    for plan, label in ((walk, "up [mm]"), (swaying, "to the left [mm]")):
        assert [ax.get_ylabel() for ax in figure_of(plot_posture(plan)).axes[:2]] == [label, label]


def test_the_figure_numbers_its_points_from_0_to_8(walk: Plan) -> None:
    figure = figure_of(plot_posture(walk))
    assert len(figure.axes) == 4
    for ax in figure.axes:
        assert [t.get_text() for t in ax.texts] == [str(k) for k in range(9)]
    lines = {line.get_gid(): line for line in figure.axes[1].lines}
    drawn = np.array(lines["com"].get_xdata()) / 1e3
    assert drawn == pytest.approx(cog_cycle(walk, striding_cycle(walk)).com[:, 0])


def test_plans_without_an_obstacle_and_cycles_that_are_none_are_refused(
    walk: Plan, short_plan: Plan
) -> None:
    with pytest.raises(InputError, match="no obstacle"):
        plot_posture(short_plan)
    with pytest.raises(InputError, match="cycle must be a whole number from 0 to"):
        cog_cycle(walk, 99)


def test_snapshots_show_both_front_feet_over_the_board(walk: Plan) -> None:
    """The rows of Fig. 8: lift-off before the board, touchdown behind it, above it in between."""
    drawn = plot_stride_snapshots(walk)
    assert drawn.shape == (2, 5)
    for row, leg in zip(drawn, ("RF", "LF"), strict=True):
        feet = [next(line for line in ax.lines if line.get_gid() == leg).get_xydata()[-1]
                for ax in row]  # fmt: skip
        x, z = np.array(feet).T
        assert x[0] < -0.02 and x[-1] > 0.02 and (np.diff(x) > -1e-9).all()
        assert z[2] > walk.settings.obstacles[0].height and z[0] == pytest.approx(z[-1])
        assert row[0].get_title(loc="left").startswith(leg)


def test_both_front_feet_stand_equally_far_behind_the_board(walk: Plan) -> None:
    """The paper's do not, which it explains by clearance and slip."""
    first, second = front_strides(walk)
    assert first.foot_end[0] == pytest.approx(second.foot_end[0], abs=1e-9)


def test_strides_need_an_obstacle(short_plan: Plan) -> None:
    with pytest.raises(InputError, match="no obstacle"):
        plot_stride_snapshots(short_plan)
