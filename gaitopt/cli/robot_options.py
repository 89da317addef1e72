"""Options that say which robot is meant and how its file is read: the same for all commands."""

from __future__ import annotations

import re
import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import wraps
from inspect import Parameter, Signature, signature
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, get_type_hints

import typer

from gaitopt.cli.completion import complete_robot
from gaitopt.errors import InputError

if TYPE_CHECKING:
    from gaitopt.robots.quadruped import Quadruped

OPTION_OF = {
    "legs": "--leg LF=NAME", "feet": "--foot LF=LINK,X,Y,Z", "foot_radius": "--foot-radius",
    "pose": "--pose JOINT=RADIANS", "knees": "--knee LF=SIDE", "masses": "--mass LINK=KG",
    "velocity_limits": "--velocity-limit", "effort_limits": "--effort-limit",
    "acceleration_limits": "--joint-acceleration-limit",
    "motor_inertia": "--motor-inertia", "torque_line": "--torque-line",
    "package_folders": "--package-folder DIR", "xacro_arguments": "--argument NAME=VALUE",
    "scale": "--scale",
}  # fmt: skip
"""Options in place of the keywords of ``load_robot``."""

RobotOption = Annotated[
    str | None,
    typer.Option(help="A robot's name (see [bold]gaitopt robot --list[/]) or its file: URDF, "
                 "xacro or MJCF.", metavar="ROBOT", rich_help_panel="What walks where",
                 autocompletion=complete_robot),
]  # fmt: skip


@dataclass(frozen=True)
class RobotChoice:
    """A robot as the command line names it.

    Attributes:
        source: a name, a path, or the text of a file.
        options: keywords of :func:`gaitopt.load_robot`; only those that were given.
    """

    source: str
    options: Mapping[str, Any] = field(default_factory=dict)

    def load(self) -> Quadruped:
        """The robot.

        Raises:
            RobotError, InputError, MissingPackageError: as for :func:`gaitopt.load_robot`.
        """
        from gaitopt.robots.catalog import load_robot

        return load_robot(self.source, **self.options)

    def mesh_folders(self) -> tuple[Path, ...] | None:
        """The folders that hold meshes of the robot's own file, or its own where none does.

        They are looked for as :func:`gaitopt.viewing.replay.mesh_files.folders_of_meshes` tells.
        ``None`` for robots that come with a package, and where the file cannot be read.
        """
        from gaitopt.errors import GaitoptError, RobotWarning
        from gaitopt.robots.catalog import EXAMPLE_ROBOTS, robot_file
        from gaitopt.viewing.replay.mesh_files import folders_of_meshes

        if self.source.strip().lower() in EXAMPLE_ROBOTS:
            return None
        try:
            file = robot_file(self.source)
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", RobotWarning)
                if file is None:
                    return None
                packages = self.options.get("package_folders", ())
                return folders_of_meshes(self.load().urdf, file.parent, packages) or (file.parent,)
        except GaitoptError:
            return None  # the command itself says why


def takes_robot(
    default: str | None, shown: Any = RobotOption
) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Give a command a robot, and the options that say how its file is read.

    The command's parameter that is a :class:`RobotChoice` becomes an option or argument with the
    robot's name, and the parameters of :func:`reading` follow the command's own. Without a name the
    command gets ``None``.

    Args:
        default: the robot's name if none is given.
        shown: type of the parameter, with what its help says.
    """

    def decorate(command: Callable[..., None]) -> Callable[..., None]:
        own, hints = _parameters(command), get_type_hints(command)
        (robot,) = [p for p in own if hints[p.name] in (RobotChoice, RobotChoice | None)]
        named = robot.replace(default=default, annotation=shown)
        ways = _parameters(reading)

        @wraps(command)
        def run(**given: Any) -> None:
            options = reading(**{way.name: given.pop(way.name, None) for way in ways})
            source = given[robot.name]
            if source is None and options:
                given_ways = ", ".join(OPTION_OF[name].split()[0] for name in options)
                raise InputError(f"{given_ways} says how a robot is read: give --robot as well")
            choice = None if source is None else RobotChoice(source, options)
            if given.get("meshes") and given.get("mesh_folder") is None and choice is not None:
                given["mesh_folder"] = choice.mesh_folders()
            command(**{**given, robot.name: choice})

        shared = [named if p is robot else p for p in own] + ways
        run.__annotations__ = {p.name: p.annotation for p in shared}
        vars(run)["__signature__"] = Signature(shared)
        return run

    return decorate


def _parameters(function: Callable[..., Any]) -> list[Parameter]:
    """The parameters of a function, with their types instead of the types' texts."""
    hints = get_type_hints(function, include_extras=True)
    return [p.replace(annotation=hints[p.name]) for p in signature(function).parameters.values()]


def _way(text: str, metavar: str | None = None) -> Any:
    """An option that says how the file is read, with its help."""
    return typer.Option(help=text, metavar=metavar, rich_help_panel="How the robot is read")


def reading(
    foot_radius: Annotated[float | None, _way("Radius of the feet, in metres.")] = None,
    masses: Annotated[
        str | None,
        _way("'shapes' estimates masses from the links' shapes, 'file' only inertias, 'none' does "
             "without."),
    ] = None,
    mass: Annotated[list[str] | None, _way("Mass of a link, as LINK=KG.", "LINK=KG")] = None,
    velocity_limit: Annotated[
        list[str] | None,
        _way("Velocity limit of all joints, in rad/s; or of one, as JOINT=NUMBER.", "NUMBER"),
    ] = None,
    effort_limit: Annotated[
        list[str] | None,
        _way("Torque limit of all joints, in N m; or of one, as JOINT=NUMBER.", "NUMBER"),
    ] = None,
    joint_acceleration_limit: Annotated[
        list[str] | None,
        _way("Acceleration limit of all joints, in rad/s², which every plan keeps; or of one, as "
             "JOINT=NUMBER.", "NUMBER"),
    ] = None,
    motor_inertia: Annotated[
        list[str] | None,
        _way("Inertia of motor and gear at every joint, in kg m²; or at one, as JOINT=NUMBER.",
             "NUMBER"),
    ] = None,
    torque_line: Annotated[
        tuple[float, float] | None,
        _way("Two speeds of all joints, in rad/s, with a space between them (10 30): up to the "
             "first a motor has its whole torque, and at the second none.", "FULL NONE"),
    ] = None,
    leg: Annotated[
        list[str] | None,
        _way("Foot link or last joint of a leg, as LF=NAME; four times.", "LEG=NAME"),
    ] = None,
    foot: Annotated[
        list[str] | None,
        _way("Link of a leg's foot, as LF=LINK; with a place in its frame, in metres, as "
             "LF=LINK,X,Y,Z.", "LEG=LINK"),
    ] = None,
    knee: Annotated[
        list[str] | None,
        _way("Side to which a leg's knee points, as LF=backward.", "LEG=SIDE"),
    ] = None,
    pose: Annotated[
        list[str] | None,
        _way("Where a joint of no leg is locked, as JOINT=RADIANS.", "JOINT=RADIANS"),
    ] = None,
    scale: Annotated[
        float | None,
        _way("Unit of length of a file that is not in metres: 0.001 for millimetres.", "METRES"),
    ] = None,
    package_folder: Annotated[list[Path] | None, _way("Folder with ROS packages.")] = None,
    argument: Annotated[
        list[str] | None, _way("Argument of a xacro file, as NAME=VALUE.", "NAME=VALUE")
    ] = None,
) -> dict[str, Any]:  # fmt: skip
    """Keywords of :func:`gaitopt.load_robot` from options; only those that were given.

    Raises:
        InputError: an option is not written as its help says.
    """
    if masses is not None and mass:
        raise InputError("--masses and --mass exclude each other: give one of them")
    keywords = {
        "foot_radius": foot_radius, "masses": masses or _numbers("--mass", mass),
        "velocity_limits": _number_or_numbers("--velocity-limit", velocity_limit),
        "effort_limits": _number_or_numbers("--effort-limit", effort_limit),
        "acceleration_limits": _number_or_numbers(
            "--joint-acceleration-limit", joint_acceleration_limit
        ),
        "motor_inertia": _number_or_numbers("--motor-inertia", motor_inertia),
        "torque_line": torque_line, "legs": _pairs("--leg", leg), "feet": _feet(foot),
        "knees": _pairs("--knee", knee), "pose": _numbers("--pose", pose),
        "scale": scale, "package_folders": package_folder,
        "xacro_arguments": _pairs("--argument", argument),
    }  # fmt: skip
    return {name: value for name, value in keywords.items() if value not in (None, {}, [])}


def in_options(text: str) -> str:
    """A message of gaitopt with the options of the command line in place of robots' keywords."""
    text = re.sub(r"\b(masses|timing)=(['\"])(\w+)\2", r"--\1 \3", text)
    text = text.replace("meshes='folder'", "--mesh-folder").replace(" (meshes=False)", "")
    for keyword, option in OPTION_OF.items():
        value = r"({[^{}]*}|\[[^\[\]]*\]|\.\.\.)?"
        text = re.sub(rf"\b{keyword}=(?=\d)", f"{option} ", text)
        text = re.sub(rf"\b{keyword}={value}", option, text)
    return text


def _number_or_numbers(option: str, given: list[str] | None) -> float | dict[str, float] | None:
    """One number for all joints, or numbers by joint.

    Raises:
        InputError: it is neither, or both.
    """
    if not given:
        return None
    if len(given) == 1 and "=" not in given[0]:
        try:
            return float(given[0])
        except ValueError:
            raise InputError(f"{option} takes a number, or JOINT=NUMBER: {given[0]!r}") from None
    return _numbers(option, given)


def _pairs(option: str, given: list[str] | None) -> dict[str, str]:
    """Values by name of an option ``NAME=VALUE``.

    Raises:
        InputError: one has no ``=``, or a name comes twice.
    """
    pairs: dict[str, str] = {}
    for text in given or []:
        name, mark, value = text.partition("=")
        if not mark or not name:
            raise InputError(f"{option} takes NAME=VALUE, got {text!r}")
        if name in pairs:
            raise InputError(f"{option} names {name!r} twice")
        pairs[name] = value
    return pairs


def _feet(given: list[str] | None) -> dict[str, Any]:
    """Feet by leg: links, or links with places; raises InputError where a place is none."""
    feet: dict[str, Any] = {}
    for leg, text in _pairs("--foot", given).items():
        link, *place = text.split(",")
        try:
            feet[leg] = (link, tuple(float(x) for x in place)) if place else link
        except ValueError as error:
            raise InputError(f"--foot takes LEG=LINK or LEG=LINK,X,Y,Z: {error}") from None
    return feet


def _numbers(option: str, given: list[str] | None) -> dict[str, float]:
    """Numbers by name of an option ``NAME=NUMBER``; raises InputError where one is none."""
    try:
        return {name: float(value) for name, value in _pairs(option, given).items()}
    except ValueError as error:
        raise InputError(f"{option} takes NAME=NUMBER: {error}") from None
