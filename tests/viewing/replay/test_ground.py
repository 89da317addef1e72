"""The replay of a walk over a height map shows that map, its footholds and what was tried."""

from __future__ import annotations

import base64
import json
import re
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from ground_walks import bumps, bumpy_search, bumpy_walk, footholds_on
from in_browser import WATCH

import gaitopt
from gaitopt import LEGS, HeightMap, Plan
from gaitopt.conventions import FloatArray
from gaitopt.terrain.layers import FOOTINGS
from gaitopt.viewing.colours import FOOTING_COLOURS
from gaitopt.viewing.replay.ground import window as windows
from gaitopt.viewing.replay.ground.window import ground_window
from gaitopt.viewing.replay.page import Page, render
from gaitopt.viewing.replay.plan_page import plan_page, plan_scene
from gaitopt.viewing.replay.race import race_scene
from gaitopt.viewing.replay.replay import replay_html
from gaitopt.viewing.replay.runners import line_up
from gaitopt.viewing.replay.scene import Ball, Cylinder, Draped, Node, Relief, Scene

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")


def ground_of(plan: Plan) -> HeightMap:
    assert plan.footholds.ground is not None
    return plan.footholds.ground


def over(plan: Plan, ground: HeightMap) -> Plan:
    """The same walk with another map below it."""
    return replace(plan, footholds=plan.footholds.with_(ground=ground))


def data_in(text: str) -> dict[str, Any]:
    """The data of a page as its script reads it."""
    found = re.search(r'<script type="application/json" id="data">(.*?)</script>', text, re.S)
    assert found is not None
    return dict(json.loads(found.group(1)))


def decoded(heights: dict[str, Any]) -> FloatArray:
    """The heights of a page, as its script decodes them."""
    numbers = np.frombuffer(base64.b64decode(heights["z"]), "<u2").reshape(heights["shape"])
    return np.where(numbers == 65535, np.nan, heights["low"] + heights["unit"] * numbers)


def by_path(scene: Scene) -> dict[tuple[str, ...], Node]:
    return {node.path: node for node in scene.nodes}


# ---------------------------------------------------------------- what the page holds


def test_the_page_holds_the_heights() -> None:
    ground = ground_of(bumpy_walk())
    (heights,) = data_in(replay_html(bumpy_walk()))["ground"]["heights"]
    shown = decoded(heights)
    assert np.array_equal(np.isnan(shown), np.isnan(ground.z))
    # Half a step of 16 bits.
    assert np.nanmax(np.abs(shown - ground.z)) <= 0.51 * np.ptp(ground.height_range) / 65534
    assert (heights["step"], tuple(heights["origin"])) == (ground.resolution, ground.origin)


def test_level_ground_is_shown_at_its_height() -> None:
    ground = ground_of(bumpy_walk())
    level = over(bumpy_walk(), ground.with_heights(np.full(ground.shape, 0.3)))
    (heights,) = data_in(replay_html(level))["ground"]["heights"]
    assert np.array_equal(decoded(heights), np.full(ground.shape, 0.3))


def test_a_map_of_150_by_75_adds_little() -> None:
    rng = np.random.default_rng(0)
    rough = HeightMap(rng.uniform(-0.01, 0.01, (150, 75)), 0.02, (-0.6, -0.75))
    before, after = replay_html(bumpy_walk()), replay_html(over(bumpy_walk(), rough))
    assert len(after) < 5e6
    # Heights of 2 bytes, codes of one, in base64.
    assert len(after) - len(before) < 1.1 * (2 + 1) * rough.z.size * 4 / 3


def test_columns_are_not_drawn_where_there_is_a_map() -> None:
    plan = bumpy_walk()
    scene = plan_scene(replace(plan, footholds=plan.footholds.with_(radius=0.02)))
    route = [p for n in scene.nodes if n.path[0] == "route" for p in n.parts]
    columns = [p for p in route if isinstance(p.shape, Cylinder) and p.shape.radius > 0.002]
    assert columns == []
    assert sum(isinstance(p.shape, Relief) for p in route) == 1


def test_pages_without_a_map_have_none(short_plan: Plan) -> None:
    data = data_in(replay_html(short_plan))
    on_maps = {"heights": [], "reliefs": [], "draped": [], "dots": []}
    assert on_maps.items() <= data["ground"].items()
    assert {part["kind"] for part in data["ground"]["solids"]} == {"tubes"}
    assert "Steppable" not in [s["name"] for s in data["switches"]]


def test_the_page_says_how_much_is_unknown() -> None:
    ground = ground_of(bumpy_walk())
    share = np.isnan(ground.z).mean()
    assert f"ground: {share:.1%} unknown and left out" in plan_page(bumpy_walk()).facts
    known = over(bumpy_walk(), ground.with_heights(np.nan_to_num(ground.z)))
    assert not [fact for fact in plan_page(known).facts if "unknown" in fact]


# ---------------------------------------------------------------- what lies on it


@pytest.mark.parametrize("leg", LEGS)
def test_footholds_lie_where_the_feet_touch_with_their_normals(leg: str) -> None:
    plan = bumpy_walk()
    node = by_path(plan_scene(plan))["route", f"footholds {leg}"]
    discs, *sticks = node.parts
    index, count = LEGS.index(leg), plan.footholds.counts[leg]
    touches = plan.footholds.touching(plan.robot.foot_radius)[index, :count]
    normals = plan.footholds.normal_array[index, :count]
    assert isinstance(discs.shape, Draped)
    middles = [corners.mean(axis=0) for corners in discs.shape.polygons]
    assert np.allclose(middles, touches[:, :2], atol=1e-9)
    assert len(sticks) == count
    for stick, place, normal in zip(sticks, touches, normals, strict=True):
        assert isinstance(stick.shape, Cylinder)
        assert np.allclose(stick.pose[:3, 2], normal, atol=1e-9)
        foot = stick.pose[:3, 3] - 0.5 * stick.shape.length * normal
        assert np.allclose(foot, place, atol=1e-9)


def test_the_support_polygon_is_laid_upon_the_ground() -> None:
    plan = bumpy_walk()
    nodes = by_path(plan_scene(plan))
    for index, phase in enumerate(plan.phases):
        if phase.kind != "swing":
            continue
        outer = nodes["support", str(index)].parts[0].shape
        assert isinstance(outer, Draped)
        feet = plan.at([phase.start + phase.duration / 2]).feet[0]
        standing = np.array([feet[LEGS.index(leg), :2] for leg in phase.support])
        (corners,) = outer.polygons
        away = np.linalg.norm(corners[:, None] - standing[None], axis=2).min(axis=1)
        assert away.max() < 1e-6


def test_the_mark_rolls_on_the_ground_below_the_body_centre() -> None:
    plan = bumpy_walk()
    scene = plan_scene(plan)
    assert isinstance(by_path(scene)["support", "cog"].parts[0].shape, Ball)
    track = next(t for t in scene.tracks if t.path == ("support", "cog"))
    moments = np.random.default_rng(1).uniform(0.0, plan.duration, 200)
    shown = np.column_stack([np.interp(moments, track.times, v) for v in track.values.T])
    cog = plan.at(moments).cog
    assert np.linalg.norm(shown[:, :2] - cog[:, :2], axis=1).max() < 1.2e-3
    height = ground_of(plan).height(cog[:, :2])
    # Half a cell of the block's sides is 20 mm high; elsewhere it is millimetres.
    assert np.median(np.abs(shown[:, 2] - height)) < 1e-3
    assert np.abs(shown[:, 2] - height).max() < 0.02


# ---------------------------------------------------------------- switches


def test_where_feet_may_stand_can_be_shown() -> None:
    plan = bumpy_walk()
    layers = gaitopt.ground_layers(ground_of(plan), robot=plan.robot)
    page = plan_page(plan)
    (switch,) = [s for s in page.switches if s.name == "Steppable"]
    assert (switch.key, switch.frame, switch.shown) == ("s", "footing", False)
    shown = [f.value for f, count in layers.counts.items() if count]
    assert [name for name, _ in switch.legend] == shown
    (cover,) = [r for r in data_in(render(page))["ground"]["reliefs"] if "codes" in r]
    codes = np.frombuffer(base64.b64decode(cover["codes"]), np.uint8)
    assert np.array_equal(codes.reshape(layers.codes.shape), layers.codes)
    assert cover["palette"] == [FOOTING_COLOURS[f.value] for f in FOOTINGS]


def test_what_the_search_tried_can_be_shown() -> None:
    plan, search = bumpy_walk(), bumpy_search()
    page = plan_page(plan, search=search)
    assert [s.name for s in page.switches] == ["Steppable", "Search"]
    (dots,) = data_in(render(page))["ground"]["dots"]
    points = np.frombuffer(base64.b64decode(dots["points"]), "<f4").reshape(-1, 3)
    tried = np.unique(search.tried, axis=0)
    assert np.allclose(points[:, :2], tried[:, :2], atol=1e-6)
    lines = by_path(page.scene)["search",].parts[1].shape
    assert isinstance(lines, Draped)
    ends = np.concatenate(lines.polygons)[:, 0]
    assert (ends.min(), ends.max()) == pytest.approx((0.0, 0.4))


def test_layers_of_the_search_are_shown_as_they_are() -> None:
    plan, search = bumpy_walk(), bumpy_search()
    strict = gaitopt.ground_layers(ground_of(plan), robot=plan.robot, edge_margin=0.08)
    scene = plan_scene(plan, search=replace(search, layers=strict))
    cover = by_path(scene)["footing",].parts[0].shape
    assert isinstance(cover, Relief) and cover.codes is not None
    assert np.array_equal(cover.codes, strict.codes)
    assert not np.array_equal(strict.codes, search.layers.codes)


# ---------------------------------------------------------------- large maps


def large_map(length: float = 8.0) -> HeightMap:
    """A map of 1 cm that is far larger than the walk, with an edge across it at x = 0.1."""
    x = np.arange(round(2 * length / 0.01) + 1)[:, None] * 0.01 - length
    y = np.arange(round(length / 0.01) + 1)[None] * 0.01 - length / 2
    z = np.where(x > 0.1, 0.05, 0.0) + 0.0 * y
    return HeightMap(z, 0.01, (-length, -length / 2))


def test_a_large_map_is_cut_off_around_the_walk_and_the_page_says_so() -> None:
    plan = over(bumpy_walk(), large_map())
    page = plan_page(plan)
    (said,) = [fact for fact in page.facts if "ground" in fact]
    margin = float(np.hypot(*plan.robot.stance_size))
    assert said == f"ground: only within {margin:.2g} m of the walk"
    window = ground_window(plan)
    assert window is not None
    (x0, x1), (y0, y1) = window.ground.extent
    feet = np.concatenate([plan.footholds[leg] for leg in LEGS])
    assert x0 <= feet[:, 0].min() - margin and feet[:, 0].max() + margin <= x1
    assert y0 <= feet[:, 1].min() - margin and feet[:, 1].max() + margin <= y1
    assert np.prod(window.ground.shape) < 0.1 * large_map().z.size
    # The part is where it was in the whole map, and so is where feet may stand.
    at = np.random.default_rng(0).uniform([x0, y0], [x1, y1], (50, 2))
    assert np.allclose(window.ground.height(at), large_map().height(at), atol=1e-12)
    (i, j), (nx, ny) = window.first, window.ground.shape
    whole = gaitopt.ground_layers(large_map(), robot=plan.robot).codes[i : i + nx, j : j + ny]
    assert np.array_equal(window.codes(plan, None), whole)


def test_a_fine_map_is_drawn_from_fewer_points_and_the_page_says_so(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(windows, "MOST_DRAWN", 600)
    plan = bumpy_walk()
    page, ground = plan_page(plan), ground_of(plan)
    assert any("drawn from one point every" in fact for fact in page.facts)
    (heights,) = data_in(render(page))["ground"]["heights"]
    every = round(heights["step"] / ground.resolution)
    assert every > 1
    assert np.allclose(decoded(heights), ground.z[::every, ::every], atol=1e-6, equal_nan=True)
    assert np.prod(heights["shape"]) <= 600


@pytest.mark.parametrize(
    ("shape", "origin"), [((2, 2), (0.0, 0.0)), ((50, 50), (100.0, 100.0)), ((600, 300), (9, 9))]
)
def test_maps_that_are_not_below_the_walk_are_drawn_all_the_same(
    shape: tuple[int, int], origin: tuple[float, float]
) -> None:
    elsewhere = HeightMap(np.zeros(shape), 0.02, origin)
    (heights,) = data_in(replay_html(over(bumpy_walk(), elsewhere)))["ground"]["heights"]
    assert (decoded(heights) == 0.0).all()


def test_a_plan_without_steps_is_shown_on_its_ground() -> None:
    plan = bumpy_walk()
    first = {leg: points[:1] for leg, points in plan.footholds.points.items()}
    feet = gaitopt.Footholds(first, ground=ground_of(plan))
    still = gaitopt.plan_crawl(plan.robot, feet, timing="velocity")
    assert still.duration == 0.0
    assert len(data_in(replay_html(still))["ground"]["reliefs"]) == 2


# ---------------------------------------------------------------- races, notebooks, words


def test_lanes_of_a_race_keep_their_grounds_apart() -> None:
    plan = bumpy_walk()
    runners = line_up({"a": plan, "b": plan})
    scene = race_scene(runners)
    reliefs = [(n.path, p.shape) for n in scene.nodes for p in n.parts
               if isinstance(p.shape, Relief)]  # fmt: skip
    assert [path[0] for path, _ in reliefs] == ["lane 0", "lane 1"]
    sides = []
    for runner, (_, relief) in zip(runners, reliefs, strict=True):
        low = relief.heights.origin[1] + runner.offset[1]
        sides.append((low, low + relief.heights.step * (relief.heights.z.shape[1] - 1)))
    (_, first), (second, _) = sorted(sides)
    assert first < second
    floor = by_path(scene)["route", "ground"]
    lows = [
        np.nanmin(r.heights.z) + u.offset[2] for u, (_, r) in zip(runners, reliefs, strict=True)
    ]
    assert floor.parts[0].pose[2, 3] + floor.pose[2, 3] < min(lows)


def test_a_notebook_shows_a_ground_and_a_search() -> None:
    shown = gaitopt.show(bumpy_walk(), search=bumpy_search())
    assert "reliefs" in shown.data and "Steppable" in shown.data


def test_names_are_text_on_a_ground_too() -> None:
    evil = "</script><script>alert(1)</script>"
    text = replay_html(bumpy_walk(), title=evil, search=bumpy_search(complete=False))
    assert "alert(1)</script>" not in text


def test_the_camera_looks_at_the_robot_wherever_the_ground_is() -> None:
    ground = bumps()
    high = ground.with_heights(ground.z + 5.0)
    robot = bumpy_walk().robot
    feet = footholds_on(high, robot.foot_radius)
    plan = gaitopt.plan_crawl(robot, feet, timing="velocity", follow_terrain=True)
    page, low = plan_page(plan), plan_page(bumpy_walk())
    assert page.centre[2] == pytest.approx(low.centre[2] + 5.0, abs=1e-3)
    assert page.radius == pytest.approx(low.radius, rel=1e-3)
    assert page.follow_drop == low.follow_drop is not None


# ---------------------------------------------------------------- a real browser

REPORT = """<script>
(() => {
  const { viewer, draw } = window.gaitopt, tree = viewer.scene_tree;
  const meshes = (path) => tree.find(path).object.children.filter((c) => c.geometry);
  const list = (a) => a ? Array.from(a.array) : [];
  const frame = (path) => tree.find(path).object.visible;
  const press = (key) => window.dispatchEvent(new KeyboardEvent("keydown", { key }));
  const geometry = (mesh) => ({ places: list(mesh.geometry.getAttribute("position")),
    index: list(mesh.geometry.index) });
  const out = { relief: geometry(meshes(["route", "ground"])[0]),
    disc: geometry(meshes(["route", "footholds LF"])[0]), seen: [] };
  const look = () => out.seen.push([frame(["footing"]), frame(["search"]),
    ...[...document.querySelectorAll(".legend")].slice(1).map((e) => e.hidden)]);
  look(); press("s"); look(); press("t"); look();
  [...document.querySelectorAll("button")].find((b) => b.textContent === "Steppable").click();
  look(); draw();
  out.dots = meshes(["search"]).map((m) => m.type);
  out.problems = window.problems;
  const pre = document.createElement("pre");
  pre.id = "report"; pre.textContent = btoa(JSON.stringify(out));
  document.body.append(pre);
})();
</script>"""


def in_a_browser(page: Page, folder: Path) -> dict[str, Any]:
    """What a page reports from Chromium."""
    text = render(page).replace("<body>", "<body>" + WATCH).replace("</body>", REPORT + "</body>")
    file = folder / "page.html"
    file.write_text(text, "utf-8")
    assert CHROMIUM is not None
    run = subprocess.run(
        [CHROMIUM, "--headless", "--no-sandbox", "--disable-gpu", "--enable-unsafe-swiftshader",
         "--use-angle=swiftshader", "--disable-quic", "--no-first-run", "--disable-sync",
         "--disable-background-networking", f"--user-data-dir={folder / 'profile'}",
         "--window-size=320,240", "--virtual-time-budget=2000", "--dump-dom",
         f"{file.as_uri()}#paused"],
        capture_output=True, text=True, timeout=600, check=False,
    )  # fmt: skip
    found = re.search(r'<pre id="report">([^<]+)</pre>', run.stdout)
    assert found, run.stderr[-2000:]
    return dict(json.loads(base64.b64decode(found.group(1))))


@pytest.mark.skipif(CHROMIUM is None, reason="no chromium on the PATH to draw the page")
def test_a_browser_draws_the_surface_of_the_map_and_its_switches_work(tmp_path: Path) -> None:
    plan, search = bumpy_walk(), bumpy_search()
    report = in_a_browser(plan_page(plan, search=search), tmp_path)
    assert [p for p in report["problems"] if "GL Driver" not in p] == []
    check_surface(ground_of(plan), report["relief"])
    check_discs(plan, report["disc"])
    # Frames of footing and search, and whether their legends are hidden.
    assert report["seen"] == [
        [False, False, True, True], [True, False, False, True], [True, True, False, False],
        [False, True, True, False],
    ]  # fmt: skip
    assert sorted(report["dots"]) == ["Mesh", "Points"]


def check_surface(ground: HeightMap, relief: dict[str, list[float]]) -> None:
    """Every point inside of every triangle lies on the map, and all known triangles are there."""
    count = ground.z.size
    places = np.reshape(relief["places"], (-1, 3))
    index = np.reshape(relief["index"], (-1, 3)).astype(int)
    top = index[(index < count).all(axis=1)]
    corners = places[top]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert (normals[:, 2] > 0).all()
    weights = np.random.default_rng(0).dirichlet([1, 1, 1], len(top))
    inside = np.einsum("nc,nci->ni", weights, corners)
    assert np.abs(inside[:, 2] - ground.height(inside[:, :2])).max() < 2e-6
    # By the area of the known cells and half cells.
    z = ground.z
    low = np.isfinite(z[:-1, :-1] + z[1:, :-1] + z[1:, 1:]).sum()
    high = np.isfinite(z[:-1, :-1] + z[:-1, 1:] + z[1:, 1:]).sum()
    assert len(top) == low + high < 2 * (z.shape[0] - 1) * (z.shape[1] - 1)


def check_discs(plan: Plan, disc: dict[str, list[float]]) -> None:
    """Discs have their area, and lie on the ground."""
    corners = np.reshape(disc["places"], (-1, 3, 3))
    sides = corners[:, 1:] - corners[:, :1]
    area = 0.5 * np.cross(sides[:, 0], sides[:, 1])[:, 2].sum()
    one = 0.5 * 20 * 0.02**2 * np.sin(2 * np.pi / 20)
    assert area == pytest.approx(one * plan.footholds.counts["LF"], rel=1e-3)
    off = corners[..., 2] - ground_of(plan).height(corners[..., :2])
    assert off.min() > 0.0 and off.max() < 1.5e-3
