"""Whether feet stood on their footholds is judged by all calls of the controller."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

import gaitopt
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
