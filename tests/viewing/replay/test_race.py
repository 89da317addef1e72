"""The race in one page: lanes, one clock, names; and the race as bars."""

from __future__ import annotations

import base64
import html
import json
import re
import shutil
import subprocess
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

import gaitopt
from gaitopt import LEGS, InputError, Plan, Quadruped
from gaitopt.conventions import FloatArray
from gaitopt.planners.time_optimal.planner import plan_route
from gaitopt.viewing.figures.panels import figure_of
from gaitopt.viewing.figures.race import plot_race
from gaitopt.viewing.replay.page import Page
from gaitopt.viewing.replay.race import (
    race_html,
    race_page,
    race_replay,
    race_scene,
    show_race,
)
from gaitopt.viewing.replay.robot_scene import joint_paths
from gaitopt.viewing.replay.runners import LANE_COLOURS, Runner, line_up
from gaitopt.viewing.replay.scene import Cylinder, Scene

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")


@pytest.fixture(scope="module")
def plans(wang: Quadruped) -> dict[str, Plan]:
    """Eight steps in three ways."""
    columns = gaitopt.s_columns(0, columns=3)
    return {
        "the paper": gaitopt.plan_crawl(wang, columns, timing="velocity"),
        "swing": plan_route(wang, columns, free="swing", timing="velocity"),
        "height": plan_route(wang, columns, free="height", timing="velocity"),
    }


@pytest.fixture(scope="module")
def runners(plans: dict[str, Plan]) -> tuple[Runner, ...]:
    return line_up(plans)


@pytest.fixture(scope="module")
def scene(runners: tuple[Runner, ...]) -> Scene:
    return race_scene(runners)


@pytest.fixture(scope="module")
def page(plans: dict[str, Plan]) -> Page:
    return race_page(plans)


def frames_at(scene: Scene, moment: float) -> dict[tuple[str, ...], FloatArray]:
    """World poses of all frames, as three.js joins the keys: by straight lines and slerp."""
    tracks = {(t.path, t.kind): t for t in scene.tracks}
    poses: dict[tuple[str, ...], FloatArray] = {(): np.eye(4)}
    for node in scene.nodes:
        local = node.pose.copy()
        if (track := tracks.get((node.path, "position"))) is not None:
            local[:3, 3] = [np.interp(moment, track.times, track.values[:, i]) for i in range(3)]
        if (track := tracks.get((node.path, "quaternion"))) is not None:
            turns = Rotation.from_quat(track.values)
            if len(track.times) > 1:
                turns = Slerp(track.times, turns)([np.clip(moment, 0.0, track.times[-1])])
            local[:3, :3] = turns[0].as_matrix()
        above = next(poses[node.path[:k]] for k in range(len(node.path) - 1, -1, -1)
                     if node.path[:k] in poses)  # fmt: skip
        poses[node.path] = above @ local
    return poses


def places_at(scene: Scene, runner: Runner, moment: float) -> tuple[FloatArray, FloatArray]:
    """Where the base ``(3,)`` and the feet ``(4, 3)`` of a runner are shown."""
    poses, robot = frames_at(scene, moment), runner.plan.robot
    paths = joint_paths(robot, (*runner.root, "robot"))
    feet = []
    for leg in LEGS:
        frame = robot.model.frames[robot.model.getFrameId(robot.legs[leg].foot)]
        tip = np.append(frame.placement.translation, 1.0)
        feet.append((poses[paths[int(frame.parentJoint)]] @ tip)[:3])
    return poses[paths[1]][:3, 3], np.array(feet)


# ---------------------------------------------------------------- one clock, many lanes


def test_every_robot_walks_its_plan_on_its_own_lane(
    scene: Scene, runners: tuple[Runner, ...]
) -> None:
    """0.6 mm for the body; three joints of 1.1 mrad add up to 2.5 mm at a foot."""
    for runner in runners:
        for moment in np.linspace(0.0, runner.plan.duration, 13):
            there = runner.plan.at([moment])
            base, feet = places_at(scene, runner, float(moment))
            assert np.linalg.norm(base - there.q[0, :3] - runner.offset) < 6.1e-4
            assert np.linalg.norm(feet - there.feet[0] - runner.offset, axis=1).max() < 2.5e-3


def test_who_has_arrived_stands_still_while_others_walk(
    scene: Scene, runners: tuple[Runner, ...], plans: dict[str, Plan]
) -> None:
    slow, fast = runners[0], runners[2]
    assert scene.duration == plans["the paper"].duration > 2 * fast.plan.duration
    arrived = places_at(scene, fast, fast.plan.duration)
    end = places_at(scene, fast, scene.duration)
    assert np.array_equal(arrived[0], end[0]) and np.array_equal(arrived[1], end[1])
    assert np.ptp([places_at(scene, slow, t)[0][0] for t in (fast.plan.duration, 26.0)]) > 0.01


def test_lanes_lie_side_by_side_from_right_to_left(runners: tuple[Runner, ...]) -> None:
    steps = np.diff([runner.offset for runner in runners], axis=0)
    ends = runners[0].plan.footholds.array[:, [0, -1]].mean(axis=0)
    ahead = (ends[1] - ends[0])[:2] / np.linalg.norm((ends[1] - ends[0])[:2])
    assert np.abs(steps - steps[0]).max() < 1e-12
    assert steps[0][:2] @ ahead == pytest.approx(0.0, abs=1e-12)
    assert steps[0][:2] @ [-ahead[1], ahead[0]] > 0.4


def test_robots_and_columns_of_neighbours_keep_apart(
    scene: Scene, runners: tuple[Runner, ...]
) -> None:
    moments = np.linspace(0.0, scene.duration, 40)
    shown = [[places_at(scene, r, float(t)) for t in moments] for r in runners]
    for one, other in pairwise(runners):
        columns = [r.plan.footholds.array.reshape(-1, 3) + r.offset for r in (one, other)]
        gap = np.linalg.norm((columns[0][:, None] - columns[1])[..., :2], axis=2).min()
        assert gap > 0.1
    for k in range(len(moments)):
        for i in range(len(runners) - 1):
            away = shown[i][k][1][:, None] - shown[i + 1][k][1]
            assert np.linalg.norm(away, axis=2).min() > 0.1


def test_lanes_nest_where_the_route_bends(wang: Quadruped) -> None:
    """Lanes of an S need less room than the S is wide."""
    plan = gaitopt.plan_crawl(wang, gaitopt.s_columns(0), timing="velocity")
    wide = line_up({"a": plan, "b": plan})
    pitch = np.linalg.norm(wide[1].offset - wide[0].offset)
    assert pitch < np.ptp(plan.footholds.array[..., 1]) + 0.3


def test_robots_and_terrains_of_all_sizes_stand_on_one_ground(wang: Quadruped) -> None:
    small = gaitopt.load_robot("a1")
    terrain = gaitopt.s_columns(1, columns=2, body_length=0.36, body_width=0.26, forward=0.05)
    plans = {
        "large": gaitopt.plan_crawl(
            wang, gaitopt.s_columns(0, columns=2, height_jitter=0.03), timing="velocity"
        ),
        "small": gaitopt.plan_crawl(
            small, terrain, body_height=0.28, swing_height=0.03, timing="velocity"
        ),
    }
    scene = race_scene(line_up(plans))
    poses = frames_at(scene, 0.0)
    bottoms = [
        (poses[node.path] @ part.pose)[2, 3] - part.shape.length / 2
        for node in scene.nodes for part in node.parts
        if "footholds" in node.path[-1] and isinstance(part.shape, Cylinder)
    ]  # fmt: skip
    assert len(bottoms) == 16 and np.abs(bottoms).max() < 1e-12
    assert len([node for node in scene.nodes if node.path[-1] == "ground"]) == 1


# ---------------------------------------------------------------- what stands around


def test_names_count_steps_and_then_tell_time_and_ratio(page: Page, plans: dict[str, Plan]) -> None:
    paper, swing, _ = page.labels
    assert [label.name for label in page.labels] == list(plans)
    assert paper.result == f"{plans['the paper'].duration:.1f} s"
    ratio = plans["the paper"].duration / plans["swing"].duration
    assert swing.result == f"{plans['swing'].duration:.1f} s · {ratio:.2f}×"
    assert swing.since == plans["swing"].duration
    assert (
        swing.landings == tuple(s.end for s in plans["swing"].swings) and len(swing.landings) == 8
    )
    assert swing.landings[-1] == pytest.approx(swing.since)


def test_without_the_baseline_there_are_no_ratios(plans: dict[str, Plan]) -> None:
    page = race_page({"swing": plans["swing"]})
    assert "×" not in page.labels[0].result
    other = race_page(plans, baseline="swing")
    assert "×" in other.labels[0].result and "×" not in other.labels[1].result


def test_the_bar_tells_who_arrives(page: Page, plans: dict[str, Plan]) -> None:
    order = sorted(plans, key=lambda name: plans[name].duration)
    assert [m.start for m in page.captions] == [0.0, *(plans[name].duration for name in order)]
    for moment, name in zip(page.captions[1:], order, strict=True):
        assert moment.label.startswith(f"{name} has arrived: {plans[name].duration:.0f}"[:-2])
        # The mark is who arrives, the bar from there on who comes next.
        assert moment.mark == next(label.colour for label in page.labels if label.name == name)
    marks = [moment.mark for moment in page.captions]
    assert [moment.colour for moment in page.captions] == [*marks[1:], ""]


def test_the_first_view_holds_all_lanes(page: Page, runners: tuple[Runner, ...]) -> None:
    low, high = np.min(page.in_view, axis=0), np.max(page.in_view, axis=0)
    assert len(page.in_view) == 8
    for runner in runners:
        feet = runner.plan.footholds.array.reshape(-1, 3) + runner.offset
        body = runner.plan.path.knots()[:, :3] + runner.offset
        for points in (feet, body):
            assert (points >= low - 1e-12).all() and (points <= high + 1e-12).all()


def test_verdicts_are_written_with_the_times(plans: dict[str, Plan]) -> None:
    page = race_page(plans, verdicts={"swing": "certified"})
    told = {label.name: label.result for label in page.labels}
    assert told["swing"].endswith("\ncertified")
    assert not any("certified" in result for name, result in told.items() if name != "swing")
    (arrival,) = [c.label for c in page.captions if c.label.startswith("swing has")]
    assert arrival.endswith(" · certified")


def test_the_camera_follows_the_fastest(page: Page) -> None:
    assert page.follow == "/lane 2/robot/base"


# ---------------------------------------------------------------- the file


def test_eight_lanes_of_64_steps_are_small_and_self_contained(plan: Plan, tmp_path: Path) -> None:
    file = race_replay({f"lane {i}": plan for i in range(8)}, tmp_path / "race.html")
    assert file.stat().st_size < 8_000_000
    text = re.sub(r'<script type="text/plain" id="licences">.*?</script>', "",
                  file.read_text("utf-8"), flags=re.S)  # fmt: skip
    assert set(re.findall(r"https?://[\w./]+", text)) <= {"http://www.w3.org/1999/xhtml"}
    assert "default-src &#x27;none&#x27;" in text


def test_the_same_race_gives_the_same_file(plans: dict[str, Plan]) -> None:
    assert race_html(plans) == race_html(plans)


def test_names_are_text_whatever_they_hold(plans: dict[str, Plan]) -> None:
    evil = "</script><script>alert(1)</script>"
    text = race_html({evil: plans["swing"]}, title=evil)
    assert evil not in text and f"<title>{html.escape(evil)}</title>" in text


@pytest.mark.parametrize("nothing", [{}, {"a": None}, []])
def test_a_race_without_plans_is_refused(nothing: Any, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="at least one plan"):
        race_replay(nothing, tmp_path / "race.html")
    assert not list(tmp_path.iterdir())


def test_a_notebook_shows_the_same_page(plans: dict[str, Plan]) -> None:
    shown = show_race(plans, height=321).data
    assert "height:321px" in shown and 'sandbox="allow-scripts"' in shown
    inside = re.search(r'srcdoc="([^"]*)"', shown)
    assert inside is not None and html.unescape(inside[1]) == race_html(plans)


# ---------------------------------------------------------------- a real browser

DRIVE = """<script>
window.problems = [];
window.addEventListener("error", (e) => window.problems.push(String(e.message)));
setTimeout(() => {
  const { seek, draw, viewer } = window.gaitopt;
  const boxes = () => [...document.querySelectorAll(".label")].map((box) => {
    const { left, right, top, bottom } = box.getBoundingClientRect();
    return { text: [...box.children].map((c) => c.textContent), done: box.className,
      inside: left >= 0 && right <= innerWidth && top >= 0 && bottom <= innerHeight };
  });
  const place = (path) => viewer.scene_tree.find(path).object.matrixWorld.elements.slice(12, 15);
  const views = @TIMES@.map((time) => {
    seek(time);
    draw();
    return { phase: document.getElementById("phase").textContent, boxes: boxes(),
      bases: @BASES@.map(place) };
  });
  const pre = document.createElement("pre");
  pre.id = "report";
  const bytes = new TextEncoder().encode(JSON.stringify({ views, problems: window.problems }));
  pre.textContent = btoa(String.fromCharCode(...bytes));
  document.body.append(pre);
}, 300);
</script>"""


@pytest.mark.skipif(CHROMIUM is None, reason="no chromium on the PATH to draw the page")
def test_a_browser_runs_the_race(
    plans: dict[str, Plan], runners: tuple[Runner, ...], tmp_path: Path
) -> None:
    times = [5.0, plans["height"].duration + 1e-3, plans["the paper"].duration]
    bases = [[*r.root, "robot", "base"] for r in runners]
    drive = DRIVE.replace("@TIMES@", json.dumps(times)).replace("@BASES@", json.dumps(bases))
    file = tmp_path / "race.html"
    file.write_text(race_html(plans).replace("</body>", drive + "</body>"), "utf-8")
    run = subprocess.run(
        [str(CHROMIUM), "--headless", "--no-sandbox", "--disable-gpu",
         "--enable-unsafe-swiftshader", "--use-angle=swiftshader", "--no-first-run",
         "--disable-background-networking", "--disable-component-update", "--disable-sync",
         "--disable-quic", f"--user-data-dir={tmp_path / 'profile'}", "--window-size=640,480",
         "--virtual-time-budget=4000", "--dump-dom", f"{file.as_uri()}#paused"],
        capture_output=True, text=True, timeout=600, check=False,
    )  # fmt: skip
    found = re.search(r'<pre id="report">([^<]+)</pre>', run.stdout)
    assert found, run.stderr[-2000:]
    report = json.loads(base64.b64decode(found[1]))
    assert report["problems"] == []
    early, first, last = report["views"]
    done = sum(end <= 5.0 for end in race_page(plans).labels[1].landings)
    assert early["phase"] == "all start together"
    assert early["boxes"][1]["text"] == ["swing", f"{done} of 8 steps"]
    assert [box["done"] for box in first["boxes"]] == ["label", "label", "label done"]
    assert first["phase"].startswith("height has arrived: ")
    assert [box["text"][1] for box in last["boxes"]] == [r.result for r in runners]
    assert all(box["inside"] for view in report["views"] for box in view["boxes"])
    for view, moment in zip(report["views"], times, strict=True):
        for runner, (x, y, z) in zip(runners, view["bases"], strict=True):
            there = runner.plan.at([min(moment, runner.plan.duration)]).q[0, :3] + runner.offset
            assert np.linalg.norm(np.array([x, -z, y]) - there) < 7e-4


# ---------------------------------------------------------------- bars


def bars_of(times: dict[str, list[float]]) -> Any:
    """The axes with the bars."""
    (ax,) = figure_of(plot_race(times)).axes
    return ax


def test_bars_are_medians_with_their_range_and_ratio() -> None:
    times = {"the paper": [100.0, 40.0, 60.0], "swing": [50.0, 30.0, 20.0]}
    ax = bars_of(times)
    assert [bar.get_width() for bar in ax.patches] == [60.0, 30.0]
    assert [text.get_text() for text in ax.texts] == ["60.0 s", "30.0 s   2.00×"]
    ends = [bars.lines[2][0].get_segments()[0][:, 0].tolist() for bars in ax.containers[1::2]]
    assert ends == [[40.0, 100.0], [20.0, 50.0]]
    assert [label.get_text() for label in ax.get_yticklabels()] == list(times)
    assert "3 terrains" in ax.get_title(loc="left")


def test_one_terrain_has_no_range_and_a_missing_plan_no_bar() -> None:
    ax = bars_of({"the paper": [20.0], "swing": [np.nan], "height": [4.0]})
    assert [bar.get_width() for bar in ax.patches] == [20.0, 4.0]
    assert [text.get_text() for text in ax.texts] == ["20.0 s", " no plan", "4.00 s   5.00×"]
    assert "terrains" not in ax.get_title(loc="left")


def test_a_row_keeps_its_colour_whoever_else_runs() -> None:
    from matplotlib.colors import to_hex

    for names in (("height", "swing"), ("swing", "height", "the paper")):
        ax = bars_of({name: [1.0] for name in names})
        assert [to_hex(bar.get_facecolor()) for bar in ax.patches] == [
            LANE_COLOURS[name] for name in names
        ]


def test_bars_need_the_same_number_of_times() -> None:
    with pytest.raises(
        InputError, match=r"the same number of times \(n,\), got a \(2,\), b \(1,\)"
    ):
        plot_race({"a": [1.0, 2.0], "b": [1.0]})
    with pytest.raises(InputError, match="no name"):
        plot_race({})
