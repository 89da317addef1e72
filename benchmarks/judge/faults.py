"""Faults that are planted into plans: edits of path, footholds, settings, phases and robots."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from typing import Final

import numpy as np

from benchmarks.judge.swayed import swayed
from gaitopt import LEGS, MotionPath, Plan, Quadruped
from gaitopt.errors import GaitoptError

Fault = Callable[[Plan, np.random.Generator], tuple[Plan, str]]


def _size(rng: np.random.Generator, low: float, high: float) -> float:
    """A random size, as often small as large."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def _with_values(plan: Plan, coefficients: np.ndarray) -> Plan:
    return replace(plan, path=MotionPath(plan.path.times, coefficients))


def column_shifted(plan: Plan, rng: np.random.Generator) -> tuple[Plan, str]:
    """One coordinate of the path shifted all along."""
    column, by = int(rng.integers(plan.path.coefficients.shape[2])), _size(rng, 1e-6, 0.1)
    changed = plan.path.coefficients.copy()
    changed[-1, :, column] += by
    return _with_values(plan, changed), f"column {column} shifted by {by:.3g}"


def bump(plan: Plan, rng: np.random.Generator) -> tuple[Plan, str]:
    """One coordinate leaves its course on one segment, and comes back to it."""
    times, old = plan.path.times, plan.path.coefficients
    k, column = int(rng.integers(old.shape[1])), int(rng.integers(old.shape[2]))
    length, by = times[k + 1] - times[k], _size(rng, 1e-6, 0.05)
    degree = max(len(old) - 1, 4)
    changed = np.zeros((degree + 1, *old.shape[1:]))
    changed[degree + 1 - len(old) :] = old
    # 16 by s^2 (1 - s)^2 with s = t / length: its rates are zero at both ends.
    for power, share in ((2, 1.0), (3, -2.0), (4, 1.0)):
        changed[degree - power, k, column] += 16.0 * by * share / length**power
    where = f"{times[k]:.3f} to {times[k + 1]:.3f} s"
    return _with_values(plan, changed), f"column {column} bumps by {by:.3g}, {where}"


def sway(plan: Plan, rng: np.random.Generator) -> tuple[Plan, str]:
    """The body moves aside for a while, or turns, and the legs follow: no foot moves."""
    column, by = int(rng.integers(6)), _size(rng, 1e-4, 0.1) * float(rng.choice([-1.0, 1.0]))
    begin, end = np.sort(rng.uniform(0.0, plan.duration, 2))
    said = f"column {column} of the base sways by {by:.3g}, {begin:.3f} to {end:.3f} s"
    return swayed(plan, column, by, float(begin), float(end)), said


def jump(plan: Plan, rng: np.random.Generator) -> tuple[Plan, str]:
    """One coordinate jumps on one segment."""
    changed, by = plan.path.coefficients.copy(), _size(rng, 1e-10, 1e-2)
    k, column = int(rng.integers(changed.shape[1])), int(rng.integers(changed.shape[2]))
    changed[-1, k, column] += by
    return _with_values(plan, changed), f"column {column} jumps by {by:.3g} in segment {k}"


def hurried(plan: Plan, factor: float) -> Plan:
    """The same motion in ``factor`` times the time, which plans themselves refuse below 1."""
    old = plan.path.coefficients
    powers = np.arange(len(old))[::-1]
    path = MotionPath(plan.path.times * factor, old / (factor**powers)[:, None, None])
    return replace(plan, path=path, phases=tuple(phase.slowed(factor) for phase in plan.phases))


def quicker(plan: Plan, rng: np.random.Generator) -> tuple[Plan, str]:
    """The whole plan in less time."""
    factor = 1.0 / (1.0 + _size(rng, 1e-4, 0.5))
    return hurried(plan, factor), f"{factor:.5f} times the time"


def foothold_moved(plan: Plan, rng: np.random.Generator) -> tuple[Plan, str]:
    """One foothold moved."""
    leg = LEGS[int(rng.integers(4))]
    points = {name: np.array(p) for name, p in plan.footholds.points.items()}
    k, axis = int(rng.integers(len(points[leg]))), int(rng.integers(3))
    by = _size(rng, 1e-4, 0.05) * float(rng.choice([-1.0, 1.0]))
    points[leg][k, axis] += by
    said = f"foothold {k} of {leg} moved by {by:.3g} along {'xyz'[axis]}"
    return replace(plan, footholds=plan.footholds.with_(points=points)), said


def ground_changed(plan: Plan, rng: np.random.Generator) -> tuple[Plan, str]:
    """Higher or lower ground around a random place under the walk; of walks over a map."""
    ground = plan.footholds.ground
    if ground is None:
        return foothold_moved(plan, rng)
    by, reach = _size(rng, 1e-3, 0.1) * float(rng.choice([-1.0, 1.0])), _size(rng, 0.03, 0.2)
    points = np.concatenate(list(plan.footholds.points.values()))[:, :2]
    place = points[int(rng.integers(len(points)))] + rng.uniform(-0.15, 0.15, 2)
    x, y = np.meshgrid(ground.x, ground.y, indexing="ij")
    near = np.hypot(x - place[0], y - place[1]) < reach
    changed = ground.with_heights(ground.z + by * near)
    said = f"ground {by:.3g} higher within {reach:.3g} of {np.round(place, 3).tolist()}"
    return replace(plan, footholds=plan.footholds.with_(ground=changed)), said


def radius_changed(plan: Plan, rng: np.random.Generator) -> tuple[Plan, str]:
    """Another radius of the columns."""
    radius = plan.footholds.landing_radius * _size(rng, 1e-3, 30.0)
    return replace(plan, footholds=plan.footholds.with_(radius=radius)), f"radius {radius:.4g}"


def slippery(plan: Plan, rng: np.random.Generator) -> tuple[Plan, str]:
    """Footholds with little friction."""
    friction = float(rng.uniform(0.05, 0.6))
    changed = {leg: np.full(n, 1.0) for leg, n in plan.footholds.counts.items()}
    leg = LEGS[int(rng.integers(4))]
    changed[leg][int(rng.integers(len(changed[leg])))] = friction
    said = f"a foothold of {leg} with friction {friction:.3g}"
    return replace(plan, footholds=plan.footholds.with_(friction=changed)), said


def setting_changed(plan: Plan, rng: np.random.Generator) -> tuple[Plan, str]:
    """A promise made stricter or weaker."""
    settings = plan.settings
    names = ["stability_margin", "swing_height", "reach_fraction"]
    names += [n for n in ("clearance", "margin", "acceleration_limit", "jerk_limit")
              if getattr(settings, n, None)]  # fmt: skip
    name = str(rng.choice(names))
    factor = float(rng.choice([_size(rng, 0.01, 1.0), _size(rng, 1.0, 4.0)]))
    value = getattr(settings, name) * factor
    value = min(value, 1.0) if name == "reach_fraction" else value
    return replace(plan, settings=replace(settings, **{name: value})), f"{name} {value:.4g}"


def forces_changed(plan: Plan, rng: np.random.Generator) -> tuple[Plan, str]:
    """Other limits on forces."""
    limits = plan.settings.forces
    if limits is None:
        return setting_changed(plan, rng)
    name = str(rng.choice(["friction", "reserve", "reserve_on_four", "torque_share", "sides"]))
    value = {"friction": _size(rng, 0.05, 3.0), "reserve": _size(rng, 1e-3, 0.3),
             "reserve_on_four": _size(rng, 1e-3, 0.2), "torque_share": _size(rng, 0.05, 1.0),
             "sides": int(rng.integers(3, 12))}[name]  # fmt: skip
    forces = replace(limits, **{name: value})
    return replace(plan, settings=replace(plan.settings, forces=forces)), f"{name} {value:.4g}"


def order_changed(plan: Plan, rng: np.random.Generator) -> tuple[Plan, str]:
    """Another order of the legs in the settings."""
    if not hasattr(plan.settings, "sequence"):
        return phase_changed(plan, rng)
    order = tuple(str(leg) for leg in rng.permutation(LEGS))
    return replace(plan, settings=replace(plan.settings, sequence=order)), f"order {order}"


def phase_changed(plan: Plan, rng: np.random.Generator) -> tuple[Plan, str]:
    """One phase tells something else."""
    phases, k = list(plan.phases), int(rng.integers(len(plan.phases)))
    phase, by = phases[k], _size(rng, 1e-11, 1e-2)
    what = str(rng.choice(["cog_start", "cog_end", "foot_start", "foot_end", "start", "duration",
                           "support", "gone", "boundary", "margin"]))  # fmt: skip
    if what in ("cog_start", "cog_end", "foot_start", "foot_end"):
        phases[k] = replace(phase, **{what: getattr(phase, what) + np.array([by, 0.0, 0.0])})
    elif what in ("start", "duration", "margin"):
        phases[k] = replace(phase, **{what: getattr(phase, what) + by})
    elif what == "support":
        phases[k] = replace(phase, support=tuple(leg for leg in LEGS if rng.random() < 0.7))
    elif what == "gone":
        del phases[k]
    elif k + 1 < len(phases):
        after = phases[k + 1]
        by = min(by, 0.5 * after.duration)
        phases[k] = replace(phase, duration=phase.duration + by)
        phases[k + 1] = replace(after, start=after.start + by, duration=after.duration - by)
    entry = min(plan.entry, len(phases))
    return replace(plan, phases=tuple(phases), entry=entry), f"phase {k}: {what} {by:.3g}"


def robot_changed(plan: Plan, rng: np.random.Generator) -> tuple[Plan, str]:
    """Another limit or mass in the robot's file, mostly under another name."""
    attribute = str(rng.choice(["velocity", "effort", "upper", "lower", "mass", "mass"]))
    where = '<mass\\b[^>]*?value="' if attribute == "mass" else f'<limit\\b[^>]*?{attribute}="'
    pattern = f'({where})([^"]+)'
    spots = list(re.finditer(pattern, plan.robot.urdf))
    spot = spots[int(rng.integers(len(spots)))]
    factor = float(rng.choice([_size(rng, 0.1, 1.0), _size(rng, 1.0, 3.0)]))
    urdf = plan.robot.urdf
    urdf = urdf[: spot.start(2)] + repr(float(spot.group(2)) * factor) + urdf[spot.end(2) :]
    name = plan.robot.name if rng.random() < 0.2 else "another"
    other = Quadruped.from_urdf(urdf, name, dict(plan.robot.knees) or None)
    said = f"{attribute} of number {spots.index(spot)} times {factor:.3g}, named {name}"
    return replace(plan, robot=other), said


def model_in_memory(plan: Plan, rng: np.random.Generator) -> tuple[Plan, str]:
    """A weaker model in memory, which does not count."""
    other = Quadruped.from_urdf(plan.robot.urdf, plan.robot.name, dict(plan.robot.knees) or None)
    other.model.velocityLimit[:] *= 0.5
    other.model.inertias[2].mass *= 3.0
    return replace(plan, robot=other), "half the velocity limits in memory (harmless)"


def record_changed(plan: Plan, rng: np.random.Generator) -> tuple[Plan, str]:
    """Another ZMP margin in what the planner tells."""
    told = plan.record.zmp_margin
    value = (told or 0.0) + float(rng.choice([-1.0, 1.0])) * _size(rng, 1e-6, 0.1)
    return replace(plan, record=replace(plan.record, zmp_margin=value)), f"zmp_margin {value:.4g}"


FAULTS: Final[tuple[Fault, ...]] = (
    column_shifted, bump, bump, sway, sway, sway, jump, quicker, foothold_moved, ground_changed,
    radius_changed, slippery, setting_changed, setting_changed, forces_changed, order_changed,
    phase_changed, phase_changed, robot_changed, robot_changed, model_in_memory, record_changed,
)  # fmt: skip
"""All faults; those of many kinds more than once."""


def planted(plan: Plan, rng: np.random.Generator) -> tuple[Plan, str]:
    """A plan with a random fault that its own classes do not refuse, and what it is."""
    for _ in range(50):
        fault = FAULTS[int(rng.integers(len(FAULTS)))]
        try:
            return fault(plan, rng)
        except GaitoptError:
            continue
    raise RuntimeError("fifty faults in a row were refused")
