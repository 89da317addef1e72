"""Maps that are filled, cropped and resampled."""

from __future__ import annotations

import numpy as np
import pytest

from gaitopt import GroundError, HeightMap, InputError, make_ground

X, Y = np.meshgrid(np.arange(20) * 0.1, np.arange(10) * 0.1, indexing="ij")


def test_unknown_ground_is_filled() -> None:
    z = np.zeros((9, 9))
    z[:, 5:] = 1.0
    z[3:6, 3:6] = np.nan
    z[0, 0] = np.nan
    ground = HeightMap(z, 0.1)
    assert ground.filled("highest").z[3:6, 3:6].tolist() == [[1.0] * 3] * 3
    assert ground.filled("lowest").z[3:6, 3:6].tolist() == [[0.0] * 3] * 3
    nearest = ground.filled()
    assert nearest.z[4, 3] == 0.0 and nearest.z[4, 5] == 1.0
    for method in ("nearest", "highest", "lowest"):
        whole = ground.filled(method)
        assert whole.known.all() and whole.z[0, 0] == 0.0
        assert (whole.z[ground.known] == z[ground.known]).all()
        assert whole.filled(method) == whole
    with pytest.raises(InputError, match="nearest, highest, lowest"):
        ground.filled("average")


def test_a_part_of_a_map_is_the_same_ground() -> None:
    ground = make_ground("rubble", seed=1)
    part = ground.cropped(x=(0.5, 1.5), y=(-0.2, 0.3))
    (x0, x1), (y0, y1) = part.extent
    assert (x0, x1, y0, y1) == pytest.approx((0.5, 1.5, -0.2, 0.3), abs=1e-9)
    places = np.random.default_rng(0).uniform([0.5, -0.2], [1.5, 0.3], (100, 2))
    assert np.allclose(part.height(places), ground.height(places), atol=1e-12)
    assert ground.cropped() == ground
    assert ground.cropped(x=(1.0, np.inf)).extent[1] == ground.extent[1]
    with pytest.raises(GroundError, match="at least two"):
        ground.cropped(x=(50.0, 60.0))


def test_a_plane_stays_a_plane_at_any_resolution() -> None:
    plane = HeightMap(0.3 * X - 0.2 * Y, 0.1, (1.0, -1.0))
    for resolution in (0.03, 0.1, 0.25):
        other = plane.resampled(resolution)
        x, y = np.meshgrid(other.x - 1.0, other.y + 1.0, indexing="ij")
        assert np.allclose(other.z, 0.3 * x - 0.2 * y, atol=1e-12)
        assert other.origin == plane.origin
        assert 0.0 <= plane.extent[0][1] - other.extent[0][1] < resolution
    assert np.allclose(plane.resampled(0.1).z, plane.z, atol=1e-15)
    with pytest.raises(GroundError, match="coarser"):
        plane.resampled(1e-5)
    with pytest.raises(GroundError, match="finer"):
        plane.resampled(5.0)


def test_half_the_resolution_keeps_all_points() -> None:
    rough = HeightMap(np.random.default_rng(0).uniform(size=(8, 7)), 0.1)
    fine = rough.resampled(0.05)
    assert np.allclose(fine.z[::2, ::2], rough.z, atol=1e-12)
    # The diagonals of the finer grid lie along those of the coarser one.
    places = np.random.default_rng(1).uniform(0.0, 0.6, (200, 2))
    assert np.allclose(fine.height(places), rough.height(places), atol=1e-12)
