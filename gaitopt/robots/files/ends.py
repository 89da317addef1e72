"""Where the foot of a leg is: its frame, which is the centre of a ball, and the ball's radius."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.errors import InputError, RobotError
from gaitopt.robots.discovery import FOOT_WORDS
from gaitopt.robots.files.limbs import Limb
from gaitopt.robots.files.meshes import MeshFinder
from gaitopt.robots.files.notes import first_of
from gaitopt.robots.files.origins import placement_of
from gaitopt.robots.files.shapes import Ball, Solid, end_ball, farthest, rolling_ball, solids_of
from gaitopt.robots.files.tree import Joint, UrdfTree

ANKLE = 1.5
"""How far a link may be from the axis of a wheel, in its radii. Chosen: what is farther away is the
foot of a leg with an ankle."""
BESIDE = 1e-3
"""How far a ball's centre may be from the foot link's origin, and the link stays the foot [m].
Chosen: a tenth of the radius of small feet."""
LARGEST_FOOT = 0.3
"""Largest radius of a foot that is no wheel, as a share of the lower leg. Chosen."""
LARGEST_BALL = 0.5
"""The same of a foot that is a ball in the file. Chosen: no knee is within its foot then."""
MARKER = 0.02
"""Radius below which a ball only marks a place, as a share of the lower leg. Chosen: balls that are
feet have 0.06 of it or more."""
ASYMMETRY = 0.1
"""Difference of the lower legs of both sides from which on it is told, as a share of them. Chosen:
digits of files differ by less than a hundredth."""
ACROSS = 0.5
"""Sine of the angle to the knee's axis below which a shape lies across its leg. Chosen: lower legs
are at right angles to the axis, and feet are set off along it by less than the leg's length."""
BEYOND = 1.3
"""A leg whose shape is so many times longer than its farthest link has no foot link. Chosen."""


@dataclass(frozen=True, eq=False)
class FootPlace:
    """A foot.

    Attributes:
        link: the link that carries it.
        at: its centre in that link's frame ``(3,)`` [m]; zero where the link is the foot.
        radius: of its ball [m]; 0 where it is not known.
        how: where this was read, in words.
    """

    link: str
    at: FloatArray
    radius: float
    how: str


def set_feet(
    tree: UrdfTree,
    limbs: dict[str, Limb],
    asked: Mapping[str, Any],
    finder: MeshFinder,
    given: float | None,
    how_given: str,
    done: list[str],
    warnings: list[str],
) -> tuple[dict[str, str], float]:
    """Find or make the links of the feet; gives them, and their radius [m], the ``given`` one."""
    feet, radii, told, lengths = {}, [], [], {}
    for leg, limb in limbs.items():
        place = _foot(tree, leg, limb, asked.get(leg), finder)
        radii.append(place.radius)
        told.append(place.how.replace(place.link, "its link"))
        feet[leg] = place.link
        pose = tree.rigid_with(limb.end).get(place.link, np.eye(4))
        lengths[leg] = float(np.linalg.norm(pose[:3, :3] @ place.at + pose[:3, 3]))
        if place.at.any() or place.link in tree.joints:
            feet[leg] = tree.new_name(f"{leg} ball")
            tree.add_frame(feet[leg], place.link, place.at)
    warnings += _unlike(lengths)
    if given is not None:
        done.append(f"feet: radius {1e3 * given:.4g} mm, {how_given}")
        return feet, float(given)
    how = sorted(set(told))
    done.append(f"feet: radius {1e3 * min(radii):.4g} mm, from {'; '.join(how)}")
    if min(radii) == 0.0:
        lost = _lost_meshes(tree, limbs, finder)
        warnings.append(
            f"the radius of the feet is not known, so they are points{lost}; give foot_radius="
        )
    elif max(radii) > 1.05 * min(radii):
        warnings.append(
            f"the feet have radii of {1e3 * min(radii):.4g} to {1e3 * max(radii):.4g} mm, and the "
            "least counts; give foot_radius="
        )
    return feet, float(min(radii))


def _lost_meshes(tree: UrdfTree, limbs: dict[str, Limb], finder: MeshFinder) -> str:
    """What meshes of lower legs that are missing mean for their feet, in words."""
    links = [tree.links[link] for limb in limbs.values() for link in tree.rigid_with(limb.end)]
    names = {mesh.get("filename", "") for link in links for mesh in link.iter("mesh")}
    lost = sorted(name for name in names if finder.find(name) is None)
    if not lost:
        return ""
    return (
        f", and may end elsewhere, for meshes of the lower legs are missing ({first_of(lost)}: "
        "give package_folders=)"
    )


def _unlike(lengths: Mapping[str, float]) -> list[str]:
    """A warning where a left leg's foot is elsewhere than that of the right one.

    Args:
        lengths: from the last joint to the foot, by leg [m].
    """
    for left, right in (("LF", "RF"), ("LH", "RH")):
        one, other = lengths[left], lengths[right]
        if abs(one - other) > ASYMMETRY * max(one, other):
            return [
                f"the feet of {left} and {right} are {1e3 * one:.4g} and {1e3 * other:.4g} mm from "
                "their last joints, and robots are alike on both sides; if shapes of the file are "
                "not where the legs are, give feet={'LF': ('link', (x, y, z)), ...}"
            ]
    return []


def _foot(tree: UrdfTree, leg: str, limb: Limb, asked: Any, finder: MeshFinder) -> FootPlace:
    """The foot of a leg: that which the user names, or the one that is found."""
    if asked is None:
        return find_foot(tree, leg, limb, finder)
    if isinstance(asked, str):
        return place_asked(tree, leg, limb, asked, finder)
    link, at = asked
    near = place_asked(tree, leg, limb, link, finder)
    return FootPlace(near.link, np.asarray(at, dtype=np.float64), near.radius, near.how)


def find_foot(tree: UrdfTree, leg: str, limb: Limb, finder: MeshFinder) -> FootPlace:
    """The foot of a leg.

    Args:
        tree: the robot, with its wheels locked.
        leg: what to call the leg in messages.
        limb: the leg.
        finder: where meshes are.

    Raises:
        RobotError: no link lies beyond the last joint, and no shape ends there.
    """
    if limb.wheel is not None:
        wheel = _wheel(tree, limb, finder)
        if not _goes_on(tree, limb.wheel, wheel):
            return wheel
    body = tree.rigid_with(limb.end)
    solids, shapes = _solids(tree, body, finder)
    link = _farthest_link(body)
    distance = float(np.linalg.norm(body[link][:3, 3]))
    tip = farthest(shapes) if shapes else np.zeros(3)
    longer = float(np.linalg.norm(tip)) > BEYOND * distance
    if distance < BESIDE or (longer and not _footlike(link)):
        return _end_of_shape(tree, leg, limb, _lengthwise(solids, shapes, limb.joints[-1].axis))
    return _foot_of_link(link, body, solids, shapes, limb.joints[-1].axis)


def place_asked(tree: UrdfTree, leg: str, limb: Limb, link: str, finder: MeshFinder) -> FootPlace:
    """The foot at a link that the user names; raises InputError where it is not on the leg."""
    body = tree.rigid_with(limb.end)
    if link not in body:
        raise InputError(
            f"{tree.label}: feet: {link!r} is no link beyond the last joint of leg {leg}; these "
            f"are {', '.join(body)}"
        )
    solids, shapes = _solids(tree, {link: body[link]}, finder)
    return _foot_of_link(link, body, solids, shapes, limb.joints[-1].axis)


def _solids(
    tree: UrdfTree, poses: dict[str, FloatArray], finder: MeshFinder
) -> tuple[dict[str, dict[str, list[Solid]]], list[Solid]]:
    """Collision and visual shapes of links, and all of the first kind that there is."""
    solids = {
        tag: {link: list(solids_of(tree, link, pose, tag, finder)) for link, pose in poses.items()}
        for tag in ("collision", "visual")
    }
    for of_links in solids.values():
        shapes = [solid for of_link in of_links.values() for solid in of_link]
        if shapes:
            return solids, shapes
    return solids, []


def _lengthwise(
    solids: dict[str, dict[str, list[Solid]]], shapes: list[Solid], axis: FloatArray
) -> list[Solid]:
    """Shapes that lie along the lower leg: the visual ones where those of collision do not.

    Boxes of collision that somebody typed may lie along the knee's axis ``(3,)``, across the leg.
    """
    for of_links in solids.values():
        found = [solid for of_link in of_links.values() for solid in of_link]
        tip = farthest(found) if found else np.zeros(3)
        if np.linalg.norm(np.cross(tip, axis)) > ACROSS * np.linalg.norm(tip):
            return found
    return shapes


def _footlike(link: str) -> bool:
    return any(word in link.lower() for word in FOOT_WORDS)


def _farthest_link(body: dict[str, FloatArray]) -> str:
    """The link farthest from the knee; of equal ones that named like a foot."""
    return max(
        body, key=lambda name: (round(float(np.linalg.norm(body[name][:3, 3])), 6), _footlike(name))
    )


def _foot_of_link(
    link: str,
    body: dict[str, FloatArray],
    solids: dict[str, dict[str, list[Solid]]],
    shapes: list[Solid],
    axis: FloatArray,
) -> FootPlace:
    """The foot at a link: where a ball is near it, that ball.

    ``axis`` is the knee's ``(3,)``.
    """
    place = body[link][:3, 3]
    distance = float(np.linalg.norm(place))
    along = place / distance if distance > BESIDE else np.array([0.0, 0.0, -1.0])
    least = MARKER * distance
    balls = [end_ball(solid, along) for solid in shapes if solid.kind == "sphere"]
    ball = _end_near([ball for ball in balls if ball.radius > least], place, along)
    if ball is not None:
        return _placed(link, body, ball, f"a ball near {link}")
    for tag, of_links in solids.items():
        if of_links[link]:
            beyond = max(
                float((ball.centre - place) @ along) + ball.radius
                for ball in (end_ball(solid, along) for solid in of_links[link])
            )
            if least < beyond < LARGEST_FOOT * max(distance, 0.1):
                how = f"how far the {tag} shape of {link} goes beyond it"
                return FootPlace(link, np.zeros(3), beyond, how)
    ends = [end_ball(solid, along) for solid in shapes if solid.kind in ("capsule", "cylinder")]
    ball = _end_near(ends, place, along)
    if ball is not None:
        return _placed(link, body, ball, f"the end of a shape near {link}")
    ball = rolling_ball(shapes, along, axis, LARGEST_FOOT * distance) if shapes else None
    if ball is not None and ball.radius > least and _end_near([ball], place, along):
        how = f"how the shapes near {link} roll over the ground"
        foot, beside = _placed(link, body, ball, how), float(np.linalg.norm(ball.centre - place))
        return foot if foot.at.any() else replace(foot, radius=ball.radius + beside)
    return FootPlace(link, np.zeros(3), 0.0, f"no shape at {link} tells a radius")


def _end_near(balls: list[Ball], place: FloatArray, along: FloatArray) -> Ball | None:
    """Of the balls near a place that which reaches farthest along the leg; ``None`` for none."""
    near = [ball for ball in balls if np.linalg.norm(ball.centre - place) <= 1.5 * ball.radius]
    return _outermost(near, along) if near else None


def _outermost(balls: list[Ball], along: FloatArray) -> Ball:
    """The ball that reaches farthest along the leg."""
    return max(balls, key=lambda ball: float(ball.centre @ along) + ball.radius)


def _placed(link: str, body: dict[str, FloatArray], ball: Ball, how: str) -> FootPlace:
    """A foot at a ball near a link."""
    pose = body[link]
    at = (ball.centre - pose[:3, 3]) @ pose[:3, :3]
    if np.linalg.norm(at) <= BESIDE:
        at = np.zeros(3)
    return FootPlace(link, np.asarray(at), ball.radius, how)


def _end_of_shape(tree: UrdfTree, leg: str, limb: Limb, shapes: list[Solid]) -> FootPlace:
    """The foot at the end of the lower leg's shapes."""
    tip = farthest(shapes) if shapes else np.zeros(3)
    length = float(np.linalg.norm(tip))
    if length < BESIDE:
        raise RobotError(
            f"{tree.label}: leg {leg}: no link lies beyond joint {limb.joints[-1].name}, and no "
            f"shape of {limb.end} tells where it ends (meshes that are missing tell nothing: give "
            "package_folders=...); add a foot link on a fixed joint at the end of the lower leg, "
            f"or give feet={{'{leg}': ('{limb.end}', (x, y, z))}}"
        )
    along = tip / length
    ball = _outermost([end_ball(solid, along) for solid in shapes], along)
    if any(len(solid.corners) for solid in shapes):
        rolling = rolling_ball(shapes, along, limb.joints[-1].axis, LARGEST_FOOT * length)
        plain = [end_ball(solid, along) for solid in shapes if not len(solid.corners)]
        same = [one for one in plain if rolling is not None and one.is_like(rolling)]
        # A ball of the file is exact, where it is the one on which the foot rolls.
        ball = same[0] if same else rolling or ball
    own = (end_ball(solid, along) for solid in shapes if solid.kind == "sphere")
    share = LARGEST_BALL if any(one.is_like(ball) for one in own) else LARGEST_FOOT
    radius = min(ball.radius, share * length)
    centre = ball.centre + (ball.radius - radius) * along
    return FootPlace(limb.end, centre, radius, f"the end of the shape of {limb.end}")


def _goes_on(tree: UrdfTree, joint: Joint, wheel: FootPlace) -> bool:
    """Whether a leg goes on below its fourth joint, which is then an ankle and no wheel."""
    far = max(
        float(np.linalg.norm(np.cross(joint.axis, pose[:3, 3])))
        for pose in tree.rigid_with(joint.child).values()
    )
    return far > max(ANKLE * wheel.radius, BESIDE)


def _wheel(tree: UrdfTree, limb: Limb, finder: MeshFinder) -> FootPlace:
    """The foot at a locked wheel: in its middle, as large as the wheel."""
    assert limb.wheel is not None
    link, axis = limb.wheel.child, limb.wheel.axis
    for tag in ("collision", "visual"):
        solids = list(solids_of(tree, link, np.eye(4), tag, finder))
        wide = [_across(solid, axis) for solid in solids]
        if wide:
            radius, middle = max(wide)
            return FootPlace(link, middle * axis, radius, f"the {tag} shape of the wheel")
    inertial = tree.links[link].find("inertial")
    middle = 0.0
    if inertial is not None:
        where = f"{tree.label}: link {link}: inertia"
        middle = float(placement_of(inertial, where)[:3, 3] @ axis)
    return FootPlace(link, middle * axis, 0.0, "the wheel, whose shape is missing")


def _across(solid: Solid, axis: FloatArray) -> tuple[float, float]:
    """A shape's radius about an axis through the origin, and its middle along the axis [m]."""
    if len(solid.corners):
        along = solid.corners @ axis
        away = np.linalg.norm(solid.corners - np.outer(along, axis), axis=1)
        return float(away.max()), float(along.min() + along.max()) / 2.0
    return float(solid.size[0]), float(solid.pose[:3, 3] @ axis)
