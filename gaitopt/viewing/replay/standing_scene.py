"""Where contact forces let the robot stand during each swing, beside its support polygon."""

from __future__ import annotations

from typing import Final

from gaitopt.plan.plan import Plan
from gaitopt.plan.standing_regions import swing_region
from gaitopt.viewing.colours import HELD
from gaitopt.viewing.replay.scene import (
    Appearance,
    FramePath,
    Heights,
    Node,
    Part,
    Scene,
    shown_during,
)
from gaitopt.viewing.replay.support_scene import GROUND_LIFT, outlined, standing_places

STANDING: Final[FramePath] = ("standing",)


def standing_scene(
    plan: Plan, root: FramePath = STANDING, *, heights: Heights | None = None
) -> Scene:
    """For each swing: the outline of where contact forces hold the true centre of mass.

    It is empty where the plan promises no forces, or lets the body rely on its momentum. Phase
    ``i`` of the plan has the frame ``(*root, str(i))``. Outlines lie in the plane of the feet, or
    upon a height map where one is drawn (``heights``).
    """
    nodes, tracks = [], []
    lift = GROUND_LIFT - plan.robot.foot_radius
    for index, stance in standing_places(plan).items():
        region = swing_region(plan, stance.phase) if stance.phase.kind == "swing" else None
        if region is None or len(region.vertices) < 3:
            continue
        path = (*root, str(index))
        line = outlined(stance, region.vertices, 0.0035, lift + 1.2e-3, heights)
        look = Appearance(HELD, 0.95, lit=False, casts_shadow=False, layer=8)
        nodes.append(Node(path, (Part(line, look),)))
        tracks.append(shown_during(path, stance.phase.start, stance.phase.end, plan.duration))
    return Scene((Node(root), *nodes) if nodes else (), tuple(tracks), plan.duration)
