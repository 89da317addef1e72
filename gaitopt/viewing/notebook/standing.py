"""The lines of a standing robot: trunk and legs."""

from __future__ import annotations

import numpy as np

from gaitopt.conventions import LEGS, FloatArray
from gaitopt.robots.quadruped import Quadruped
from gaitopt.robots.whole_body import configuration


def standing_lines(robot: Quadruped) -> tuple[FloatArray, dict[str, FloatArray]]:
    """Trunk and legs of the robot in its standing pose, in the base frame.

    Returns:
        The hips around the trunk ``(5, 3)``, closed, and of each leg the origins of its joints and
        its foot ``(n + 1, 3)`` [m].
    """
    import pinocchio as pin

    model = robot.model
    data = model.createData()
    q = configuration(robot, np.zeros(3), np.zeros(3), robot.standing_joints())
    pin.forwardKinematics(model, data, q)
    pin.updateFramePlacements(model, data)
    legs = {}
    for name in LEGS:
        leg = robot.legs[name]
        joints = [data.oMi[model.getJointId(joint)].translation for joint in leg.joints]
        foot = data.oMf[model.getFrameId(leg.foot)].translation
        legs[name] = np.array([*joints, foot])
    around = [legs[name][0] for name in (*LEGS, LEGS[0])]
    return np.array(around), legs
