"""Whether feet stood on their footholds is judged by all calls of the controller."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

import gaitopt
from gaitopt.plan.record import RouteRecord
from gaitopt.planners.time_optimal import planner
from gaitopt.simulation.landings import Looks, landings
from gaitopt.simulation.result import MissReason

pytest.importorskip("mujoco")


@pytest.fixture(scope="module")
def twice_in_a_row() -> gaitopt.Plan:
    """A smooth walk in which each leg steps twice in a row, and stands for 12 ms in between."""
    robot = gaitopt.load_robot("go2")
    columns = gaitopt.s_columns(0, columns=3, robot=robot)
    order = ("RH", "RH", "RF", "RF", "LH", "LH", "LF", "LF")
    return gaitopt.plan_route(robot, columns, free="swing", sequence=order)


def test_stances_between_two_samples_of_the_motion_count(twice_in_a_row: gaitopt.Plan) -> None:
    """Stances of 10 ms are seen, and what is seen does not hang on how often motion is recorded."""
    swings = twice_in_a_row.swings
    stood = [after.start - before.end for before, after in pairwise(swings)
             if before.leg == after.leg]  # fmt: skip
    assert min(stood) < gaitopt.SimulationSettings().record_every
    found = [gaitopt.simulate(twice_in_a_row, gaitopt.SimulationSettings(record_every=every))
             for every in (0.02, 0.3)]  # fmt: skip
    assert [each.missed for each in found] == [(), ()]
    np.testing.assert_array_equal(found[0].landing_errors, found[1].landing_errors)


def test_an_order_in_which_feet_hardly_stand_is_told(
    twice_in_a_row: gaitopt.Plan, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A foot that is to stand for less than an interval of the controller does not come down."""
    assert not planner.hardly_stands(twice_in_a_row)
    monkeypatch.setattr(planner, "LEAST_STANCE", 0.05)
    assert planner.hardly_stands(twice_in_a_row)
    # A walk phase by phase waits in physics where a foot lifts off as it lands.
    assert isinstance(twice_in_a_row.record, RouteRecord)
    boxes = replace(twice_in_a_row.record, instead="the walk phase by phase is faster")
    assert not planner.hardly_stands(replace(twice_in_a_row, record=boxes))


def test_a_foot_that_lands_where_the_clock_stands_still_is_seen(
    twice_in_a_row: gaitopt.Plan,
) -> None:
    """Also where the clock stands a rounding before the touch-down."""
    plan, first = twice_in_a_row, twice_in_a_row.swings[0]
    clock = np.array([0.0, first.end - 1e-12, first.end - 1e-12, plan.swings[1].start + 1e-3])
    q = plan.at(clock).q
    columns = np.arange(12).reshape(4, 3)
    beneath = np.tile(columns[:, 0], (4, 1))
    beneath[:, gaitopt.LEGS.index(first.leg)] = [
        -1,
        *[columns[gaitopt.LEGS.index(first.leg), 1]] * 2,
        -1,
    ]
    looks = Looks(np.array([0.0, 0.1, 0.2, 0.21]), clock, q, beneath)
    assert landings(plan, looks, columns, gaitopt.SimulationSettings())[0][1] is None


def test_feet_that_do_not_stand_are_missed(twice_in_a_row: gaitopt.Plan) -> None:
    """A foot in the air during one short stance, and one that leaves, are told by step."""
    plan, clock = twice_in_a_row, np.arange(0.0, twice_in_a_row.duration + 0.4, 0.006)
    planned = plan.at(np.minimum(clock, plan.duration))
    columns = np.arange(12).reshape(4, 3)
    counts = np.array([[sum(s.leg == leg and s.end <= t for s in plan.swings)
                        for leg in gaitopt.LEGS] for t in clock])  # fmt: skip
    beneath = np.where(planned.contacts, columns[np.arange(4), counts], -1)
    settings = gaitopt.SimulationSettings()
    looks = Looks(clock, clock, planned.q, beneath)
    assert all(miss is None for _, miss in landings(plan, looks, columns, settings))
    first = plan.swings[0]
    leg = gaitopt.LEGS.index(first.leg)
    short = (clock >= first.end) & (clock < plan.swings[1].start)
    lifted = np.array(beneath)
    lifted[short, leg] = -1
    [miss] = [miss for _, miss in landings(plan, Looks(clock, clock, planned.q, lifted), columns,
                                           settings) if miss is not None]  # fmt: skip
    assert (miss.step, miss.leg, miss.reason) == (0, first.leg, MissReason.NO_CONTACT)
    lifted = np.array(beneath)
    lifted[clock > clock[-1] - 0.1, leg] = -1
    [miss] = [miss for _, miss in landings(plan, Looks(clock, clock, planned.q, lifted), columns,
                                           settings) if miss is not None]  # fmt: skip
    assert (miss.step, miss.leg, miss.reason) == (1, first.leg, MissReason.LEFT)
