"""How quickly a foot moves that has lost the ground: what steps of the physics have to resolve."""

from __future__ import annotations

import numpy as np

from gaitopt.conventions import GRAVITY, LEGS
from gaitopt.robots.quadruped import Quadruped

FAR = 0.01
"""Way that a foot without ground is let go, as a share of its leg's reach. Chosen: some 2 to 7 mm,
less than feet may miss their footholds by."""


def time_to_give_way(robot: Quadruped) -> float:
    """Time in which a foot without ground moves by :data:`FAR` of its leg's reach [s].

    Its joints have the torques for a quarter of the robot's weight on it. The body stands still,
    and what the leg weighs is left out. The shortest of the four legs' times counts.

    The foot's inertia is the mass ``1 / (n J H^-1 J^T n)`` that it shows upwards at the standing
    pose, with the joints' inertia ``H``, of links and motors, and the foot's Jacobian ``J`` (Khatib
    1987, IEEE J. Robotics and Automation 3(1)). Infinite for robots without a mass.
    """
    import pinocchio as pin

    model, load = robot.model, robot.mass * GRAVITY / len(LEGS)
    if not load > 0.0:
        return float(np.inf)
    data, q = model.createData(), pin.neutral(model)
    q[7:] = robot.standing_joints()
    inertia = np.triu(pin.crba(model, data, q))  # with the model's armature
    inertia += np.triu(inertia, 1).T
    pin.computeJointJacobians(model, data, q)
    pin.updateFramePlacements(model, data)
    up, times = robot.body_axes[:, 2], []
    for name, leg in robot.legs.items():
        columns = 6 + np.array(robot.leg_columns[name])
        frame = model.getFrameId(leg.foot)
        jacobian = pin.getFrameJacobian(model, data, frame, pin.LOCAL_WORLD_ALIGNED)[:3, columns]
        pushed = up @ jacobian
        ease = float(pushed @ np.linalg.solve(inertia[np.ix_(columns, columns)], pushed))
        times.append(np.sqrt(2.0 * FAR * leg.reach / (load * ease)) if ease > 0.0 else np.inf)
    return float(min(times))
