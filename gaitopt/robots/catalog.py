"""Robots by name: gaitopt's own, those of example-robot-data, or any robot file."""

from __future__ import annotations

import math
import os
import unicodedata
from collections.abc import Mapping, Sequence
from dataclasses import replace
from difflib import get_close_matches
from functools import cache
from importlib import resources
from itertools import islice
from pathlib import Path
from typing import Any, Final
from xml.etree import ElementTree

from gaitopt.errors import InputError, MissingPackageError, RobotError, RobotWarning, warn
from gaitopt.files import StrPath, what_no_file_is
from gaitopt.inputs import as_text
from gaitopt.robots.abilities import friction_warnings, inertia_warnings, torque_warnings
from gaitopt.robots.at_many_poses.leg_ends import wide_end
from gaitopt.robots.files.notes import Notes
from gaitopt.robots.files.options import ReadOptions, folder_paths
from gaitopt.robots.files.packages import packaged_robot
from gaitopt.robots.files.reading import name_of, read_file, read_text
from gaitopt.robots.files.sizes import UNREAL
from gaitopt.robots.quadruped import Quadruped
from gaitopt.robots.urdf_text import with_velocity_limit

RobotSource = StrPath
"""A robot's name, the path of its file, or the text of one, which is longer than any path."""

OWN_ROBOTS: Final[tuple[str, ...]] = ("wang2020", "frog1")
"""Robots whose URDF is shipped with gaitopt."""

VARIANTS: Final[Mapping[str, tuple[str, float]]] = {"wang2020-fast": ("wang2020", 300.0)}
"""Robots that are others with another velocity limit of their joints [deg/s].

With joints of 17 deg/s wang2020 cannot trot. 300 deg/s is about what the motors of small robots
reach, and lets it trot without a URDF from elsewhere.
"""

NO_NAMES: Final = ("robot", "model", "scene", "urdf", "main")
"""Names of files that tell nothing of a robot: the name inside the file is taken instead."""

ROBOT_FILES: Final = (".urdf", ".xacro", ".xml", ".mjcf")
"""How the names of robot files end."""
MOST_FILES: Final = 1000
"""Most files of a folder among which one with a similar name is looked for."""

LOOK_ALIKE: Final = str.maketrans("oil", "011")
"""Letters that can be taken for digits."""

OWN_NAMES: Final = (*OWN_ROBOTS, *VARIANTS)
"""Names of all robots that come with gaitopt."""

EXAMPLE_ROBOTS: Final[tuple[str, ...]] = (
    "a1", "go1", "go2", "b1", "laikago", "anymal", "anymal_c", "hyq", "solo12", "solo8",
    "quadruped",
)  # fmt: skip
"""Quadrupeds of the package ``example-robot-data`` (extra ``robots``)."""


def robot_names() -> tuple[str, ...]:
    """Every name that :func:`load_robot` knows."""
    return OWN_NAMES + EXAMPLE_ROBOTS


def load_robot(
    source: RobotSource,
    knees: Mapping[str, str] | None = None,
    *,
    legs: Mapping[str, str] | None = None,
    feet: Mapping[str, Any] | None = None,
    foot_radius: float | None = None,
    pose: Mapping[str, float] | None = None,
    masses: Mapping[str, float] | str | None = None,
    velocity_limits: float | Mapping[str, float] | None = None,
    effort_limits: float | Mapping[str, float] | None = None,
    acceleration_limits: float | Mapping[str, float] | None = None,
    motor_inertia: float | Mapping[str, float] | None = None,
    torque_line: tuple[float, float] | Mapping[str, tuple[float, float]] | None = None,
    scale: float | None = None,
    package_folders: Sequence[StrPath] = (),
    xacro_arguments: Mapping[str, str] | None = None,
) -> Quadruped:
    """Load a robot by name, or from a file: URDF, xacro or MJCF.

    What the file leaves open is guessed, and told in :attr:`Quadruped.notes`; what the user should
    look at is also a :class:`gaitopt.RobotWarning`. Legs may have any usual name wherever legs are
    keys: ``LF``, ``FL``, ``front_left``.

    Args:
        source: a name of :func:`robot_names`, as ``"wang2020"`` or ``"go2"``; a name of the
            packages robot_descriptions or mujoco_menagerie (``"go1_description"``,
            ``"unitree_go1"``), which download a robot at its first use; a path to a file; or the
            text of one.
        knees: side per leg, ``"forward"`` or ``"backward"``, where the knee's limits leave both
            open; front knees backward and hind knees forward by default.
        legs: foot link or last joint of every leg, where the four legs are not found, or wrongly.
        feet: the foot of a leg: a link, or a link and a place ``(x, y, z)`` in its frame [m].
        foot_radius: radius of the feet [m]; from their shapes by default. Where the ends of legs
            are wider than their balls, it is by default the radius of balls that hold them.
        pose: positions of joints of no leg (head, arm, wheels) by name [rad, m]. Such joints are
            locked, by default as near to zero as their limits allow.
        masses: of links by name [kg]; ``"shapes"`` estimates all of them from the links' shapes;
            ``"file"`` keeps them and takes the inertias from the shapes; ``"none"`` loads
            a robot without masses, for plans with ``timing="velocity"``.
        velocity_limits: of the legs' joints [rad/s], one number or by joint.
        effort_limits: of the legs' joints [N m], one number or by joint.
        acceleration_limits: of the legs' joints [rad/s^2], one number or by joint. Every plan
            of the robot keeps them; no robot file tells any.
        motor_inertia: inertia of motor and gear at the legs' joints [kg m^2], one number or by
            joint: that of the rotor times the square of the gear's ratio. Instead of an MJCF's
            ``armature``; a URDF has none.
        torque_line: two speeds of the legs' joints [rad/s], one pair or pairs by joint: up to the
            first a motor has its whole torque, and at the second, the speed without load, it has
            none. In between the torque that drives the joint falls linearly.
        scale: unit of length of a URDF or xacro file that is not in metres [m]: 0.001 for one in
            millimetres. Places, shapes and meshes are multiplied by it, moments of inertia by its
            square.
        package_folders: folders with ROS packages, for ``package://`` and ``$(find ...)``. Folders
            above the file and those in ``ROS_PACKAGE_PATH`` are looked into anyway.
        xacro_arguments: of a xacro file, by name.

    Raises:
        RobotError: unknown name, unreadable or malformed file, or no quadruped that gaitopt can
            plan for; the message says which joint or leg.
        InputError: an option is not valid, or names what the robot does not have.
        MissingPackageError: a package that provides the robot, or reads its file, is missing.
    """
    options = ReadOptions(
        legs=legs, feet=feet, foot_radius=foot_radius, pose={} if pose is None else pose,
        masses=masses, velocity_limits=velocity_limits, effort_limits=effort_limits,
        acceleration_limits=acceleration_limits, motor_inertia=motor_inertia,
        torque_line=torque_line, scale=scale, package_folders=folder_paths(package_folders),
        xacro_arguments={} if xacro_arguments is None else xacro_arguments,
    )  # fmt: skip
    name, urdf, notes = _read(source, options)
    robot = Quadruped.from_urdf(urdf, name or None, knees)
    if robot.name not in robot_names() and (end := wide_end(replace(robot, notes=notes))):
        told = f"{end.words}; give foot_radius={end.enough:.4g}"
        if foot_radius is None and end.is_foot:
            name, urdf, notes = _read(source, replace(options, ends_within=end.enough))
            robot = Quadruped.from_urdf(urdf, name or None, knees)
            told = (f"{end.words}; so its radius is taken as {1e3 * end.enough:.4g} mm: give "
                    f"foot_radius={end.radius:.4g} for the ball itself")  # fmt: skip
        notes = replace(notes, warnings=(*notes.warnings, told))
    if not any(UNREAL in warning for warning in notes.warnings):
        told_all = (*notes.warnings, *torque_warnings(robot), *inertia_warnings(robot),
                    *friction_warnings(robot))  # fmt: skip
        notes = replace(notes, warnings=told_all)
    for warning in notes.warnings:
        warn(f"{robot.name}: {warning}", RobotWarning)
    return replace(robot, notes=notes)


def _read(source: StrPath, options: ReadOptions) -> tuple[str, str, Notes]:
    """Name of a robot (empty for the one inside its file), its URDF, and what was read."""
    if not isinstance(source, (str, os.PathLike)) or isinstance(os.fspath(source), bytes):
        raise InputError(f"a robot is a name, a path or the text of a file, got {as_text(source)}")
    name = str(source).strip().lower()
    if name in OWN_NAMES:
        text = _own_text(name)
        plain = options.empty and not options.xacro_arguments
        return (name, text, Notes()) if plain else (name, *read_text(text, name, options))
    if name in EXAMPLE_ROBOTS:
        return (name, *read_file(example_urdf(name), options))
    if _is_text(source):
        urdf, notes = read_text(str(source), "robot", options)
        return _own_name("", urdf, "text"), urdf, notes
    found = _packaged(name, source)
    if found is not None:
        path, arguments = found
        options = replace(options, xacro_arguments={**arguments, **options.xacro_arguments})
        return (name, *read_file(path, options))
    path = _user_file(source)
    urdf, notes = read_file(path, options)
    name = "" if name_of(path).lower() in NO_NAMES else name_of(path)
    return _own_name(name, urdf, path.name), urdf, notes


def taken_for(name: str) -> str | None:
    """The known name that a name is, or that it can be taken for: ``"Go-2 "`` for ``"go2"``."""
    return {_letters(known): known for known in robot_names()}.get(_letters(name))


def _letters(name: str) -> str:
    """Letters and digits of a name, as small ones; O counts as zero, I and L as one."""
    plain = unicodedata.normalize("NFKC", name).casefold().translate(LOOK_ALIKE)
    return "".join(letter for letter in plain if letter.isalnum())


def _own_name(name: str, urdf: str, origin: str) -> str:
    """The name of a user's robot; with where it is from, if it can be taken for a known robot's.

    A plan of a robot with a known name is judged by the known robot.

    Args:
        name: of the robot; empty for the one inside the URDF.
        urdf: its text.
        origin: name of its file.
    """
    plain = name or ElementTree.fromstring(urdf).get("name", "")
    known = taken_for(plain)
    if known is None:
        return name
    try:
        same = known_urdf(known) == urdf
    except MissingPackageError:
        same = False
    return name if same else f"{plain.strip()} ({origin})"


@cache
def known_urdf(name: str) -> str:
    """The URDF that :func:`load_robot` gives a robot of :func:`robot_names`, without options.

    Raises:
        MissingPackageError: the package that provides the robot is missing.
    """
    return _own_text(name) if name in OWN_NAMES else read_file(example_urdf(name), ReadOptions())[0]


def robot_file(source: StrPath) -> Path | None:
    """The file that :func:`load_robot` reads; ``None`` for gaitopt's own robots, and for texts.

    Raises:
        RobotError, MissingPackageError: as for :func:`load_robot`.
    """
    name = str(source).strip().lower()
    if name in OWN_NAMES or _is_text(source):
        return None
    if name in EXAMPLE_ROBOTS:
        return example_urdf(name)
    found = _packaged(name, source)
    return _user_file(source) if found is None else found[0]


def _packaged(name: str, source: StrPath) -> tuple[Path, Mapping[str, str]] | None:
    """The file of a robot of another package; ``None`` for a path, or a name that none knows."""
    if is_file(Path(source)) or not name.isidentifier():
        return None
    return packaged_robot(name)


def _is_text(source: StrPath) -> bool:
    """Whether it is the text of a robot file: it has a tag, and is no path.

    A path may hold a ``<``, too: that of a file which exists, or one that ends as robot files do.
    """
    if not isinstance(source, str) or "<" not in source:
        return False
    return not is_file(Path(source)) and Path(source).suffix.lower() not in ROBOT_FILES


def _user_file(source: StrPath) -> Path:
    """The file of a path; raises RobotError where there is none."""
    path = Path(source)
    if is_file(path):
        return path
    special = what_no_file_is(path)
    if special:
        raise RobotError(
            f"cannot read {path}: it is {special}, and no file; save it as a file first"
        )
    if path.suffix or len(path.parts) > 1:
        raise RobotError(
            f"no robot file at {path}{_near(path)}; give an existing file or a robot's name"
        )
    raise RobotError(
        f"unknown robot {str(source)!r}; known are {', '.join(robot_names())}, or give a path to a "
        "robot file"
    )


def _near(path: Path) -> str:
    """The file in the same folder whose name is most like that of ``path``, in words."""
    try:
        files = [entry.name for entry in islice(path.parent.iterdir(), MOST_FILES)
                 if entry.suffix in ROBOT_FILES and entry.is_file()]  # fmt: skip
    except (OSError, ValueError):
        return ""
    near = get_close_matches(path.name, files, n=1)
    return f" (did you mean {str(path.with_name(near[0]))!r}?)" if near else ""


def _own_text(name: str) -> str:
    """The URDF of one of gaitopt's own robots."""
    if name in VARIANTS:
        name, limit = VARIANTS[name]
        return with_velocity_limit(own_urdf(name).read_text("utf-8"), math.radians(limit))
    return own_urdf(name).read_text("utf-8")


def is_file(path: Path) -> bool:
    """Whether a file is there; false also for what cannot be a path."""
    try:
        return path.is_file()
    except (OSError, ValueError):  # a name too long, a folder that is closed, a null character
        return False


def own_urdf(name: str) -> Path:
    """Path of a URDF shipped with gaitopt: inside the wheel, or in a checkout's ``urdf/``."""
    package = Path(str(resources.files("gaitopt")))
    for folder in (package / "urdf", package.parent / "urdf"):
        if (folder / f"{name}.urdf").is_file():
            return folder / f"{name}.urdf"
    raise RobotError(f"{name}.urdf is missing from this installation of gaitopt; reinstall it")


def example_urdf(name: str) -> Path:
    """Path of an example-robot-data quadruped's URDF."""
    try:
        import pinocchio  # noqa: F401  (puts the folder of cmeel's packages on the path)
        from example_robot_data.robots_loader import ROBOTS, getModelPath
    except ImportError as error:
        raise MissingPackageError(
            f"robot {name!r} needs the packages example-robot-data and -loaders: "
            "pip install 'gaitopt[robots]'"
        ) from error
    loader = ROBOTS[name]
    inside = "/".join((loader.path, loader.urdf_subpath, loader.urdf_filename))
    return Path(getModelPath(inside)) / inside
