"""The timing in settings, and in plan files from before there were timings."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gaitopt
from gaitopt import CrawlSettings, ForceLimits, GaitSettings, InputError, Plan, RouteSettings
from gaitopt.plan.settings.by_name import settings_from_dict
from gaitopt.plan.settings.over_obstacle import StrideSettings

OVER_FOOTHOLDS = (CrawlSettings, RouteSettings)
ALL = (*OVER_FOOTHOLDS, GaitSettings, StrideSettings)
LOW = replace(ForceLimits(), friction=0.4)


@pytest.mark.parametrize("kind", OVER_FOOTHOLDS)
def test_walks_over_footholds_are_timed_by_forces_by_default(kind: Any) -> None:
    settings = kind()
    assert settings.timing == "forces" and settings.com == "model"
    assert settings.forces == settings.promised_forces == ForceLimits()
    assert kind(forces=LOW).promised_forces == LOW


@pytest.mark.parametrize("kind", OVER_FOOTHOLDS)
def test_by_velocity_nothing_is_said_of_forces(kind: Any) -> None:
    settings = kind(timing="velocity")
    assert settings.com == "body" and settings.promised_forces is None


def test_gaits_promise_forces_by_default_and_then_sway() -> None:
    settings = GaitSettings()
    assert settings.timing == "forces" and settings.promised_forces == ForceLimits()
    assert settings.sway and not GaitSettings(timing="velocity").sway
    robot = gaitopt.load_robot("a1")
    asked = {"schedule": gaitopt.trot(0.5), "velocity": 0.1, "duration": 1.0}
    assert GaitSettings.for_robot(robot, **asked).lead == 0.25
    slow = GaitSettings.for_robot(robot, timing="velocity", **asked)
    assert (slow.sway, slow.lead, slow.forces) == (False, 0.0, None)


def test_striding_promises_forces_by_default_with_a_larger_margin() -> None:
    assert StrideSettings().promised_forces == ForceLimits()
    robot = gaitopt.load_robot("anymal_c")
    margins = [StrideSettings.for_robot(robot, timing=t).stability_margin
               for t in (None, "forces", "velocity")]  # fmt: skip
    height = robot.standing_height
    assert margins == [round(0.07 * height, 4)] * 2 + [round(0.02 * min(1.0, height / 0.4), 4)]


@pytest.mark.parametrize("name", ["wang2020", "go2", "anymal_c"])
@pytest.mark.parametrize("kind", OVER_FOOTHOLDS)
def test_forces_ask_for_a_larger_margin(kind: Any, name: str) -> None:
    robot = gaitopt.load_robot(name)
    height = robot.standing_height
    assert kind.for_robot(robot).stability_margin == round(0.07 * height, 4)
    assert kind.for_robot(robot, timing=None).stability_margin == round(0.07 * height, 4)
    slow = kind.for_robot(robot, timing="velocity")
    assert slow.stability_margin == round(0.05 * height, 4)
    assert kind.for_robot(robot, stability_margin=0.01).stability_margin == 0.01


@pytest.mark.parametrize("kind", ALL)
def test_limits_without_the_timing_are_refused(kind: Any) -> None:
    with pytest.raises(InputError, match="limits of the timing 'forces'"):
        kind(timing="velocity", forces=ForceLimits())
    with pytest.raises(InputError, match="timing must be one of forces, velocity"):
        kind(timing="torque")
    with pytest.raises(InputError, match="forces must be ForceLimits or None"):
        kind(timing="forces", forces=0.6)


@pytest.mark.parametrize("kind", ALL)
@pytest.mark.parametrize("timing", ["forces", "velocity"])
def test_timings_survive_being_stored(kind: Any, timing: str) -> None:
    settings = kind(timing=timing)
    stored = json.loads(json.dumps(settings.to_dict()))
    assert stored["timing"] == timing
    assert settings_from_dict(kind.planner, stored) == settings
    other = settings.with_forces(LOW)
    assert other.timing == "forces" and other.promised_forces == LOW
    assert settings_from_dict(kind.planner, json.loads(json.dumps(other.to_dict()))) == other


@pytest.mark.parametrize("kind", ALL)
def test_settings_of_old_files_have_the_timing_of_their_forces(kind: Any) -> None:
    stored = kind(timing="velocity").to_dict()
    del stored["timing"]
    assert settings_from_dict(kind.planner, stored).timing == "velocity"
    without = {key: value for key, value in stored.items() if key != "forces"}
    assert settings_from_dict(kind.planner, without).promised_forces is None
    stored["forces"] = kind().with_forces(LOW).to_dict()["forces"]
    old = settings_from_dict(kind.planner, stored)
    assert old.timing == "forces" and old.promised_forces == LOW


def without_timing(plan: Plan, path: Path) -> Plan:
    """The plan through a file as it was before there were timings."""
    plan.save(path)
    with np.load(path) as stored:
        arrays = dict(stored)
    header = json.loads(arrays["header"].tobytes())
    del header["settings"]["timing"]
    arrays["header"] = np.frombuffer(json.dumps(header).encode(), dtype=np.uint8)
    np.savez(path, **arrays)
    return gaitopt.load_plan(path)


def test_an_old_plan_file_says_what_it_said(short_plan: Plan, tmp_path: Path) -> None:
    old = without_timing(short_plan, tmp_path / "velocity.npz")
    assert old.settings == short_plan.settings and old.settings.timing == "velocity"
    by_forces = gaitopt.retimed(short_plan)
    old = without_timing(by_forces, tmp_path / "forces.npz")
    assert old.settings == by_forces.settings and old.settings.promised_forces == ForceLimits()
