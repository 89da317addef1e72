"""Replays: what the page shows is what the plan says, and the page needs nothing but itself."""

import base64
import html
import json
import re
import shutil
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
import robot_texts
from in_browser import WATCH

from gaitopt.conventions import LEGS
from gaitopt.errors import InputError
from gaitopt.motion.path import MotionPath
from gaitopt.plan.plan import Plan
from gaitopt.planners.crawl import plan_crawl
from gaitopt.robots.catalog import load_robot
from gaitopt.robots.quadruped import Quadruped
from gaitopt.terrain.columns import s_columns
from gaitopt.terrain.footholds import Footholds
from gaitopt.viewing.colours import LEG_COLOURS
from gaitopt.viewing.replay.curves.of_plan import plan_curves
from gaitopt.viewing.replay.encoding import commands, track_data
from gaitopt.viewing.replay.keyframes import kept_between, kept_samples, sample_times, slerp
from gaitopt.viewing.replay.mesh_files import folders_of_meshes, read_mesh
from gaitopt.viewing.replay.numbers import packed
from gaitopt.viewing.replay.page import SPEEDS, comfortable_speed
from gaitopt.viewing.replay.plan_page import plan_scene
from gaitopt.viewing.replay.replay import replay, replay_html, show
from gaitopt.viewing.replay.robot_scene import joint_paths, robot_scene
from gaitopt.viewing.replay.robot_shapes import robot_parts
from gaitopt.viewing.replay.scene import Box, Polygon, joined

BODY_TOLERANCE = 1.0e-4 + 1e-5
"""What the replay promises for the body [m], and the float32 of its numbers."""

FOOT_TOLERANCE = 4.0e-4
"""A tenth of a milliradian at each of three joints of a leg of 0.6 m, and at the body [m]."""

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
FLAGS = (
    "--headless", "--no-sandbox", "--disable-gpu", "--enable-unsafe-swiftshader",
    "--use-angle=swiftshader", "--disable-quic", "--no-first-run", "--disable-sync",
    "--disable-background-networking", "--disable-component-update",
)  # fmt: skip


@pytest.fixture(scope="module")
def robot():
    return load_robot("wang2020")


@pytest.fixture(scope="module")
def walk(robot):
    """Eight steps of the paper's walk."""
    return plan_crawl(robot, s_columns(0, columns=3, forward=0.18), timing="velocity")


@pytest.fixture(scope="module")
def scene(walk):
    return plan_scene(walk)


@pytest.fixture(scope="module")
def turning(robot, walk):
    """A plan of cubics that rolls, pitches, yaws and raises the body, fast."""
    start = walk.path.knots()[0]
    rng = np.random.default_rng(3)
    coefficients = rng.uniform(-0.25, 0.25, (4, 6, 18))
    coefficients[3] = start + rng.uniform(-0.2, 0.2, (6, 18))
    for i in range(1, 6):  # no jumps: each segment starts where the one before ends
        coefficients[3, i] = coefficients[:, i - 1].sum(axis=0)
    return Plan(robot, walk.footholds, walk.settings, (), MotionPath(np.arange(7.0), coefficients))


def value_at(track, time):
    """The value three.js shows: float32 keys, straight lines, slerp, or the key before."""
    times = np.asarray(track.times, dtype=np.float32).astype(float)
    index = int(np.searchsorted(times, time, side="right")) - 1
    if track.kind == "visible":
        return bool(track.values[max(index, 0)])
    values = np.asarray(track.values, dtype=np.float32).astype(float)
    if index < 0 or index >= len(times) - 1:
        return values[np.clip(index, 0, len(times) - 1)]
    part = (time - times[index]) / (times[index + 1] - times[index])
    a, b = values[index], values[index + 1]
    if track.kind == "position":
        return a + part * (b - a)
    return slerp(a[None], b[None], np.array([part]))[0]


def frames_at(scene, time):
    """World poses of all frames of a scene: {path: (4, 4)}."""
    poses = {(): np.eye(4)}
    tracks = {}
    for track in scene.tracks:
        tracks.setdefault(track.path, []).append(track)
    for node in scene.nodes:
        local = node.pose.copy()
        for track in tracks.get(node.path, ()):
            if track.kind == "position":
                local[:3, 3] = value_at(track, time)
            elif track.kind == "quaternion":
                x = value_at(track, time)
                local[:3, :3] = pin.Quaternion(x / np.linalg.norm(x)).matrix()
        poses[node.path] = poses.get(node.path[:-1], np.eye(4)) @ local
    return poses


def worst_errors(plan, count, seed=0):
    """Largest error of the body's place, and of any foot's, over random times [m]."""
    scene, robot = robot_scene(plan), plan.robot
    data, paths = robot.model.createData(), joint_paths(robot, ("robot",))
    body = feet = 0.0
    for moment in np.random.default_rng(seed).uniform(0, plan.duration, count):
        pin.framesForwardKinematics(robot.model, data, plan.at([moment]).q[0])
        shown = frames_at(scene, moment)
        body = max(body, np.linalg.norm(shown[paths[1]][:3, 3] - data.oMi[1].translation))
        for leg in robot.legs.values():
            index = robot.model.getFrameId(leg.foot)
            frame = robot.model.frames[index]
            foot = shown[paths[frame.parentJoint]] @ frame.placement.homogeneous
            feet = max(feet, np.linalg.norm(foot[:3, 3] - data.oMf[index].translation))
    return body, feet


# ---------------------------------------------------------------- the motion


def test_the_robot_moves_as_planned(walk):
    body, feet = worst_errors(walk, 200)
    assert body < BODY_TOLERANCE
    assert feet < FOOT_TOLERANCE


def test_a_turning_body_on_curved_paths_moves_as_planned(turning):
    body, feet = worst_errors(turning, 300)
    assert body < BODY_TOLERANCE
    assert feet < 2 * FOOT_TOLERANCE  # legs stretched far out by random angles


def test_a_joint_that_turns_by_more_than_half_a_turn_takes_the_long_way(robot, walk):
    start = walk.path.knots()[0]
    end = start.copy()
    end[6:] += 5.0
    plan = Plan(robot, walk.footholds, walk.settings, (), MotionPath.polyline([0, 1], [start, end]))
    assert max(worst_errors(plan, 50)) < FOOT_TOLERANCE


def test_a_robot_whose_joints_lie_askew_moves_as_planned():
    robot = load_robot("solo12")
    rng = np.random.default_rng(1)
    values = np.zeros((4, 6 + 12))
    values[:, 6:] = rng.uniform(-1, 1, (4, 12))
    plan = Plan(robot, s_columns(0, columns=2), plan_settings(), (),
                MotionPath.polyline(np.arange(4.0), values))  # fmt: skip
    assert max(worst_errors(plan, 50)) < FOOT_TOLERANCE


def plan_settings():
    from gaitopt.plan.settings.crawl import CrawlSettings

    return CrawlSettings(timing="velocity")


def test_a_plan_without_motion_is_a_still_picture(robot, tmp_path):
    plan = plan_crawl(robot, s_columns(0, columns=1), timing="velocity")
    assert plan.duration == 0
    assert replay(plan, tmp_path / "still.html").is_file()


# ---------------------------------------------------------------- keyframes


def test_straight_lines_need_two_keys_and_rest_needs_one():
    t = np.linspace(0, 1, 101)
    assert kept_samples(t, 3 * t, 1e-9).tolist() == [0, 100]
    assert kept_samples(t, np.ones((101, 3)), 1e-9).tolist() == [0]


def test_thinning_keeps_its_word_and_drops_most_samples():
    t = np.linspace(0, 10, 5001)
    y = np.column_stack([np.sin(t), np.cos(3 * t)])
    keep = kept_samples(t, y, 1e-3)
    shown = np.column_stack([np.interp(t, t[keep], y[keep, i]) for i in range(2)])
    assert np.linalg.norm(shown - y, axis=1).max() <= 1e-3
    assert len(keep) < 500


def test_a_jump_keeps_both_of_its_keys():
    t = np.array([0.0, 1.0, 1.0, 2.0])
    assert kept_samples(t, np.array([0.0, 0.0, 1.0, 1.0]), 1e-4).tolist() == [0, 1, 2, 3]


def test_samples_of_several_pieces_are_those_of_one_after_the_other():
    rng = np.random.default_rng(0)
    y = np.cumsum(rng.normal(size=(400, 3)), axis=0)
    t = np.concatenate([np.cumsum(rng.uniform(0.1, 1.0, n)) for n in (150, 1, 2, 247)])
    starts, ends = np.array([0, 150, 151, 153]), np.array([149, 150, 152, 399])
    each = [
        first + kept_samples(t[first : last + 1], y[first : last + 1], 2.0)
        for first, last in zip(starts, ends, strict=True)
    ]
    assert kept_between(t, y, 2.0, starts, ends).tolist() == np.concatenate(each).tolist()


def test_curved_paths_are_looked_at_often_enough():
    t = 2.0
    path = MotionPath(np.array([0.0, t]), np.array([[[1.0] * 7], [[0.0] * 7], [[0.0] * 7]]))
    gap = np.diff(sample_times(path)).max()
    assert 2.0 * gap**2 / 8 <= 5e-5 * (1 + 1e-9)  # |y''| = 2


def unpacked(data):
    """What the page's script reads, in Python."""
    octets, columns, at = base64.b64decode(data["bytes"]), [], 0
    for _ in range(data["columns"]):
        whole, column = 0, []
        for _ in range(data["rows"]):
            number, shift = 0, 0
            while octets[at] > 127:
                number, shift, at = number | (octets[at] & 127) << shift, shift + 7, at + 1
            number, at = number | octets[at] << shift, at + 1
            whole += -(number + 1) // 2 if number % 2 else number // 2
            column.append(whole * data["unit"])
        columns.append(column)
    assert at == len(octets)
    return np.array(columns).T


def test_numbers_come_back_within_half_a_unit_in_a_third_of_the_room():
    rng = np.random.default_rng(0)
    values = np.cumsum(rng.normal(0.0, 0.01, (4000, 3)), axis=0) - [0.0, 1e6, 3.0]
    data = packed(values, 1e-5)
    assert np.abs(unpacked(data) - values).max() <= 0.5e-5 * (1 + 1e-4)
    assert len(data["bytes"]) < 0.5 * 4 / 3 * values.size * 4 + 100
    assert unpacked(packed(np.zeros((0, 2)), 1.0)).size == 0


def test_turns_of_joints_are_one_angle_a_key(walk, scene):
    for track in scene.tracks:
        if track.path[-1].startswith("joint"):
            data = track_data(track)
            assert data["kind"] == "turn"
            (angle,), (u, v) = unpacked(data["values"]).T, np.array(data["plane"])
            shown = np.outer(np.cos(angle), u) + np.outer(np.sin(angle), v)
            assert np.abs(np.abs(np.sum(shown * track.values, axis=1)) - 1).max() < 1e-9
            assert np.abs(np.diff(angle)).max(initial=0.0) < np.pi / 2


# ---------------------------------------------------------------- support


def test_exactly_the_present_phase_is_shown(walk, scene):
    shows = {t.path: t for t in scene.tracks if t.kind == "visible"}
    for moment in np.random.default_rng(2).uniform(0, walk.duration, 200):
        visible = [int(p[-1]) for p, track in shows.items() if value_at(track, moment)]
        assert [walk.phases[i] for i in visible] == [walk.phase_at(moment)]


def test_nothing_is_drawn_for_phases_that_do_not_last(walk, scene):
    lasting = {i for i, p in enumerate(walk.phases) if p.duration > 0}
    assert len(lasting) < len(walk.phases)
    shown = {n.path[-1] for n in scene.nodes if n.path[0] == "support" and len(n.path) == 2}
    assert shown - {"cog", "trail"} == {str(i) for i in lasting}


def test_triangles_stand_on_the_feet_and_their_inside_keeps_the_margin(walk, scene):
    nodes = {n.path: n for n in scene.nodes}
    for index, phase in enumerate(walk.phases):
        if phase.kind != "swing":
            continue
        parts = [p.shape for p in nodes["support", str(index)].parts]
        outer, _, inner, _ = (s.vertices for s in parts if isinstance(s, Polygon))
        start = walk.at([phase.start + phase.duration / 2])
        feet = np.array([start.feet[0, LEGS.index(leg)] for leg in phase.support])
        away = np.linalg.norm(outer[:, None, :2] - feet[None, :, :2], axis=2).min(axis=1)
        assert away.max() < 1e-6
        sides = np.roll(outer, -1, axis=0)[:, :2] - outer[:, :2]
        normals = np.column_stack([-sides[:, 1], sides[:, 0]])
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        depth = np.einsum("sk,psk->ps", normals, inner[:, None, :2] - outer[None, :, :2])
        assert depth.min() == pytest.approx(walk.settings.stability_margin, abs=1e-9)


def test_the_mark_lies_under_the_body_centre_on_the_ground(walk, scene):
    for moment in np.random.default_rng(4).uniform(0, walk.duration, 50):
        place = frames_at(scene, moment)["support", "cog"][:3, 3]
        assert np.linalg.norm(place[:2] - walk.at([moment]).cog[0, :2]) < 2e-4
        assert abs(place[2] - walk.footholds.array[0, 0, 2]) < 1e-4


# ---------------------------------------------------------------- what stands around


def test_columns_end_one_foot_radius_below_their_footholds(walk, scene):
    nodes = {n.path: n for n in scene.nodes}
    for leg in LEGS:
        parts = nodes["route", f"footholds {leg}"].parts
        tops = np.array([p.pose[:3, 3] + [0, 0, p.shape.length / 2] for p in parts])
        expected = walk.footholds[leg] - [0, 0, walk.robot.foot_radius]
        assert np.abs(tops - expected).max() < 1e-12
        assert {p.shape.radius for p in parts} == {walk.footholds.radius}


def test_open_ground_is_drawn_under_the_feet(robot, walk):
    plan = replace(walk, footholds=Footholds(dict(walk.footholds.points)))
    scene = plan_scene(plan)
    floor = next(n for n in scene.nodes if n.path == ("route", "ground")).parts[0]
    level = floor.pose[2, 3] + floor.shape.size[2] / 2
    assert level == pytest.approx(-robot.foot_radius)


@pytest.mark.parametrize("name", ["a1", "anymal_c", "solo12", "hyq"])
def test_mesh_robots_are_drawn_as_tubes_from_hip_to_foot(name):
    robot = load_robot(name)
    parts = robot_parts(robot)
    assert any(isinstance(p.shape, Box) for p in parts[1])
    for leg in robot.legs.values():
        frame = robot.model.frames[robot.model.getFrameId(leg.foot)]
        balls = [p for p in parts[frame.parentJoint] if type(p.shape).__name__ == "Ball"]
        away = [np.linalg.norm(p.pose[:3, 3] - frame.placement.translation) for p in balls]
        assert min(away) < 1e-9


def test_meshes_are_embedded_when_asked_for():
    parts = robot_parts(load_robot("solo12"), meshes=True)
    faces = sum(
        len(p.shape.faces) for ps in parts.values() for p in ps if hasattr(p.shape, "faces")
    )
    assert faces > 1000


def test_feet_of_mesh_robots_have_the_colours_of_their_legs():
    robot = load_robot("solo12")
    parts = robot_parts(robot, meshes=True)
    for name, leg in robot.legs.items():
        frame = robot.model.frames[robot.model.getFrameId(leg.foot)]
        balls = [p for p in parts[frame.parentJoint] if type(p.shape).__name__ == "Ball"]
        assert [p.appearance.colour for p in balls] == [LEG_COLOURS[name]]
        assert balls[0].shape.radius > robot.foot_radius
        shank = parts[robot.model.getJointId(leg.joints[-1])]
        assert {p.appearance.colour for p in shank} == {LEG_COLOURS[name]}
        thigh = parts[robot.model.getJointId(leg.joints[-2])]
        assert LEG_COLOURS[name] not in {p.appearance.colour for p in thigh}


@pytest.mark.parametrize("name", ["wang2020", "frog1"])
def test_legs_of_our_own_robots_have_the_colours_of_their_columns(name):
    robot = load_robot(name)
    parts = robot_parts(robot)
    for leg in LEGS:
        shank = parts[robot.model.getJointId(robot.legs[leg].joints[-1])]
        assert LEG_COLOURS[leg] in {p.appearance.colour for p in shank}
        others = {LEG_COLOURS[other] for other in LEGS if other != leg}
        assert not others & {p.appearance.colour for p in shank}


def test_a_mesh_that_is_missing_costs_its_link_only(tmp_path):
    import trimesh

    mesh = '<visual><geometry><mesh filename="../meshes/{}.stl"/></geometry></visual>'
    text = robot_texts.robot().replace(
        '<link name="base">', f'<link name="base">{mesh.format("a")}'
    )
    text = text.replace('<link name="LF_l0">', f'<link name="LF_l0">{mesh.format("b")}')
    robot = load_robot(text)
    with pytest.raises(InputError, match="is not in"):
        robot_parts(robot, meshes=tmp_path)
    (tmp_path / "meshes").mkdir()
    trimesh.creation.box().export(tmp_path / "meshes" / "a.stl")
    parts = robot_parts(robot, meshes=tmp_path)
    assert len(parts[1]) == 1 and robot.model.getJointId("LF_j0") not in parts


@pytest.mark.parametrize("colour", ["", "0.5", "1 2", "0.5 0.5 0.5", "nan 0 0 1"])
def test_colours_of_too_few_numbers_are_none(colour):
    visual = (
        '<visual><geometry><box size="1 1 1"/></geometry><material name="m">'
        f'<color rgba="{colour}"/></material></visual>'
    )
    text = robot_texts.robot().replace('<link name="base">', f'<link name="base">{visual}')
    (part,) = robot_parts(load_robot(text))[1]
    assert re.fullmatch("#[0-9a-f]{6}", part.appearance.colour)


def test_a_scale_of_two_numbers_is_refused(tmp_path):
    with pytest.raises(InputError, match="a scale of 2 numbers; give 3"):
        read_mesh("part.stl", [1.0, 2.0], tmp_path)


def test_meshes_may_lie_in_several_folders(tmp_path):
    import trimesh

    mesh = '<visual><geometry><mesh filename="package://{}/part.stl"/></geometry></visual>'
    text = robot_texts.robot().replace(
        '<link name="base">', f'<link name="base">{mesh.format("trunks")}'
    )
    text = text.replace('<link name="LF_l0">', f'<link name="LF_l0">{mesh.format("legs")}')
    for place, name in (("one", "trunks"), ("other", "legs")):
        (tmp_path / place / name).mkdir(parents=True)
        trimesh.creation.box().export(tmp_path / place / name / "part.stl")
    robot, folders = load_robot(text), [tmp_path / "one", tmp_path / "other"]
    own = tmp_path / "description"
    own.mkdir()
    assert set(folders_of_meshes(text, own, folders)) == {folders[0], folders[1]}
    parts = robot_parts(robot, meshes=folders)
    assert len(parts[1]) == 1 and robot.model.getJointId("LF_j0") in parts
    assert robot.model.getJointId("LF_j0") not in robot_parts(robot, meshes=folders[0])
    with pytest.raises(InputError, match="names no folder"):
        robot_parts(robot, meshes=())


@pytest.mark.parametrize("meshes", [None, 1, 1.0, b"x", [True], {"a": 1}, iter(["a"]), np.True_])
def test_meshes_are_said_by_folders_or_by_true_and_false(robot, meshes):
    """Also where the robot names no meshes."""
    with pytest.raises(InputError, match="meshes must be true or false, a folder, or a list of"):
        robot_parts(robot, meshes=meshes)


def test_a_robot_without_any_shape_is_drawn_too(robot):
    bare = re.sub(r"<visual>.*?</visual>", "", robot.urdf, flags=re.S)
    assert robot_parts(Quadruped.from_urdf(bare))[1]


@pytest.mark.parametrize("name", ["package://../../secret.stl", "/etc/passwd", "none.stl", "x.py"])
def test_mesh_files_outside_the_folder_are_not_opened(tmp_path, name):
    inside = tmp_path / "meshes"
    inside.mkdir()
    (tmp_path / "secret.stl").write_text("solid\nendsolid\n")
    with pytest.raises(InputError, match="meshes=False"):
        read_mesh(name, None, inside)


# ---------------------------------------------------------------- the file


def test_the_main_job_is_small_and_self_contained(robot, tmp_path):
    plan = plan_crawl(robot, s_columns(0), timing="velocity")
    path = replay(plan, tmp_path / "walk.html")
    assert path == tmp_path / "walk.html"
    assert 0.9e6 < path.stat().st_size < 2.5e6
    text = path.read_text("utf-8")
    text, licences = re.subn(r'<script type="text/plain" id="licences">.*?</script>', "", text,
                             flags=re.S)  # fmt: skip
    assert licences == 1
    # The one other address in the file is the name of XML's namespace, which is never fetched.
    assert set(re.findall(r"https?://[\w./]+", text)) <= {"http://www.w3.org/1999/xhtml"}
    assert re.findall(r"(?:src|href)=[\"'](?!data:)", text) == []
    assert "default-src &#x27;none&#x27;" in text
    assert "64 steps" in text
    assert "step 12 of 64" in text


def test_pages_grow_by_a_few_kilobytes_a_step(robot, walk):
    """So 1024 steps stay far below 8 MB. The curves have the same number of instants."""
    plans = [walk, *(plan_crawl(robot, s_columns(0, columns=n), timing="velocity")
                     for n in (17, 65))]  # fmt: skip
    steps = np.array([plan.footholds.steps for plan in plans])
    sizes = np.array([len(replay_html(plan)) for plan in plans])
    assert steps.tolist() == [8, 64, 256]
    rates = np.diff(sizes) / np.diff(steps)
    assert rates[1] < 5e3 and sizes[2] < 8e6 / 2


def test_the_same_plan_gives_the_same_file(walk, scene):
    assert replay_html(walk) == replay_html(walk)
    assert commands(scene) == commands(joined([scene]))


def test_names_and_titles_are_text_whatever_they_hold(robot, walk, tmp_path):
    evil = "</script><script>alert(1)</script>&<!--"
    urdf = robot.urdf.replace('"LF_HAA"', f'"{html.escape(evil)}/x"')
    other = Quadruped.from_urdf(urdf, evil)
    plan = Plan(other, walk.footholds, walk.settings, walk.phases, walk.path)
    for title in (None, evil):
        text = replay(plan, tmp_path / "evil.html", title=title).read_text("utf-8")
        assert "alert(1)</script>" not in text
        assert f"<title>{html.escape(evil)}</title>" in text
        assert text.count("</script>") == replay_html(walk).count("</script>")


def test_nothing_is_left_behind_when_writing_fails(walk, tmp_path):
    with pytest.raises(InputError, match="cannot write"):
        replay(walk, tmp_path / "no" / "walk.html")
    kept = tmp_path / "walk.html"
    kept.write_text("before")
    mesh_plan = replace(walk, robot=load_robot("a1"))
    with pytest.raises(InputError, match="mesh"):
        replay(mesh_plan, kept, meshes=tmp_path)
    assert kept.read_text() == "before"
    assert [p.name for p in tmp_path.iterdir()] == ["walk.html"]


@pytest.mark.parametrize(
    ("duration", "speed"), [(213, 5), (72, 2), (35, 1), (3600, 20), (2, 0.05), (0.5, 0.02)]
)
def test_a_replay_lasts_about_half_a_minute(duration, speed):
    assert comfortable_speed(duration) == speed
    assert comfortable_speed(0.0) in SPEEDS


def test_a_notebook_shows_the_same_page_in_a_frame_of_its_own(walk):
    shown = show(walk, height=321).data
    assert 'sandbox="allow-scripts"' in shown
    assert "height:321px" in shown
    inside = re.search(r'srcdoc="([^"]*)"', shown).group(1)
    assert html.unescape(inside) == replay_html(walk)
    with pytest.raises(InputError, match="height"):
        show(walk, height=-1)


def test_importing_is_light():
    code = (
        "import sys, gaitopt.viewing.replay.replay, gaitopt.viewing.replay.browser; "
        "print([m for m in ('meshcat', 'yourdfpy', 'trimesh', 'IPython') if m in sys.modules])"
    )
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == "[]"


def test_a_replay_needs_no_server_and_leaves_meshcat_as_it_is():
    code = (
        "import sys, gaitopt; from gaitopt.viewing.replay.replay import replay_html; "
        "robot, places = gaitopt.load_robot('wang2020'), gaitopt.s_columns(0, columns=2); "
        "plan = gaitopt.plan_crawl(robot, places); "
        "replay_html(plan); print([m for m in ('meshcat', 'tornado', 'zmq', 'IPython') "
        "if m in sys.modules]); import meshcat; meshcat.geometry.Box([1, 1, 1]); "
        "print(meshcat.Visualizer.__name__, meshcat.commands.SetObject.__module__)"
    )
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout.split("\n") == ["[]", "Visualizer meshcat.commands", ""]


# ---------------------------------------------------------------- a real browser

DRIVE = """<script>
(() => {
  const { state, seek, setPlaying, viewer, pass } = window.gaitopt;
  const out = { start: state.time, label: document.getElementById("phase").textContent,
    playing: state.playing, poses: [], visible: [] };
  const key = (k, more) => window.dispatchEvent(new KeyboardEvent("keydown", { key: k, ...more }));
  const tree = viewer.scene_tree;
  for (const time of @TIMES@) {
    seek(time);
    viewer.render();
    out.poses.push(@PATHS@.map((p) => tree.find(p).object.matrixWorld.elements.slice()));
    out.visible.push(pass.names());
  }
  const scrub = document.getElementById("scrub");
  scrub.value = "500000"; scrub.dispatchEvent(new Event("input"));
  out.scrubbed = state.time;
  key("ArrowRight"); out.forward = state.time - out.scrubbed;
  key("ArrowLeft"); out.back = state.time - out.scrubbed;
  key("End"); out.end = state.time;
  key("Home"); out.home = state.time;
  key(" "); out.started = state.playing; out.drawn = viewer.renderer.info.render.triangles;
  setTimeout(() => {
    out.played = state.time; key(" "); out.paused = state.playing;
    out.resources = performance.getEntriesByType("resource").map((e) => e.name);
    out.problems = window.problems;
    const pre = document.createElement("pre");
    pre.id = "report"; pre.textContent = btoa(JSON.stringify(out));
    document.body.append(pre);
  }, 1500);
})();
</script>"""

browser = pytest.mark.skipif(CHROMIUM is None, reason="no chromium on the PATH to draw the page")


def run_chromium(tmp_path, *arguments):
    profile = tmp_path / "profile"
    return subprocess.run(
        [CHROMIUM, *FLAGS, f"--user-data-dir={profile}", *arguments],
        capture_output=True, text=True, timeout=600, check=False,
    )  # fmt: skip


@browser
def test_a_browser_plays_the_plan(robot, walk, tmp_path):
    times = np.linspace(0, walk.duration, 23)[1:-1].tolist()
    phase = walk.phases[9]
    start = round(phase.start + phase.duration / 2, 3)
    paths = joint_paths(robot, ("robot",))
    drive = DRIVE.replace("@TIMES@", json.dumps(times))
    drive = drive.replace("@PATHS@", json.dumps([list(p) for p in paths.values()]))
    page = (
        replay_html(walk).replace("<body>", "<body>" + WATCH).replace("</body>", drive + "</body>")
    )
    file = tmp_path / "driven.html"
    file.write_text(page, "utf-8")
    run = run_chromium(tmp_path, "--window-size=320,240", "--virtual-time-budget=4000",
                       "--dump-dom", f"{file.as_uri()}#t={start}&paused")  # fmt: skip
    found = re.search(r'<pre id="report">([^<]+)</pre>', run.stdout)
    assert found, run.stderr[-2000:]
    report = json.loads(base64.b64decode(found.group(1)))

    assert [p for p in report["problems"] if "GL Driver" not in p] == []
    assert report["resources"] == []
    assert report["start"] == start
    assert not report["playing"]
    curves = plan_curves(walk)
    margin = 1e3 * np.interp(start, curves.times, curves.margin)
    doing, told = report["label"].rsplit(" ", 2)[0], report["label"].split()[-2]
    assert doing == f"swing {phase.leg}, step {phase.step + 1} of 8, margin"
    assert float(told) == pytest.approx(margin, abs=0.11)
    assert report["scrubbed"] == pytest.approx(walk.duration / 2)
    assert report["forward"] == pytest.approx(comfortable_speed(walk.duration))
    assert report["back"] == pytest.approx(0)
    assert (report["end"], report["home"]) == (walk.duration, 0)
    assert report["started"]
    assert not report["paused"]
    assert 0 < report["played"] < 5
    assert report["drawn"] > 1000
    for moment, poses, visible in zip(times, report["poses"], report["visible"], strict=True):
        check_poses(walk, moment, paths, poses)
        assert [walk.phases[int(i)] for i in visible] == [walk.phase_at(moment)]


def check_poses(plan, moment, paths, poses):
    """three.js's matrices (by columns, y up) against Pinocchio."""
    model = plan.robot.model
    data = model.createData()
    pin.forwardKinematics(model, data, plan.at([moment]).q[0])
    up = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
    for joint, elements in zip(paths, poses, strict=True):
        matrix = np.reshape(elements, (4, 4)).T
        assert np.abs(up @ matrix[:3, 3] - data.oMi[joint].translation).max() < FOOT_TOLERANCE
        assert np.abs(up @ matrix[:3, :3] - data.oMi[joint].rotation).max() < 5e-4


@browser
def test_a_browser_draws_robot_and_columns(walk, tmp_path):
    from matplotlib.image import imread

    file = replay(walk, tmp_path / "walk.html")
    picture = tmp_path / "walk.png"
    run = run_chromium(tmp_path, "--window-size=640,480", "--virtual-time-budget=1500",
                       f"--screenshot={picture}", f"{file.as_uri()}#t=3&paused")  # fmt: skip
    assert picture.is_file(), run.stderr[-2000:]
    middle = imread(picture)[150:400, :, :3]
    colourful = middle.max(axis=2) - middle.min(axis=2) > 0.35
    assert middle.std() > 0.05
    assert colourful.mean() > 0.005  # columns, sleeves, arcs
    assert (middle.max(axis=2) < 0.35).mean() > 0.01  # the robot
