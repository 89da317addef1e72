"""One body height for all walks of a comparison."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from typing import Any

from gaitopt.plan.settings.crawl import CrawlSettings
from gaitopt.planners.phase_by_phase.fitting_height import with_fitting_height
from gaitopt.robots.quadruped import Quadruped
from gaitopt.terrain.footholds import Footholds


def with_one_height(
    robot: Quadruped, footholds: Footholds, options: Mapping[str, Any]
) -> dict[str, Any]:
    """Options of :func:`gaitopt.plan_crawl` with the same body height for all methods.

    It is the height in ``options``, or else the one that the paper's method takes for
    ``footholds``.
    """
    if options.get("body_height") is not None:
        return dict(options)
    known = {f.name for f in fields(CrawlSettings)}
    chosen = CrawlSettings.for_robot(robot, **{k: v for k, v in options.items() if k in known})
    fitting = with_fitting_height(robot, footholds, chosen)
    return {**options, "body_height": fitting.body_height}
