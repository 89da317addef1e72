"""Plan files: an ``.npz`` of plain arrays and one JSON header. Loading one executes nothing."""

from __future__ import annotations

import io
import json
import zipfile
import zlib
from dataclasses import fields
from typing import Any

import numpy as np

from gaitopt.conventions import LEGS
from gaitopt.errors import GaitoptError, PlanFileError
from gaitopt.files import StrPath, read_bounded, written_whole
from gaitopt.planning.path import MotionPath
from gaitopt.planning.phase import CogEvidence, Limit, Phase
from gaitopt.planning.plan import Plan
from gaitopt.planning.settings import settings_from_dict
from gaitopt.robots.quadruped import Quadruped
from gaitopt.terrain.footholds import Footholds

FORMAT = "gaitopt-plan"
VERSION = 1
FILE_LIMIT = 300_000_000
"""Most bytes of a plan file that are read."""
CONTENT_LIMIT = 1_000_000_000
"""Most bytes that a plan file may unpack to."""

_ARRAYS = ("footholds", "times", "coefficients")


def save_plan(plan: Plan, path: StrPath) -> None:
    """Write ``plan`` to ``path``, whole or not at all.

    The file holds the robot's URDF, so that whoever receives it needs nothing else.

    Raises:
        InputError: the file cannot be written.
    """
    header = {
        "format": FORMAT,
        "version": VERSION,
        "robot": {
            "name": plan.robot.name,
            "sha256": plan.robot.sha256,
            "knees": dict(plan.robot.knees),
            "urdf": plan.robot.urdf,
        },
        "planner": plan.settings.planner,
        "settings": plan.settings.to_dict(),
        "column_radius": plan.footholds.radius,
        "phases": [_phase_to_dict(phase) for phase in plan.phases],
        "info": dict(plan.info),
    }
    text = json.dumps(header, allow_nan=False).encode()
    with written_whole(path, binary=True) as stream:
        np.savez_compressed(
            stream,
            header=np.frombuffer(text, dtype=np.uint8),
            footholds=plan.footholds.array,
            times=plan.path.times,
            coefficients=plan.path.coefficients,
        )


def load_plan(path: StrPath) -> Plan:
    """Read a plan that :meth:`Plan.save` wrote.

    Raises:
        PlanFileError: the file is missing, cut short, too large, of another version, or no plan
            at all; or its URDF is not the one it was planned with.
        RobotError: the URDF inside cannot be used.
    """
    data = read_bounded(path, FILE_LIMIT, PlanFileError)
    try:
        header, arrays = _unpack(data, str(path))
        return _plan_from(header, arrays, str(path))
    except GaitoptError as error:
        if isinstance(error, PlanFileError) or not str(error):
            raise
        raise PlanFileError(f"{path} holds no valid plan: {error}") from error
    except (
        zipfile.BadZipFile, zlib.error, EOFError, OSError, KeyError, ValueError, TypeError,
        AttributeError, NotImplementedError, RecursionError, MemoryError,
    ) as error:  # fmt: skip
        raise PlanFileError(
            f"{path} is no plan file, or was cut short ({type(error).__name__}: {error}); make it "
            "anew with Plan.save"
        ) from error


def _unpack(data: bytes, name: str) -> tuple[dict[str, Any], dict[str, Any]]:
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        content = sum(entry.file_size for entry in archive.infolist())
        if content > CONTENT_LIMIT:
            raise PlanFileError(
                f"{name} would unpack to {content / 1e9:.1f} GB; at most {CONTENT_LIMIT / 1e9:.0f} "
                "GB are read"
            )
        broken = archive.testzip()
        if broken:
            raise PlanFileError(f"{name}: the part {broken} is damaged; ask for the file again")
    with np.load(io.BytesIO(data), allow_pickle=False) as stored:
        missing = [key for key in ("header", *_ARRAYS) if key not in stored]
        if missing:
            raise PlanFileError(f"{name} is no plan file: it has no part {', '.join(missing)}")
        header = json.loads(stored["header"].tobytes().decode("utf-8"))
        if not isinstance(header, dict) or header.get("format") != FORMAT:
            raise PlanFileError(f"{name} is no plan file: its header is of another kind")
        if header.get("version") != VERSION:
            raise PlanFileError(
                f"{name} is a plan of version {header.get('version')!r}; this gaitopt reads "
                f"version {VERSION}"
            )
        return header, {key: stored[key] for key in _ARRAYS}


def _plan_from(header: dict[str, Any], arrays: dict[str, Any], name: str) -> Plan:
    described = header["robot"]
    robot = Quadruped.from_urdf(described["urdf"], described["name"], described["knees"])
    if robot.sha256 != described["sha256"]:
        raise PlanFileError(
            f"{name}: the URDF inside has the fingerprint {robot.sha256[:12]}..., and the plan was "
            f"made for {str(described['sha256'])[:12]}...; plan again for this robot"
        )
    points = dict(zip(LEGS, arrays["footholds"], strict=True))
    return Plan(
        robot=robot,
        footholds=Footholds(points, header["column_radius"]),
        settings=settings_from_dict(header["planner"], header["settings"]),
        phases=tuple(_phase_from_dict(p) for p in header["phases"]),
        path=MotionPath(arrays["times"], arrays["coefficients"]),
        info=header["info"],
    )


def _phase_to_dict(phase: Phase) -> dict[str, Any]:
    out: dict[str, Any] = {f.name: getattr(phase, f.name) for f in fields(phase)}
    for key in ("cog_start", "cog_end", "foot_start", "foot_end"):
        out[key] = out[key].tolist()
    out["limited_by"] = [[x.kind, x.name, x.value, x.spans] for x in phase.limited_by]
    if phase.evidence is not None:
        out["evidence"] = {**vars(phase.evidence), "duals": dict(phase.evidence.duals)}
    return out


def _phase_from_dict(stored: dict[str, Any]) -> Phase:
    limits = tuple(
        Limit(kind, name, value, tuple((a, b) for a, b in spans))
        for kind, name, value, spans in stored["limited_by"]
    )
    evidence = stored["evidence"]
    return Phase(**{
        **stored,
        "support": tuple(stored["support"]),
        "limited_by": limits,
        "evidence": None if evidence is None else CogEvidence(**evidence),
    })  # fmt: skip
