"""The balls that are a robot's feet, as its URDF has them."""

from __future__ import annotations

import math
from xml.etree import ElementTree


def ball_radius(urdf: str, links: list[str]) -> float:
    """Radius of the smallest ball among the collision shapes of the foot ``links`` [m].

    It is 0 where a link has no ball, because its foot is a mesh or has no shape.
    """
    found = {link.get("name"): link for link in ElementTree.fromstring(urdf).findall("link")}
    radius = min(_smallest_ball(found.get(name)) for name in links)
    return 0.0 if math.isinf(radius) else radius


def _smallest_ball(link: ElementTree.Element | None) -> float:
    """Radius of the smallest ball of a link [m]; infinite where it has none."""
    balls = [] if link is None else link.findall("collision/geometry/sphere")
    # What is no number has been refused before (gaitopt.robots.urdf_text).
    return min((float(ball.get("radius", "inf")) for ball in balls), default=math.inf)
