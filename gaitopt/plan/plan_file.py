"""Reading plan files."""

from __future__ import annotations

from typing import Any

from gaitopt.errors import GaitoptError, PlanFileError
from gaitopt.files import StrPath, read_bounded
from gaitopt.motion.path import MotionPath
from gaitopt.plan.archive import FILE_LIMIT, _unpack
from gaitopt.plan.foothold_archive import unpacked_footholds
from gaitopt.plan.phase import _phase_from_dict
from gaitopt.plan.plan import Plan
from gaitopt.plan.record import record_from_dict
from gaitopt.plan.settings.by_name import settings_from_dict
from gaitopt.robots.quadruped import Quadruped


def load_plan(path: StrPath) -> Plan:
    """Read a plan that :meth:`Plan.save` wrote.

    Raises:
        PlanFileError: the file is missing, cut short, too large, of another version, or no plan
            at all; its URDF is not the one it was planned with, or cannot be used.
    """
    data = read_bounded(path, FILE_LIMIT, PlanFileError)
    try:
        header, arrays = _unpack(data, str(path))
        return _plan_from(header, arrays, str(path))
    except PlanFileError:
        raise
    except GaitoptError as error:
        raise PlanFileError(f"{path} holds no valid plan: {error}") from error
    except Exception as error:
        # Damaged and made-up files make the libraries that read them raise errors of many kinds:
        # RuntimeError for an encrypted part, tokenize's for the header of an array, lzma's own,
        # MemoryError for an array that is said to be huge, RecursionError for lists in lists.
        raise PlanFileError(
            f"{path} is no plan file, or was cut short ({type(error).__name__}: {error}); make it "
            "anew with Plan.save"
        ) from error


def _plan_from(header: dict[str, Any], arrays: dict[str, Any], name: str) -> Plan:
    described = header["robot"]
    robot = Quadruped.from_urdf(described["urdf"], described["name"], described["knees"])
    if robot.sha256 != described["sha256"]:
        raise PlanFileError(
            f"{name}: the URDF inside has the fingerprint {robot.sha256[:12]}..., and the plan was "
            f"made for {str(described['sha256'])[:12]}...; plan again for this robot"
        )
    return Plan(
        robot=robot,
        footholds=unpacked_footholds(header["column_radius"], header.get("footholds", {}), arrays),
        settings=settings_from_dict(header["planner"], header["settings"]),
        phases=tuple(_phase_from_dict(p) for p in header["phases"]),
        path=MotionPath(arrays["times"], arrays["coefficients"]),
        record=record_from_dict(header["planner"], header["info"]),
        entry=header.get("entry", 0),
    )
