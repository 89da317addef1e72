"""What of a simulated robot touches the ground: balls at its feet, limbs, or its own file's shapes.

A URDF says little about contacts, so the feet get balls, and limbs and trunk touch the ground and
nothing else. An MJCF is a model for physics: its shapes touch the ground and one another as it
says.
"""

from __future__ import annotations

from typing import Any

from gaitopt.conventions import LEGS
from gaitopt.robots.files.own_shapes import MOST_BITS
from gaitopt.robots.quadruped import Quadruped
from gaitopt.simulation.limbs import add_limbs
from gaitopt.simulation.settings import SimulationSettings

LEAST_BALL = 0.003
"""Radius of the ball of a foot for which the URDF has none [m]. Chosen: near to a point, and yet
larger than what contacts give way."""

TORSION, ROLLING = 0.005, 0.0001
"""MuJoCo's own coefficients of torsional and rolling friction [m]. Contacts without rotational
friction (``condim`` 3) do not use them."""

FOOT = "gaitopt foot "
"""Beginning of the names of the feet's balls and of their places."""

BALL_BITS, LIMB_BITS = (1, 2), (4, 8)
"""What balls and limbs touch: neither one another nor themselves."""

GROUND_BITS, PLATE_BITS = (2 | 8, 1 | 4), (2, 1)
"""The ground touches balls and limbs. A plate below a foothold of open ground touches balls alone:
nothing is known of the ground beside it."""


def surface(settings: SimulationSettings) -> dict[str, Any]:
    """How two shapes touch one another."""
    return {
        "condim": 3,
        "friction": [settings.friction, TORSION, ROLLING],
        "solref": [settings.contact_time, 1.0],
    }


def ground_bits(own: bool, plate: bool = False) -> dict[str, int]:
    """What the ground touches: balls and limbs, or all of a robot's own shapes.

    Args:
        own: whether the shapes are those of the robot's file.
        plate: whether it is a plate below a foothold of open ground.
    """
    bits = (MOST_BITS, MOST_BITS) if own else PLATE_BITS if plate else GROUND_BITS
    return {"contype": bits[0], "conaffinity": bits[1]}


def has_own_feet(robot: Quadruped) -> bool:
    """Whether its file has shapes that touch something, on the last link of every leg."""
    import pinocchio as pin

    model, links = robot.model, {shape.link for shape in robot.notes.own.shapes}
    joints = {
        int(frame.parentJoint) for frame in model.frames
        if frame.type == pin.FrameType.BODY and str(frame.name) in links
    }  # fmt: skip
    return all(int(model.getJointId(robot.legs[leg].joints[-1])) in joints for leg in LEGS)


def add_shapes(
    mujoco: Any, spec: Any, robot: Quadruped, settings: SimulationSettings, own: bool
) -> None:
    """Add the places of the feet, and the shapes of the robot.

    Args:
        mujoco, spec: the package, and the model that is made.
        robot: the robot.
        settings: of the contacts.
        own: whether the shapes are those of its file, and not balls.
    """
    for leg in LEGS:
        spec.body(robot.legs[leg].foot).add_site(name=FOOT + leg)
    if own:
        _add_own(mujoco, spec, robot, settings)
        return
    radius, (contype, conaffinity) = robot.foot_radius or LEAST_BALL, BALL_BITS
    for leg in LEGS:
        spec.body(robot.legs[leg].foot).add_geom(
            name=FOOT + leg, type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[radius, 0, 0], mass=0.0,
            contype=contype, conaffinity=conaffinity, **surface(settings),
        )  # fmt: skip
    if settings.limbs:
        bits = {"contype": LIMB_BITS[0], "conaffinity": LIMB_BITS[1]}
        add_limbs(mujoco, spec, robot, _first_links(robot), {**bits, **surface(settings)})


def _add_own(mujoco: Any, spec: Any, robot: Quadruped, settings: SimulationSettings) -> None:
    """Add the shapes of the robot's file: where they are, and what they touch."""
    bodies = {body.name: body for body in spec.bodies}
    own = robot.notes.own
    for number, shape in enumerate(own.shapes):
        if shape.link not in bodies:
            continue
        made: dict[str, Any] = {"size": [*shape.size, 0.0, 0.0, 0.0][:3]}
        if shape.kind == "mesh":
            mesh = spec.add_mesh(name=f"gaitopt mesh {number}")
            mesh.uservert = list(shape.corners)
            made = {"meshname": mesh.name}
        bodies[shape.link].add_geom(
            name=f"gaitopt shape {number}", mass=0.0, pos=list(shape.place), quat=list(shape.turn),
            type=getattr(mujoco.mjtGeom, f"mjGEOM_{shape.kind.upper()}"), contype=shape.bits[0],
            conaffinity=shape.bits[1], **made, **surface(settings),
        )  # fmt: skip
    moving = _moving_links(robot)
    for pair in {*own.apart, *_overlapping(mujoco, spec, robot)}:
        one, other = (moving.get(link, "") for link in pair)
        if one in bodies and other in bodies and one != other:
            spec.add_exclude(bodyname1=one, bodyname2=other)


def _overlapping(mujoco: Any, spec: Any, robot: Quadruped) -> set[tuple[str, str]]:
    """Links whose own shapes touch when the robot stands, high above any ground.

    There the file's shapes are too large, and would push the robot apart; the certificate leaves
    such shapes out as well.
    """
    try:
        model = spec.copy().compile()
    except (ValueError, mujoco.FatalError):
        return set()  # the caller compiles it again, and tells what is wrong
    data = mujoco.MjData(model)
    for name, angle in zip(robot.joint_names, robot.standing_joints(), strict=True):
        data.qpos[int(model.joint(name).qposadr[0])] = angle
    mujoco.mj_forward(model, data)
    names = [mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_BODY, k) for k in range(model.nbody)]
    pairs = [[int(model.geom_bodyid[g]) for g in contact.geom] for contact in data.contact]
    return {(names[one], names[other]) for one, other in pairs if 0 not in (one, other)}


def _moving_links(robot: Quadruped) -> dict[str, str]:
    """For each link the one on its joint, which stays when links that do not move go."""
    import pinocchio as pin

    first = _first_links(robot)
    return {
        str(frame.name): first[int(frame.parentJoint)]
        for frame in robot.model.frames
        if frame.type == pin.FrameType.BODY and int(frame.parentJoint) in first
    }


def _first_links(robot: Quadruped) -> dict[int, str]:
    """The link on each joint, by Pinocchio's number: its frame is that of the joint."""
    import pinocchio as pin

    first: dict[int, str] = {}
    for frame in robot.model.frames:
        if frame.type == pin.FrameType.BODY:
            # The link on a joint comes before those that are fixed to it.
            first.setdefault(int(frame.parentJoint), str(frame.name))
    return first
