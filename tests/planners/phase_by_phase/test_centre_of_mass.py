"""Walks whose margin is that of the true centre of mass, and physics' word on the default walk."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

import gaitopt
from gaitopt import Plan
from gaitopt.plan.com_margin import margins_over

Array = NDArray[np.float64]


def walk(name: str, **options: str) -> Plan:
    robot = gaitopt.load_robot(name)
    return gaitopt.plan_crawl(robot, gaitopt.s_columns(0, columns=3, robot=robot), **options)


def in_swings(plan: Plan) -> Array:
    """Dense instants at which a foot is in the air."""
    swings = [p for p in plan.phases if p.kind == "swing"]
    return np.concatenate([np.linspace(p.start, p.end, 202)[1:-1] for p in swings])


@pytest.fixture(scope="module", params=["go2", "anymal_c"])
def default(request: pytest.FixtureRequest) -> Plan:
    return walk(request.param)


def test_phases_tell_the_margin_of_the_true_centre_of_mass(default: Plan) -> None:
    asked = default.settings.stability_margin
    assert asked <= default.margin < asked + 1e-4
    assert "true centre of mass" in default.record.stability
    for phase in default.phases:
        if phase.duration > 0.0:
            inside = np.linspace(phase.start, phase.end, 202)[1:-1]
            found = gaitopt.com_margin(default, inside)[1].min()
            assert phase.margin == pytest.approx(found, abs=2e-4)


def test_the_true_centre_of_mass_keeps_the_margin(default: Plan) -> None:
    """And the optimum has no more than it has to, up to the reserve between samples."""
    settings = default.settings
    assert settings.timing == "forces" and settings.true_com
    assert settings.stability_margin == round(0.07 * default.robot.standing_height, 4)
    margins = gaitopt.com_margin(default, in_swings(default))[1]
    assert settings.stability_margin <= margins.min() < settings.stability_margin + 1e-4


@pytest.mark.parametrize("name", ["go2", "anymal_c", "a1"])
def test_the_body_centre_s_margin_is_not_that_of_the_true_one(name: str) -> None:
    """The legs' mass wanders by millimetres in the body."""
    plan = walk(name, com="body", timing="velocity")
    times = in_swings(plan)
    motion = plan.at(times)
    asked = plan.settings.stability_margin
    assert margins_over(motion, motion.cog).min() == pytest.approx(asked, abs=1e-6)
    assert gaitopt.com_margin(plan, times)[1].min() < asked - 1e-3
    certificate = gaitopt.verify(plan, collisions=False)
    assert certificate["margin of the body centre"].limit == pytest.approx(asked, abs=2e-6)
    # Of the true centre of mass no more is promised than that it is over the feet.
    assert certificate["margin of the true COM"].limit == 0.0


def test_com_goes_with_both_timings(default: Plan) -> None:
    """The margin does not depend on the timing, only on the course."""
    plan = gaitopt.plan_crawl(
        default.robot, default.footholds, com="model", timing="velocity",
        stability_margin=default.settings.stability_margin,
    )  # fmt: skip
    assert plan.duration < default.duration
    margins = gaitopt.com_margin(plan, in_swings(plan))[1]
    assert margins.min() >= plan.settings.stability_margin
    np.testing.assert_allclose(
        [p.cog_end for p in plan.phases], [p.cog_end for p in default.phases], atol=1e-9
    )


def test_with_forces_the_body_centre_may_keep_the_margin_all_the_same() -> None:
    plan = walk("go2", com="body")
    motion = plan.at(in_swings(plan))
    least = margins_over(motion, motion.cog).min()
    assert least == pytest.approx(plan.settings.stability_margin, abs=1e-6)
    assert gaitopt.verify(plan, collisions=False)["contact forces"].status == "ok"


def test_the_default_walk_of_go2_is_walked_in_physics() -> None:
    plan = walk("go2")
    result = gaitopt.simulate(plan)
    assert result.succeeded and result.rates_within, str(result)
