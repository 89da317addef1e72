"""The verdict on a plan in one line: certificate, physics, and what to do next."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from gaitopt.certificate.certificate import Certificate
    from gaitopt.simulation.result import SimulationResult


def verdict_line(
    certificate: Certificate, physics: SimulationResult | None, plan: Path, masses: bool = True
) -> str:
    """One line: what is certified, what physics says, and what to do next.

    Args:
        certificate: of the plan.
        physics: the walk in physics; ``None`` where it was not tried.
        plan: the plan's file.
        masses: whether the robot has masses, without which there is no physics.
    """
    ahead = _next(certificate, physics, plan, masses)
    return "; ".join([_certified(certificate), _tried(physics), ahead])


def verdict_code(
    certificate: Certificate, physics: SimulationResult | None, strict: bool = False
) -> int:
    """The exit code: 1 where a promise is violated, or physics fails; otherwise 0.

    Args:
        certificate: of the plan.
        physics: the walk in physics; ``None`` where it was not tried.
        strict: whether the code is 3 where the plan is not certified.
    """
    if certificate.outcome == "violated" or (physics is not None and not physics.passed):
        return 1
    return 3 if strict and certificate.outcome != "certified" else 0


def _certified(certificate: Certificate) -> str:
    outcome = certificate.outcome
    if outcome == "certified":
        return "certified at every instant, contact forces included"
    if outcome == "violated":
        names = ", ".join(check.name for check in certificate.violations)
        return f"violated: {names}"
    if outcome == "kinematics only":
        from gaitopt.certificate.check import FORCES  # late: the command line begins without NumPy

        # Only what is promised and holds leaves what was asked for beyond it.
        if any(c.name == FORCES and c.promised and c.status == "ok" for c in certificate.checks):
            return "kinematics only: no contact forces keep the limits that were asked for"
        return "kinematics only: contact forces are not promised"
    missing = [c.name for c in certificate.checks if c.status == "unchecked" and c.promised]
    return f"not all checked: {', '.join(missing)}"


def _tried(physics: SimulationResult | None) -> str:
    if physics is None:
        return "not tried in physics"
    return "passed in physics" if physics.passed else f"failed in physics ({physics.failures[0]})"


def _next(
    certificate: Certificate, physics: SimulationResult | None, plan: Path, masses: bool
) -> str:
    doubtful = not certificate.ok or certificate.outcome == "not all checked"
    if doubtful or (physics is not None and not physics.passed):
        return f"next: gaitopt verify {plan}"
    if physics is None and not masses:
        return f"next: gaitopt export {plan} walk.csv, or masses for physics (--masses shapes)"
    if physics is None:
        return f"next: gaitopt simulate {plan}"
    return f"next: gaitopt export {plan} walk.csv"
