"""Sparse quadratic programs, by PIQP."""

from __future__ import annotations

from typing import Any

import numpy as np

from gaitopt.conventions import FloatArray


def solve_sparse(
    hessian: Any,
    gradient: FloatArray,
    matrix: Any,
    low: FloatArray,
    high: FloatArray,
    *,
    refinement: bool = False,
) -> tuple[FloatArray, bool]:
    """Minimise ``x H x / 2 + g x`` over ``low <= A x <= high``, all sparse, by PIQP.

    PIQP is an interior-point method. ProxQP's sparse solver, which does well with few active rows,
    did not end within minutes with the thousands that programs of whole walks have.

    Args:
        hessian, gradient, matrix, low, high: the program.
        refinement: whether every linear system is solved with iterative refinement. Programs with
            many equations and inequalities that need it: of ten, without it six did not end in 200
            iterations, and with it all did that have a solution, in a quarter of the time.

    Returns:
        The answer, and whether the solver calls it a solution. Callers judge it by its residuals.
    """
    import casadi as ca

    h, a = (_as_casadi(m) for m in (hessian, matrix))
    options: dict[str, Any] = {
        "piqp": {"max_iter": 200, "eps_abs": 1e-9, "eps_rel": 0.0},
        "error_on_fail": False,
    }
    if refinement:
        options["piqp"]["iterative_refinement_always_enabled"] = True
    solver = ca.conic("program", "piqp", {"h": h.sparsity(), "a": a.sparsity()}, options)
    found = solver(h=h, g=gradient, a=a, lba=low, uba=high)
    return np.asarray(found["x"]).ravel(), bool(solver.stats()["success"])


def _as_casadi(matrix: Any) -> Any:
    """A SciPy matrix as CasADi's, which not all of its versions read by themselves."""
    import casadi as ca

    columns = matrix.tocsc()
    columns.sort_indices()
    rows, count = columns.shape
    pattern = ca.Sparsity(rows, count, columns.indptr.tolist(), columns.indices.tolist())
    return ca.DM(pattern, columns.data)
