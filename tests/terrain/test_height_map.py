"""The ground as a height map: a surface that is piecewise linear, the same as MuJoCo's."""

from __future__ import annotations

import pickle

import numpy as np
import pytest

from gaitopt import GroundError, HeightMap, InputError

RNG = np.random.default_rng(3)
ROUGH = HeightMap(RNG.uniform(0.0, 1.0, (5, 4)), 0.5, (-1.0, 2.0))


def test_a_plane_is_met_exactly() -> None:
    x, y = np.meshgrid(np.arange(4) * 0.1, np.arange(6) * 0.1 + 1.0, indexing="ij")
    plane = HeightMap(0.3 * x - 0.2 * y + 1.0, 0.1, (0.0, 1.0))
    places = RNG.uniform([0.0, 1.0], [0.3, 1.5], (50, 2))
    assert np.allclose(plane.height(places), places @ [0.3, -0.2] + 1.0, atol=1e-14)
    assert np.allclose(plane.gradient(places), [0.3, -0.2], atol=1e-12)
    normal = np.array([-0.3, 0.2, 1.0]) / np.linalg.norm([-0.3, 0.2, 1.0])
    assert np.allclose(plane.normal(places), normal, atol=1e-12)


def test_points_of_the_grid_have_their_heights() -> None:
    x, y = np.meshgrid(ROUGH.x, ROUGH.y, indexing="ij")
    assert np.allclose(ROUGH.height(np.stack([x, y], axis=-1)), ROUGH.z, atol=1e-14)
    assert ROUGH.extent == ((-1.0, 1.0), (2.0, 3.5))


def test_mujoco_divides_cells_in_the_same_way() -> None:
    mujoco = pytest.importorskip("mujoco")
    (x0, x1), (y0, y1) = ROUGH.extent
    low, high = ROUGH.height_range
    spec = mujoco.MjSpec()
    spec.add_hfield(
        name="g", nrow=ROUGH.shape[1], ncol=ROUGH.shape[0],
        size=[(x1 - x0) / 2.0, (y1 - y0) / 2.0, high - low, 0.1],
        userdata=((ROUGH.z - low) / (high - low)).T.ravel().tolist(),
    )  # fmt: skip
    middle = [(x0 + x1) / 2.0, (y0 + y1) / 2.0, low]
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_HFIELD, hfieldname="g", pos=middle)
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    down, hit = np.array([0.0, 0.0, -1.0]), np.zeros(1, np.int32)
    for place in RNG.uniform([x0, y0], [x1, y1], (100, 2)):
        above = np.append(place, 5.0)
        distance = mujoco.mj_ray(model, data, above, down, None, 1, -1, hit)
        # MuJoCo keeps heights as floats of 32 bits.
        assert 5.0 - distance == pytest.approx(float(ROUGH.height(place)), abs=1e-6)


def test_off_the_map_and_where_unknown_nothing_is_told() -> None:
    z = np.zeros((3, 3))
    z[2, 2] = np.nan
    ground = HeightMap(z, 1.0)
    assert np.isnan(ground.height([-0.1, 0.5])) and np.isnan(ground.height([0.5, 2.1]))
    assert np.isnan(ground.height([1.9, 1.2])) and np.isnan(ground.normal([1.9, 1.2])).all()
    assert ground.height([0.5, 1.9]) == 0.0
    assert not ground.known[2, 2] and ground.known.sum() == 8


def test_borders_belong_to_the_map() -> None:
    assert np.isfinite(ROUGH.height([[-1.0, 2.0], [1.0, 3.5], [1.0 + 1e-11, 3.5]])).all()


def test_maps_are_compared_and_pickled() -> None:
    again = pickle.loads(pickle.dumps(ROUGH))
    assert again == ROUGH and again != ROUGH.with_heights(ROUGH.z + 1.0)
    with pytest.raises(ValueError, match="read-only"):
        ROUGH.z[0, 0] = 1.0


@pytest.mark.parametrize(
    ("z", "words"),
    [
        (np.zeros(3), "shape"),
        (np.zeros((1, 3)), "shape"),
        ([[0.0, "a"], [1.0, 2.0]], "numbers"),
        ([[0.0, 1.0], [1.0]], "numbers"),
        ([[0.0, None], [1.0, 2.0]], "of object; give NaN where a height is not known"),
        (np.zeros((2, 2), dtype=complex), "numbers"),
        (np.full((2, 2), np.nan), "no height of the map is known"),
        ([[0.0, 1e7], [0.0, 0.0]], r"z\[0, 1\] is 1e\+07"),
        ([[0.0, np.inf], [0.0, 0.0]], r"z\[0, 1\] is inf"),
    ],
)
def test_heights_that_are_none_are_refused(z: object, words: str) -> None:
    with pytest.raises(GroundError, match=words):
        HeightMap(z, 0.1)  # type: ignore[arg-type]


def test_grid_is_checked() -> None:
    with pytest.raises(InputError, match="resolution"):
        HeightMap(np.zeros((2, 2)), 0.0)
    with pytest.raises(GroundError, match="origin"):
        HeightMap(np.zeros((2, 2)), 0.1, (0.0, np.nan))
