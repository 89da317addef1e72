"""The replay as people use it: keys, mouse, a telephone, curves. Asserts what is drawn."""

from __future__ import annotations

from collections.abc import Iterator
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from ground_walks import bumpy_walk
from in_browser import Driven, driven, needs_browser

import gaitopt
from gaitopt import LEGS, Plan
from gaitopt.viewing.colours import LEG_COLOURS
from gaitopt.viewing.replay.curves.of_plan import plan_curves
from gaitopt.viewing.replay.page import SPEEDS
from gaitopt.viewing.replay.replay import replay_html
from gaitopt.viewing.replay.video.chromium import chromium

pytestmark = needs_browser
DESK, PHONE = (1000, 760), (420, 800)
TIME = "window.gaitopt.state.time"


@pytest.fixture(scope="module")
def plan() -> Plan:
    robot = gaitopt.load_robot("wang2020")
    return gaitopt.plan_crawl(robot, gaitopt.s_columns(0, columns=2))


@pytest.fixture(scope="module")
def desk(plan: Plan, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Driven]:
    folder = tmp_path_factory.mktemp("desk")
    yield from driven(replay_html(plan), folder, "paused&curves&t=2&no-shadows", DESK)


@pytest.fixture(scope="module")
def phone(plan: Plan, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Driven]:
    folder = tmp_path_factory.mktemp("phone")
    yield from driven(replay_html(plan), folder, "paused&t=2&no-shadows", PHONE, touch=True)


def picture(page: Driven) -> np.ndarray:
    """What is drawn, as an image of RGB ``(h, w, 3)``."""
    from matplotlib.image import imread

    page.value("window.gaitopt.draw()")
    return np.asarray(imread(BytesIO(page.browser.picture()))[..., :3])


def near(image: np.ndarray, colour: str, within: float = 0.08) -> np.ndarray:
    """Which pixels have about a colour ``"#rrggbb"``."""
    wanted = [int(colour[i : i + 2], 16) / 255.0 for i in (1, 3, 5)]
    return np.asarray(np.abs(image - wanted).max(axis=2) < within)


# ---------------------------------------------------------------- curves


def test_the_curves_are_those_of_the_plan(plan: Plan, desk: Driven) -> None:
    curves = plan_curves(plan)
    assert curves is not None and curves.margin is not None
    names = desk.value("[...document.querySelectorAll('.chart div')].map((e) => e.firstChild.data)")
    assert names == ["feet on the ground", "joint velocity, share of limit",
                     "joint torque, share of limit", "stability margin of the centre of mass",
                     "vertical force on each foot [N]"]  # fmt: skip
    for moment in np.linspace(0.1, plan.duration - 0.1, 7).tolist():
        desk.value(f"window.gaitopt.seek({moment})")
        stand, velocity, _, margin, forces = desk.value(
            "[...document.querySelectorAll('.chart b')].map((e) => e.textContent)"
        )
        contacts = plan.at([moment]).contacts[0]
        assert set(stand.split()) == {leg for leg, on in zip(LEGS, contacts, strict=True) if on}
        use = np.array([np.interp(moment, curves.times, c) for c in curves.velocity_use.T])
        joint, share = velocity.removesuffix(" %").rsplit(" ", 1)
        assert float(share) == pytest.approx(100.0 * use.max(), abs=1.0)
        assert use[curves.joints.names.index(joint)] > use.max() - 5e-3
        told = float(margin.removesuffix(" mm"))
        assert told == pytest.approx(1e3 * np.interp(moment, curves.times, curves.margin), abs=0.15)
        # The caption tells the same, of this instant.
        caption = desk.value("document.getElementById('phase').textContent")
        assert caption.endswith(f" of 4, margin {margin}")
        pressed = dict(zip(forces.split()[::2], map(float, forces.split()[1::2]), strict=True))
        assert sum(pressed.values()) == pytest.approx(curves.weight, rel=0.15)
        assert all(pressed[leg] < 1.0 for leg, on in zip(LEGS, contacts, strict=True) if not on)


def test_a_click_on_the_curves_seeks(plan: Plan, desk: Driven) -> None:
    box = desk.box(".chart:nth-child(3) canvas")
    for part in (0.25, 0.8):
        desk.click(box["left"] + part * box["width"], box["top"] + 5.0)
        assert desk.value(TIME) == pytest.approx(part * plan.duration, abs=0.01 * plan.duration)
        cursor = desk.box(".cursor")
        middle = (cursor["left"] + cursor["right"]) / 2.0
        assert middle == pytest.approx(box["left"] + part * box["width"], abs=2.0)


def test_the_diagram_shows_who_stands(plan: Plan, desk: Driven) -> None:
    """Pixels of the gait diagram against the plan's contacts."""
    box, image = desk.box(".chart canvas"), picture(desk)
    parts = np.linspace(0.03, 0.97, 60)
    contacts = plan.at(parts * plan.duration).contacts
    for row, leg in enumerate(("LF", "RF", "LH", "RH")):
        y = round(box["top"] + (row + 0.5) * box["height"] / 4.0)
        x = np.round(box["left"] + parts * box["width"]).astype(int)
        drawn = near(image[[y]], LEG_COLOURS[leg])[0, x]
        agree = drawn == contacts[:, LEGS.index(leg)]
        # The cursor, and pixels on which a foot lifts off or lands, may differ.
        assert agree.mean() > 0.9, leg


def test_the_joint_that_limits_is_marked_on_the_robot(plan: Plan, desk: Driven) -> None:
    curves = plan_curves(plan)
    assert curves is not None and curves.torque_use is not None
    uses = np.maximum(curves.velocity_use, curves.torque_use)
    most = uses.max(axis=1)
    # A leg on the camera's side, so that its mark is seen whole.
    near_knee = uses[:, curves.joints.names.index("RF_KFE")]
    full, idle = curves.times[near_knee > 0.99][5], curves.times[most.argmin()]
    desk.value(f"window.gaitopt.seek({full})")
    name = desk.value("window.gaitopt.curves.limiting")
    use = uses[np.searchsorted(curves.times, full)]
    assert use[curves.joints.names.index(name)] > 0.98
    orange = near(picture(desk), "#d98a48", 0.2).sum()
    desk.value(f"window.gaitopt.seek({idle})")
    assert most.min() < 0.9 and desk.value("window.gaitopt.curves.limiting") is None
    assert orange > near(picture(desk), "#d98a48", 0.2).sum() + 200


# ---------------------------------------------------------------- keys and focus


def test_keys_do_what_the_list_says(plan: Plan, desk: Driven) -> None:
    desk.value("window.gaitopt.seek(5)")
    desk.press(".")
    step = desk.value("window.gaitopt.state.speed") / 30.0
    assert desk.value(TIME) == pytest.approx(5.0 + step, abs=1e-6)
    desk.press(",")
    assert desk.value(TIME) == pytest.approx(5.0, abs=1e-6)
    speed = desk.value("window.gaitopt.state.speed")
    desk.press("-")
    slower = desk.value("window.gaitopt.state.speed")
    assert slower == SPEEDS[SPEEDS.index(speed) - 1]
    desk.press("+")
    eye = "window.gaitopt.viewer.camera.position.toArray()"
    first = desk.value(eye)
    desk.press("4")
    top = desk.value(eye)
    assert top[1] > first[1] and abs(top[0] - first[0]) + abs(top[2] - first[2]) > 0.1
    desk.press("r")
    assert desk.value(eye) == pytest.approx(first, abs=1e-9)
    desk.press("c")
    assert desk.value("document.getElementById('curves').hidden")
    desk.press("c")
    desk.press("?")
    listed = desk.value("[...document.querySelectorAll('#keys kbd')].map((e) => e.textContent)")
    assert {"space", "F", "R", "C", "Z", "N", "X", "1", "4", "?", "Esc"} <= set(listed)
    assert not desk.value("document.getElementById('help').hidden")
    desk.press("Escape")
    assert desk.value("document.getElementById('help').hidden")
    assert desk.problems == []


def test_a_control_with_the_focus_keeps_its_keys(desk: Driven) -> None:
    """Arrows change the list that has the focus, and the space bar presses the button."""
    desk.value("window.gaitopt.seek(5)")
    desk.value("document.getElementById('speed').focus()")
    desk.press("ArrowRight")
    assert desk.value(TIME) == pytest.approx(5.0)
    desk.value("document.getElementById('follow').focus()")
    before = desk.value("window.gaitopt.state.follow")
    desk.press(" ")
    assert desk.value("window.gaitopt.state.follow") != before
    assert not desk.value("window.gaitopt.state.playing")
    desk.press(" ")
    # The bar of the time has none: its arrows are the replay's.
    desk.value("document.getElementById('scrub').focus()")
    desk.press("Home")
    assert desk.value(TIME) == 0.0
    desk.value("document.activeElement.blur()")


# ---------------------------------------------------------------- names, small windows, colours


def test_feet_carry_their_names(desk: Driven) -> None:
    script = ("[...document.querySelectorAll('.label.foot')].filter((e) => !e.hidden)"
              ".map((e) => e.textContent)")  # fmt: skip
    assert sorted(desk.value(script)) == sorted(LEGS)
    desk.press("n")
    assert desk.value(script) == []
    desk.press("n")


def robot_sides(page: Driven) -> tuple[float, float]:
    """Where the robot's hips, feet and body begin and end on the screen [pixels]."""
    left, right = page.value("""(() => {
      const { viewer, draw } = window.gaitopt, xs = [];
      draw();
      viewer.scene_tree.find(["robot"]).object.traverse((o) => {
        if (!o.isMesh) return;
        const p = new MeshCat.THREE.Vector3().setFromMatrixPosition(o.matrixWorld);
        xs.push((p.project(viewer.camera).x + 1) / 2 * innerWidth);
      });
      return [Math.min(...xs), Math.max(...xs)];
    })()""")
    return float(left), float(right)


def test_on_a_telephone_all_is_there_and_the_robot_is_large(phone: Driven) -> None:
    left, right = robot_sides(phone)
    assert left > 0.0 and right < PHONE[0] and right - left > 200.0
    assert phone.value("window.gaitopt.state.follow")
    for name in ("#play", "#speed", "#view", "#more", "#follow", "#home", "#ask", "#scrub"):
        box = phone.box(name)
        assert box["left"] >= -8.0 and box["right"] <= PHONE[0] + 8.0, name
        assert box["top"] >= 0.0 and box["bottom"] <= PHONE[1], name
        if name != "#scrub":
            assert box["height"] >= 38.0 and box["width"] >= 24.0, name
    sizes = phone.value("""['#phase', '#clock', '#about h1', '#follow'].map((s) =>
        parseFloat(getComputedStyle(document.querySelector(s)).fontSize))""")
    assert min(sizes) >= 13.0
    assert phone.value("document.documentElement.scrollWidth") <= PHONE[0]
    assert phone.problems == []


def test_a_robot_that_would_be_tiny_is_followed(desk: Driven) -> None:
    """Of a short route all is shown; from six times as far away the robot could not be seen."""
    tiny = "window.gaitopt.view.tiny()"
    assert not desk.value(tiny) and not desk.value("window.gaitopt.state.follow")
    left, right = robot_sides(desk)
    assert right - left > 90.0
    away = desk.value(f"""(() => {{
      const {{ camera, controls }} = window.gaitopt.viewer;
      camera.position.sub(controls.target).multiplyScalar(6).add(controls.target);
      const found = {tiny};
      window.gaitopt.view.reset();
      return found;
    }})()""")
    assert away


def test_fingers_turn_the_view_and_draw_the_time(plan: Plan, phone: Driven) -> None:
    eye = "window.gaitopt.viewer.camera.position.toArray()"
    before = phone.value(eye)
    phone.drag((200.0, 250.0), (300.0, 260.0))
    assert np.linalg.norm(np.subtract(phone.value(eye), before)) > 0.05
    phone.value("window.gaitopt.setCurves(true)")
    box = phone.box("#curves")
    phone.drag((box["left"] + 20.0, box["top"] + 30.0),
               (box["left"] + 0.6 * box["width"], box["top"] + 30.0))  # fmt: skip
    assert phone.value(TIME) == pytest.approx(0.6 * plan.duration, abs=0.01 * plan.duration)
    phone.value("window.gaitopt.setCurves(false)")


def test_the_page_fits_when_the_window_changes(desk: Driven) -> None:
    desk.browser.resize((800, 600))
    assert desk.box("#bar")["right"] <= 800.0 and desk.box("#bar")["bottom"] <= 600.0
    strip: dict[str, Any] = desk.value("(() => { const s = document.getElementById('strip');"
                                       "return { a: s.width, b: s.clientWidth }; })()")  # fmt: skip
    assert strip["a"] == strip["b"]
    desk.browser.resize(DESK)


def test_the_stick_stands_where_limbs_are_nearest_to_the_ground(tmp_path: Path) -> None:
    plan = bumpy_walk()
    curves, moment = plan_curves(plan), 0.37 * plan.duration
    assert curves is not None and curves.clearance is not None
    index = int(np.searchsorted(curves.times, moment, side="right")) - 1
    upper, gap = curves.clearance.place[index], curves.clearance.gap[index]
    for page in driven(replay_html(plan), tmp_path, f"paused&t={moment}&no-shadows", (400, 300)):
        ends = page.value("""(() => {
          let stick = null;
          window.gaitopt.draw();
          window.gaitopt.view.world.traverse((o) => { if (o.name === "nearest") stick = o; });
          return [0.5, -0.5].map((z) => stick.localToWorld(new MeshCat.THREE.Vector3(0, 0, z)))
            .map((p) => [p.x, -p.z, p.y]);
        })()""")
        assert page.problems == []
    np.testing.assert_allclose(ends[0], upper, atol=2e-3)
    np.testing.assert_allclose(ends[1], upper - [0.0, 0.0, gap], atol=2e-3)


WORK = """((end) => {
  const { THREE } = MeshCat, most = {};
  let counts = {};
  const counted = (owner, names) => {
    for (const name of names) {
      const old = owner[name];
      owner[name] = function (...given) {
        counts[name] = (counts[name] || 0) + 1;
        return old.apply(this, given);
      };
    }
  };
  counted(THREE.Vector3.prototype, ["set"]);
  counted(THREE.Quaternion.prototype, ["slerp"]);
  counted(THREE.Object3D.prototype, ["add", "remove", "updateMatrix"]);
  counted(THREE.BufferGeometry.prototype, ["setAttribute", "dispose"]);
  counted(window, ["countUpTo"]);
  for (let i = 0; i < 400; i++) {
    counts = {};
    window.gaitopt.seek(end * i / 399);
    for (const name in counts) most[name] = Math.max(most[name] || 0, counts[name]);
  }
  let objects = 0;
  window.gaitopt.viewer.scene.traverse(() => { objects++; });
  return { most, objects };
})"""
"""What the page does to show each of 400 instants of a walk: the most calls of a kind for one."""


def test_a_long_walk_asks_no_more_of_a_frame_than_a_short_one(tmp_path: Path) -> None:
    """Objects moved, searched for, made and let go, of 8 steps and of 64.

    Times of frames are in :mod:`benchmarks.speed.frames`.
    """
    robot = gaitopt.load_robot("wang2020")
    work, columns = [], (3, 17)
    with chromium() as browser:
        for count in columns:
            route = gaitopt.s_columns(0, columns=count)
            plan = gaitopt.plan_crawl(robot, route, timing="velocity")
            file = gaitopt.replay(plan, tmp_path / f"{count}.html")
            browser.open(f"{file.as_uri()}#paused&no-curves&no-shadows", (320, 240))
            work.append(browser.run(f"{WORK}({plan.duration})"))
            shown = browser.run("window.gaitopt.pass.names()[0]")
            assert plan.phases[int(shown)].end == pytest.approx(plan.duration, abs=1e-9)
    assert work[0]["most"] == work[1]["most"]
    assert work[0]["most"]["add"] >= 5 and work[0]["most"]["dispose"] >= 4  # A polygon is made.
    # Nothing stays of the steps behind: the scene has one object more for each column.
    assert work[1]["objects"] - work[0]["objects"] == len(LEGS) * (columns[1] - columns[0])


@pytest.mark.parametrize("vision", ["protanopia", "deuteranopia", "tritanopia"])
def test_colours_of_the_legs_differ_as_the_colour_blind_see_them(desk: Driven, vision: str) -> None:
    """Chromium's own simulation, on the colours that it drew in the gait diagram."""
    desk.value("window.gaitopt.seek(0)")
    desk.browser.call("Emulation.setEmulatedVisionDeficiency", type=vision)
    image, box = picture(desk), desk.box(".chart canvas")
    desk.browser.call("Emulation.setEmulatedVisionDeficiency", type="none")
    # All feet stand at the end, the last pixels of the diagram.
    x = round(box["right"]) - 3
    seen = [image[round(box["top"] + (row + 0.5) * box["height"] / 4.0), x] for row in range(4)]
    for i in range(4):
        for j in range(i):
            assert np.linalg.norm(seen[i] - seen[j]) > 0.2, (vision, i, j)


def test_without_a_graphics_card_a_replay_that_plays_has_fewer_pixels(desk: Driven) -> None:
    """The browser of these tests draws with the processor."""
    width = "window.gaitopt.viewer.renderer.domElement.width"
    whole = desk.value(width)
    desk.value("window.gaitopt.setPlaying(true)")
    assert desk.value(width) == pytest.approx(whole / 2.0, abs=1.0)
    desk.value("window.gaitopt.setPlaying(false)")
    assert desk.value(width) == whole and desk.problems == []


def test_in_the_page_of_a_site_nothing_covers_the_robot(plan: Plan, tmp_path: Path) -> None:
    """The gallery has low frames: colours are folded, and buttons have a row of their own."""
    size = (736, 420)
    for page in driven(replay_html(plan), tmp_path, "paused&t=2&no-shadows", size):
        about, bar, clock = page.box("#about"), page.box("#bar"), page.box("#clock")
        assert about["height"] < 60.0 and bar["top"] > size[1] / 2.0
        tools = [page.box(f"#{name}") for name in ("speed", "view", "more", "follow", "home")]
        assert all(box["top"] > clock["bottom"] for box in tools)
        assert max(box["right"] for box in tools) < bar["right"] and page.problems == []
        page.value("document.querySelector('#about h1').click()")
        assert page.box("#about")["height"] > 120.0
