"""Pinocchio's inverse dynamics of many samples in one call."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np

from gaitopt.conventions import FloatArray

FEW = 200
"""Samples for which a thread takes longer to begin than the way through Python that it saves."""


def inverse_dynamics(model: Any, q: FloatArray, v: FloatArray, a: FloatArray) -> FloatArray:
    """Generalised forces without contact forces, by Pinocchio's RNEA ``(N, nv)``.

    Args:
        model: Pinocchio's.
        q: configurations ``(N, nq)``.
        v, a: velocities and accelerations ``(N, nv)``.
    """
    import pinocchio as pin

    if len(q) < FEW or not hasattr(pin, "rneaInParallel"):
        # Wheels of Pinocchio that are built without OpenMP have no such call.
        data, out = model.createData(), np.empty(v.shape)
        for i, sample in enumerate(zip(q, v, a, strict=True)):
            out[i] = pin.rnea(model, data, *sample)
        return out
    # Pinocchio sets the number of OpenMP's threads of the thread that calls it, for good. In a
    # thread of its own, whatever else the program computes with OpenMP keeps its number.
    with ThreadPoolExecutor(max_workers=1) as own:
        return own.submit(_in_one_call, model, q, v, a).result()


def _in_one_call(model: Any, q: FloatArray, v: FloatArray, a: FloatArray) -> FloatArray:
    """On one core: it saves the way through Python for each sample, 40 % of the time."""
    import pinocchio as pin

    pool, out = pin.ModelPool(model, 1), np.empty(v.shape[::-1], order="F")
    pin.rneaInParallel(1, pool, *(np.asfortranarray(table.T) for table in (q, v, a)), out)
    return np.ascontiguousarray(out.T)
