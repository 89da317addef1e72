"""Calls of methods of what functions return: wrong values are put into these, too."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np

import gaitopt
from benchmarks.fuzz import calls as sound
from gaitopt.optimize.spline.limits import JointLimits

Call = tuple[Callable[..., Any], dict[str, Any]]


@cache
def forces() -> Any:
    """Contact forces of the walk."""
    return gaitopt.contact_forces(sound.plan(), dt=0.5)


def methods() -> dict[str, Call]:
    """Every call by name, with all its arguments by name."""
    return {**_of_ground(), **_of_robots(), **_of_plans(), **_of_settings(), **_further()}


def _of_ground() -> dict[str, Call]:
    g, f, h = gaitopt, sound.footholds(), sound.ground()
    board = g.rectangular_obstacle(0.1, 0.1)
    layers = g.ground_layers(h, robot=sound.robot())
    first = dict.fromkeys(g.LEGS, 0)
    order = sound.plan().settings.swing_legs(f.counts)
    return {
        "Obstacle": (g.Obstacle, {"shape": "round", "core": ((0.0, 0.1),), "rounding": 0.1,
            "length": 1.0, "position": (0.0, 0.0, 0.0), "yaw": 0.0}),
        "Obstacle.contains": (board.contains, {"points": np.ones((2, 3))}),
        "Obstacle.distance": (board.distance, {"points": np.ones((2, 3))}),
        "Obstacle.height_at": (board.height_at, {"places": np.ones((2, 2))}),
        "Obstacle.inflated": (board.inflated, {"margin": 0.01}),
        "Obstacle.mesh": (board.mesh, {"sides": 8}),
        "Obstacle.outline": (g.round_obstacle(0.1).outline, {"sides": 8}),
        "Obstacle.section_distance": (board.section_distance, {"x": np.ones(2), "z": np.ones(2)}),
        "Obstacle.to_local": (board.to_local, {"points": np.ones((2, 3))}),
        "Obstacle.to_world": (board.to_world, {"points": np.ones((2, 3))}),
        "GroundLayers.footing": (layers.footing, {"place": [0.1, 0.1]}),
        "HeightMap.cropped": (h.cropped, {"x": (0.0, 0.4), "y": (-0.2, 0.2)}),
        "HeightMap.from_columns": (g.HeightMap.from_columns, {"footholds": f, "foot_radius": 0.01,
            "resolution": 0.02, "depth": 0.3}),
        "Footholds.after": (f.after, {"first": first, "order": order}),
        "Footholds.raised": (f.raised, {"height": 0.01}),
        "Footholds.touching": (f.touching, {"radius": 0.01}),
        "Footholds.with_": (f.with_, {"radius": 0.02, "points": dict(f.points)}),
        "Footholds[...]": (f.__getitem__, {"leg": "LF"}),
    }  # fmt: skip


def _of_robots() -> dict[str, Call]:
    g, r = gaitopt, sound.robot()
    leg, state = r.legs["LF"], g.State.standing(r)
    own = {"position": np.zeros(3), "rpy": np.zeros(3), "joints": r.standing_joints(),
           "linear": np.zeros(3), "angular": np.zeros(3), "rates": np.zeros(12),
           "support": g.LEGS}  # fmt: skip
    return {
        "Quadruped.from_urdf": (g.Quadruped.from_urdf, {"urdf": r.urdf, "name": "a",
            "knees": dict(r.knees)}),
        "State.of": (g.State.of, {"robot": r, **own}),
        "State.standing(...)": (g.State.standing, {"robot": r, "feet": None, "height": 0.4,
            "heading": 0.0}),
        "Leg.joint_points": (leg.joint_points, {"q": np.array([0.1, 0.8, -1.5])}),
        "Leg.gap_in_words": (leg.gap_in_words, {"point": leg.forward(np.array([0.1, 0.8, -1.5]))}),
        "nearest_state": (g.nearest_state, {"robot": r, "state": state, "footholds": None}),
        "square_stance": (g.square_stance, {"robot": r, "state": state}),
        "feet_down": (g.feet_down, {"robot": r, "state": replace(state, support=())}),
    }  # fmt: skip


def _of_plans() -> dict[str, Call]:
    g, q = gaitopt, sound.quick_plan()
    spline = g.JointSpline(np.array([[0.0], [0.1], [0.3], [0.4]]), np.full(3, 0.2), _limits())
    swung = next(phase for phase in q.phases if phase.flying)
    return {
        "MotionPath.slowed(...)": (q.path.slowed, {"factor": 2.0}),
        "Phase.slowed": (swung.slowed, {"factor": 2.0}),
        "Phase": (g.Phase, {name: getattr(swung, name) for name in swung.__dataclass_fields__}),
        "Plan.to_dataframe": (q.to_dataframe, {"dt": 0.1}),
        "ContactForces.conflicts": (forces().conflicts, {"sample": 0}),
        "Certificate[...]": (g.verify(q, collisions=False).__getitem__, {"name": "reach"}),
        "JointSpline.active": (spline.active, {"share": 0.999}),
        "JointSpline.cost": (spline.cost, {"time_weight": 1.0, "acceleration_weight": 0.1}),
        "JointSpline.evaluate": (spline.evaluate, {"times": [0.0, 0.1], "derivative": 1}),
        "JointSpline.stretched": (spline.stretched, {"factor": 2.0}),
    }  # fmt: skip


def _limits() -> Any:
    return JointLimits(np.full(1, 2.0), np.full(1, 50.0), np.full(1, 1e4))


def _of_settings() -> dict[str, Call]:
    g, r, f = gaitopt, sound.robot(), sound.footholds()
    crawl = g.CrawlSettings()
    schedule = g.trot(0.5)
    terrain = {name: value for name, value in vars(g.TerrainSettings.for_robot(r)).items()}
    return {
        "CrawlSettings.for_robot": (g.CrawlSettings.for_robot, {"robot": r,
            "stability_margin": 0.02, "timing": "velocity"}),
        "CrawlSettings.with_forces": (crawl.with_forces, {"limits": g.ForceLimits()}),
        "CrawlSettings.joint_accelerations": (crawl.joint_accelerations, {"robot": r}),
        "CrawlSettings.order_over": (crawl.order_over, {"footholds": f}),
        "CrawlSettings.swing_legs": (crawl.swing_legs, {"footholds": 3}),
        "GaitSettings.for_robot": (g.GaitSettings.for_robot, {"robot": r, "velocity": (0.1, 0.0),
            "duration": 1.0, "ramp": 0.5, "schedule": schedule}),
        "GaitSettings(...)": (g.GaitSettings, {"cycle_times": (0.5, 0.5, 0.5), "plateau": 1.0,
            "lead": 0.2, "swing": "cycloid", "sway": True, "adapt": 0.0}),
        "RouteSettings(...)": (g.RouteSettings, {"heading": 0.0, "acceleration_limit": 10.0,
            "jerk_limit": 1e4, "body_height": 0.4, "reach_fraction": 0.9}),
        "StrideSettings.for_robot": (g.StrideSettings.for_robot, {"robot": r, "margin": 0.02}),
        "TerrainSettings": (g.TerrainSettings, terrain),
        "TerrainSettings.for_robot": (g.TerrainSettings.for_robot, {"robot": r,
            "step_length": 0.1, "friction": 0.6}),
        "TerrainSettings.longest": (g.TerrainSettings.for_robot(r).longest, {"metres": 1.0}),
        "SimulationSettings.for_reach": (g.SimulationSettings().for_reach, {"reach": 0.5}),
        "ForceLimits.from_dict": (g.ForceLimits.from_dict, {"stored": {"friction": 0.6}}),
        "ForceLimits.or_default": (g.ForceLimits.or_default, {"given": None}),
        "ForceLimits.least_normal_shares": (g.ForceLimits().least_normal_shares,
            {"standing": np.ones(4, np.bool_)}),
        "Freedoms": (g.Freedoms, {"overlap": False, "swing": False, "height": False,
            "posture": False, "dynamic": False}),
        "Freedoms.from_name": (g.Freedoms.from_name, {"name": "height"}),
        "Freedoms.of": (g.Freedoms.of, {"given": "height"}),
        "GaitSchedule.from_dict": (g.GaitSchedule.from_dict, {"values": schedule.to_dict()}),
        "GaitSchedule.intervals": (schedule.intervals, {"duration": 1.0}),
        "GaitSchedule.stride": (schedule.stride, {"velocity": 0.3}),
        "GaitSchedule.phase": (schedule.phase, {"t": [0.0, 0.1]}),
        "GaitSchedule.support": (schedule.support, {"t": [0.0, 0.1]}),
    }  # fmt: skip


def _further() -> dict[str, Call]:
    """Functions that few use."""
    g, q, here = gaitopt, sound.quick_plan(), sound.folder()
    return {
        "plot_cycloids": (g.plot_cycloids, {"ax": None}),
        "plot_margin_over_duty": (g.plot_margin_over_duty, {"duties": [0.8, 0.9], "stride": 0.3,
            "length": 0.6, "ax": None}),
        "plot_race": (g.plot_race, {"times": {"the paper": [1.0, 2.0], "other": [1.0, 1.5]},
            "baseline": "the paper", "ax": None}),
        "plot_stride_snapshots": (g.plot_stride_snapshots, {"plan": object(), "axes": None}),
        "plot_swing_curves": (g.plot_swing_curves, {"length": 0.15, "height": 0.06,
            "duration": 0.25, "rise": 0.0, "axes": None}),
        "save_gait_figures": (g.save_gait_figures, {"plan": q, "folder": here / "gait"}),
        "explore": (g.explore, {"robot": sound.robot(), "terrain": sound.footholds(),
            "goal": None}),
        "progress_bar": (g.progress_bar, {"text": "walk"}),
    }  # fmt: skip
