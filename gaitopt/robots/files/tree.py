"""A URDF as a tree of links and joints that can be changed and written again."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from xml.etree import ElementTree

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.errors import RobotError
from gaitopt.robots.files.origins import (
    Element,
    number_in,
    numbers,
    placement_of,
    rotation_about,
    set_origin,
)

MOST_LINKS = 3000
"""Most links that are read. Chosen: the largest file at hand has about 100."""
HINGES = ("revolute", "continuous")
ONE_WAY = (*HINGES, "prismatic")
"""Types of joints that move one way."""


class Joint:
    """A joint of a :class:`UrdfTree`.

    Attributes:
        element: its element, which may be changed.
        name, parent, child: its name, and those of the links that it joins.
        placement: pose of its frame, which is the child link's, in the parent link ``(4, 4)``.
        axis: unit axis in that frame ``(3,)``.
    """

    def __init__(self, element: Element, label: str) -> None:
        self.element = element
        self.name = element.get("name") or ""
        where = f"{label}: joint {self.name or 'without a name'}"
        self.parent, self.child = (_end(element, end, where) for end in ("parent", "child"))
        if not self.name:
            raise RobotError(
                f"{label}: the joint between {self.parent} and {self.child} has no name; give it "
                "one (<joint name=...>)"
            )
        self.placement = placement_of(element, where)
        self.axis = _axis_of(element, where)

    @property
    def kind(self) -> str:
        """The joint's type."""
        return self.element.get("type") or ""

    @property
    def fixed(self) -> bool:
        """Whether it never moves."""
        return self.kind == "fixed"

    def motion(self, at: float) -> FloatArray:
        """Pose ``(4, 4)`` of the joint's frame at a position [rad, m], from that at 0."""
        out = np.eye(4)
        if self.kind in HINGES:
            out[:3, :3] = rotation_about(self.axis, at)
        elif self.kind == "prismatic":
            out[:3, 3] = at * self.axis
        return out

    def limits(self) -> tuple[float, float]:
        """Lower and upper limit; infinite where there are none."""
        limit = self.element.find("limit")
        if limit is None or self.kind == "continuous":
            return -np.inf, np.inf
        low, high = (number_in(limit.get(name, "0")) for name in ("lower", "upper"))
        return (low, high) if low < high else (-np.inf, np.inf)

    def move(self, placement: FloatArray) -> None:
        """Give the joint another place on its parent link."""
        self.placement = placement
        set_origin(self.element, placement)

    def turn(self, axis: FloatArray) -> None:
        """Give the joint another unit axis ``(3,)`` in its frame."""
        self.axis = axis
        element = self.element.find("axis")
        if element is None:
            element = ElementTree.SubElement(self.element, "axis")
        element.set("xyz", " ".join(repr(float(a) + 0.0) for a in axis))

    def lock(self, at: float) -> None:
        """Make it a fixed joint at a position [rad, m]."""
        self.move(self.placement @ self.motion(at))
        self.element.set("type", "fixed")
        for tag in ("axis", "limit", "mimic", "dynamics", "safety_controller", "calibration"):
            for part in self.element.findall(tag):
                self.element.remove(part)


class UrdfTree:
    """The links and joints of a URDF.

    Attributes:
        label: what to call the robot in messages.
        root: the element ``<robot>``.
        links: elements of the links by name.
        joints: the joints by name.
        base: name of the link that has no joint above it.
    """

    def __init__(self, root: Element, label: str) -> None:
        self.label, self.root = label, root
        self.links = {link.get("name") or "": link for link in root.findall("link")}
        twice = Counter(link.get("name") or "" for link in root.findall("link")).most_common(1)
        if twice and twice[0][1] > 1:
            raise RobotError(
                f"{label}: {twice[0][1]} links have the name {twice[0][0]}; rename all but one, "
                "and the ends of their joints"
            )
        if len(self.links) > MOST_LINKS:
            raise RobotError(f"{label}: {len(self.links)} links; at most {MOST_LINKS} are read")
        self.joints: dict[str, Joint] = {}
        for element in root.findall("joint"):
            joint = Joint(element, label)
            if joint.name in self.joints:
                raise RobotError(f"{label}: 2 joints have the name {joint.name}")
            self.joints[joint.name] = joint
        self._connect()

    def _connect(self) -> None:
        """Find the base, and check that everything hangs on it.

        Raises:
            RobotError: a joint names a link that is missing, or the links are no tree.
        """
        self._above: dict[str, Joint] = {}
        self._below: dict[str, list[Joint]] = {name: [] for name in self.links}
        for joint in self.joints.values():
            for end in (joint.parent, joint.child):
                if end not in self.links:
                    raise RobotError(
                        f"{self.label}: joint {joint.name} names the link {end!r}, which is missing"
                    )
            if joint.child in self._above:
                raise RobotError(
                    f"{self.label}: link {joint.child} hangs on two joints, "
                    f"{self._above[joint.child].name} and {joint.name}; closed chains (five-bar or "
                    "parallel legs) cannot be planned for"
                )
            self._above[joint.child] = joint
            self._below[joint.parent].append(joint)
        if not self.links:
            raise RobotError(
                f"{self.label}: the file has no link: it may be a part of a robot, as a xacro file "
                "of macros is; give the file that includes it"
            )
        roots = [name for name in self.links if name not in self._above]
        if len(roots) != 1:
            said = ", ".join(roots[:5]) or "none"
            alone = [name for name in roots if not self._below[name]][: len(roots) - 1]
            cure = f": remove {', '.join(alone[:5])}, or let a joint hold it" if alone else ""
            raise RobotError(
                f"{self.label}: {len(roots)} links hang on no joint ({said}); a robot has one base"
                f"{cure}"
            )
        self.base = roots[0]
        reached = len(list(self.walk()))
        if reached != len(self.joints):
            raise RobotError(f"{self.label}: its joints form a circle")

    def walk(self, link: str | None = None) -> Iterator[Joint]:
        """All joints below a link (the base), each after the one above it."""
        todo = [self.base if link is None else link]
        while todo:
            for joint in self._below[todo.pop()]:
                yield joint
                todo.append(joint.child)

    def above(self, link: str) -> Joint | None:
        """The joint that a link hangs on."""
        return self._above.get(link)

    def below(self, link: str) -> list[Joint]:
        """The joints that hang on a link."""
        return self._below[link]

    def moving_above(self, link: str) -> list[Joint]:
        """The joints between the base and a link that move, from the base on."""
        out: list[Joint] = []
        joint = self._above.get(link)
        while joint is not None:
            if not joint.fixed:
                out.append(joint)
            joint = self._above.get(joint.parent)
        return out[::-1]

    def rigid_with(self, link: str) -> dict[str, FloatArray]:
        """A link and those below it on fixed joints, and their poses in it ``(4, 4)``."""
        found, todo = {link: np.eye(4)}, [link]
        while todo:
            parent = todo.pop()
            for joint in self._below[parent]:
                if joint.fixed:
                    found[joint.child] = found[parent] @ joint.placement
                    todo.append(joint.child)
        return found

    def poses(self) -> dict[str, FloatArray]:
        """Poses of all links in the base's frame at the zero configuration ``(4, 4)``."""
        found = {self.base: np.eye(4)}
        for joint in self.walk():
            found[joint.child] = found[joint.parent] @ joint.placement
        return found

    def mass(self, link: str) -> float:
        """Mass of one link [kg]; 0 where it has none."""
        mass = self.links[link].find("inertial/mass")
        return 0.0 if mass is None else number_in(mass.get("value", "0"))

    def remove_above(self, link: str) -> None:
        """Make a link the base: whatever is not below it goes."""
        kept = {link} | {joint.child for joint in self.walk(link)}
        for name in [name for name in self.links if name not in kept]:
            self.root.remove(self.links.pop(name))
        for name in [name for name, joint in self.joints.items() if joint.parent not in kept]:
            self.root.remove(self.joints.pop(name).element)
        self._connect()

    def put_above(self, name: str, turn: FloatArray) -> None:
        """Put a new base without mass above the base, which is turned in it by ``(3, 3)``."""
        place = np.eye(4)
        place[:3, :3] = turn
        self._join(name, name, self.base, place)

    def rename(self, joint: str, name: str) -> None:
        """Give a joint another name."""
        found = self.joints.pop(joint)
        found.name = name
        found.element.set("name", name)
        self.joints[name] = found

    def new_name(self, name: str) -> str:
        """A name that no link or joint has."""
        while name in self.links or name in self.joints:
            name += "'"
        return name

    def add_frame(self, name: str, parent: str, xyz: FloatArray) -> None:
        """Add a link without mass at a place of another [m]."""
        place = np.eye(4)
        place[:3, 3] = xyz
        self._join(name, parent, name, place)

    def _join(self, name: str, parent: str, child: str, place: FloatArray) -> None:
        """Add a link ``name`` without mass that is fixed above or below another."""
        self.links[name] = ElementTree.SubElement(self.root, "link", name=name)
        joint = ElementTree.SubElement(self.root, "joint", name=f"{name} fixed", type="fixed")
        set_origin(joint, place)
        ElementTree.SubElement(joint, "parent", link=parent)
        ElementTree.SubElement(joint, "child", link=child)
        self.joints[f"{name} fixed"] = Joint(joint, self.label)
        self._connect()

    def text(self) -> str:
        """The URDF as text."""
        return ElementTree.tostring(self.root, encoding="unicode")


def _end(element: Element, end: str, where: str) -> str:
    """The link at one end of a joint."""
    found = element.find(end)
    name = None if found is None else found.get("link")
    if not name:
        raise RobotError(f"{where} has no {end} link")
    return name


def _axis_of(element: Element, where: str) -> FloatArray:
    """A joint's unit axis; x where there is none, as URDF has it.

    Joints that do not turn often have an axis of zeros, which does not matter.
    """
    axis = element.find("axis")
    text = "1 0 0" if axis is None else axis.get("xyz", "1 0 0")
    moves = element.get("type") in ONE_WAY
    if not moves:
        return np.array([1.0, 0.0, 0.0])
    vector = numbers(text, 3, f"{where}: its <axis>")
    length = float(np.linalg.norm(vector))
    if not 1e-9 < length < 1e9:
        raise RobotError(f"{where}: its <axis> {text[:60]!r} has no direction")
    return np.asarray(vector / length)
