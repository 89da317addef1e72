"""Contact forces held against the equations of motion and their limits, from the forces alone."""

from __future__ import annotations

import numpy as np

from gaitopt.conventions import BoolArray, FloatArray
from gaitopt.dynamics.contact_forces import ContactForces
from gaitopt.dynamics.contacts import pyramid_rows
from gaitopt.dynamics.force_space import ForceProblem
from gaitopt.dynamics.force_status import FORCE_TOLERANCE, ForceResiduals
from gaitopt.dynamics.torque_limits import effort_limits


def judged(problem: ForceProblem, forces: FloatArray, conflicts: BoolArray) -> ContactForces:
    """Contact forces with the torques that belong to them and all residuals.

    Args:
        problem: the problem.
        forces: ``(N, 4, 3)`` in the world's axes [N].
        conflicts: which limits were found to be in the way ``(N, 8 + nj)``; those that the forces
            exceed are added.
    """
    standing, limits = problem.standing, problem.limits
    normals, grip = problem.equations.contacts.normals, problem.equations.contacts.grip
    pressing = np.einsum("nfi,nfi->nf", normals, forces)
    sliding = np.linalg.norm(forces - pressing[..., None] * normals, axis=2)
    friction = -(pyramid_rows(limits, normals, grip) @ forces[..., None])[..., 0].min(axis=2)
    least = problem.weight * limits.least_normal_shares(standing)
    missed = np.maximum(least - pressing, pressing - problem.weight * problem.most)
    left = problem.equations.residuals(forces)
    torques = problem.equations.torques(forces)
    beyond = np.maximum(problem.torque_low - torques, torques - problem.torque_high)
    residuals = ForceResiduals(
        force=np.linalg.norm(left[:, :3], axis=1),
        moment=np.linalg.norm(left[:, 3:], axis=1),
        friction=np.where(standing, np.maximum(friction, 0.0), 0.0),
        normal_force=np.where(standing, np.maximum(missed, 0.0), 0.0),
        torque=np.maximum(beyond, 0.0),
    )
    return ContactForces(
        times=problem.times,
        forces=forces,
        torques=torques,
        standing=standing,
        reserve=np.where(standing, pressing / problem.weight, np.inf).min(axis=1),
        friction_use=np.where(standing, _cone_use(sliding, limits.friction * grip * pressing), 0.0),
        torque_use=_torque_use(problem, torques),
        residuals=residuals,
        conflict_table=conflicts | _exceeded(problem, residuals),
        limits=limits,
        joint_names=problem.robot.joint_names,
        unlimited=effort_limits(problem.robot).unknown,
        weight=problem.weight,
        length=problem.length,
    )


def _exceeded(problem: ForceProblem, residuals: ForceResiduals) -> BoolArray:
    """Which limits the forces exceed by more than rounding ``(N, 8 + nj)``."""
    largest = np.maximum(-problem.torque_low, problem.torque_high)
    return np.concatenate(
        [
            residuals.friction > FORCE_TOLERANCE * problem.weight,
            residuals.normal_force > FORCE_TOLERANCE * problem.weight,
            residuals.torque > FORCE_TOLERANCE * largest,
        ],
        axis=1,
    )


def _cone_use(sliding: FloatArray, holding: FloatArray) -> FloatArray:
    """Tangential force as a share of the largest one; ``inf`` where a foot does not press."""
    pressed = holding > 0.0
    return np.where(pressed, sliding / np.where(pressed, holding, 1.0), np.inf)


def _torque_use(problem: ForceProblem, torques: FloatArray) -> FloatArray:
    """Torques as shares of what the joints have ``(N, nj)``; NaN without a known limit."""
    bound = np.where(torques >= 0.0, problem.torque_high, -problem.torque_low)
    full = bound / problem.limits.torque_share
    known = np.isfinite(full)
    with np.errstate(divide="ignore", invalid="ignore"):
        use = np.abs(torques) / full
    # No torque at a speed at which the motor has none is no use at all.
    return np.where(known, np.where(torques == 0.0, 0.0, use), np.nan)
