"""A certificate: what holds of a plan at every instant, and not only at samples.

It is worked out from the robot's URDF and the stored path with Pinocchio's kinematics, and bounds
hold for the time between samples (:mod:`gaitopt.certificate.enclosure`). The checks use none of the
planners' bounds, constraints, kinematics or collision shapes. Shared with the planners are the
data: robot, plan, path, footholds and obstacles; and :meth:`gaitopt.Leg.inverse` finds the square
stance, in which pairs of shapes that touch are left out of the check of self-collision.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache

from gaitopt.certificate import balance, clearance, contacts, joints
from gaitopt.certificate.certificate import Certificate
from gaitopt.certificate.check import ASKED_FORCES, FORCES, Check, unchecked
from gaitopt.certificate.claims.known_robot import refuse_other_robot, refuse_other_text
from gaitopt.certificate.claims.statements import not_compared, not_judged, phases_agree
from gaitopt.certificate.claims.weak_settings import weak_settings
from gaitopt.certificate.collisions import obstacles, self_collision
from gaitopt.certificate.collisions.pair_search import CONTACT
from gaitopt.certificate.forces import contact_forces
from gaitopt.certificate.ground.checks import ground_checks
from gaitopt.certificate.trace import trace
from gaitopt.dynamics.contacts import ForceLimits
from gaitopt.errors import InputError
from gaitopt.inputs import as_text, check_kind
from gaitopt.plan.plan import Plan
from gaitopt.robots.quadruped import Quadruped


def verify(
    plan: Plan,
    robot: Quadruped | None = None,
    *,
    collisions: bool = True,
    forces: ForceLimits | None = None,
) -> Certificate:
    """Judge a plan at every instant.

    Masses, lengths and limits are those of the plan's URDF, which is read anew, and settings are
    checked anew: what was changed in memory does not count.

    Args:
        plan: any planner's plan.
        robot: the robot it is to run on; the plan's own by default.
        collisions: whether to look for self-collisions.
        forces: limits within which contact forces and joint torques must exist at every instant;
            those that the plan promises by default. A plan that promises none is not certified
            without them, and where forces do not exist its outcome is ``"kinematics only"``. Where
            a plan promises other limits, both are checked: ``"contact forces"`` is the promise,
            and ``"contact forces as asked"`` is this.

    Returns:
        The certificate. A violated check is no error: see :meth:`Certificate.raise_for_violations`.

    Raises:
        InputError: plan, robot or ``forces`` are something else, or a setting was changed in memory
            to a value that it cannot have.
        RobotError: the plan was made for another URDF than that of ``robot``; or its robot bears
            the name of one that is known, and differs from it, or has wider limits.
    """
    check_kind("plan", plan, Plan)
    plan = _read_anew(plan)
    compared = True
    if robot is None:
        compared = refuse_other_robot(plan.robot)
    else:
        check_kind("robot", robot, Quadruped)
        refuse_other_text(plan.robot, robot)
    forces = None if forces is None else _checked(forces)
    motion = trace(plan)
    found: list[Check | None] = [
        contacts.continuity(plan),
        contacts.contact_sequence(plan),
        phases_agree(plan, motion),
        contacts.slip(plan, motion),
        contacts.landings(plan, motion),
        contacts.swing_height(plan, motion),
        contacts.ground(plan, motion),
        clearance.swing_clearance(plan, motion),
        *ground_checks(plan, motion),
        joints.joint_positions(plan, motion),
        joints.joint_velocities(plan, motion),
        joints.joint_accelerations(plan, motion),
        joints.joint_jerks(plan, motion),
        joints.reach(plan, motion),
        balance.margin_of_cog(plan, motion),
        balance.margin_of_com(plan, motion),
        balance.zmp(plan, motion),
        obstacles.obstacles_cleared(plan),
        self_collision.self_collision(plan)
        if collisions
        else unchecked(self_collision.NAME, "m", "not asked for", CONTACT),
        *_checks_of_forces(plan, forces),
        *weak_settings(plan, [each for each in (plan.settings.promised_forces, forces) if each]),
        None if compared else not_compared(plan.robot),
        not_judged(plan),
    ]
    judged = tuple(check for check in found if check is not None)
    return Certificate(plan.robot.name, plan.robot.sha256, judged, len(motion.phase) + 1)


def _checks_of_forces(plan: Plan, asked: ForceLimits | None) -> list[Check]:
    """The check of what the plan promises, and of what is asked beyond it.

    Where both are there they have names of their own, so that none stands for the other.
    """
    promised = plan.settings.promised_forces
    found = [] if promised is None else [contact_forces(plan, promised)]
    if asked is not None and asked != promised:
        name = FORCES if promised is None else ASKED_FORCES
        found.append(replace(contact_forces(plan, asked), name=name, promised=False))
    return found or [unchecked(FORCES, "N", "not asked for", 0.0)]


def _read_anew(plan: Plan) -> Plan:
    """The plan as its file would give it back."""
    robot, settings = plan.robot, plan.settings
    limits = None if settings.forces is None else _checked(settings.forces)
    return replace(
        plan,
        robot=_robot_of(str(robot.urdf), str(robot.name), _texts(robot.knees)),
        footholds=plan.footholds.with_(),
        settings=replace(settings, forces=limits),
    )


def _texts(knees: Mapping[str, str]) -> tuple[tuple[str, str], ...]:
    return tuple(sorted((str(leg), str(side)) for leg, side in knees.items()))


@lru_cache(maxsize=4)
def _robot_of(urdf: str, name: str, knees: tuple[tuple[str, str], ...]) -> Quadruped:
    """A robot as its URDF has it, which nobody but the certificate knows, and could change."""
    return Quadruped.from_urdf(urdf, name, dict(knees))


def _checked(limits: ForceLimits) -> ForceLimits:
    if not isinstance(limits, ForceLimits):
        raise InputError(f"forces must be ForceLimits or None, got {as_text(limits)}")
    line = limits.torque_line
    return replace(limits, torque_line=None if line is None else replace(line))
