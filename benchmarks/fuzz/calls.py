"""A call that works for every public function and class: wrong values are put into these."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

import gaitopt

Call = tuple[Callable[..., Any], dict[str, Any]]


@cache
def robot() -> Any:
    """The robot of all calls."""
    return gaitopt.load_robot("wang2020")


@cache
def footholds() -> Any:
    """The footholds of all calls."""
    return gaitopt.s_columns(0, columns=2, robot=robot())


@cache
def plan() -> Any:
    """A walk with contact forces."""
    return gaitopt.plan_crawl(robot(), footholds())


@cache
def quick_plan() -> Any:
    """A walk without contact forces."""
    return gaitopt.plan_crawl(robot(), footholds(), timing="velocity")


@cache
def ground() -> Any:
    """A small height map."""
    return gaitopt.make_ground("flat", length=1.2, robot=robot(), resolution=0.05)


@cache
def folder() -> Path:
    """Where files are written to."""
    return Path(tempfile.mkdtemp(prefix="gaitopt-fuzz-"))


@cache
def plan_file() -> Path:
    """A plan file."""
    path = folder() / "plan.npz"
    quick_plan().save(path)
    return path


@cache
def map_file() -> Path:
    """A file of a height map."""
    path = folder() / "map.npy"
    np.save(path, np.zeros((20, 30)))
    return path


@cache
def calls() -> dict[str, Call]:
    """Every call by name, with all its arguments by name."""
    from benchmarks.fuzz.methods import methods

    return {**_models(), **_gaits(), **_grounds(), **_planners(), **_consumers(), **_methods(),
            **methods()}  # fmt: skip


def _models() -> dict[str, Call]:
    g, r = gaitopt, robot()
    feet = {leg: footholds()[leg][0] for leg in g.LEGS}
    rows = np.array([feet[leg] for leg in g.LEGS])
    middle = rows.mean(0)[:2]
    hip = np.array([*middle, 0.4])
    triangle = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    joints = g.joints_from_feet(r, hip, np.zeros(3), rows)
    n = r.model.nv
    jacobian = np.eye(3)
    return {
        "load_robot": (g.load_robot, {"source": "wang2020", "knees": None, "legs": None,
            "feet": None, "foot_radius": 0.01, "pose": None, "masses": None,
            "velocity_limits": 1.0, "effort_limits": 50.0, "motor_inertia": 0.01,
            "torque_line": (10.0, 30.0), "scale": 1.0, "package_folders": (),
            "xacro_arguments": None}),
        "feet_from_joints": (g.feet_from_joints, {"robot": r, "position": hip,
            "rpy": np.zeros(3), "joints": joints}),
        "joints_from_feet": (g.joints_from_feet, {"robot": r, "position": hip,
            "rpy": np.zeros(3), "feet": rows, "on_unreachable": "raise"}),
        "static_stability_margin": (g.static_stability_margin, {"feet": triangle,
            "cog": [0.2, 0.2]}),
        "support_margin": (g.support_margin, {"feet": rows[:, :2], "contacts": [True] * 4,
            "point": middle}),
        "shrunken_polygon": (g.shrunken_polygon, {"corners": triangle, "margin": 0.01}),
        "whole_body_zmp": (g.whole_body_zmp, {"model": r.model, "q": _neutral(r),
            "v": np.zeros(n), "a": np.zeros(n), "ground_height": 0.0}),
        "build_cog_problem": (g.build_cog_problem, {"robot": r, "feet": feet, "height": 0.4,
            "start": middle, "swing": "LF", "foothold": feet["LF"], "stability_margin": 0.02,
            "reach_fraction": 1.0, "objective": "distance"}),
        "solve_cog": (g.solve_cog, {"problem": g.build_cog_problem(r, feet, 0.4, middle)}),
        "build_speed_lp": (g.build_speed_lp, {"jacobian": jacobian, "direction": np.ones(3),
            "limits": np.ones(3)}),
        "solve_speed_lp": (g.solve_speed_lp, {"problem": g.build_speed_lp(
            jacobian, np.ones(3), np.ones(3))}),
        "solve_posture": (g.solve_posture, {"problem": object()}),
        "solve_spline": (g.solve_spline, {"problem": object(), "starts": 1}),
        "feasible_region": (g.feasible_region, {"robot": r, "feet": rows,
            "normals": (0.0, 0.0, 1.0), "limits": None, "support": g.LEGS, "posture": None,
            "torques": True, "tolerance": 5e-4, "grip": 1.0}),
        "file_configurations": (g.file_configurations, {"robot": r, "q": _neutral(r),
            "model": r.model}),
        "ForceLimits": (g.ForceLimits, {"friction": 0.6, "reserve": 0.02, "torque_share": 0.9,
            "sides": 4, "torque_line": None, "balance_tolerance": 1e-3, "speed_share": 1.0,
            "transfer_time": 0.0, "reserve_on_four": None}),
    }  # fmt: skip


def _neutral(r: Any) -> Any:
    import pinocchio as pin

    return pin.neutral(r.model)


def _gaits() -> dict[str, Call]:
    g = gaitopt
    schedule = g.trot(0.5)
    made = {
        name: (getattr(g, name), {"cycle_time": 0.6, "duty_factor": duty})
        for name, duty in (
            ("trot", 0.5),
            ("pace", 0.5),
            ("bound", 0.5),
            ("walk", 0.75),
            ("wave", 0.8),
            ("pronk", 0.7),
            ("quasi_static", 0.625),
        )
    }
    start, end = np.zeros(3), np.array([0.1, 0.0, 0.0])
    curves = {
        f"swing_curve {name}": (
            g.swing_curve,
            {"name": name, "start": start, "end": end, "height": 0.05, "duration": 0.3},
        )
        for name in g.SWING_CURVES
    }
    return {
        **made, **curves,
        "GaitSchedule": (g.GaitSchedule, {"cycle_time": 0.5, "duty_factor": 0.6,
            "phase_offsets": dict(zip(g.LEGS, (0.0, 0.5, 0.0, 0.5), strict=True)),
            "name": "own"}),
        "GaitStateMachine": (g.GaitStateMachine, {"schedule": schedule, "cycles": 2, "first": None,
            "transition_time": 0.1, "longest_wait": 0.5, "earliest_contact": 0.5}),
        "adapted_step_time": (g.adapted_step_time, {"nominal": 0.5, "margin": [0.02],
            "nominal_margin": 0.03, "gain": 1.0, "least": 0.1, "most": 1.0}),
        "longitudinal_margin": (g.longitudinal_margin, {"schedule": g.wave(1.0), "stride": 0.3,
            "length": 0.6}),
        "margin_over_duty": (g.margin_over_duty, {"orders": [("RH", "RF", "LH", "LF")],
            "duties": [0.8], "stride": 0.3, "length": 0.6}),
        "swing_events": (g.swing_events, {"schedule": schedule, "cycles": 2,
            "cycle_times": [0.5, 0.5], "first": None}),
        "com_touchdown": (g.com_touchdown, {"nominal": [0.0, 0.0], "com": [0.0, 0.0],
            "velocity": [0.1, 0.0], "position_gain": 0.1, "velocity_gain": 0.1}),
        "velocity_touchdown": (g.velocity_touchdown, {"nominal": [0.0, 0.0],
            "velocity": [0.1, 0.0], "commanded": [0.1, 0.0], "stance_time": 0.3, "gain": 0.1}),
    }  # fmt: skip


def _grounds() -> dict[str, Call]:
    g, r = gaitopt, robot()
    place = {"length": 1.5, "position": (0.0, 0.0, 0.0), "yaw": 0.0}
    points = {leg: np.array(footholds()[leg]) for leg in g.LEGS}
    return {
        "s_columns": (g.s_columns, {"seed": 0, "robot": r, "columns": 3, "forward": 0.05,
            "amplitude": 0.02, "wavelength": 1.0, "jitter": 0.01, "height_jitter": 0.0,
            "body_length": 0.4, "body_width": 0.2, "diameter": 0.04}),
        "Footholds": (g.Footholds, {"points": points, "radius": 0.02, "normals": None,
            "friction": None, "ground": None, "order": None, "swing_heights": None,
            "postures": None, "body_places": None}),
        "HeightMap": (g.HeightMap, {"z": np.zeros((4, 5)), "resolution": 0.02,
            "origin": (0.0, 0.0)}),
        "make_ground": (g.make_ground, {"name": "rubble", "seed": 0, "difficulty": 0.5, "robot": r,
            "length": 1.5, "width": 1.2, "resolution": 0.05, "apron": 0.5}),
        "ground_layers": (g.ground_layers, {"ground": ground(), "robot": r, "friction": 0.6,
            "foot_radius": 0.01, "patch": 0.05, "max_roughness": 0.02, "edge_height": 0.05,
            "edge_margin": 0.02, "pit_depth": 0.1, "pit_length": 0.1, "pit_width": 0.1}),
        "load_ground": (g.load_ground, {"path": map_file(), "resolution": 0.02, "heights": None,
            "origin": (0.0, 0.0), "unit": None, "method": None, "layer": None, "topic": None,
            "message": None}),
        "rectangular_obstacle": (g.rectangular_obstacle, {"height": 0.1, "width": 0.1, **place}),
        "triangular_obstacle": (g.triangular_obstacle, {"height": 0.1, "width": 0.1, "apex": 0.0,
            **place}),
        "round_obstacle": (g.round_obstacle, {"diameter": 0.1, **place}),
    }  # fmt: skip


def _planners() -> dict[str, Call]:
    g, r, f = gaitopt, robot(), footholds()
    crawl = {"robot": r, "footholds": f, "settings": None, "progress": None, "start": None,
             "end": None, "stability_margin": 0.02, "body_height": 0.4, "swing_height": 0.05,
             "reach_fraction": 1.0, "heading": 0.0, "timing": "velocity", "forces": None,
             "sequence": ("RH", "RF", "LH", "LF"), "follow_terrain": False}  # fmt: skip
    fast = g.load_robot("wang2020-fast")
    gait = {"robot": fast, "schedule": g.trot(0.5), "settings": None, "progress": None,
            "start": None, "velocity": 0.2, "yaw_rate": 0.0, "distance": 0.1,
            "timing": "velocity"}  # fmt: skip
    way = {"robot": r, "ground": ground(), "goal": (0.4, 0.0), "start": (0.0, 0.0, 0.0),
           "progress": None, "friction": 0.6, "step_length": 0.1, "width": 2,
           "width_limit": 2, "time_limit": 5.0}  # fmt: skip
    return {
        "plan_crawl": (g.plan_crawl, crawl),
        "plan_route": (g.plan_route, crawl | {"free": "height"}),
        "plan_gait": (g.plan_gait, gait),
        "plan_stride": (g.plan_stride, {"robot": r, "obstacle": g.rectangular_obstacle(0.05, 0.05),
            "settings": None, "margin": 0.03, "clearance": 0.01, "approach": 1, "leave": 1,
            "timing": "velocity"}),
        "plan_stand_up": (g.plan_stand_up, {"robot": r, "state": g.State.standing(r),
            "footholds": None, "height": 0.4, "heading": 0.0, "forces": None}),
        "search_terrain": (g.search_terrain, way),
        "choose_footholds": (g.choose_footholds, way),
        "plan_terrain": (g.plan_terrain, way),
        "retimed": (g.retimed, {"plan": quick_plan(), "forces": None, "rounding": 0.0}),
        "compare": (g.compare, {"robot": r, "terrains": f}),
        "CrawlSettings": (g.CrawlSettings, {"stability_margin": 0.02, "body_height": 0.4,
            "swing_height": 0.07, "reach_fraction": 1.0, "heading": 0.0, "timing": "velocity",
            "acceleration_limit": None, "jerk_limit": None, "forces": None,
            "sequence": ("RH", "RF", "LH", "LF"), "follow_terrain": False, "cog_start": None}),
        "GaitSettings": (g.GaitSettings, {"stability_margin": 0.0, "body_height": 0.4,
            "schedule": g.trot(0.5), "velocity": (0.1, 0.0), "yaw_rate": 0.0, "cycles": 2}),
        "StrideSettings": (g.StrideSettings, {"margin": 0.03, "clearance": 0.01, "approach": 1,
            "leave": 1, "obstacles": ()}),
        "RouteSettings": (g.RouteSettings, {"stability_margin": 0.02, "body_height": 0.4,
            "timing": "velocity", "free": g.Freedoms()}),
        "SimulationSettings": (g.SimulationSettings, {"timestep": 0.002, "control_every": 3,
            "friction": 1.0, "sensing_delay": 0.0, "pushes": (), "column_errors": (),
            "body_mass_factor": 1.0, "leg_mass_factor": 1.0}),
        "Push": (g.Push, {"time": 0.1, "duration": 0.1, "force": (1.0, 0.0, 0.0)}),
    }  # fmt: skip


def _consumers() -> dict[str, Call]:
    g, p, q = gaitopt, plan(), quick_plan()
    here = folder()
    figures = {name: (getattr(g, name), {"plan": q, "axes" if many else "ax": None})
               for name, many in (("plot_paths", False), ("plot_margin", False),
                                  ("plot_snapshots", True), ("plot_posture", True),
                                  ("plot_zmp", True), ("plot_terrain_profile", True),
                                  ("plot_gait_cycle", False))}  # fmt: skip
    return {
        **figures,
        "plot_swing": (g.plot_swing, {"plan": q, "step": 0, "ax": None}),
        "plot_feasible_area": (g.plot_feasible_area, {"plan": q, "step": 0, "ax": None}),
        "plot_joint_curves": (g.plot_joint_curves, {"plan": q, "legs": ("LF",),
            "span": (0.0, 1.0), "derivatives": (0, 1), "axes": None}),
        "plot_joint_velocities": (g.plot_joint_velocities, {"plan": q, "cycle": 0, "axes": None}),
        "plot_cog_over_time": (g.plot_cog_over_time, {"plans": {"one": q}, "ax": None}),
        "plot_terrain": (g.plot_terrain, {"footholds": footholds(), "ax": None}),
        "plot_terrain_map": (g.plot_terrain_map, {"shown": ground(), "ax": None, "search": None}),
        "plot_gait_diagram": (g.plot_gait_diagram, {"schedule": g.trot(0.5), "cycles": 2,
            "ax": None}),
        "verify": (g.verify, {"plan": q, "robot": None, "collisions": False, "forces": None}),
        "com_margin": (g.com_margin, {"plan": q, "times": np.array([0.0, 0.5])}),
        "contact_forces": (g.contact_forces, {"plan": p, "limits": None, "dt": 0.1,
            "times": None, "objective": "smoothest", "normals": None}),
        "export": (g.export, {"plan": q, "path": here / "a.csv", "format": "csv", "dt": 0.1,
            "joints": None, "prefix": "", "controller": None, "forces": None, "ramp": 0.2}),
        "export_csv": (g.export_csv, {"plan": q, "path": here / "b.csv", "dt": 0.1}),
        "export_ros": (g.export_ros, {"plan": q, "path": here / "c.yaml", "dt": 0.1}),
        "replay": (g.replay, {"plan": q, "path": here / "d.html", "title": "t", "meshes": False,
            "simulated": None, "search": None}),
        "save_figures": (g.save_figures, {"plan": q, "folder": here / "figures",
            "comparison": None, "com_margin": None, "step": None, "search": None}),
        "simulate": (g.simulate, {"plan": q, "settings": None, "gains": None}),
        "load_plan": (g.load_plan, {"path": plan_file()}),
        "show": (g.show, {"plan": q, "height": 500, "title": None, "meshes": False}),
        "view": (g.view, {"plan": object(), "title": None, "folder": here}),
        "replay_video": (g.replay_video, {"plan": object(), "path": here / "e.mp4",
            "seconds": 1.0, "rate": 10.0, "size": (64, 64), "view": "follow"}),
    }  # fmt: skip


def _methods() -> dict[str, Call]:
    """Methods of what functions return."""
    g, p, q, h = gaitopt, plan(), quick_plan(), ground()
    schedule, f = g.trot(0.5), footholds()
    curve = g.swing_curve("cycloid", np.zeros(3), np.array([0.1, 0, 0]), 0.05, 0.3)
    machine = g.GaitStateMachine(schedule, 2)
    here = folder()
    found: dict[str, Call] = {
        "Plan.save": (q.save, {"path": here / "f.npz"}),
        "Plan.state": (p.state, {"time": 0.1}),
        "Plan.slowed": (q.slowed, {"factor": 2.0}),
        "Plan.sample": (q.sample, {"dt": 0.1}),
        "Plan.footholds_ahead": (p.footholds_ahead, {"time": 0.1}),
        "Plan.phase_at": (q.phase_at, {"time": 0.1}),
        "Plan.at": (q.at, {"times": [0.0, 0.1]}),
        "Plan": (g.Plan, {"robot": q.robot, "footholds": q.footholds, "settings": q.settings,
            "phases": q.phases, "path": q.path, "record": q.record, "entry": 0}),
        "MotionPath": (g.MotionPath, {"times": q.path.times, "coefficients": q.path.coefficients}),
        "Footholds.to_csv": (f.to_csv, {"path": here / "g.csv"}),
        "Footholds.from_csv": (g.Footholds.from_csv, {"path": here / "g.csv"}),
        "HeightMap.from_points": (g.HeightMap.from_points, {"points": np.eye(3),
            "resolution": 0.1}),
        "HeightMap.from_triangles": (g.HeightMap.from_triangles, {"triangles": [np.eye(3)],
            "resolution": 0.1}),
        "HeightMap.ball": (h.ball, {"places": [[0.1, 0.1]], "radius": 0.02}),
        "HeightMap.height": (h.height, {"places": [[0.1, 0.1]]}),
        "HeightMap.gradient": (h.gradient, {"places": [[0.1, 0.1]]}),
        "HeightMap.normal": (h.normal, {"places": [[0.1, 0.1]]}),
        "HeightMap.filled": (h.filled, {"method": "nearest"}),
        "HeightMap.resampled": (h.resampled, {"resolution": 0.1}),
        "HeightMap.with_heights": (h.with_heights, {"z": np.zeros(h.shape)}),
        "HeightMap.save": (h.save, {"path": here / "h.npz"}),
        "MotionPath.polyline": (g.MotionPath.polyline, {"times": [0.0, 1.0],
            "values": [[0.0], [1.0]]}),
        "MotionPath.evaluate": (q.path.evaluate, {"times": [0.0, 0.1], "derivative": 1}),
        "MotionPath.jumps": (q.path.jumps, {"derivative": 0}),
        "State.standing": (g.State.standing, {"robot": robot()}),
        "State": (g.State, {"q": p.state(0.1).q, "v": p.state(0.1).v,
            "support": p.state(0.1).support, "joint_names": p.state(0.1).joint_names}),
    }  # fmt: skip
    leg, angles = robot().legs["LF"], np.array([0.1, 0.8, -1.5])
    found |= {
        "Leg.forward": (leg.forward, {"q": angles}),
        "Leg.inverse": (leg.inverse, {"point": leg.forward(angles)}),
        "Leg.jacobian": (leg.jacobian, {"q": angles}),
        "Leg.jacobian_rate": (leg.jacobian_rate, {"q": angles, "rates": angles}),
        "Leg.length": (leg.length, {"point": leg.forward(angles)}),
        "Leg.shortfall": (leg.shortfall, {"point": leg.forward(angles)}),
    }
    times = {"GaitSchedule": schedule, "GaitStateMachine": machine, "SwingCurve": curve,
             "MotionPath": q.path}  # fmt: skip
    for name, value in times.items():
        for method in dir(type(value)):
            if not method.startswith("_") and callable(getattr(value, method)):
                found.setdefault(f"{name}.{method}", (getattr(value, method), _some(value, method)))
    f.to_csv(here / "g.csv")
    return {name: call for name, call in found.items() if call[1] is not None}


def _some(value: Any, method: str) -> Any:
    """Arguments of a method of times, places and legs; ``None`` where it takes others."""
    import inspect

    usual = {"t": 0.1, "time": 0.1, "times": np.array([0.1, 0.2]), "phase": 0.2, "leg": "LF",
             "legs": ("LF",), "dt": 0.05, "order": 1, "cycles": 2, "cycle_time": 0.5,
             "factor": 2.0, "duty_factor": 0.6}  # fmt: skip
    names = [p.name for p in inspect.signature(getattr(value, method)).parameters.values()
             if p.default is p.empty and p.kind is not p.VAR_KEYWORD]  # fmt: skip
    return {n: usual[n] for n in names} if names and all(n in usual for n in names) else None
