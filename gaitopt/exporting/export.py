"""``export``: a plan's motion for robots, simulators and learning code."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from difflib import get_close_matches
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final

import numpy as np

from gaitopt.errors import InputError
from gaitopt.exporting import (
    bag,
    crocoddyl,
    learning,
    mujoco_files,
    rerun_file,
    ros,
    tables,
    unitree,
)
from gaitopt.exporting.at_rest import RAMP, at_rest
from gaitopt.exporting.format import Format
from gaitopt.exporting.interpolation import CORNER
from gaitopt.exporting.joint_order import Joints, joint_order
from gaitopt.exporting.sampled import Exported, Source
from gaitopt.files import StrPath
from gaitopt.inputs import as_text, check_kind
from gaitopt.plan.plan import Plan

FORMATS: Final[Mapping[str, Format]] = MappingProxyType(
    {
        module.FORMAT.name: module.FORMAT
        for module in (ros, bag, mujoco_files, unitree, learning, crocoddyl, rerun_file, tables)
    }
)
"""All formats, by name."""


def export(
    plan: Plan,
    path: StrPath,
    format: str | None = None,
    *,
    dt: float | None = None,
    joints: Joints = None,
    prefix: str = "",
    controller: str | None = None,
    forces: bool | None = None,
    ramp: float = RAMP,
    **options: Any,
) -> Exported:
    """Write a plan's motion for another program.

    The motion in the file begins and ends at rest. Where the plan moves at its ends (as plans with
    ``timing="velocity"`` do), its pace rises and falls evenly there, along the same path.

    Args:
        plan: from any planner.
        path: the file; it is complete, or not there at all.
        format: its format, one of :data:`gaitopt.exporting.export.FORMATS`; by default that of the
            path's ending. The page "From plan to robot" describes them and their options.
        dt: time between samples [s]; by default the format's own.
        joints: which joints, in which order: their names in a list; ``{"plan's": "new"}``; or the
            path of a controller's parameter file (YAML). All in the plan's order by default.
        prefix: begins every joint's name in the file.
        controller: the controller in a parameter file that has several.
        forces: whether the file has joint torques and contact forces; by default where the plan
            promises them and the format's consumers take them.
        ramp: time in which the pace rises from zero, or falls, where the plan moves at its ends
            [s]; 0 refuses such plans.
        options: of the format.

    Returns:
        The files, and what was measured of them.

    Raises:
        InputError: format, option or joint is unknown; a name is not safe to write; the plan does
            not fit the format; or the file cannot be written.
        MissingPackageError: the format needs a package that is not installed.
    """
    check_kind("plan", plan, Plan)
    if not plan.duration > 0.0:
        raise InputError("this plan takes no time: there is no motion to export")
    try:
        target = Path(path)
    except TypeError:
        raise InputError(
            f"the path of a file must be a text or a path, got {as_text(path)}"
        ) from None
    chosen = _format(target, format)
    _check_options(chosen, options)
    order = joint_order(plan.robot.joint_names, joints, prefix, controller)
    resting = at_rest(plan, ramp)
    notes = []
    if resting is not plan:
        notes.append(
            f"the plan moves at its ends: its pace rises and falls within {ramp:g} s there, so "
            f"that the motion takes {resting.duration:.3f} s and not {plan.duration:.3f} s"
        )
    if order.left_out:
        notes.append(f"without the joints {', '.join(order.left_out)}")
    source = Source(resting, order, _with_forces(resting, chosen, forces), ramp, tuple(notes))
    written = chosen(source, target, dt, **options)
    return replace(written, notes=(*notes, *written.notes))


def export_ros(plan: Plan, path: StrPath, dt: float | None = None) -> None:
    """Write the joints' motion as YAML in the format of ``trajectory_msgs/JointTrajectory``.

    It is :func:`export` with the format ``"ros2"`` and its defaults: at rest at both ends, points
    with positions [rad] and velocities [rad/s], so chosen that the cubic of the controller keeps
    the joints' velocity limits and is within 1e-3 rad of the plan.

    Args:
        plan: the plan.
        path: the file; it is complete, or not there at all.
        dt: longest time between points [s].

    Raises:
        InputError: ``dt`` is out of range, a name is not safe to write, or the file cannot be
            written.
    """
    export(plan, path, "ros2", dt=dt)


def _format(path: Path, name: str | None) -> Format:
    """The format of this name, or of the path's ending."""
    known = ", ".join(FORMATS)
    if name is not None:
        if name not in FORMATS:
            near = get_close_matches(str(name), FORMATS, n=1)
            hint = f"did you mean {near[0]}?" if near else f"there are {known}"
            raise InputError(f"unknown format {name!r}; {hint}")
        return FORMATS[name]
    suffix = path.suffix.lower()
    found = [f for f in FORMATS.values() if suffix in f.suffixes]
    if len(found) != 1:
        names = ", ".join(f.name for f in found) or known
        raise InputError(f"the ending of {path} does not say the format; give one of {names}")
    return found[0]


def _check_options(chosen: Format, options: Mapping[str, Any]) -> None:
    for name in options:
        if name not in chosen.options:
            near = get_close_matches(name, chosen.options, n=1)
            known = ", ".join(chosen.options) or "none"
            hint = f"did you mean {near[0]}?" if near else f"it has {known}"
            raise InputError(f"the format {chosen.name} has no option {name!r}; {hint}")


def _with_forces(plan: Plan, chosen: Format, asked: bool | None) -> bool:
    """Whether the file has torques and contact forces.

    Raises:
        InputError: they were asked for, and the plan has none.
    """
    if asked not in (None, True, False):
        raise InputError(f"forces must be True, False or None, got {as_text(asked)}")
    if asked is None:
        return chosen.forces and plan.settings.promised_forces is not None
    if asked:
        plan.robot.require_masses()
        jump = float(np.max(plan.path.jumps(1), initial=0.0))
        if jump > CORNER:
            raise InputError(
                f"velocities of this plan jump by {jump:.3g} rad/s: no torques make that motion; "
                "export gaitopt.retimed(plan), or leave forces out"
            )
    return asked
