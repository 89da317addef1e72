"""What an MJCF's actuators say of a joint's motor: its torque, its inertia, and how it falls."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from gaitopt.errors import RobotError
from gaitopt.robots.files.mjcf.links import HINGE
from gaitopt.robots.files.notes import FASTEST, LARGEST_INERTIA


class Motor(NamedTuple):
    """What the file says of a joint's motor.

    Attributes:
        effort: the torque limit [N m]; 0 for none.
        inertia: seen at the joint [kg m^2]; 0 for none.
        line: speeds at which the torque begins to fall and ends [rad/s]; ``None`` for none.
    """

    effort: float
    inertia: float
    line: tuple[float, float] | None


def motor_of(mujoco: Any, model: Any, joint: int, where: str) -> Motor:
    """The motor of a joint.

    Args:
        mujoco, model: the package, and the model.
        joint: the joint's number.
        where: what messages begin with: robot and joint.

    Raises:
        RobotError: the motor's inertia or speeds are no sensible numbers.
    """
    actuators = actuators_of(mujoco, model, joint)
    effort = effort_of(mujoco, model, joint, actuators)
    inertia = motor_inertia_of(model, joint, actuators)
    if not inertia <= LARGEST_INERTIA:
        raise RobotError(
            f"{where}: its motor's inertia is {inertia:g} kg m^2, above {LARGEST_INERTIA:g}; "
            "correct its armature, which counts times the square of gear in an actuator"
        )
    hinge = int(model.jnt_type[joint]) == HINGE
    line = torque_line_of(mujoco, model, actuators, effort) if hinge else None
    if line is not None and not 0.0 <= line[0] < line[1] <= FASTEST:
        raise RobotError(
            f"{where}: by its actuator its torque falls from {line[0]:g} to {line[1]:g} rad/s, "
            "which no motor does; correct gear, gainprm, biasprm or ctrlrange"
        )
    return Motor(effort, inertia, line)


def actuators_of(mujoco: Any, model: Any, joint: int) -> list[int]:
    """Numbers of the actuators that act on a joint itself, and not by tendons."""
    of_joint = int(mujoco.mjtTrn.mjTRN_JOINT)
    return [i for i in range(model.nu) if int(model.actuator_trntype[i]) == of_joint
            and int(model.actuator_trnid[i][0]) == joint]  # fmt: skip


def effort_of(mujoco: Any, model: Any, joint: int, actuators: Sequence[int]) -> float:
    """The least torque that a joint and its actuators state [N m]; 0 where they state none."""
    efforts = [_actuator_effort(mujoco, model, i) for i in actuators]
    if model.jnt_actfrclimited[joint]:
        efforts.append(float(np.abs(model.jnt_actfrcrange[joint]).min()))
    return min([e for e in efforts if e is not None and e > 0.0], default=0.0)


def motor_inertia_of(model: Any, joint: int, actuators: Sequence[int]) -> float:
    """Inertia of a joint's motors, seen at the joint [kg m^2].

    Infinite or NaN where the file's numbers are too large; the caller refuses that.
    """
    found = float(model.dof_armature[int(model.jnt_dofadr[joint])])
    # Since MuJoCo 4 an actuator may have one of its own, on the motor's side of the gear.
    own: Any = getattr(model, "actuator_armature", None)
    for i in actuators if own is not None else ():
        gear = float(model.actuator_gear[i][0])
        found += float(own[i]) * (gear * gear)  # gear**2 raises OverflowError for huge numbers
    return found


def torque_line_of(
    mujoco: Any, model: Any, actuators: Sequence[int], effort: float
) -> tuple[float, float] | None:
    """Speeds at which a joint's torque begins to fall and ends [rad/s]; ``None`` for none.

    Infinite or NaN where the file's numbers are too large; the caller refuses that.

    A ``general`` actuator with the force ``k u - b v``, of a control ``u`` (a voltage) within
    limits and its speed ``v``, is a motor whose torque falls with its speed. Where ``k`` equals
    ``b`` it is a servo of the speed, and ``b`` is a gain that tells nothing of the motor; so it is
    where the joint has more actuators than one.

    Args:
        mujoco, model: the package, and the model.
        actuators: of the joint.
        effort: the joint's torque limit [N m].
    """
    if len(actuators) != 1 or not effort > 0.0:
        return None
    (actuator,) = actuators
    largest = _falling_force(mujoco, model, actuator)
    gear = abs(float(model.actuator_gear[actuator][0]))
    slope = -float(model.actuator_biasprm[actuator][2])
    # The product may be 0 where neither factor is: both may be tiny.
    if largest is None or not min(largest, gear, slope, slope * gear) > 0.0:
        return None
    full = (largest - effort / gear) / (slope * gear)
    return max(full, 0.0), largest / (slope * gear)


def _actuator_effort(mujoco: Any, model: Any, actuator: int) -> float | None:
    """The torque that an actuator can make at its joint [N m]; ``None`` where nothing says it."""
    gear = abs(float(model.actuator_gear[actuator][0]))
    found = []
    if model.actuator_forcelimited[actuator]:
        found.append(gear * float(np.abs(model.actuator_forcerange[actuator]).min()))
    largest = _falling_force(mujoco, model, actuator)
    if largest is not None:
        found.append(gear * largest)
    return min(found, default=None)


def _falling_force(mujoco: Any, model: Any, actuator: int) -> float | None:
    """The largest ``k u`` of an actuator with the force ``k u - b v``; ``None`` for others.

    Where ``b`` is 0 it is a plain motor.
    """
    fixed = int(model.actuator_gaintype[actuator]) == int(mujoco.mjtGain.mjGAIN_FIXED)
    still = int(model.actuator_dyntype[actuator]) == int(mujoco.mjtDyn.mjDYN_NONE)
    bias, kinds = int(model.actuator_biastype[actuator]), mujoco.mjtBias
    affine = bias == int(kinds.mjBIAS_AFFINE) and not model.actuator_biasprm[actuator][:2].any()
    if not (fixed and still and (affine or bias == int(kinds.mjBIAS_NONE))):
        return None
    gain = float(model.actuator_gainprm[actuator][0])
    servo = affine and gain == -float(model.actuator_biasprm[actuator][2])
    if servo or not model.actuator_ctrllimited[actuator]:
        return None
    return abs(gain) * float(np.abs(model.actuator_ctrlrange[actuator]).min())
