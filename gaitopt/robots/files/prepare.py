"""Makes of any URDF with four legs one that the rest of gaitopt reads as it is.

What comes out has a base with a mass, four chains of two or three ``revolute`` joints, feet, and
nothing else that moves. A URDF that is all that already keeps its text.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from gaitopt.conventions import LEGS, frozen
from gaitopt.errors import InputError, RobotError
from gaitopt.robots.discovery import Chain, assign_names, heading_axes
from gaitopt.robots.feet import ball_radius
from gaitopt.robots.files.axes import straighten
from gaitopt.robots.files.elements import unknown_elements
from gaitopt.robots.files.ends import set_feet
from gaitopt.robots.files.hulls import find_hulls
from gaitopt.robots.files.joint_limits import set_limits
from gaitopt.robots.files.limbs import Limb, find_limbs, lock_play, named_limbs
from gaitopt.robots.files.masses import set_masses
from gaitopt.robots.files.meshes import MeshFinder, named_folder
from gaitopt.robots.files.motors import acceleration_limits, motor_inertias, torque_lines
from gaitopt.robots.files.notes import TAG, Notes, first_of, read_notes, write_notes
from gaitopt.robots.files.options import ReadOptions, SpeedPair
from gaitopt.robots.files.origins import tidy
from gaitopt.robots.files.own_shapes import OwnShapes
from gaitopt.robots.files.shapes import write_known_shapes
from gaitopt.robots.files.sizes import (
    mass_warnings,
    remove_empty_shapes,
    scale_lengths,
    size_warnings,
)
from gaitopt.robots.files.tree import UrdfTree
from gaitopt.robots.files.upright import stand_upright
from gaitopt.robots.leg_names import leg_of_names
from gaitopt.robots.urdf_text import parsed_urdf

PINOCCHIO = ("root_joint", "universe")
"""Names that Pinocchio gives itself."""
GROUND = "world"
"""Name of the link that stands for the ground in ROS and MuJoCo."""


def prepared_urdf(
    urdf: str, known: Notes | None, label: str, folder: Path | None, options: ReadOptions,
    *, square: bool = True,
) -> tuple[str, Notes]:  # fmt: skip
    """The URDF's text, made ready, and what was read and guessed.

    Args:
        urdf: the text.
        known: what a reader of another kind of file found, in notes.
        label: what to call the robot in messages.
        folder: where the file lies, for its meshes; ``None`` for a robot that comes as text.
        options: what the user says of it.
        square: whether axes that are meant to be square are made so.

    Raises:
        RobotError: it has no four legs, or another fault that cannot be passed over.
        InputError: an option names what the robot does not have.
    """
    root = parsed_urdf(urdf, label)
    before = read_notes(urdf, label)
    if root.find(TAG) is not None and options.empty:
        return _checked(root, urdf, label), before
    notes, same = known or before, ElementTree.tostring(root)
    tidy(root)
    done, warnings = list(notes.done), _open_warnings(notes, options)
    warnings += (unread := unknown_elements(root))
    if options.scale is not None:
        scale_lengths(root, options.scale, label)
        done.append(f"lengths are those of the file times {options.scale:g}")
    done += remove_empty_shapes(root)
    tree, finder = (
        UrdfTree(root, label),
        MeshFinder(folder, options.package_folders, named_folder(root)),
    )
    done += write_known_shapes(tree)
    named, locked = _set_legs(tree, options, done, warnings, square=square)
    unreal = size_warnings(tree, named.values())
    warnings += unreal
    # Feet of an earlier reading stay, unless the user says that the legs are others.
    kept = {} if options.legs else {leg: (link, np.zeros(3)) for leg, link in before.feet.items()}
    asked = {**kept, **(options.feet or {})}
    given = options.foot_radius if options.foot_radius is not None else before.foot_radius
    how = "as given"
    if options.ends_within is not None:
        given, how = options.ends_within, "which holds the ends of the legs"
    with _adding([*unreal, *unread]):
        feet, radius = set_feet(tree, named, asked, finder, given, how, done, warnings)
        warnings += set_masses(tree, options.masses, finder)
    warnings += [] if unreal else mass_warnings(tree, named.values())
    lines = torque_lines(tree.label, named, notes.torque_lines, options.torque_line)
    _set_limits(tree, named, options, lines, done, warnings)
    told = Notes(
        kind=notes.kind, feet=feet, foot_radius=radius, standing=notes.standing,
        armature=motor_inertias(tree.label, named, notes.armature, options.motor_inertia),
        accelerations=acceleration_limits(
            tree.label, named, before.accelerations, options.acceleration_limits
        ),
        torque_lines=lines, locked={**notes.locked, **locked},
        hulls=find_hulls(tree, finder) or notes.hulls, own=_own(notes, options),
        done=tuple(done), warnings=tuple(dict.fromkeys(warnings)),
    )  # fmt: skip
    plain = known is None and options.legs is None and not asked and not told.hulls
    plain &= ElementTree.tostring(root) == same and told.armature == before.armature
    plain &= told.torque_lines == before.torque_lines
    plain &= told.accelerations == before.accelerations
    if plain and radius == ball_radius(urdf, list(feet.values())):
        return urdf, told
    root.attrib.setdefault("name", label)
    write_notes(root, told)
    return tree.text(), told


@contextmanager
def _adding(doubts: list[str]) -> Iterator[None]:
    """Add doubts to the message of a RobotError, which they may explain."""
    try:
        yield
    except RobotError as error:
        if not doubts:
            raise
        raise RobotError("; ".join([str(error), *doubts])) from error


def _checked(root: ElementTree.Element, urdf: str, label: str) -> str:
    """The text of a URDF that has been made ready before: somebody may have changed it since."""
    same, tree = ElementTree.tostring(root), UrdfTree(root, label)
    if any(tree.mass(link) > 0.0 for link in tree.links):
        set_masses(tree, None, MeshFinder(None))
    return urdf if ElementTree.tostring(root) == same else tree.text()


def _open_warnings(notes: Notes, options: ReadOptions) -> list[str]:
    """Warnings of an earlier reading that no option settles now."""
    settled = [f"{name}=" for name in ("velocity_limits", "effort_limits", "foot_radius", "masses")
               if getattr(options, name) is not None]  # fmt: skip
    return [text for text in notes.warnings if not any(name in text for name in settled)]


def _own(notes: Notes, options: ReadOptions) -> OwnShapes:
    """The shapes of the file, unless the user says that the feet are others."""
    given = options.foot_radius is not None or options.feet is not None
    return OwnShapes() if given else notes.own


def _set_legs(
    tree: UrdfTree, options: ReadOptions, done: list[str], warnings: list[str], *, square: bool
) -> tuple[dict[str, Limb], dict[str, float]]:
    """Leave a robot whose legs alone move; gives them by name, and what was locked where."""
    _set_base(tree, done)
    _part_names(tree)
    still = lock_play(tree, done)
    asked = named_limbs(tree, options.legs) if options.legs else None
    limbs = list(asked.values()) if asked else find_limbs(tree, warnings)
    stand_upright(tree, limbs, done)
    locked = still | _lock_others(tree, limbs, options, done)
    if square:
        warnings += straighten(tree, limbs)
    named = asked or _named(tree, limbs)
    warnings += [] if asked else _other_corners(named)
    _refuse_linkages(tree, named)
    return named, locked


def _set_limits(
    tree: UrdfTree,
    limbs: dict[str, Limb],
    options: ReadOptions,
    lines: Mapping[str, SpeedPair],
    done: list[str],
    warnings: list[str],
) -> None:
    """Make the limits of the legs' joints valid, and their joints have one angle each."""
    joints = [joint for limb in limbs.values() for joint in limb.joints]
    endless = [joint.name for joint in joints if joint.kind == "continuous"]
    warnings += set_limits(
        tree.label, joints, options.velocity_limits, options.effort_limits, lines
    )
    if endless:
        done.append(f"joints without an end have one angle each: {', '.join(endless)}")


def _set_base(tree: UrdfTree, done: list[str]) -> None:
    """Make the body the base: what is above a joint that floats goes, and a link for the ground.

    Raises:
        RobotError: what would go has a mass.
    """
    floating = [joint for joint in tree.walk() if joint.kind == "floating"]
    below = [joint.child for joint in floating if list(tree.walk(joint.child))]
    ends = [joint for joint in floating if joint.child not in below and joint.parent != tree.base]
    for joint in ends:
        joint.lock(0.0)
    if ends:
        named = first_of([joint.name for joint in ends])
        done.append(f"joints that float with nothing below them count as fixed: {named}")
    new = below[0] if below else None
    if new is None and tree.base.lower() == GROUND and len(tree.below(tree.base)) == 1:
        joint = tree.below(tree.base)[0]
        if joint.kind != "fixed":
            raise RobotError(
                f"{tree.label}: joint {joint.name} ({joint.kind}) joins the body to {tree.base!r}; "
                "a robot that walks is free: make it 'floating' or 'fixed'"
            )
        new = joint.child
    if new is None:
        return
    kept = {new} | {joint.child for joint in tree.walk(new)}
    heavy = [name for name in tree.links if name not in kept and tree.mass(name) > 0.0]
    if heavy:
        raise RobotError(
            f"{tree.label}: link {heavy[0]} has a mass and is not below the body {new}, which "
            "floats; put the floating joint above it, or take its mass away"
        )
    done.append(f"the body is {new}; what the file has above it is left out ({tree.base})")
    tree.remove_above(new)


def _part_names(tree: UrdfTree) -> None:
    """Give fixed joints other names where a link has the same: Pinocchio then finds neither."""
    for name, joint in list(tree.joints.items()):
        if joint.fixed and (name in tree.links or name in PINOCCHIO):
            tree.rename(name, tree.new_name(f"{name} fixed"))


def _lock_others(
    tree: UrdfTree, limbs: Iterable[Limb], options: ReadOptions, done: list[str]
) -> dict[str, float]:
    """Lock every joint that belongs to no leg; gives the joints and where they are locked.

    Raises:
        InputError: ``pose`` names a joint of a leg, or none.
    """
    own = {joint.name for limb in limbs for joint in limb.joints}
    wheels = {limb.wheel.name for limb in limbs if limb.wheel is not None}
    for name in options.pose:
        if name not in tree.joints or name in own:
            raise InputError(f"pose: {name!r} is no joint beside those of the legs")
    locked = {}
    for joint in list(tree.walk()):
        if joint.fixed or joint.name in own:
            continue
        low, high = joint.limits()
        at = float(options.pose.get(joint.name, np.clip(0.0, low, high)))
        joint.lock(at)
        locked[joint.name] = at
    for what, names in (("fourth joints", [n for n in locked if n in wheels]),
                        ("joints of no leg", [n for n in locked if n not in wheels])):  # fmt: skip
        if names:
            places = ", ".join(f"{name} at {locked[name]:.4g}" for name in names)
            done.append(f"{what} are locked: {places}")
    return locked


def _named(tree: UrdfTree, limbs: list[Limb]) -> dict[str, Limb]:
    """Which limb is which leg."""
    poses = tree.poses()
    chains, whose = [], {}
    for limb in limbs:
        frames = [poses[joint.child] for joint in limb.joints]
        ends = tree.rigid_with(limb.end)
        tip = max(ends, key=lambda name: float(np.linalg.norm(ends[name][:3, 3])))
        chain = Chain(
            joints=(),
            names=tuple(joint.name for joint in limb.joints),
            points=frozen([frame[:3, 3] for frame in frames]),
            axes=frozen([f[:3, :3] @ j.axis for f, j in zip(frames, limb.joints, strict=True)]),
            foot=tip,
            tip=frozen(poses[tip][:3, 3]),
        )
        chains.append(chain)
        whose[chain.names] = limb
    named = assign_names(tree.label, chains, heading_axes(tree.label, chains))
    return {leg: whose[named[leg].names] for leg in LEGS}


def _other_corners(named: Mapping[str, Limb]) -> list[str]:
    """A warning where the names of the joints tell all four legs, and other ones than they are."""
    told = {leg: leg_of_names(joint.name for joint in limb.joints) for leg, limb in named.items()}
    if set(told.values()) != set(LEGS) or all(leg == name for leg, name in told.items()):
        return []
    legs = ", ".join(f"{named[leg].joints[0].name} is on leg {leg}" for leg in LEGS)
    return [
        f"legs are in other corners than their names tell: {legs}; a robot faces at right angles "
        "to its knees' axes, so it walks sideways, seen by these names, or they exchange left and "
        "right: give legs= to say what is meant"
    ]


def _refuse_linkages(tree: UrdfTree, limbs: dict[str, Limb]) -> None:
    """Refuse legs whose joints follow one another."""
    for leg, limb in limbs.items():
        for joint in limb.joints:
            mimic = joint.element.find("mimic")
            if mimic is not None:
                raise RobotError(
                    f"{tree.label}: leg {leg}: joint {joint.name} follows {mimic.get('joint')} "
                    "(<mimic>), as in a parallel or five-bar linkage; gaitopt plans for serial "
                    "legs: describe the leg by joints that move on their own"
                )
