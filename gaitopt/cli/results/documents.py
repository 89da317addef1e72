"""Plans, certificates and simulations as JSON documents, for ``--json``."""

from __future__ import annotations

import dataclasses
import math
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from gaitopt.certificate.certificate import Certificate
    from gaitopt.plan.plan import Plan
    from gaitopt.simulation.result import SimulationResult


def plain(value: Any) -> Any:
    """A value as JSON has it: numbers that are not finite become ``null``, arrays lists."""
    import numpy as np

    if isinstance(value, dict):
        return {str(key): plain(each) for key, each in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(each) for each in value]
    if isinstance(value, np.ndarray):
        return plain(value.tolist())
    if isinstance(value, Enum):
        return str(value)
    if isinstance(value, (bool, np.bool_)) or value is None:
        return None if value is None else bool(value)
    if isinstance(value, (int, np.integer)):
        return int(value)
    if isinstance(value, (float, np.floating)):
        return float(value) if math.isfinite(value) else None
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {f.name: plain(getattr(value, f.name)) for f in dataclasses.fields(value)}
    return str(value) if isinstance(value, (str, Path)) else repr(value)


def plan_document(plan: Plan) -> dict[str, Any]:
    """What a plan is: numbers in metres, seconds and m/s, and the settings that it was made for."""
    document = {
        "robot": plan.robot.name, "planner": plan.settings.planner, "steps": len(plan.swings),
        "distance": plan.distance, "duration": plan.duration, "mean_speed": plan.mean_speed,
        "margin": plan.margin, "urdf_sha256": plan.robot.sha256,
        "settings": plan.settings.to_dict(),
    }  # fmt: skip
    return {name: plain(value) for name, value in document.items()}


def certificate_document(certificate: Certificate) -> dict[str, Any]:
    """The outcome, and every check with its numbers."""
    return {
        "outcome": str(certificate.outcome),
        "checks": [plain(check) for check in certificate.checks],
    }


def simulation_document(result: SimulationResult) -> dict[str, Any]:
    """The verdict, and the numbers of a simulation without its samples."""
    names = ("passed", "failures", "status", "end", "waited", "steps_done", "steps", "missed",
             "landing_error", "tilt", "body_error", "smallest_margin", "slip", "torque_use",
             "rate_use", "servo_tolerance", "energy", "own_shapes", "bumps")  # fmt: skip
    return {name: plain(getattr(result, name)) for name in names}
