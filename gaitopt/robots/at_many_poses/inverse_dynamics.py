"""Pinocchio's inverse dynamics of many samples in one call."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np

from gaitopt.conventions import FloatArray


def inverse_dynamics(model: Any, q: FloatArray, v: FloatArray, a: FloatArray) -> FloatArray:
    """Generalised forces without contact forces, by Pinocchio's RNEA ``(N, nv)``.

    Args:
        model: Pinocchio's.
        q: configurations ``(N, nq)``.
        v, a: velocities and accelerations ``(N, nv)``.
    """
    import pinocchio as pin

    if not hasattr(pin, "rneaInParallel"):
        # Wheels of Pinocchio that are built without OpenMP.
        data = model.createData()
        rows = [pin.rnea(model, data, *sample) for sample in zip(q, v, a, strict=True)]
        return np.array(rows).reshape(v.shape)
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
