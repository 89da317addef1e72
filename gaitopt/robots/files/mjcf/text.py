"""An MJCF's text, with only what describes the robot itself.

Scenes hold floors, lights, sensors, textures and plugins, and name files that may be missing. Only
bodies, joints, shapes, actuators, equalities and key frames are kept, so that MuJoCo has no reason
to refuse the rest, and neither opens files nor loads code that a file from somebody else names.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree

from gaitopt.errors import RobotError
from gaitopt.files import read_bounded
from gaitopt.robots.files.meshes import MESH_KINDS, MeshFinder, mesh_hull
from gaitopt.robots.xml_text import LIMIT, MOST_NESTED, nested_too_deeply, parsed_xml

MOST_INCLUDES = 50
MOST_COPIES = 100
"""Most files that a model may include, and most copies that a ``<replicate>`` may make, with those
that it is in."""
MOST_ELEMENTS = 50_000
"""Most elements of a model."""

TRUNK = "trunk"
"""Name of the body that is made where legs hang on the world."""
_IN_BODY = ("body", "inertial", "joint", "freejoint", "geom", "site", "frame", "replicate")
_DEFAULTS = ("default", "joint", "geom", "site", "mesh", "motor", "position", "velocity",
             "general", "intvelocity", "damper", "equality")  # fmt: skip
_COMPILER = ("angle", "autolimits", "eulerseq", "inertiafromgeom", "inertiagrouprange", "boundmass",
             "boundinertia", "settotalmass", "balanceinertia", "coordinate")  # fmt: skip
_MESH = ("scale", "refpos", "refquat", "inertia")
_EQUALITIES = ("connect", "weld", "joint")
_SHAPES = ("sphere", "capsule", "cylinder", "box", "ellipsoid", "mesh")
_UNKNOWN = ("material", "texture", "hfield", "fluidshape", "fluidcoef", "user")
"""Attributes that need what is left out, or that mean nothing here."""

Element = ElementTree.Element


class MjcfText:
    """A cleaned MJCF.

    Attributes:
        root: its element ``<mujoco>``.
        name: the model's name, ``""`` where it has none.
        meshes: for each mesh its file, as the URDF will name it, and its scale.
        keyframes: the numbers of each key frame's ``qpos``, by its name.
        missing: meshes whose file is missing.
    """

    def __init__(self, text: str, label: str, folder: Path | None, finder: MeshFinder) -> None:
        self._label, self._finder = label, finder
        root = _with_includes(_parsed(text, label), label, folder)
        if sum(1 for _ in root.iter()) > MOST_ELEMENTS:
            raise RobotError(f"{label}: the MJCF has more than {MOST_ELEMENTS} elements")
        self.name = root.get("model", "")
        self.missing: list[str] = []
        self.meshes: dict[str, tuple[str, str]] = {}
        self.keyframes = {
            key.get("name", f"key {i}"): key.get("qpos", "").split()
            for i, key in enumerate(root.iterfind("keyframe/key"))
        }
        compiler = _compiler_attributes(root)
        assets = self._mesh_assets(root, compiler)
        self.root = ElementTree.Element("mujoco", model=self.name or "robot")
        kept = {name: value for name, value in compiler.items() if name in _COMPILER}
        ElementTree.SubElement(self.root, "compiler", {
            **kept, "fusestatic": "false", "discardvisual": "false",
        })  # fmt: skip
        self.root.extend([self._cleaned(part, _DEFAULTS) for part in root.findall("default")])
        self.root.append(assets)
        self._add_bodies(root)
        for part in root.findall("actuator"):
            self.root.append(_actuators(part))
        for part in root.findall("equality"):
            out = ElementTree.SubElement(self.root, "equality")
            out.extend(child for child in part if child.tag in _EQUALITIES)
        self._add_excludes(root)

    def _add_excludes(self, root: Element) -> None:
        """Add the pairs of bodies that never touch one another."""
        names = {body.get("name") for body in self.root.iter("body")}
        out = ElementTree.SubElement(self.root, "contact")
        for pair in root.iterfind("contact/exclude"):
            bodies = {name: pair.get(name, "") for name in ("body1", "body2")}
            if names.issuperset(bodies.values()):
                ElementTree.SubElement(out, "exclude", bodies)

    def text(self) -> str:
        """The cleaned text."""
        return ElementTree.tostring(self.root, encoding="unicode")

    def _mesh_assets(self, root: Element, compiler: dict[str, str]) -> Element:
        """The meshes whose files are there."""
        out = ElementTree.Element("asset")
        folder = compiler.get("meshdir", compiler.get("assetdir", ""))
        strip = compiler.get("strippath", "false") == "true"
        defaults = {d.get("class", "main"): m.get("scale") for d in root.iter("default")
                    for m in d.findall("mesh")}  # fmt: skip
        for mesh in root.iterfind("asset/mesh"):
            file = mesh.get("file", "")
            if not file:
                continue
            name = mesh.get("name") or Path(file).stem
            inside = Path(file).name if strip else file
            path = self._finder.find(str(Path(folder) / inside)) or self._finder.find(inside)
            if path is None or path.suffix.lower() not in MESH_KINDS[:2]:
                self.missing.append(name)
                continue
            scale = mesh.get("scale") or defaults.get(mesh.get("class", "main")) or "1 1 1"
            self.meshes[name] = (str(Path(folder) / inside), scale)
            used = {k: v for k, v in mesh.attrib.items() if k in _MESH}
            given = {**used, "name": name, "scale": scale, "file": str(path)}
            ElementTree.SubElement(out, "mesh", given)
        return out

    def take_hulls(self) -> None:
        """Give all meshes the inertia of their convex hulls: open ones have none of their own."""
        for mesh in self.root.iterfind("asset/mesh"):
            mesh.set("inertia", "convex")

    def take_corners(self) -> None:
        """Give the corners of all meshes' convex hulls in place of their files.

        MuJoCo reads fewer kinds of meshes than others do, as no STL that is text. Meshes that
        nobody can read are missing, and shapes that are made of them go.
        """
        for mesh in list(self.root.iterfind("asset/mesh")):
            hull = mesh_hull(Path(mesh.attrib.pop("file", "")))
            if hull is None:
                self.root.find("asset").remove(mesh)  # type: ignore[union-attr]
                self.missing.append(mesh.get("name", ""))
                self.meshes.pop(mesh.get("name", ""), None)
            else:
                mesh.set("vertex", " ".join(map(repr, hull.ravel().tolist())))
        for body in self.root.iter("body"):
            for geom in [geom for geom in body.findall("geom") if self._is_lost(geom)]:
                body.remove(geom)

    def _add_bodies(self, root: Element) -> None:
        """Add the bodies of all worlds; shapes and sites of the world itself are no robot's.

        Programs that make an MJCF of a URDF whose base is fixed leave the legs on the world. They
        get a trunk again, with the world's shapes. Its mass is lost.
        """
        world = ElementTree.SubElement(self.root, "worldbody")
        parts = [child for part in root.findall("worldbody") for child in part]
        bodies = [child for child in parts if child.tag in ("body", "frame", "replicate")]
        moving = [body for body in bodies if body.find("joint") is not None]
        if len(moving) > 1 and not any(_is_free(body) for body in bodies):
            shapes = [child for child in parts if child.tag == "geom" and not self._is_lost(child)]
            trunk = ElementTree.SubElement(world, "body", name=TRUNK)
            trunk.extend([self._cleaned(child, _IN_BODY) for child in shapes])
            for shape in trunk.findall("geom"):
                shape.set("mass", "0")
            world = trunk
        world.extend([self._cleaned(body, _IN_BODY) for body in bodies])

    def _cleaned(self, element: Element, tags: tuple[str, ...], copies: float = 1.0) -> Element:
        """A copy with only children of some kinds, and without shapes that cannot be read.

        Args:
            element: what is copied.
            tags: of the children that stay.
            copies: how many copies the elements around it make of it.
        """
        if element.tag == "replicate":
            copies *= _copies(element)
        if not copies <= MOST_COPIES:
            raise RobotError(f"{self._label}: <replicate> makes more than {MOST_COPIES} copies")
        given = {k: v for k, v in element.attrib.items() if k not in _UNKNOWN}
        out = ElementTree.Element(element.tag, given)
        for child in element:
            if child.tag == "attach":
                raise RobotError(
                    f"{self._label}: it attaches a part of the model {child.get('model')!r}, which "
                    "is not read; save the whole model with MuJoCo (mj_saveLastXML) and give that"
                )
            if child.tag in tags and not self._is_lost(child):
                out.append(self._cleaned(child, tags, copies))
        return out

    def _is_lost(self, element: Element) -> bool:
        """Whether an element is a shape whose mesh is missing, or of a kind that is not read."""
        if element.tag != "geom":
            return False
        mesh = element.get("mesh")
        lost = mesh is not None and mesh not in self.meshes
        return lost or element.get("type", "mesh") not in _SHAPES


def _is_free(body: Element) -> bool:
    """Whether a body has a free joint."""
    free = any(joint.get("type") == "free" for joint in body.findall("joint"))
    return free or body.find("freejoint") is not None


def _parsed(text: str, label: str) -> Element:
    """The element ``<mujoco>`` of a text."""
    root = parsed_xml(text, label, "MJCF")
    if root.tag not in ("mujoco", "mujocoinclude"):
        raise RobotError(f"{label}: the outermost element is <{root.tag}>, not <mujoco>")
    return root


def _with_includes(root: Element, label: str, folder: Path | None) -> Element:
    """The element with what it includes in the places of ``<include>``.

    Raises:
        RobotError: a file is missing, outside of the folder above the model's, or one of too many;
            or the files nest elements too deeply.
    """
    read = 0

    def expand(element: Element, depth: int) -> Iterator[Element]:
        nonlocal read
        if depth > MOST_NESTED:
            raise nested_too_deeply(label, "MJCF")
        for child in list(element):
            if child.tag != "include":
                child[:] = list(expand(child, depth + 1))
                yield child
                continue
            read += 1
            if read > MOST_INCLUDES:
                raise RobotError(f"{label}: the MJCF includes more than {MOST_INCLUDES} files")
            yield from expand(_included(child.get("file", ""), label, folder), depth + 1)

    root[:] = list(expand(root, 0))
    return root


def _included(file: str, label: str, folder: Path | None) -> Element:
    """The root of a file that is included."""
    if folder is None:
        raise RobotError(f"{label}: it includes {file!r}; give the path of the file, not its text")
    path = (folder / file).resolve()
    if not path.is_relative_to(folder.resolve().parent):
        raise RobotError(f"{label}: it includes {file!r}, which is not beside it; copy it there")
    data = read_bounded(path, LIMIT, RobotError)
    return _parsed(data.decode("utf-8", "replace"), f"{label}: {file}")


def _compiler_attributes(root: Element) -> dict[str, str]:
    """The attributes of all ``<compiler>`` elements."""
    out: dict[str, str] = {}
    for compiler in root.findall("compiler"):
        out.update(compiler.attrib)
    return out


def _actuators(part: Element) -> Element:
    """The actuators of joints, without what other parts of a model are needed for."""
    out = ElementTree.Element("actuator")
    out.extend(
        ElementTree.Element(child.tag, {k: v for k, v in child.attrib.items() if k != "user"})
        for child in part
        if child.get("joint") and child.tag in _DEFAULTS
    )
    return out


def _copies(element: Element) -> float:
    """How many copies a ``<replicate>`` makes, one at least; infinite for what is no number."""
    try:
        return max(float(element.get("count", "1")), 1.0)
    except ValueError:
        return float("inf")
