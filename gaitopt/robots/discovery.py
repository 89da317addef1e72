"""Finds the four legs in a model's kinematic tree.

Joint axes are taken from the model at its zero configuration, because the axes in a URDF's text are
given in frames that may be rotated. Names of joints count only where geometry leaves a choice.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pinocchio as pin

from gaitopt.conventions import LEGS, FloatArray, frozen
from gaitopt.errors import RobotError
from gaitopt.robots.leg_names import parts_of

LEAST_SHARE = 0.74
"""Least share of the squared pitch axes along the base's x or y, with which the robot faces along
the other. With three of four legs along an axis it is at least 0.75, less rounding."""
UPRIGHT = 0.7
"""Least vertical part of a knee's axis that counts as upright. Chosen: half of a right angle."""
FOOT_WORDS = ("foot", "toe", "contact", "sole")
"""Words in the names of links that are feet."""


@dataclass(frozen=True)
class Chain:
    """A serial chain of revolute joints from the body to a foot, in the base frame at zero.

    Attributes:
        joints: Pinocchio joint ids from body to foot.
        names: their names.
        points: a point on each axis ``(nj, 3)`` [m].
        axes: unit axes ``(nj, 3)``.
        foot: name of the foot's frame.
        tip: its position ``(3,)`` [m].
    """

    joints: tuple[int, ...]
    names: tuple[str, ...]
    points: FloatArray
    axes: FloatArray
    foot: str
    tip: FloatArray


def find_chains(model: Any) -> list[Chain]:
    """The four chains of two or three revolute joints that are attached to the free-flying body.

    Raises:
        RobotError: there are fewer or more than four such chains; or there is a joint elsewhere
            whose position is not a single number.
    """
    data = model.createData()
    pin.framesForwardKinematics(model, data, pin.neutral(model))
    found, passed_over = [], []
    for first in model.children[1]:
        ids = _serial(model, first)
        names = [str(model.names[i]) for i in ids]
        if len(ids) in (2, 3) and all(_is_hinge(model.joints[i]) for i in ids):
            found.append(_read_chain(model, data, ids))
        else:
            kinds = ", ".join(
                f"{n} ({model.joints[i].shortname()})" for n, i in zip(names, ids, strict=True)
            )
            passed_over.append(f"[{kinds}]")
    if len(found) != 4:
        legs = "; ".join("-".join(c.names) for c in found) or "none"
        rest = f"; passed over: {'; '.join(passed_over)}" if passed_over else ""
        raise RobotError(
            f"{model.name}: found {len(found)} chains of two or three hinges on the body where a "
            f"quadruped has 4 ({legs}{rest}); every leg must be a serial chain of 2 or 3 revolute "
            "joints (gaitopt.load_robot makes such a robot of files with other joints)"
        )
    for i in range(2, model.njoints):
        if model.joints[i].nq != 1:
            raise RobotError(
                f"{model.name}: joint {model.names[i]} ({model.joints[i].shortname()}) has no "
                "limits or moves more than one way; make it 'fixed', or 'revolute' with limits"
            )
    return found


def with_feet(model: Any, chains: list[Chain], feet: Mapping[str, str]) -> dict[str, Chain]:
    """The chains by the legs whose feet are given.

    Args:
        model: the Pinocchio model.
        chains: the legs.
        feet: frame of the foot of every leg, by the leg's name.

    Raises:
        RobotError: a frame is not on the last joint of a chain, or two are on the same.
    """
    data = model.createData()
    pin.framesForwardKinematics(model, data, pin.neutral(model))
    named = {}
    left = {chain.joints[-1]: chain for chain in chains}
    for leg, link in feet.items():
        index = model.getFrameId(link, pin.FrameType.BODY)
        frame = model.frames[index] if index < model.nframes else None
        chain = None if frame is None else left.pop(int(frame.parentJoint), None)
        if chain is None:
            raise RobotError(
                f"{model.name}: the foot {link!r} of leg {leg} is on the last joint of no leg, or "
                "of one that has another foot"
            )
        tip = frozen(data.oMf[index].translation.copy())
        named[leg] = replace(chain, foot=link, tip=tip)
    return named


def heading_axes(
    label: str, chains: list[Chain], named: Mapping[str, Chain] | None = None
) -> FloatArray:
    """Axes of the body frame (x forward, y left, z up) as columns in the base frame ``(3, 3)``.

    The pitch axes give the lateral direction; where those of the legs form an X, names do, and the
    base's own x is forward without names. Which of its two perpendiculars is forward, names
    decide (front feet lie ahead); without names it is the base's own +x, or +y.

    Args:
        label: what to call the robot in messages.
        chains: the legs.
        named: the legs by name, where these are known.
    """
    pitch = np.array([chain.axes[-1] for chain in chains])
    share = (pitch**2).mean(axis=0)
    upright = np.abs(pitch[:, 2]) > UPRIGHT
    if upright.any() and share.max() < LEAST_SHARE:
        first, last = ([c.names[k] for c, up in zip(chains, upright, strict=True) if up]
                       for k in (0, -1))  # fmt: skip
        raise RobotError(
            f"{label}: at zero angles {', '.join(last)} turn about the vertical axis of the base, "
            "and the knees of the other legs about horizontal ones; legs are alike: correct the "
            f"<origin> (rpy) of {', '.join(first)}, so that these legs lie as the others do"
        )
    if share.argmax() == 2:
        joint = chains[int(abs(pitch[:, 2]).argmax())].names[-1]
        raise RobotError(
            f"{label}: joint {joint} turns about a vertical axis; legs must be "
            "roll-pitch-pitch or pitch-pitch"
        )
    in_an_x = np.ptp(np.sign(pitch[:, 0] * pitch[:, 1])) > 0.0
    if share.max() < LEAST_SHARE and not in_an_x:
        raise RobotError(
            f"{label}: the knees turn about axes between x and y of the base link "
            f"({chains[0].names[-1]} about {np.round(pitch[0], 4)}); turn the base link so that "
            "the robot faces along its x or y"
        )
    # Legs stand along the base's axes; a slightly turned pitch axis does not turn the body.
    known = {chain.names: leg for leg, chain in (named or {}).items()}
    sides = [_name_side(c.names if c.names not in known else [known[c.names]]) for c in chains]
    ahead = np.array(sides, dtype=np.float64) @ [chain.tip for chain in chains]
    along = 1 - int(share.argmax())
    if share.max() < LEAST_SHARE:
        # Legs reach out to the corners, as a spider's, and their knees say nothing of the front.
        along = int(abs(ahead[1]) > abs(ahead[0]))
    forward = np.eye(3)[along]
    if any(sides) and ahead[along] < 0:
        forward = -forward
    up = np.array([0.0, 0.0, 1.0])
    return np.column_stack([forward, np.cross(up, forward), up])


def assign_names(label: str, chains: list[Chain], body: FloatArray) -> dict[str, Chain]:
    """Which chain is ``LF``, ``LH``, ``RH``, ``RF``: by where its first joint sits on the body.

    Raises:
        RobotError: two chains share a corner.
    """
    starts = np.array([c.points[0] for c in chains]) @ body
    centre = starts.mean(axis=0)
    named: dict[str, Chain] = {}
    for chain, start in zip(chains, starts - centre, strict=True):
        name = ("L" if start[1] > 0 else "R") + ("F" if start[0] > 0 else "H")
        if name in named:
            raise RobotError(
                f"{label}: legs {'-'.join(named[name].names)} and {'-'.join(chain.names)} "
                f"both start in the body's {name} corner; a quadruped has one leg in each"
            )
        named[name] = chain
    return {leg: named[leg] for leg in LEGS}


def refuse_other_corners(
    label: str, asked: Mapping[str, Chain], named: Mapping[str, Chain]
) -> None:
    """Refuse legs that are asked for in corners of the body in which they are not.

    Names may say which end of the robot is the front. They cannot mirror it.

    Args:
        label: what to call the robot in messages.
        asked: the legs by the names that are asked for.
        named: the legs by the corners in which they start, with the front that the names say.

    Raises:
        RobotError: a leg is in another corner; the message names each such leg.
    """
    corners = {chain.names: leg for leg, chain in named.items()}
    wrong = [
        f"{asked[leg].names[-1]} is the last joint of {corner} and was given as {leg}"
        for leg in asked
        if (corner := corners[asked[leg].names]) != leg
    ]
    if wrong:
        raise RobotError(
            f"{label}: legs: {'; '.join(wrong)}. No turn of the body about the vertical puts "
            "these legs into the corners of their names: legs= may say which end is the front, "
            "and left is then the left of a robot that faces that way"
        )


def _serial(model: Any, first: int) -> list[int]:
    """Joint ids from ``first`` to the tip.

    A chain that branches gets more ids than a leg may have, so that it counts as no leg.
    """
    ids = [first]
    while len(model.children[ids[-1]]) == 1:
        ids.append(model.children[ids[-1]][0])
    if len(model.children[ids[-1]]) > 1:
        ids += list(model.children[ids[-1]]) + [ids[-1]] * 2
    return ids


def _is_hinge(joint: Any) -> bool:
    """Whether a joint is revolute with one angle."""
    return bool(joint.nq == 1 and joint.nv == 1 and "JointModelR" in joint.shortname())


def _read_chain(model: Any, data: Any, ids: list[int]) -> Chain:
    """The chain of these joints at the zero configuration."""
    points, axes = [], []
    for i in ids:
        placement = data.oMi[i]
        axes.append(placement.rotation @ local_axis(model.joints[i]))
        points.append(placement.translation.copy())
    foot, tip = _foot_frame(model, data, ids[-1], points[-1])
    return Chain(
        joints=tuple(ids),
        names=tuple(str(model.names[i]) for i in ids),
        points=frozen(points),
        axes=frozen(axes),
        foot=foot,
        tip=frozen(tip),
    )


def local_axis(joint: Any) -> FloatArray:
    """The unit axis ``(3,)`` of a hinge of Pinocchio, in the joint's own frame."""
    data = joint.createData()
    # calc() takes the configuration of the whole robot: from a shorter one it would read the memory
    # behind it, which now and then crashes.
    joint.calc(data, np.zeros(joint.idx_q + joint.nq))
    # The angular part of its motion subspace.
    return frozen(np.reshape(data.S, 6)[3:])


def _foot_frame(model: Any, data: Any, last: int, knee: FloatArray) -> tuple[str, FloatArray]:
    """The link on the last joint that is farthest from it; of equal ones that named like a foot."""
    best: tuple[float, bool, int] | None = None
    for index, frame in enumerate(model.frames):
        if frame.parentJoint != last or frame.type != pin.FrameType.BODY:
            continue
        distance = round(float(np.linalg.norm(data.oMf[index].translation - knee)), 6)
        footlike = any(word in frame.name.lower() for word in FOOT_WORDS)
        if best is None or (distance, footlike) > best[:2]:
            best = (distance, footlike, index)
    if best is None or best[0] == 0.0:
        raise RobotError(
            f"{model.name}: no link lies beyond joint {model.names[last]}; add a foot link on a "
            "fixed joint at the end of the lower leg"
        )
    return str(model.frames[best[2]].name), data.oMf[best[2]].translation.copy()


def _name_side(names: Iterable[str]) -> int:
    """+1 for names of joints that say front, -1 for hind, 0 where they say nothing."""
    ends = [parts_of(name)[1] for name in names]
    return int(np.sign(ends.count("F") - ends.count("H")))
