"""ROS 2: a plan's motion for joint_trajectory_controller, as ``trajectory_msgs/JointTrajectory``.

What that controller asks for, as its pages and sources say: the joints by the names of its
parameters; times that strictly increase; a last point at rest (ros2_controllers pull 567); effort
only where it commands effort. Between points it interpolates (:mod:`.interpolation`), and from
where the robot is to a first point that lies in the future.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any, Final

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.errors import InputError
from gaitopt.exporting.at_rest import REST, at_rest
from gaitopt.exporting.format import Format
from gaitopt.exporting.interpolation import (
    INTERPOLATIONS,
    LONGEST_GAP,
    NANOSECOND,
    Points,
    choose_points,
)
from gaitopt.exporting.sampled import Exported, Source, forces_at
from gaitopt.files import written_whole
from gaitopt.inputs import check_choice, check_number
from gaitopt.plan.contact_forces import contact_forces
from gaitopt.plan.plan import Plan
from gaitopt.robots.xml_text import shown

JOINT_ERROR: Final = 1e-3
"""Default of the largest joint error [rad]: half a millimetre at the foot of a leg of 0.4 m."""
OFFSET: Final = 1.0
"""Default time from the start of the message to its first point [s]: the controller goes there from
where the robot is. At 0 it would jump."""
EFFORT_GAP: Final = 0.01
"""Longest time between points with efforts [s]: the controller draws straight lines between them,
and loads are handed over from foot to foot within 0.1 s."""


def write_trajectory(
    source: Source,
    path: Path,
    dt: float | None = None,
    *,
    interpolation: str = "cubic",
    error: float = JOINT_ERROR,
    offset: float = OFFSET,
    part_time: float | None = None,
) -> Exported:
    """Write the motion as YAML, or as JSON where the path ends with ``.json``.

    Args:
        source: what is exported.
        path: the file; with ``part_time`` parts are called ``<name>-1.yaml`` and so on.
        dt: longest time between points [s].
        interpolation: ``"linear"``: points have positions only; ``"cubic"``: and velocities;
            ``"quintic"``: and accelerations.
        error: largest distance of a joint from the plan's, as the controller interpolates [rad].
        offset: ``time_from_start`` of the first point [s].
        part_time: longest duration of a part [s]; each begins and ends at rest.
    """
    check_choice("interpolation", interpolation, INTERPOLATIONS)
    check_number("error", error, 1e-6, 1.0, "rad")
    check_number("offset", offset, 0.0, 3600.0, "s")
    gap = LONGEST_GAP if dt is None else check_number("dt", dt, 1e-3, 1e3, "s")
    if source.with_forces:
        gap = min(gap, EFFORT_GAP)
    source, edges = _parts(source, part_time)
    parts = [choose_points(source, interpolation, error, gap, a, b)
             for a, b in pairwise(edges)]  # fmt: skip
    files = _names(path, len(parts)) if part_time is not None else [path]
    for file, points in zip(files, parts, strict=True):
        _write(file, source, points, interpolation, offset)
    slowed = max(p.slowed for p in parts)
    notes = (f"made {slowed:.6f} times as slow to keep limits between points",)
    return Exported(
        files=tuple(files),
        numbers={
            "points": float(sum(len(p.times) for p in parts)),
            "joint error [rad]": max(p.joint_error for p in parts),
            "peak velocity [share of limit]": max(p.peak for p in parts),
        },
        notes=notes if slowed > 1.0 else (),
    )


def _parts(source: Source, longest: float | None) -> tuple[Source, list[float]]:
    """The motion with a stop at the end of every part, and when parts begin and end.

    Raises:
        InputError: there is no place to stop within a part.
    """
    plan = source.plan
    if longest is None or plan.duration <= check_number("part_time", longest, 0.1, 1e5, "s"):
        return source, [0.0, plan.duration]
    rests = _rests(source)
    if not len(rests) and plan.settings.static:
        # Where all feet stand, a statically stable walk may stop.
        stances = [0.5 * (p.start + p.end) for p in plan.phases if p.kind == "stance"]
        inside = [t for t in stances if source.ramp < t < plan.duration - source.ramp]
        chosen = _chosen(np.array(inside), plan.duration, longest - source.ramp)
        stopped = replace(source, plan=at_rest(plan, source.ramp, chosen[1:-1]))
        check_stops(stopped.plan)
        rests, source = _rests(stopped), stopped
    return source, _chosen(rests, source.plan.duration, longest)


def check_stops(plan: Plan) -> None:
    """Refuse stops for which a plan that promises contact forces has none.

    Raises:
        InputError: names what is in the way.
    """
    if plan.settings.promised_forces is None:
        return
    # At the path's knots, too: those of short ramps lie between samples.
    times = np.union1d(np.arange(0.0, plan.duration, EFFORT_GAP), plan.path.times)
    worst = contact_forces(plan, times=times).worst()
    if worst is not None:
        raise InputError(
            f"no contact forces stop this walk at the ends of parts: {worst}; give a longer ramp, "
            "or export plan.slowed(2)"
        )


def _rests(source: Source) -> FloatArray:
    """Times inside the plan at which nothing moves."""
    path = source.plan.path
    inner = path.times[1:-1]
    moving = np.abs(path.evaluate(inner, 1)) + path.jumps(1)
    return np.asarray(inner[moving.max(axis=1, initial=0.0) <= REST * 10])


def _chosen(rests: FloatArray, duration: float, longest: float) -> list[float]:
    """Ends of parts, each as late as it may be."""
    edges = [0.0]
    while duration - edges[-1] > longest:
        near = rests[(rests > edges[-1] + NANOSECOND) & (rests <= edges[-1] + longest)]
        if not len(near):
            raise InputError(
                f"within {longest:.3g} s after {edges[-1]:.3f} s of the plan there is no place to "
                "stop: give a larger part_time or a shorter ramp"
            )
        edges.append(float(near[-1]))
    return [*edges, duration]


def _names(path: Path, count: int) -> list[Path]:
    """Names of the files of parts."""
    digits = len(str(count))
    return [path.with_name(f"{path.stem}-{i:0{digits}d}{path.suffix}") for i in range(1, count + 1)]


def message(source: Source, points: Points, interpolation: str, offset: float) -> dict[str, Any]:
    """The message as plain lists and numbers, with the fields' names of ROS."""
    tables = {"positions": points.positions}
    if interpolation != "linear":
        tables["velocities"] = points.velocities
    if interpolation == "quintic":
        tables["accelerations"] = points.accelerations
    if source.with_forces:
        found = forces_at(source.plan, points.plan_times)
        tables["effort"] = found.torques[:, source.order.columns]
    stamps = np.rint((points.times + offset) / NANOSECOND).astype(np.int64).tolist()
    return {
        "header": {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": ""},
        "joint_names": list(source.order.names),
        "points": [
            {name: [_rounded(x) for x in table[i]] for name, table in tables.items()}
            | {"time_from_start": {"sec": stamp // 10**9, "nanosec": stamp % 10**9}}
            for i, stamp in enumerate(stamps)
        ],
    }


def _rounded(value: float) -> float:
    """A number as it is written: with 12 digits, and no minus before a zero."""
    return float(f"{value:.12g}") + 0.0


def _write(file: Path, source: Source, points: Points, interpolation: str, offset: float) -> None:
    told = message(source, points, interpolation, offset)
    with written_whole(file) as stream:
        if file.suffix.lower() == ".json":
            json.dump(told, stream, allow_nan=False)
        else:
            stream.writelines(_yaml(told, source, points))


def _yaml(told: dict[str, Any], source: Source, points: Points) -> Iterator[str]:
    """The message in YAML: JSON's lists and texts are YAML, too."""
    yield (
        f"# {shown(source.plan.robot.name)}: {len(points.times)} points, "
        f"{points.times[-1]:.3f} s\n"
        f"header: {json.dumps(told['header'])}\njoint_names:\n"
    )
    # YAML does not join the two escapes of JSON for a character beyond U+FFFF.
    yield from (f"- {json.dumps(name, ensure_ascii=False)}\n" for name in told["joint_names"])
    yield "points:\n"
    for point in told["points"]:
        lines = [f"{name}: {json.dumps(value)}\n" for name, value in point.items()]
        yield "- " + "  ".join(lines)


FORMAT = Format(
    name="ros2",
    summary="JointTrajectory of ROS 2 for joint_trajectory_controller, YAML or JSON",
    suffixes=(".yaml", ".yml", ".json"),
    write=write_trajectory,
    options=("interpolation", "error", "offset", "part_time"),
    forces=False,
)
