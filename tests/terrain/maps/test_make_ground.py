"""Made grounds: what each kind is like, and that all have room to stand at start and goal."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import gaitopt
from gaitopt import Footing, HeightMap, InputError, ground_layers, ground_names, make_ground
from gaitopt.conventions import FloatArray
from gaitopt.terrain.maps.catalogue import GROUNDS

KINDS = ground_names()
ROUGH = [kind for kind in KINDS if kind != "flat"]


def inner(ground: HeightMap, apron: float, length: float) -> FloatArray:
    """Heights between the aprons."""
    return ground.z[(ground.x >= apron) & (ground.x <= length - apron)]


@pytest.mark.parametrize("kind", KINDS)
def test_the_same_seed_gives_the_same_ground_and_another_one_another(kind: str) -> None:
    assert make_ground(kind, seed=3) == make_ground(kind, seed=3)
    if kind != "flat":
        assert make_ground(kind, seed=3) != make_ground(kind, seed=4)


@settings(max_examples=60, deadline=None)
@given(
    kind=st.sampled_from(KINDS), seed=st.integers(0, 2**40), difficulty=st.floats(0.0, 1.0),
    length=st.floats(0.9, 4.0), resolution=st.sampled_from([0.01, 0.02, 0.03, 0.05]),
)  # fmt: skip
def test_every_ground_is_flat_where_the_robot_starts_and_where_its_goal_is(
    kind: str, seed: int, difficulty: float, length: float, resolution: float
) -> None:
    # A ramp has a landing of 0.4 m between the aprons.
    assume(kind != "ramp" or length > 1.2)
    ground = make_ground(kind, seed=seed, difficulty=difficulty, length=length,
                         resolution=resolution, apron=0.4)  # fmt: skip
    assert ground.known.all()
    (x0, x1), (y0, y1) = ground.extent
    assert x0 == pytest.approx(-0.4, abs=resolution)
    assert x1 == pytest.approx(length + 0.4, abs=resolution)
    assert -y0 == pytest.approx(y1) and 2.0 * y1 == pytest.approx(1.5, abs=2.0 * resolution)
    start, goal = ground.x < 0.4, ground.x > length - 0.4
    assert (ground.z[start] == 0.0).all()
    assert np.ptp(ground.z[goal]) == 0.0
    if kind not in ("stairs_up", "stairs_down"):
        assert (ground.z[goal] == 0.0).all()


@pytest.mark.parametrize("name", ["wang2020", "go2", "anymal_c"])
def test_ground_and_aprons_fit_the_robot(name: str) -> None:
    robot = gaitopt.load_robot(name)
    (ahead, aside), height = robot.stance_size, robot.standing_height
    for kind in ROUGH:
        ground = make_ground(kind, robot=robot, difficulty=1.0, seed=1)
        feet = np.array([[x, y] for x in (-ahead / 2, ahead / 2) for y in (-aside / 2, aside / 2)])
        layers = ground_layers(ground, robot=robot)
        for place in np.vstack([feet, feet + np.array([3.0, 0.0])]):
            assert layers.footing(place) is Footing.STEPPABLE
    rubble = make_ground("rubble", robot=robot, difficulty=1.0, tilt=0.0)
    assert 0.5 * height < rubble.height_range[1] <= 0.55 * height
    # Without a robot the ground fits wang2020.
    same = make_ground("rubble", robot=robot) == make_ground("rubble")
    assert same == (name == "wang2020")


@pytest.mark.parametrize("kind", ROUGH)
def test_a_higher_difficulty_is_rougher(kind: str) -> None:
    grounds = [make_ground(kind, seed=2, difficulty=d) for d in (0.0, 0.5, 1.0)]
    if kind in ("stepping_stones", "gaps", "beams"):
        rough = [(ground.z < -0.5).mean() for ground in grounds]
    else:
        rough = [np.abs(np.diff(ground.z, axis=0)).mean() for ground in grounds]
    assert rough[0] < rough[1] < rough[2]


def test_rubble_is_stones_with_flat_tops_up_to_its_height() -> None:
    ground = make_ground("rubble", height=0.15, tilt=0.0, block=0.2, apron=0.4, length=4.0)
    z = inner(ground, 0.4, 4.0)
    tops = np.unique(z)
    assert tops[0] >= 0.0 and 0.14 < tops[-1] <= 0.15
    # One stone for about each 0.2 m by 0.2 m.
    assert len(tops) == pytest.approx(3.2 * 1.5 / 0.04, rel=0.3)
    # Uniform between 0 and the height: mean and spread are known.
    assert z.mean() == pytest.approx(0.075, abs=0.012)
    assert z.std() == pytest.approx(0.15 / np.sqrt(12.0), abs=0.01)
    tilted = make_ground("rubble", height=0.0, tilt=0.2, block=0.3, apron=0.4, length=4.0)
    slopes = np.tan(ground_layers(tilted, edge_height=1.0).slope)
    assert np.nanmedian(slopes[30:-30]) < 0.2


def test_stepping_stones_are_squares_over_a_pit_and_some_are_missing() -> None:
    options = {"block": 0.2, "gap": 0.1, "relief": 0.05, "depth": 0.7, "length": 12.0}
    ground = make_ground("stepping_stones", missing=0.0, width=6.0, apron=0.4, **options)
    z = inner(ground, 0.4, 12.0)
    stones = z > -0.6
    assert set(np.unique(z[~stones])) == {-0.7}
    assert np.abs(z[stones]).max() <= 0.05 and np.abs(z[stones]).max() > 0.045
    # 20 cm squares, which contain 100 points of the grid on average, on 30 cm squares.
    assert stones.mean() == pytest.approx((0.2 / 0.3) ** 2, rel=0.05)
    fewer = make_ground("stepping_stones", missing=0.3, width=6.0, apron=0.4, **options)
    left = (inner(fewer, 0.4, 12.0) > -0.6).mean() / stones.mean()
    assert left == pytest.approx(0.7, abs=0.06)
    layers = ground_layers(ground)
    assert layers.counts[Footing.PIT] > 1000
    assert not layers.steppable[ground.z < -0.6].any()


def test_stairs_have_their_risers_and_treads() -> None:
    up = make_ground("stairs_up", seed=1, riser=0.12, tread=0.28, apron=0.5)
    rises = np.diff(up.z[:, 5])
    at = np.flatnonzero(rises)
    assert np.allclose(rises[at], 0.12) and set(np.diff(at)) == {14}
    assert len(at) == int(2.0 / 0.28) and up.z[-1, 0] == pytest.approx(0.12 * len(at))
    assert (np.ptp(up.z, axis=1) == 0.0).all()
    down = make_ground("stairs_down", seed=1, riser=0.12, tread=0.28, apron=0.5)
    assert np.array_equal(down.z, -up.z)
    both = make_ground("stairs", seed=1, riser=0.12, tread=0.28, apron=0.5, length=4.0)
    rises = np.diff(both.z[:, 5])
    assert np.allclose(np.abs(rises[rises != 0.0]), 0.12) and rises.sum() == pytest.approx(0.0)
    assert (np.diff(np.sign(rises[rises != 0.0])) != 0).sum() == 1
    assert (both.z[:, 0] == both.height_range[1]).sum() * 0.02 > 0.4


def test_a_ramp_has_its_angle() -> None:
    ground = make_ground("ramp", angle=np.radians(25.0), length=4.0)
    slopes = np.unique(np.diff(ground.z[:, 3]).round(9) / 0.02)
    assert slopes[[0, -1]] == pytest.approx([-np.tan(np.radians(25)), np.tan(np.radians(25))])
    assert (ground.z[:, 0] > ground.height_range[1] - 1e-9).sum() * 0.02 > 0.38
    assert ground.height_range[1] > 0.4


def test_a_ramp_without_room_is_refused_and_not_level() -> None:
    with pytest.raises(InputError, match=r"length must be more than 1\.44 m"):
        make_ground("ramp", length=1.4)
    assert make_ground("ramp", length=1.6).height_range[1] > 0.0


def test_gaps_without_room_are_refused_and_not_level() -> None:
    with pytest.raises(InputError, match=r"length must be at least (\d\.\d\d) m") as caught:
        make_ground("gaps", seed=1, length=1.2)
    least = float(re.findall(r"least (\S+) m", str(caught.value))[0])
    assert make_ground("gaps", seed=1, length=least + 0.01).height_range[0] < -0.5


def test_gaps_have_their_length_and_depth() -> None:
    ground = make_ground("gaps", seed=5, gap=0.12, depth=0.6, turn=0.0, distance=0.4, length=6.0)
    assert set(np.unique(ground.z)) == {-0.6, 0.0}
    edges = np.flatnonzero(np.diff(ground.z[:, 0]))
    assert len(edges) >= 8
    # A gap of 12 cm contains six points of the grid.
    assert set(edges[1::2] - edges[::2]) <= {5, 6, 7}
    between = (edges[2::2] - edges[1:-1:2]) * 0.02
    assert between.min() >= 0.30 and between.max() <= 0.62
    turned = make_ground("gaps", seed=5, gap=0.12, turn=0.25, length=6.0)
    assert (np.ptp(turned.z, axis=1) > 0.0).mean() > 0.2


def test_hills_have_their_height_and_no_steps() -> None:
    ground = make_ground("hills", height=0.3, wavelength=1.5, length=8.0, seed=2)
    low, high = ground.height_range
    assert high - low == pytest.approx(0.3)
    # A sine of that height and wavelength is nowhere steeper than pi 0.3 / 1.5.
    assert np.abs(np.diff(ground.z, axis=0)).max() / 0.02 < 2.0 * np.pi * 0.3 / 1.5


def test_beams_lie_below_the_feet() -> None:
    sizes = {"beam": 0.1, "piece": 0.5, "offset": 0.0, "relief": 0.02, "depth": 0.6}
    ground = make_ground("beams", seed=1, apron=0.4, **sizes)
    z = inner(ground, 0.5, 3.0)
    wood = z > -0.5
    # 10 cm about y = 15 cm, and the same on the other side.
    assert np.allclose(np.abs(ground.y[wood.any(axis=0)]), 0.15, atol=0.051)
    assert wood[1:-1].sum(axis=1).min() >= 2 * 5
    assert np.abs(z[wood]).max() <= 0.02
    assert len(np.unique(z[wood])) > 4


def test_what_cannot_be_made_is_refused() -> None:
    with pytest.raises(InputError, match="there is no ground named 'swamp'; there are flat, rub"):
        make_ground("swamp")
    with pytest.raises(InputError, match="rubble has no size riser; it has height, block, tilt"):
        make_ground("rubble", riser=0.1)
    with pytest.raises(InputError, match="flat has no size height; it has none"):
        make_ground("flat", height=0.1)
    with pytest.raises(InputError, match="length"):
        make_ground("rubble", length=0.7)
    with pytest.raises(InputError, match="16,000,000 points"):
        make_ground("rubble", length=900.0, width=900.0)
    for name in ("difficulty", "seed", "resolution", "width", "apron", "height"):
        with pytest.raises(InputError, match=name):
            make_ground("rubble", **{name: -1})  # type: ignore[arg-type]
    with pytest.raises(InputError, match="Quadruped"):
        make_ground("rubble", robot="go2")  # type: ignore[arg-type]


def test_the_page_on_terrain_tells_all_kinds_and_sizes() -> None:
    page = (Path(__file__).parents[3] / "docs" / "terrain.md").read_text("utf-8")
    rows = dict(re.findall(r"^\| `(\w+)` \|[^|]*\|([^|]*)\|$", page, re.MULTILINE))
    assert tuple(name for name in rows if name in GROUNDS) == KINDS
    for name, kind in GROUNDS.items():
        told = re.findall(r"`(\w+)` ([\d.]+)(?: to ([\d.]+))?(°?)", rows[name])
        assert [size for size, *_ in told] == [size.name for size in kind.sizes]
        for size, (_, easy, hard, degree) in zip(kind.sizes, told, strict=True):
            unit = np.radians(1.0) if degree else 1.0
            assert float(easy) * unit == pytest.approx(size.easy)
            assert float(hard or easy) * unit == pytest.approx(size.hard)
