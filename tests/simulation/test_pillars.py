"""A foot stands on its own column, also where a higher one is near."""

from __future__ import annotations

import numpy as np
import pytest

import gaitopt
from gaitopt import LEGS, Footholds
from gaitopt.errors import FootholdsError
from gaitopt.simulation.pillars import column_radii

FOOT, RADIUS = 0.015, 0.02


def two(apart: float, higher: float, radius: float | None) -> Footholds:
    """A second foothold of RF beside the first of LF, and all others far away."""
    corners = {"LF": (0.0, 0.0), "LH": (-0.4, 0.0), "RH": (-0.4, -0.4), "RF": (0.0, -0.4)}
    points = {leg: np.array([[x, y, 0.0]]) for leg, (x, y) in corners.items()}
    points["RF"] = np.vstack([points["RF"], [apart, 0.0, higher]])
    return Footholds(points, radius, order=("RF",))


@pytest.mark.parametrize("higher", [0.002, 0.005, 0.03, -0.03])
@pytest.mark.parametrize("apart", [0.0, 0.005, 0.01, 0.015, 0.02, 0.025, 0.03, 0.038, 0.042])
def test_overlapping_columns_are_refused_where_the_lower_foot_would_be_lifted(
    apart: float, higher: float
) -> None:
    """By an independent measure: points on the higher column's top and side, from the ball."""
    turns = np.linspace(0.0, 2.0 * np.pi, 361)
    rings = [
        np.stack([r * np.cos(turns), r * np.sin(turns), np.full(361, z)], axis=1)
        for r, z in [(r, -FOOT + abs(higher)) for r in np.linspace(0.0, RADIUS, 81)]
        + [(RADIUS, z) for z in np.linspace(-0.1, -FOOT + abs(higher), 200)]
    ]  # fmt: skip
    column = np.add(np.concatenate(rings), [apart, 0.0, 0.0])
    depth = FOOT - np.linalg.norm(column, axis=1).min()
    if apart <= RADIUS and abs(higher) >= FOOT:
        depth = FOOT
    if depth > 0.0011 and apart < 2.0 * RADIUS:
        with pytest.raises(FootholdsError, match="smaller columns, or a height map"):
            column_radii(two(apart, higher, RADIUS), FOOT)
    elif depth < 0.0009 or apart > 2.0 * RADIUS:
        assert (column_radii(two(apart, higher, RADIUS), FOOT) == RADIUS).all()


def test_the_refusal_names_both_columns() -> None:
    with pytest.raises(
        FootholdsError,
        match=r"foothold 1 of RF and foothold 0 of LF overlap: they are 25\.0 mm apart, and their "
        r"heights differ by 30\.0 mm",
    ):
        column_radii(two(0.025, -0.03, RADIUS), FOOT)


def test_plates_of_open_ground_make_room() -> None:
    """The higher one is smaller; the lower one, and all others, are as they were."""
    for apart, left in ((0.025, 0.010), (0.001, 0.005), (0.033, 0.018), (0.06, RADIUS)):
        radii = column_radii(two(apart, 0.03, None), FOOT)
        rest = np.delete(radii.reshape(-1), 4 * 2 - 1)
        assert radii[LEGS.index("RF"), 1] == pytest.approx(left)
        assert (rest == RADIUS).all()


def test_level_columns_may_overlap_and_feet_on_stairs_stand() -> None:
    assert (column_radii(two(0.01, 0.0, RADIUS), FOOT) == RADIUS).all()
    robot = gaitopt.load_robot("a1")
    flat = gaitopt.s_columns(0, columns=2, robot=robot)
    points = {leg: flat[leg] + [0.0, 0.0, 0.01 * (leg[1] == "F")] for leg in LEGS}
    plan = gaitopt.plan_crawl(robot, Footholds(points, flat.radius))
    result = gaitopt.simulate(plan)
    assert result.passed, str(result)


def test_legs_that_step_unequally_often_reach_all_their_footholds() -> None:
    robot = gaitopt.load_robot("go2")
    even = gaitopt.s_columns(0, columns=3, robot=robot)
    points = {leg: even[leg][: 2 if leg == "LH" else 3] for leg in LEGS}
    order = ("RF", "LH", "LF", "RH", "RF", "LF", "RH")
    plan = gaitopt.plan_crawl(robot, Footholds(points, even.radius, order=order))
    result = gaitopt.simulate(plan)
    assert result.passed and result.steps_done == 7, str(result)
    for leg, foot in zip(LEGS, result.motion.feet[-1], strict=True):
        assert np.linalg.norm(foot[:2] - points[leg][-1, :2]) < 0.5 * plan.footholds.landing_radius
