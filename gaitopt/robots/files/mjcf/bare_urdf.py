"""A robot's URDF for MuJoCo: without shapes, with inertias that are possible, free to move."""

from __future__ import annotations

from xml.etree import ElementTree

import numpy as np

from gaitopt.errors import RobotError
from gaitopt.robots.quadruped import Quadruped

LEAST_GYRATION = 1e-3
"""Radius of gyration that a link without inertia gets [m]: less than that of any link."""
LEAST_INERTIA = 1e-13
"""Least principal moment of inertia [kg m^2]: MuJoCo refuses those below 1e-14."""
LEAST_MASS = 1e-10
"""Mass up to which a link counts as one without [kg]: some programs write such for links that mark
a place, and MuJoCo refuses them."""
SINGULAR = 1e-9
"""Least eigenvalue of an inertia matrix, as a share of its trace, that counts as positive: what
rounding of a URDF's digits can make of zero."""


def bare_urdf(robot: Quadruped) -> str:
    """The robot's URDF without shapes, and with a root that is free to move.

    Some URDFs hold inertias that no body can have (anymal_c's cameras and hatch). Their products of
    inertia are set to zero, and MuJoCo is told to replace what is still impossible by the inertia
    of a ball with the same trace.

    Raises:
        RobotError: the root link is called ``world``, which means the ground in MuJoCo.
    """
    root = ElementTree.fromstring(robot.urdf)
    children = {c.get("link") for j in root.findall("joint") for c in j.findall("child")}
    for element in list(root):
        if element.tag not in ("link", "joint"):
            root.remove(element)
    for link in root.findall("link"):
        for shape in link.findall("visual") + link.findall("collision"):
            link.remove(shape)
        for inertial in link.findall("inertial"):
            if not _make_possible(inertial):
                link.remove(inertial)
    for joint in root.findall("joint"):
        limit = joint.find("limit")
        # An empty range means no limits here (gaitopt.robots.limits); MuJoCo would warn of it.
        if joint.get("type") == "revolute" and limit is not None and _empty(limit):
            joint.set("type", "continuous")
    base = next(link.get("name") for link in root.findall("link")
                if link.get("name") not in children)  # fmt: skip
    if base == "world":
        raise RobotError(f"{robot.name}: rename the URDF's root link: 'world' means the ground")
    world = ElementTree.SubElement(root, "link", name="world")
    joint = ElementTree.SubElement(root, "joint", name="gaitopt floating", type="floating")
    ElementTree.SubElement(joint, "parent", link="world")
    ElementTree.SubElement(joint, "child", link=str(base))
    extension = ElementTree.SubElement(root, "mujoco")
    ElementTree.SubElement(
        extension, "compiler", fusestatic="false", inertiafromgeom="false", balanceinertia="true",
        boundmass="0", boundinertia="0", angle="radian", autolimits="true",
    )  # fmt: skip
    root.remove(world)
    root.insert(0, world)
    return ElementTree.tostring(root, encoding="unicode")


def _empty(limit: ElementTree.Element) -> bool:
    """Whether a joint's range is empty."""
    return not float(limit.get("lower", "0")) < float(limit.get("upper", "0"))


def _make_possible(inertial: ElementTree.Element) -> bool:
    """Set the products of inertia of a matrix that is not positive definite to zero.

    Moments that are then not positive become those of a very small body.

    Returns:
        Whether the link has a mass that counts.
    """
    mass, inertia = inertial.find("mass"), inertial.find("inertia")
    if mass is None or inertia is None or not float(mass.get("value", "0")) > LEAST_MASS:
        return False
    xx, xy, xz, yy, yz, zz = (
        float(inertia.get(f"i{n}", "0")) for n in ("xx", "xy", "xz", "yy", "yz", "zz")
    )
    least = np.linalg.eigvalsh(np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]))[0]
    if not least > max(SINGULAR * (xx + yy + zz), LEAST_INERTIA):
        for name in ("ixy", "ixz", "iyz"):
            inertia.set(name, "0")
        smallest = max(float(mass.get("value", "0")) * LEAST_GYRATION**2, 2.0 * LEAST_INERTIA)
        for name, value in (("ixx", xx), ("iyy", yy), ("izz", zz)):
            inertia.set(name, repr(max(value, smallest)))
    return True
