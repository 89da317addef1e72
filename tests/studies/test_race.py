"""The race: rows, ratios, failures, many terrains."""

from __future__ import annotations

import csv
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gaitopt
from gaitopt import Footholds, InputError, Quadruped
from gaitopt.plan.record import RouteRecord
from gaitopt.plan.settings.freedoms import VARIANTS, Freedoms
from gaitopt.planners.time_optimal.planner import plan_route
from gaitopt.studies.race import race, race_many, row_names
from gaitopt.studies.race_lanes import Lane, Race
from gaitopt.studies.race_standings import PAPER, PHASES, SSM, Finish, Standings, race_table
from gaitopt.studies.tables import as_text
from gaitopt.terrain.columns import s_columns

STATIC = ("ssm", "route", "overlap", "swing", "height", "posture")


@pytest.fixture(scope="module")
def terrain() -> Footholds:
    return gaitopt.s_columns(0, columns=3)


@pytest.fixture(scope="module")
def short(wang: Quadruped, terrain: Footholds) -> Race:
    """All static rows over eight steps."""
    return race(wang, terrain, STATIC)


def by_hand(*finishes: Finish) -> Standings:
    rows = tuple(dict.fromkeys(f.row for f in finishes))
    return Standings("robot", 8, rows, finishes, {})


# ---------------------------------------------------------------- rows


def test_all_rows_start_with_the_two_baselines() -> None:
    assert row_names() == (SSM, PAPER, *VARIANTS)


def test_the_papers_row_is_always_there_and_the_tables_order_is_kept() -> None:
    assert row_names(["posture", " swing ", "ssm"]) == (SSM, PAPER, "swing", "posture")
    assert row_names(["paper"]) == row_names([]) == (PAPER,)


def test_a_row_that_the_planner_gains_is_raced(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(VARIANTS, "new", Freedoms(overlap=True, height=True))
    assert row_names()[-1] == "new"


def test_an_unknown_row_is_named_with_those_there_are() -> None:
    with pytest.raises(InputError, match="rows names 'quick'; there are ssm, paper, route"):
        row_names(["quick"])


# ---------------------------------------------------------------- one terrain


def test_lanes_hold_the_planners_own_plans(
    short: Race, wang: Quadruped, terrain: Footholds
) -> None:
    assert [lane.name for lane in short.lanes] == list(row_names(STATIC))
    assert (
        short[SSM].plan.duration
        == gaitopt.plan_crawl(wang, terrain, objective="margin", timing="velocity").duration
    )  # type: ignore[union-attr]
    assert (
        short[PAPER].plan.duration == gaitopt.plan_crawl(wang, terrain, timing="velocity").duration
    )  # type: ignore[union-attr]
    swing = plan_route(wang, terrain, free="swing", timing="velocity")
    assert short.plans["swing"].duration == pytest.approx(swing.duration, rel=1e-9)
    assert short.ratio("swing") == pytest.approx(short.plans[PAPER].duration / swing.duration)


def test_a_row_with_more_freedom_is_faster(short: Race) -> None:
    """Each row can walk as the one before it does, but for what the knots between cost."""
    times = [plan.duration for plan in short.plans.values()]
    assert len(times) == 7
    assert all(after < 1.01 * before for before, after in pairwise(times))
    assert short.ratio("posture") > 4.5


def test_every_row_keeps_its_promises_and_its_margin(short: Race) -> None:
    for finish in short.standings.finishes:
        assert (finish.verdict, finish.message) == ("kinematics only", "")
        assert finish.margin >= 0.02 - 1e-9 and not finish.dynamic
        assert finish.solve_time > 0


def test_settings_reach_all_planners(wang: Quadruped) -> None:
    found = race(wang, gaitopt.s_columns(1, columns=2), ["swing"], certify=False,
                 stability_margin=0.03, body_height=0.42)  # fmt: skip
    for plan in found.plans.values():
        assert (plan.settings.stability_margin, plan.settings.body_height) == (0.03, 0.42)
        assert plan.margin >= 0.03 - 1e-9
    assert {f.verdict for f in found.standings.finishes} == {"unchecked"}


def test_progress_counts_rows(wang: Quadruped) -> None:
    seen: list[tuple[int, int]] = []
    race(wang, gaitopt.s_columns(1, columns=2), ["ssm"], certify=False,
         progress=lambda a, b: seen.append((a, b)))  # fmt: skip
    assert seen == [(1, 2), (2, 2)]


def test_a_gait_balanced_by_its_zmp_is_judged_by_it() -> None:
    robot = gaitopt.load_robot("wang2020-fast")
    plan = gaitopt.plan_gait(
        robot, gaitopt.trot(0.5), velocity=(0.2, 0.0), distance=0.2, timing="velocity"
    )
    finish = Lane("dynamic", plan, "", 1.0, None).finish()
    assert finish.dynamic and finish.margin == plan.record.zmp_margin
    assert "ZMP" in str(by_hand(finish))


# ---------------------------------------------------------------- the lower bound


def test_no_walk_with_as_much_freedom_stays_below_the_bound(
    short: Race, wang: Quadruped, terrain: Footholds
) -> None:
    """A row's bound holds for rows with less freedom, larger margins and short horizons, too."""
    names = ("overlap", "swing", "height", "posture")
    for i, name in enumerate(names):
        for other in (SSM, PAPER, "route", *names[: i + 1]):
            assert short[name].bound <= short.plans[other].duration
    safer = plan_route(wang, terrain, free="swing", stability_margin=0.03, timing="velocity")
    in_windows = plan_route(wang, terrain, free="swing", horizon=4, timing="velocity")
    assert short["swing"].bound < min(safer.duration, in_windows.duration)


def test_rows_are_near_their_bounds_where_there_are_any(short: Race) -> None:
    for row in ("overlap", "swing", "height", "posture"):
        assert 0.0 <= short.standings.gaps(row)[0] < 0.15
    for row in (SSM, PAPER):
        assert np.isnan(short[row].bound) and np.isnan(short.standings.gaps(row)[0])


def test_bounds_are_left_out_on_demand(wang: Quadruped) -> None:
    found = race(wang, gaitopt.s_columns(1, columns=2), ["swing"], certify=False, bound=False)
    assert np.isnan(found["swing"].bound) and "gap" not in str(found)


# ---------------------------------------------------------------- with contact forces


@pytest.fixture(scope="module")
def with_forces(wang: Quadruped) -> Race:
    ground = gaitopt.s_columns(0, columns=2)
    return race(wang, ground, ["ssm", "phases", "route", "swing"], timing="forces")


def test_with_forces_all_rows_but_the_paper_s_are_certified(with_forces: Race) -> None:
    verdicts = with_forces.standings.verdicts
    assert list(verdicts) == [SSM, PAPER, PHASES, "route", "swing"]
    assert verdicts.pop(PAPER) == "kinematics only" and set(verdicts.values()) == {"certified"}
    for name, plan in with_forces.plans.items():
        assert (plan.settings.promised_forces is None) == (name == PAPER)
        # One margin for all, of the body centre in the paper's row.
        assert plan.settings.stability_margin == pytest.approx(0.02)


def test_the_paper_s_row_is_the_same_with_forces(with_forces: Race, wang: Quadruped) -> None:
    paper = gaitopt.plan_crawl(wang, with_forces.footholds, timing="velocity")
    assert with_forces.plans[PAPER].duration == paper.duration
    phases = gaitopt.plan_crawl(
        wang, with_forces.footholds, stability_margin=paper.settings.stability_margin,
        body_height=paper.settings.body_height,
    )  # fmt: skip
    assert with_forces.plans[PHASES].duration == pytest.approx(phases.duration, rel=1e-9)
    assert with_forces.ratio(PHASES) == pytest.approx(paper.duration / phases.duration)


def test_with_forces_bounds_are_those_of_free_swings(with_forces: Race) -> None:
    assert np.isnan(with_forces["route"].bound) and np.isnan(with_forces[PHASES].bound)
    assert 0.0 < with_forces["swing"].bound <= with_forces.plans["swing"].duration


def test_the_table_tells_what_forces_bound(with_forces: Race) -> None:
    text = " ".join(str(with_forces).split())
    assert "kinematics only" in text and "certified" in text
    assert "the paper: timed by joint velocities" in text
    many = by_hand(*(Finish(s, "swing", 5.0, verdict=v)
                     for s, v in enumerate(["certified", "violated", "certified"])))  # fmt: skip
    assert "2 certified, 1 violated" in str(replace(many, timing="forces"))


def test_a_walk_phase_by_phase_in_another_row_is_told(with_forces: Race) -> None:
    plan = with_forces.plans["swing"]
    record = plan.record
    assert isinstance(record, RouteRecord)
    told = replace(plan, record=replace(record, instead="it is faster"))
    lane = replace(with_forces["swing"], plan=told)
    assert lane.finish().message == "phase by phase: it is faster"


def test_limits_on_forces_need_forces(wang: Quadruped) -> None:
    with pytest.raises(InputError, match="limits of the timing 'forces'"):
        race(wang, gaitopt.s_columns(0, columns=2), ["swing"], forces=gaitopt.ForceLimits())


@pytest.mark.parametrize(("name", "value"), [("forces", 3), ("com", "feet")])
def test_settings_that_the_paper_does_not_take_are_refused_before_any_row(
    wang: Quadruped, name: str, value: Any
) -> None:
    ground = gaitopt.s_columns(0, columns=2)
    with pytest.raises(InputError, match=f"^{name} must be"):
        race(wang, ground, ["swing"], timing="forces", **{name: value})
    with pytest.raises(InputError, match="timing"):
        race(wang, gaitopt.s_columns(0, columns=2), ["swing"], timing="guess")
    with pytest.raises(InputError, match="rows names 'phases'"):
        row_names(["phases"])


# ---------------------------------------------------------------- what goes wrong


def test_rows_that_fail_say_why_and_the_others_go_on(wang: Quadruped) -> None:
    columns = gaitopt.s_columns(0, columns=2)
    found = race(wang, columns, ["dynamic", "ssm"], certify=False, speed=0.05)
    assert found["dynamic"].plan is None and "no setting 'speed'" in found["dynamic"].error
    assert list(found.plans) == [SSM, PAPER]
    assert np.isnan(found.ratio("dynamic")) and found.ratio(SSM) < 1
    assert "dynamic: failed: RouteSettings has no setting 'speed'" in str(found)


def test_a_terrain_that_no_row_can_walk_is_named_once(wang: Quadruped) -> None:
    found = race(wang, gaitopt.s_columns(0, columns=2), ["ssm", "swing"], stability_margin=0.3)
    assert found.plans == {} and {f.verdict for f in found.standings.finishes} == {"failed"}
    text = " ".join(str(found).split())
    assert text.count("inscribed circle") == 1 and f"{SSM}, {PAPER}, swing: failed:" in text


def test_a_setting_out_of_range_is_the_users_mistake(wang: Quadruped) -> None:
    with pytest.raises(InputError, match="stability_margin"):
        race(wang, gaitopt.s_columns(0, columns=2), ["swing"], stability_margin=-1.0)


def test_a_violated_plan_is_shown_as_such(short: Race) -> None:
    """A claim of a larger margin than was planned for."""
    plan = short.plans[PAPER]
    claim = replace(plan, settings=replace(plan.settings, stability_margin=0.0201))
    finish = Lane(PAPER, claim, "", 0.1, gaitopt.verify(claim, collisions=False)).finish()
    assert finish.verdict == "violated" and "margin of the body centre" in finish.message


def test_a_lane_is_found_by_name(short: Race) -> None:
    assert short["swing"].name == "swing"
    with pytest.raises(KeyError, match="no row 'fly'; there are SSM baseline, the paper"):
        short["fly"]


# ---------------------------------------------------------------- many terrains


def test_many_terrains_are_the_races_on_each(wang: Quadruped, tmp_path: Path) -> None:
    table, seen = tmp_path / "race.csv", list[tuple[int, int]]()
    found = race_many(wang, [4, 7], ["swing"], columns=2, jobs=2, collisions=False, table=table,
                      bound=False, progress=lambda a, b: seen.append((a, b)))  # fmt: skip
    assert seen == [(k, 4) for k in range(1, 5)]
    assert found.seeds == (4, 7) and found.steps == 4
    for k, seed in enumerate((4, 7)):
        alone = race(wang, s_columns(seed, columns=2, robot=wang), ["swing"], certify=False)
        assert found.ratios("swing")[k] == pytest.approx(alone.ratio("swing"), rel=1e-6)
    assert list(found.plans) == [PAPER, "swing"]
    assert np.array_equal(found.plans["swing"].footholds.array,
                          s_columns(4, columns=2, robot=wang).array)  # fmt: skip
    with table.open(newline="") as stream:
        lines = list(csv.DictReader(stream))
    assert sorted((x["seed"], x["row"], x["verdict"]) for x in lines) == sorted(
        (str(s), row, "kinematics only") for s in (4, 7) for row in (PAPER, "swing")
    )


def test_no_terrain_and_no_table_are_refused(wang: Quadruped, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="at least one seed"):
        race_many(wang, [])
    with pytest.raises(InputError, match="cannot write the table"):
        race_many(wang, [1], ["paper"], table=tmp_path / "none" / "t.csv")


def test_ratios_are_taken_terrain_by_terrain() -> None:
    """The median of the ratios, which is not the ratio of the medians."""
    times = {PAPER: (100.0, 40.0, 60.0), "swing": (50.0, 30.0, 20.0)}
    found = by_hand(*(Finish(s, row, t[s], verdict="certified") for row, t in times.items()
                      for s in range(3)))  # fmt: skip
    assert found.ratios("swing").tolist() == pytest.approx([2.0, 4.0 / 3.0, 3.0])
    text = str(found)
    assert "2.00 (1.33 .. 3.00)" in text and "60.0 (40.0 .. 100.0)" in text
    assert "3 of 3" in text and "of 3 terrains" in text


def test_a_failed_terrain_does_not_hide_the_others() -> None:
    found = by_hand(Finish(0, PAPER, 10.0), Finish(1, PAPER, 12.0, verdict="certified"),
                    Finish(0, "swing", 5.0, verdict="certified"),
                    Finish(1, "swing", message="step 3 [bold]lost[/]"))  # fmt: skip
    assert np.array_equal(found.ratios("swing"), [2.0, np.nan], equal_nan=True)
    text = " ".join(str(found).split())
    assert "1 of 2" in text
    assert "swing, seed 1: failed: step 3 [bold]lost[/]" in text


def test_the_table_of_many_terrains_fits_a_wide_terminal() -> None:
    rows = (SSM, PAPER, "route", "dynamic")
    found = by_hand(*(Finish(s, row, 300.0 + s, 0.00474, 290.0, 12.34, 0.0201, row == "dynamic",
                             "certified") for row in rows for s in range(100)))  # fmt: skip
    assert "…" not in str(found) and "100 of 100" in str(found)


def test_many_reasons_are_counted() -> None:
    found = by_hand(*(Finish(s, PAPER, message=f"reason {s}") for s in range(9)))
    assert "reason 4" in str(found) and "reason 5" not in str(found) and "and 4 more" in str(found)


def test_the_table_has_its_units(short: Race) -> None:
    text = as_text(race_table(short.standings))
    for words in ("time [s]", "speed [mm/s]", "× the paper", "× SSM", "planning [s]",
                  "margin [mm]", "checks hold", "8 steps"):  # fmt: skip
        assert words in text
    assert "terrains" not in text and "gap [%]" in text


def test_a_column_without_numbers_is_left_out() -> None:
    text = str(by_hand(Finish(-1, PAPER, 10.0, verdict="unchecked")))
    assert "time [s]" in text and "gap" not in text and "× SSM: " in text
    assert "× SSM ┃" not in text
