"""Robots that lie on the ground or sit, and stand up.

``python -m benchmarks.physics.lying [ROBOT ...]`` lets robots sink from standing to the ground in
MuJoCo, with dampers in place of servos, as robots do that are switched off; those that sit keep the
servos of their front legs. From the state in which they then lie the nearest feasible one is taken,
and a plan to stand up from there. Those that lie with their feet in the air put them down first
(``gaitopt.feet_down``), by their servos. The plan must be certified. Then it is played as a robot
would: by position servos with planned torques, from where the robot really lies, with a second to
get to the plan's first posture. Exit code 1 where a plan is not certified, or the robot does not
stand in the end.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

import gaitopt
from gaitopt import LEGS, Footholds, Plan, State
from gaitopt.control.gains import ControlGains
from gaitopt.entering.standing_up import footholds_of
from gaitopt.errors import InfeasibleStateError
from gaitopt.exporting.sampled import forces_at
from gaitopt.exporting.servo_gains import servo_gains
from gaitopt.robots.at_many_poses.outlines import lowest_points, outlines
from gaitopt.robots.collisions.pairs import CollisionPairs
from gaitopt.robots.quadruped import Quadruped
from gaitopt.robots.rotations import quaternion_to_matrix, quaternion_to_rpy
from gaitopt.robots.whole_body import feet_from_joints
from gaitopt.simulation.model import SimModel, build_sim_model, import_mujoco, to_mujoco
from gaitopt.simulation.settings import SimulationSettings

ROBOTS = ("go2", "a1", "anymal_c", "wang2020", "hyq")
POSTURES = {"lies": (), "sits": ("LF", "RF"), "feet up": LEGS}
"""Legs whose servos stay on while the robot sinks."""
FEET_UP = "feet up"
LIFTED, APART = 0.015, 0.005
"""How high legs are above the ground of a robot that lies with its feet in the air [m], and how far
its links are apart [m]."""
HALF_TURN = 2.5
"""Farthest that its joints are turned from where they are when it stands [rad]."""
SINKING_TIME = 4.0
"""How long robots sink [s]."""
GATHERING_TIME = 1.0
"""Time from where the robot lies to the plan's first posture [s], as an exported file has it."""
WATCH_TIME = 0.5
"""How long the robot is watched after the plan [s]."""
NEAR_GROUND = 0.01
"""Feet that are less far above the ground count as standing [m]."""
LOW, TILTED = 0.03, 0.1
"""Farthest that the body may then be from the plan's end [m], [rad]."""


@dataclass(frozen=True, eq=False)
class Stood:
    """What became of a robot that stood up.

    Attributes:
        off: how far its body is from where the plan ends [m].
        tilt: how far it is turned from there [rad].
        rate_use: peak joint velocity as a share of the limit, from the plan's begin.
    """

    off: float
    tilt: float
    rate_use: float

    @property
    def stands(self) -> bool:
        """Whether it stands."""
        return self.off < LOW and self.tilt < TILTED


def world_of(robot: Quadruped) -> tuple[Any, SimModel]:
    """A robot on a plane in MuJoCo, with torques as they are asked for, and damped joints."""
    standing = State.standing(robot)
    low = State.standing(robot, height=0.9 * robot.standing_height)
    gains = ControlGains.for_plan(gaitopt.plan_stand_up(robot, low))
    sim = build_sim_model(robot, footholds_of(robot, standing), SimulationSettings())
    sim.model.dof_damping[sim.qvel] += gains.joint_damping
    data = import_mujoco().MjData(sim.model)
    data.qpos[:] = to_mujoco(sim, standing.q)
    return data, sim


def sunk(
    robot: Quadruped, data: Any, sim: SimModel, kept: Sequence[str] = ()
) -> tuple[State, Footholds]:
    """The state in which a robot lies that was switched off, and the ground below its feet.

    ``data`` is in this state afterwards.

    Args:
        robot, data, sim: the robot, and its model.
        kept: legs whose servos stay on.
    """
    mujoco, begin = import_mujoco(), np.array(data.qpos[sim.qpos])
    stiffness = np.zeros(len(begin))
    for leg in kept:
        stiffness[list(robot.leg_columns[leg])] = servo_gains(robot)[0]
    for _ in range(round(SINKING_TIME / sim.model.opt.timestep)):
        data.ctrl[sim.ctrl] = stiffness * (begin - data.qpos[sim.qpos])
        mujoco.mj_step(sim.model, data)
    return measured(robot, data, sim)


def measured(robot: Quadruped, data: Any, sim: SimModel) -> tuple[State, Footholds]:
    """The state of a robot on level ground at height 0, at rest, and the ground below its feet."""
    q = np.concatenate([data.qpos[:3], data.qpos[4:7], data.qpos[3:4], data.qpos[sim.qpos]])
    feet = feet_from_joints(robot, q[:3], quaternion_to_rpy(q[3:7]), q[7:])
    # Feet stand at height 0. One that is a little above is put down before the robot rises.
    support = tuple(leg for leg, foot in zip(LEGS, feet, strict=True) if foot[2] < NEAR_GROUND)
    state = State(q, np.zeros(6 + len(sim.qvel)), support, robot.joint_names)
    return state, Footholds({leg: [[x, y, 0.0]] for leg, (x, y, _) in zip(LEGS, feet, strict=True)})


def with_feet_up(robot: Quadruped) -> np.ndarray:
    """A configuration in which only the trunk is low: each foot is as near to its hip as it can."""
    shapes, pairs = outlines(robot), CollisionPairs.of(robot)
    assert shapes is not None
    q = np.array(State.standing(robot).q)
    trunk = [shape for shape in shapes if shape.joint == 1]
    q[2] -= min(float(points[:, 2].min()) for points in lowest_points(robot, trunk, q))
    low, high = robot.position_limits
    for leg, part in robot.legs.items():
        own = list(robot.leg_columns[leg])
        reach = np.linspace(-0.9, 0.9, 19) * part.reach
        x, z = np.meshgrid(reach, np.linspace(0.0, 0.6, 13) * part.reach)
        places = part.hip + np.stack([x.ravel(), np.full(x.size, part.lateral), -z.ravel()], axis=1)
        places = places[np.asarray(part.shortfall(places)) <= 0.0]
        angles = part.inverse(places)
        within = ((angles > low[own] + 0.02) & (angles < high[own] - 0.02)).all(axis=1)
        within &= np.abs(angles - q[7:][own]).max(axis=1) < HALF_TURN
        limbs = [shape for shape in shapes if leg_of(robot, shape.joint) == leg]
        options = []
        for found in angles[within]:
            q[7:][own] = found
            height = min(float(points[:, 2].min()) for points in lowest_points(robot, limbs, q))
            far = np.linalg.norm(part.forward(found) - part.hip)
            options.append((max(LIFTED - height, 0.0), float(far), tuple(found)))
        for _, _, found in sorted(options):
            q[7:][own] = found
            if pairs is None or pairs.distances(q[None, 7:][:, pairs.columns]).min() > APART:
                break
    return q


def leg_of(robot: Quadruped, joint: int) -> str:
    """The leg that a joint moves; empty for the trunk."""
    owner = {int(robot.model.getJointId(j)): leg for leg in LEGS for j in robot.legs[leg].joints}
    while joint > 1 and joint not in owner:
        joint = int(robot.model.parents[joint])
    return owner.get(joint, "")


def put_down(robot: Quadruped, data: Any, sim: SimModel, way: gaitopt.FeetDown) -> None:
    """The feet go down by servos that know nothing of the ground; then the robot is measured."""
    mujoco, step = import_mujoco(), sim.model.opt.timestep
    stiffness, damping = servo_gains(robot)
    for angles in way.joints(np.arange(0.0, way.times[-1] + WATCH_TIME, step)):
        push = stiffness * (angles - data.qpos[sim.qpos]) - damping * data.qvel[sim.qvel]
        data.ctrl[sim.ctrl] = np.clip(push, -robot.effort_limits, robot.effort_limits)
        mujoco.mj_step(sim.model, data)


def played(plan: Plan, data: Any, sim: SimModel) -> Stood:
    """The plan, played by position servos from where the robot is."""
    mujoco, robot, step = import_mujoco(), plan.robot, sim.model.opt.timestep
    stiffness, damping = servo_gains(robot)
    damper = -float(sim.model.actuator_biasprm[0, 2])
    here, most = np.array(data.qpos[sim.qpos]), robot.effort_limits
    count = round((GATHERING_TIME + plan.duration + WATCH_TIME) / step)
    times = np.clip(np.arange(count) * step - GATHERING_TIME, 0.0, plan.duration)
    motion, torques = plan.at(times), forces_at(plan, times).torques
    share = np.clip(np.arange(count) * step / GATHERING_TIME, 0.0, 1.0)[:, None]
    angles = here + share * (motion.q[:, 7:] - here)
    rates = np.where(share < 1.0, 0.0, motion.v[:, 6:])
    peak = np.zeros(len(most))
    for k in range(count):
        error = angles[k] - data.qpos[sim.qpos]
        late = rates[k] - data.qvel[sim.qvel]
        wanted = np.clip(share[k] * torques[k] + stiffness * error + damping * late, -most, most)
        # The model's own dampers, by which it sank, are made up for.
        data.ctrl[sim.ctrl] = wanted + damper * data.qvel[sim.qvel]
        mujoco.mj_step(sim.model, data)
        if share[k] >= 1.0:
            peak = np.maximum(peak, np.abs(data.qvel[sim.qvel]))
    last = plan.at([plan.duration]).q[0]
    turned = quaternion_to_matrix(np.append(data.qpos[4:7], data.qpos[3]))
    upright = float((turned * quaternion_to_matrix(last[3:7])).sum() - 1.0) / 2.0
    return Stood(
        float(np.linalg.norm(data.qpos[:3] - last[:3])),
        float(np.arccos(np.clip(upright, -1.0, 1.0))),
        float((peak / robot.velocity_limits).max()),
    )


def main(arguments: Sequence[str] | None = None) -> int:
    """Print a table; 1 where a plan is not certified or a robot does not stand."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.physics.lying")
    parser.add_argument("robots", nargs="*", default=ROBOTS)
    table = Table(
        "robot", "base at [m]", "pitch [rad]", "beyond limits [rad]", "then moved [mm]",
        "rises in [s]", "certificate", "simulate", "servos: off [mm]", "joint velocity [%]",
    )  # fmt: skip
    faults = 0
    for name, kept in product(parser.parse_args(arguments).robots, POSTURES):
        robot = gaitopt.load_robot(name)
        data, sim = world_of(robot)
        if kept == FEET_UP:
            data.qpos[:] = to_mujoco(sim, with_feet_up(robot))
        lying, ground = sunk(robot, data, sim, POSTURES[kept])
        if kept == FEET_UP:
            in_air = State(lying.q, 0.0 * lying.v, lying.support, lying.joint_names)
            try:
                put_down(robot, data, sim, gaitopt.feet_down(robot, in_air))
            except InfeasibleStateError as error:
                table.add_row(f"{name} {kept}", f"{lying.q[2]:.3f}", f"{lying.columns[4]:.2f}",
                              *[""] * 3, f"refused: {error.limit}")  # fmt: skip
                continue
            lying, ground = measured(robot, data, sim)
        low, high = robot.position_limits
        beyond = np.maximum(low - lying.q[7:], lying.q[7:] - high).max()
        near = gaitopt.nearest_state(robot, lying, ground)
        plan = gaitopt.plan_stand_up(robot, near.state)
        found, result = gaitopt.verify(plan), gaitopt.simulate(plan)
        stood = played(plan, data, sim)
        good = found.outcome == "certified" and result.passed and stood.stands
        faults += not good
        table.add_row(
            f"{name} {kept}", f"{lying.q[2]:.3f}", f"{lying.columns[4]:.2f}",
            f"{max(float(beyond), 0.0):.3f}", f"{1e3 * np.linalg.norm(near.body):.1f}",
            f"{plan.duration:.2f}", str(found.outcome),
            "passed" if result.passed else "failed", f"{1e3 * stood.off:.1f}",
            f"{100.0 * stood.rate_use:.0f}",
        )  # fmt: skip
    Console(width=140).print(table)
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
