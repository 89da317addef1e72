"""Which four limbs of a robot are its legs.

A robot may have a head, an arm, an antenna, wheels and rotors beside its legs. Legs are four serial
chains of hinges that are alike and start at four corners of the body.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from gaitopt.conventions import LEGS, FloatArray
from gaitopt.errors import InputError, RobotError
from gaitopt.robots.files.notes import first_of
from gaitopt.robots.files.tree import HINGES, Joint, UrdfTree
from gaitopt.robots.leg_names import leg_of_names

PLAY = 0.05
"""Hinges that turn by no more than this are no joints [rad]. Chosen: three degrees; models of gears
with backlash have hinges of one degree beside those of the motors."""
MOST_TIPS = 24
"""Most chains among which legs are looked for: sets of four of them are tried one by one."""
ALIKE = 0.25
"""How much lengths of legs, and distances of hips from their middle, may differ, as a share of
their mean. Chosen: hind legs of some robots are longer by a tenth."""
SAME = 0.95
"""Share of the legs' length from which on another chain could be a leg as well. Chosen."""
LEG_JOINTS = (2, 3)
"""Numbers of hinges that a leg may have."""
BESIDE = 0.4
"""Distance of another chain's start from a leg's, as a share of the least distance between two
legs' starts, within which it begins beside the leg. Chosen: less than half, so that it is beside
one leg only."""
CURE = "legs={'LF': 'foot link or last joint', 'LH': ..., 'RH': ..., 'RF': ...} names them"


@dataclass(frozen=True, eq=False)
class Limb:
    """A leg.

    Attributes:
        joints: its two or three hinges from the body on.
        wheel: a fourth joint, which is locked: that of a wheel, or an ankle.
    """

    joints: tuple[Joint, ...]
    wheel: Joint | None = None

    @property
    def end(self) -> str:
        """The link on the last hinge."""
        return self.joints[-1].child


def lock_play(tree: UrdfTree, done: list[str]) -> dict[str, float]:
    """Lock hinges that hardly turn in the middle of their limits; gives where each is locked.

    Args:
        tree: the robot, whose joints change.
        done: what was done to the file, in sentences.
    """
    locked = {}
    for joint in list(tree.walk()):
        low, high = joint.limits()
        if joint.kind in HINGES and high - low <= PLAY:
            locked[joint.name] = float(low + high) / 2.0
            joint.lock(locked[joint.name])
    if locked:
        done.append(
            f"hinges that turn by no more than {PLAY:g} rad, as those of backlash, count as "
            f"fixed: {first_of(list(locked))}"
        )
    return locked


def find_limbs(tree: UrdfTree, warnings: list[str]) -> list[Limb]:
    """The four legs of a robot, in any order.

    Args:
        tree: the robot.
        warnings: gets one where names decide, and more chains are like legs.

    Raises:
        RobotError: there are no four legs, or more sets of four than one.
    """
    chains = [tree.moving_above(tip.child) for tip in _tips(tree)]
    paths = [path for path in chains if len(path) >= min(LEG_JOINTS)]
    if not paths:
        raise RobotError(f"{tree.label}: no four legs found: {_too_short(tree, chains)}")
    if len(paths) > MOST_TIPS:
        paths = [path for path in paths if leg_of_names(joint.name for joint in path)]
    poses = tree.poses()
    if _in_pairs(paths, poses):
        raise RobotError(
            f"{tree.label}: two chains start at each corner of the body, as in five-bar or "
            f"parallel legs ({_listed(paths)}); gaitopt plans for serial legs: describe each leg "
            "by one chain of joints that move on their own"
        )
    found = [] if len(paths) > MOST_TIPS else _alike(tree, paths, poses)
    if not found:
        raise RobotError(
            f"{tree.label}: no four legs found, which are serial chains of 2 or 3 hinges each, "
            f"alike and at four corners of the body; the chains are: {_listed(paths)}; "
            f"{_other_kinds(paths)}{CURE}"
        )
    best, rivals = found[0], found[1:]
    _refuse_second_chains(tree, best, paths, poses)
    others = _more_legs(tree, best, paths, poses)
    if best.named and others:
        warnings.append(
            f"more chains than four are like legs, and those that end at {first_of(sorted(others))}"
            " are held still, on the ground or not: give pose= to hold them elsewhere, or legs= "
            "to say which four walk"
        )
        others = set()
    for rival in rivals:
        if rival.named == best.named and rival.length > SAME * best.length:
            others |= {limb.end for limb in rival.limbs} - {limb.end for limb in best.limbs}
    if others:
        raise RobotError(
            f"{tree.label}: more than four chains are like legs ({_listed(paths)}); a "
            f"quadruped has four ({min(others)} could be one, too): {CURE}"
        )
    return list(best.limbs)


def _more_legs(
    tree: UrdfTree, best: _Choice, paths: list[list[Joint]], poses: Mapping[str, FloatArray]
) -> set[str]:
    """The ends of two chains or more that are like the legs and start at their height.

    So it is with the middle legs of a hexapod, whatever the places of its hips.
    """
    own = {joint.name for limb in best.limbs for joint in limb.joints}
    starts = np.array([poses[limb.joints[0].child][:3, 3] for limb in best.limbs])
    up, middle = int(np.ptp(starts, axis=0).argmin()), starts.mean(axis=0)
    found = set()
    for path in paths:
        limbs = None if own.intersection(joint.name for joint in path) else _limbs([path])
        if limbs is None or len(limbs[0].joints) != len(best.limbs[0].joints):
            continue
        length = _length(tree, limbs[0], poses)
        high = abs(float(poses[path[0].child][up, 3] - middle[up]))
        if SAME < length / best.length < 1.0 / SAME and high < ALIKE * best.length:
            found.add(limbs[0].end)
    return found if len(found) > 1 else set()


def _too_short(tree: UrdfTree, chains: list[list[Joint]]) -> str:
    """Why there is no leg where no chain has as many joints as a leg."""
    if not chains:
        return (
            f"nothing moves in this file ({len(tree.links)} links, {len(tree.joints)} joints, "
            "which are all fixed); give a file with the joints of the legs"
        )
    return (
        f"every joint that moves hangs on the body alone ({_listed(chains)}), and a leg has 2 or "
        "3 hinges, one below the other: let thighs hang on hips and lower legs on thighs (in an "
        "MJCF, put their <body> inside each other)"
    )


def _other_kinds(paths: list[list[Joint]]) -> str:
    """What would do where chains of two hinges or more go on with joints of other kinds."""
    longest = max((len(path) for path in _own_joints(paths)), default=0)
    if sum(len(path) > max(LEG_JOINTS) + 1 for path in _own_joints(paths)) >= len(LEGS):
        return (
            f"legs have up to {longest} hinges here, and gaitopt plans for 2 or 3, and locks a "
            "fourth: make the others 'fixed' in the file, and then "
        )
    wrong = [
        f"{joint.name} ({joint.kind})"
        for path in paths
        for joint in path
        if joint.kind not in HINGES and sum(one.kind in HINGES for one in path) >= min(LEG_JOINTS)
    ]
    if len(wrong) < len(LEGS):
        return ""
    return f"a leg has hinges alone: make {first_of(list(dict.fromkeys(wrong)))} 'fixed'; "


def _in_pairs(paths: list[list[Joint]], poses: Mapping[str, FloatArray]) -> bool:
    """Whether there are eight chains of as many hinges, two at each corner of the body."""
    if len(paths) != 8 or len({len(path) for path in paths}) != 1:
        return False
    if len({path[0].name for path in paths}) != 8:
        return False
    if any(joint.kind not in HINGES for path in paths for joint in path):
        return False
    starts = np.array([poses[path[0].child][:2, 3] for path in paths])
    corners = [(bool(x > 0), bool(y > 0)) for x, y in starts - starts.mean(axis=0)]
    return all(corners.count(corner) == 2 for corner in corners)


def _refuse_second_chains(
    tree: UrdfTree, best: _Choice, paths: list[list[Joint]], poses: Mapping[str, FloatArray]
) -> None:
    """Refuse legs beside each of which another chain begins, as in five-bar legs.

    Raises:
        RobotError: it is so at all four.
    """
    own = {joint.name for limb in best.limbs for joint in limb.joints}
    others = [path for path in paths if not own.intersection(joint.name for joint in path)]
    starts = [poses[limb.joints[0].child][:3, 3] for limb in best.limbs]
    least = min(float(np.linalg.norm(a - b)) for a, b in combinations(starts, 2))
    beside: dict[str, list[Joint]] = {}
    for start in starts:
        away = [float(np.linalg.norm(poses[path[0].child][:3, 3] - start)) for path in others]
        near = [path for path, distance in zip(others, away, strict=True)
                if distance < BESIDE * least]  # fmt: skip
        beside |= {path[0].name: path for path in near[:1]}
    if len(beside) == len(best.limbs):
        chains = _listed(list(beside.values()))
        raise RobotError(
            f"{tree.label}: another chain starts beside each leg ({chains}), as in "
            f"five-bar or parallel legs; gaitopt plans for serial legs: describe each leg by one "
            "chain of joints that move on their own"
        )


@dataclass(frozen=True)
class _Choice:
    """Four chains that could be the legs: how they are named, and their mean length [m]."""

    limbs: tuple[Limb, ...]
    named: bool
    length: float


def _alike(
    tree: UrdfTree, paths: list[list[Joint]], poses: Mapping[str, FloatArray]
) -> list[_Choice]:
    """Sets of four chains that are alike; named ones first, then the longest."""
    found = []
    for four in combinations(paths, 4):
        limbs = _limbs(four)
        if limbs is None:
            continue
        size = _size(tree, limbs, poses, strict=len(paths) > 4)
        if size is not None:
            names = {leg_of_names(j.name for j in (*limb.joints, limb.wheel or limb.joints[-1]))
                     for limb in limbs}  # fmt: skip
            found.append(_Choice(limbs, names == set(LEGS), size))
    return sorted(found, key=lambda choice: (not choice.named, -choice.length))


def _limbs(paths: Sequence[list[Joint]]) -> tuple[Limb, ...] | None:
    """Four chains as legs; ``None`` if they are none."""
    own = _own_joints(paths)
    lengths = {len(path) for path in own}
    if any(joint.kind not in HINGES for path in own for joint in path):
        return None
    if lengths <= set(LEG_JOINTS) or lengths == {max(LEG_JOINTS) + 1}:
        return tuple(_limb(path) for path in own)
    return None


def _own_joints(paths: Sequence[list[Joint]]) -> list[list[Joint]]:
    """Chains without the joints that two of them share."""
    counted = Counter(joint.name for path in paths for joint in path)
    return [[joint for joint in path if counted[joint.name] == 1] for path in paths]


def _limb(joints: list[Joint]) -> Limb:
    """A leg of two to four joints, the fourth of which is that of a wheel."""
    most = max(LEG_JOINTS)
    return Limb(tuple(joints[:most]), joints[most] if len(joints) > most else None)


def _size(
    tree: UrdfTree, limbs: tuple[Limb, ...], poses: Mapping[str, FloatArray], *, strict: bool
) -> float | None:
    """Mean length of four chains [m]; ``None`` where they are not alike.

    Args:
        tree, limbs, poses: the chains.
        strict: whether lengths are compared.
    """
    starts = np.array([poses[limb.joints[0].child][:3, 3] for limb in limbs])
    # Whichever axis of the base points up: the hips differ least along it.
    corners = np.delete(starts - starts.mean(axis=0), int(np.ptp(starts, axis=0).argmin()), axis=1)
    lengths = np.array([_length(tree, limb, poses) for limb in limbs])
    if not strict:
        return float(lengths.mean())
    # The body may face along any axis of its base: all have one hip in each corner.
    if len({(bool(x > 0), bool(y > 0)) for x, y in corners}) != 4:
        return None
    for values in (lengths, np.hypot(*corners.T)):
        if np.ptp(values) > ALIKE * values.mean():
            return None
    return float(lengths.mean())


def _length(tree: UrdfTree, limb: Limb, poses: Mapping[str, FloatArray]) -> float:
    """Length of a chain from its first joint to the farthest link at its end [m]."""
    joints = limb.joints if limb.wheel is None else (*limb.joints, limb.wheel)
    points = [poses[joint.child][:3, 3] for joint in joints]
    places = tree.rigid_with(joints[-1].child).values()
    far = max(float(np.linalg.norm(place[:3, 3])) for place in places)
    return float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum() + far)


def _tips(tree: UrdfTree) -> list[Joint]:
    """The joints that move, and below which no other moves."""
    return [
        joint
        for joint in tree.walk()
        if not joint.fixed and all(below.fixed for below in tree.walk(joint.child))
    ]


def named_limbs(tree: UrdfTree, asked: Mapping[str, str]) -> dict[str, Limb]:
    """The four legs that the user names.

    Args:
        tree: the robot.
        asked: foot link or last joint of each leg, by the leg's name.

    Raises:
        InputError: a leg is not named, or its name is that of no leg of this robot.
    """
    missing = [leg for leg in LEGS if leg not in asked]
    if missing:
        raise InputError(f"{tree.label}: legs names no {' and no '.join(missing)}; {CURE}")
    paths = []
    for leg in LEGS:
        name = asked[leg]
        if name in tree.joints:
            link = tree.joints[name].child
        elif name in tree.links:
            link = name
        else:
            raise InputError(f"{tree.label}: legs: there is no joint or link {name!r} ({leg})")
        paths.append(tree.moving_above(link))
    limbs = {}
    for leg, own in zip(LEGS, _own_joints(paths), strict=True):
        hinges = all(joint.kind in HINGES for joint in own)
        if not hinges or not min(LEG_JOINTS) <= len(own) <= max(LEG_JOINTS) + 1:
            raise InputError(
                f"{tree.label}: legs: between the body and {asked[leg]} ({leg}) are "
                f"{_listed([own])}; a leg has 2 or 3 hinges, and may end with a wheel"
            )
        limbs[leg] = _limb(own)
    return limbs


def _listed(paths: list[list[Joint]]) -> str:
    """The joints of some chains, and what moves otherwise than a hinge."""
    named = [
        "-".join(j.name if j.kind in HINGES else f"{j.name} ({j.kind})" for j in path)
        for path in paths[:12]
    ]
    return "; ".join(named) or "none"
