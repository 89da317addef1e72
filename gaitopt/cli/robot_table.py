"""The table that ``gaitopt robot`` prints."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from rich.box import SIMPLE_HEAD
from rich.markup import escape
from rich.table import Table
from rich.text import Text

from gaitopt.cli.results.documents import plain
from gaitopt.cli.robot_options import in_options
from gaitopt.conventions import FloatArray
from gaitopt.robots.quadruped import Quadruped


def robot_tables(robot: Quadruped) -> tuple[Table, Table]:
    """Two tables of what was found in a robot's URDF: its legs, and their joints."""
    # Without sides: the numbers of a leg then fit into one line of 80 columns.
    legs = Table(
        box=SIMPLE_HEAD,
        padding=(0, 1, 0, 0),
        title=Text(
            f"{robot.name}: {robot.mass:.4g} kg, stance {robot.stance_size[0]:.3f} x "
            f"{robot.stance_size[1]:.3f} m, foot radius {1e3 * robot.foot_radius:.4g} mm"
        ),
        caption=f"leg kinematics and Pinocchio agree to {robot.closed_form_error:.1e} m",
    )
    joints = Table()
    for header in ("leg", "hip [m]", "links [m]", "offset [m]", "knee", "reach [m]"):
        legs.add_column(Text(header))
    for header in ("leg", "joint", "limits [rad]", "velocity [rad/s]", "torque [N m]"):
        joints.add_column(Text(header))
    for name, leg in robot.legs.items():
        hip = " ".join(f"{x:.3f}" for x in leg.hip)
        knee = "forward" if leg.knee > 0 else "backward"
        legs.add_row(name, hip, f"{leg.upper:.3f} {leg.lower:.3f}", f"{leg.lateral:.3f}", knee,
                     f"{leg.least_reach:.3f} .. {leg.reach:.3f}")  # fmt: skip
        for i, joint in enumerate(leg.joints):
            low, high = leg.position_limits[:, i]
            effort = robot.effort_limits[robot.leg_columns[name][i]]
            joints.add_row(
                name if i == 0 else "", Text(joint), f"{low:.3g} .. {high:.3g}",
                f"{leg.velocity_limits[i]:.4g}", f"{effort:.4g}",
                end_section=i == len(leg.joints) - 1,
            )  # fmt: skip
    return legs, joints


def robot_document(robot: Quadruped) -> dict[str, Any]:
    """The same numbers by name, for programs [m, kg, rad, rad/s, N m]."""
    legs = {
        name: {
            "joints": leg.joints, "foot": leg.foot, "hip": leg.hip, "upper": leg.upper,
            "lower": leg.lower, "lateral": leg.lateral,
            "knee": "forward" if leg.knee > 0 else "backward",
            "reach": [leg.least_reach, leg.reach], "position_limits": leg.position_limits.T,
            "velocity_limits": leg.velocity_limits,
            "effort_limits": robot.effort_limits[list(robot.leg_columns[name])],
            "acceleration_limits": robot.acceleration_limits[list(robot.leg_columns[name])],
        }
        for name, leg in robot.legs.items()
    }  # fmt: skip
    document = {
        "robot": robot.name, "urdf_sha256": robot.sha256, "mass": robot.mass,
        "foot_radius": robot.foot_radius, "standing_height": robot.standing_height,
        "read_as": robot.notes.kind, "guessed": robot.notes.done,
        "warnings": robot.notes.warnings, "legs": legs,
    }  # fmt: skip
    return {name: plain(value) for name, value in document.items()}


def robot_notes(robot: Quadruped, source: str, folders: Sequence[Path]) -> Iterator[str]:
    """Lines on what was read and guessed, where meshes are, and warnings with their cures.

    Args:
        robot: the robot.
        source: its file, a name, or the text of a file.
        folders: of packages, in which meshes are looked for.
    """
    standing = f"standing with its hips {robot.standing_height:.2f} m high"
    yield f"read as {escape(robot.notes.kind)}, {standing}"
    yield escape(
        "links of the feet: " + ", ".join(f"{leg}: {one.foot}" for leg, one in robot.legs.items())
    )
    accelerations = robot.acceleration_limits[robot.leg_joint_columns]
    if np.isfinite(accelerations).any():
        count = np.isfinite(accelerations).sum()
        yield f"acceleration limits: {_range(accelerations)} rad/s², at {count} joints"
    inertia = robot.motor_inertia[robot.leg_joint_columns]
    if inertia.any():
        yield f"motors: inertia at the joints {_range(inertia)} kg m²"
    full, none = robot.torque_lines[:, robot.leg_joint_columns]
    if np.isfinite(none).any():
        yield (
            f"motors: whole torque up to {_range(full)} rad/s, and none at {_range(none)} rad/s, "
            f"at {np.isfinite(none).sum()} joints"
        )
    yield from _general_legs(robot)
    for text in robot.notes.done:
        yield escape(text)
    yield from _mesh_lines(robot, source, folders)
    for text in robot.notes.warnings:
        yield f"[bold yellow]warning[/]: {escape(in_options(text))}"
    if not robot.notes.warnings:
        yield "no warnings"


def _general_legs(robot: Quadruped) -> Iterator[str]:
    """What is different of legs that are not roll-pitch-pitch."""
    general = [leg for leg in robot.legs.values() if leg.is_general]
    if not all(leg.has_roll for leg in robot.legs.values()):
        yield "legs without a roll joint: it walks straight ahead; not for plan_route and terrain"
    for closed, how in (
        (True, "closed form, as the first two axes meet or are parallel"),
        (False, "numerical inverse kinematics, slower"),
    ):
        names = ", ".join(leg.name for leg in general if leg.is_closed_form == closed)
        if names:
            yield f"legs {names}: axes other than roll-pitch-pitch ({how}); not for plan_route"


def _range(values: FloatArray) -> str:
    """The finite ones of some numbers, in words."""
    known = values[np.isfinite(values)]
    least, most = f"{known.min():.4g}", f"{known.max():.4g}"
    return least if least == most else f"{least} to {most}"


def _mesh_lines(robot: Quadruped, source: str, folders: Sequence[Path]) -> Iterator[str]:
    """Which mesh files were found where."""
    from gaitopt.certificate.collisions.self_collision import links_without_hulls
    from gaitopt.robots.catalog import robot_file
    from gaitopt.robots.files.meshes import found_meshes
    from gaitopt.robots.files.notes import first_of

    file = robot_file(source)
    found = found_meshes(robot.urdf, None if file is None else file.parent, folders)
    missing = sorted(name for name, path in found.items() if path is None)
    places: dict[str, list[str]] = {}
    for path in found.values():
        if path is not None:
            places.setdefault(os.path.normpath(path.parent), []).append(path.name)
    if found:
        yield f"meshes: {len(found) - len(missing)} of {len(found)} found"
    for folder, names in sorted(places.items()):
        yield escape(f"  in {folder}: {first_of(sorted(names), 3)}")
    unknown = links_without_hulls(robot)
    if missing:
        only = "" if unknown else "; they cost the drawing only"
        yield escape(f"meshes that are missing: {first_of(missing, 3)} (--package-folder{only})")
    if unknown:
        yield escape(
            "self-collisions: certificates leave them unchecked, because collision meshes are "
            f"missing or cannot be read, those of {first_of(unknown)}"
        )
