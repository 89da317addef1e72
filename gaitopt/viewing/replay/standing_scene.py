"""Where contact forces let the robot stand during each swing, beside its support polygon."""

from __future__ import annotations

from typing import Final

from gaitopt.plan.plan import Plan
from gaitopt.plan.standing_regions import swing_regions
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
MOST_REGIONS = 256
"""Most swings whose regions are computed, from the first one on: about a second."""


def standing_scene(
    plan: Plan, root: FramePath = STANDING, *, heights: Heights | None = None
) -> Scene:
    """For each of the first swings: where contact forces hold the true centre of mass, outlined.

    It is empty where the plan promises no forces, or lets the body rely on its momentum. Phase
    ``i`` of the plan has the frame ``(*root, str(i))``. Outlines lie in the plane of the feet, or
    upon a height map where one is drawn (``heights``).
    """
    if plan.settings.promised_forces is None or not plan.settings.static:
        return Scene(())
    nodes, tracks = [], []
    lift = GROUND_LIFT - plan.robot.foot_radius
    found = {i: s for i, s in standing_places(plan).items() if s.phase.kind == "swing"}
    found = dict(list(found.items())[:MOST_REGIONS])
    regions = swing_regions(plan, [stance.phase for stance in found.values()])
    for (index, stance), region in zip(found.items(), regions, strict=True):
        if region is None or len(region.vertices) < 3:
            continue
        path = (*root, str(index))
        line = outlined(stance, region.vertices, 0.0035, lift + 1.2e-3, heights)
        look = Appearance(HELD, 0.95, lit=False, casts_shadow=False, layer=8)
        nodes.append(Node(path, (Part(line, look),)))
        tracks.append(shown_during(path, stance.phase.start, stance.phase.end, plan.duration))
    return Scene((Node(root), *nodes) if nodes else (), tuple(tracks), plan.duration)
