"""Heights in place of unknown ones."""

from __future__ import annotations

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.inputs import check_choice

FILL_METHODS = ("nearest", "highest", "lowest")
"""Heights that unknown ground gets: that of the nearest known point of the grid, or the highest or
lowest one around each patch of unknown ground."""


def filled_heights(z: FloatArray, method: str) -> FloatArray:
    """Heights ``(nx, ny)`` with none unknown.

    Args:
        z: heights, NaN where unknown; one at least is known.
        method: of :data:`FILL_METHODS`.

    Raises:
        InputError: the method is unknown.
    """
    from scipy.ndimage import distance_transform_edt, label

    check_choice("method", method, FILL_METHODS)
    unknown = np.isnan(z)
    if not unknown.any():
        return z
    if method == "nearest":
        nearest = distance_transform_edt(unknown, return_distances=False, return_indices=True)
        return np.asarray(z[tuple(nearest)])
    patches, count = label(unknown, np.ones((3, 3)))
    patches = np.pad(patches, 1)
    choose = np.fmax if method == "highest" else np.fmin
    rim = np.full(count + 1, np.nan)
    nx, ny = z.shape
    for i in range(3):
        for j in range(3):
            choose.at(rim, patches[i : i + nx, j : j + ny].ravel(), z.ravel())
    return np.where(unknown, rim[patches[1:-1, 1:-1]], z)
