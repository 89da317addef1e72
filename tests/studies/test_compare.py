"""Table II."""

from __future__ import annotations

import numpy as np
import pytest

import gaitopt
from gaitopt import Comparison, Footholds, InfeasibleStepError, InputError, Plan, Quadruped
from gaitopt.cli.robot_table import robot_tables
from gaitopt.plan.settings.crawl import CrawlSettings
from gaitopt.studies.compare import METHODS, compare
from gaitopt.studies.tables import as_text
from gaitopt.terrain.columns import s_columns


@pytest.fixture(scope="module")
def one(wang: Quadruped, columns: Footholds) -> Comparison:
    return compare(wang, columns)


def test_outcomes_are_the_plans_figures(one: Comparison, plan: Plan) -> None:
    first = one.outcomes[0]
    assert first.time == pytest.approx(plan.duration, rel=1e-12)
    assert first.mean_speed == pytest.approx(1e-3 * 6.99, rel=1e-2)
    swings = sum(p.duration for p in plan.phases if p.kind == "swing")
    assert first.swing_share == pytest.approx(swings / plan.duration)
    assert first.cog_distance == pytest.approx(
        sum(float(np.linalg.norm(p.cog_end - p.cog_start)) for p in plan.phases)
    )
    assert first.margin == pytest.approx(0.02, abs=1e-9)
    assert first.com_margin == pytest.approx(float(gaitopt.com_margin(plan)[1].min()))


def test_table_two_gains_less_than_printed(one: Comparison) -> None:
    """[Wang2020], Table II: +40 to +50 % over SSM, not 81.6; 272 s at 66 mm/s, not at 5."""
    gains = {m.name: float(one.speed_up(m.name)[0]) for m in METHODS}
    assert gains["proposed"] == 0.0
    assert 0.40 < gains["SSM"] < 0.55
    assert float(one.values("fixed 66 mm/s", "time")[0]) == pytest.approx(272, abs=8)
    assert float(one.values("fixed 50 mm/s", "time")[0]) == pytest.approx(360, abs=15)
    assert float(one.values("fixed 5 mm/s", "time")[0]) > 1792


def test_the_table_says_it_all(one: Comparison) -> None:
    text = str(one)
    for words in ("proposed", "SSM", "(205)", "(372)", "(272)", "(81.6)", "(32.8)", "true COM"):
        assert words in text
    assert str(one.plans["SSM"].duration)[:5] in text


def test_with_forces_all_methods_promise_them(wang: Quadruped) -> None:
    ground = gaitopt.s_columns(0, columns=2)
    found = compare(wang, ground, methods=METHODS[:2], timing="forces")
    for method, plan in zip(METHODS, found.plans.values(), strict=False):
        assert plan.settings.promised_forces is not None
        assert isinstance(plan.settings, CrawlSettings)
        assert plan.settings.objective == method.objective
        assert found.values(method.name, "com_margin")[0] >= plan.settings.stability_margin
    assert "Table II, timed by contact forces" in str(found) and "(205)" not in str(found)


def test_several_terrains_give_mean_and_spread(wang: Quadruped) -> None:
    terrains = [(s, gaitopt.s_columns(s, columns=3)) for s in range(4)]
    seen: list[tuple[int, int]] = []
    found = compare(wang, terrains, methods=METHODS[:2],
                    progress=lambda a, b: seen.append((a, b)))  # fmt: skip
    assert found.seeds == (0, 1, 2, 3)
    assert seen == [(k, 8) for k in range(1, 9)]
    times = found.values("proposed", "time")
    assert f"{times.mean():.1f} ± {times.std(ddof=1):.1f}" in str(found)
    assert found.speed_up("SSM") == pytest.approx(found.values("SSM", "time") / times - 1)


def test_a_terrain_that_cannot_be_walked_is_counted_and_told(wang: Quadruped) -> None:
    good = gaitopt.s_columns(0, columns=2)
    far = Footholds({leg: good[leg] * [[1, 1, 1], [9, 1, 1]] for leg in gaitopt.LEGS})
    found = compare(wang, [(1, far), (2, good)])
    assert found.seeds == (2,) and [seed for seed, _ in found.infeasible] == [1]
    assert "1 terrains left out as infeasible (seeds 1)" in " ".join(str(found).split())
    with pytest.raises(InfeasibleStepError):
        compare(wang, far)


def test_nothing_to_compare_is_refused(wang: Quadruped) -> None:
    with pytest.raises(InputError, match="at least one terrain"):
        compare(wang, [])


def test_wang2020s_own_terrain_is_the_default_one(wang: Quadruped) -> None:
    assert s_columns(4, robot=wang) == gaitopt.s_columns(4)


def test_a_robot_is_described() -> None:
    text = "".join(map(as_text, robot_tables(gaitopt.load_robot("anymal_c"))))
    assert "LF_HAA" in text and "agree to" in text and "52.13 kg" in text
