"""A certificate: what holds of a plan at every instant, and not only at samples.

Worked out from the robot's URDF and the stored path, with Pinocchio's kinematics. The planners' own
kinematics judge nothing here: :meth:`gaitopt.Leg.inverse` is used once, to find pairs of shapes
that touch in the standing pose. Shared with the planners are the data: robot, plan, path, obstacle.
Between samples, bounds take over (:mod:`gaitopt.certificate.enclosure`).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from gaitopt.certificate.certificate import Certificate
from gaitopt.certificate.check import Check
from gaitopt.errors import RobotError

if TYPE_CHECKING:
    from gaitopt.plan.plan import Plan
    from gaitopt.robots.quadruped import Quadruped


def verify(plan: Plan, robot: Quadruped | None = None, *, collisions: bool = True) -> Certificate:
    """Judge a plan at every instant.

    Args:
        plan: any planner's plan.
        robot: the robot it is to run on; the plan's own by default.
        collisions: whether to look for self-collisions, which takes most of the time.

    Returns:
        The certificate. A violated check is no error: see :meth:`Certificate.raise_for_violations`.

    Raises:
        RobotError: the plan was made for another URDF than that of ``robot``, or than the one that
            gaitopt ships under the same name.
    """
    from gaitopt.certificate import balance as check_balance
    from gaitopt.certificate import clearance as check_clearance
    from gaitopt.certificate import contacts as check_contacts
    from gaitopt.certificate import joints as check_joints
    from gaitopt.certificate import obstacles as check_obstacles
    from gaitopt.certificate import self_collision as collision
    from gaitopt.certificate import trace as motion

    _refuse_other_robot(plan, robot)
    traced = motion.trace(plan)
    found: list[Check | None] = [
        check_contacts.continuity(plan),
        check_contacts.contact_sequence(plan),
        check_contacts.slip(plan, traced),
        check_contacts.landings(plan, traced),
        check_contacts.swing_height(plan, traced),
        check_contacts.ground(plan, traced),
        check_clearance.swing_clearance(plan, traced),
        check_joints.joint_positions(plan, traced),
        check_joints.joint_velocities(plan, traced),
        check_joints.joint_accelerations(plan, traced),
        check_joints.joint_jerks(plan, traced),
        check_joints.reach(plan, traced),
        check_balance.margin_of_cog(plan, traced),
        check_balance.margin_of_com(plan, traced),
        check_balance.zmp(plan, traced),
        check_obstacles.obstacles_cleared(plan),
        collision.self_collision(plan)
        if collisions
        else Check("self-collision", "unchecked", float("nan"), 0.0, "m", note="not asked for"),
    ]
    judged = tuple(check for check in found if check is not None)
    return Certificate(plan.robot.name, plan.robot.sha256, judged, len(traced.feet_bulge) + 1)


def _refuse_other_robot(plan: Plan, robot: Quadruped | None) -> None:
    from gaitopt.robots.catalog import OWN_ROBOTS, VARIANTS, load_robot

    name = plan.robot.name
    if robot is None and name in (*OWN_ROBOTS, *VARIANTS):
        robot = load_robot(name)
    if robot is not None and robot.sha256 != plan.robot.sha256:
        raise RobotError(
            f"the plan was made for a {name} whose URDF has the fingerprint "
            f"{plan.robot.sha256[:12]}, and {robot.name} here has {robot.sha256[:12]}; plan again "
            "for this robot"
        )
