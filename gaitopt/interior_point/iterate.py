"""The point that the interior-point method improves step by step."""

from __future__ import annotations

from dataclasses import dataclass, field

from gaitopt.conventions import FloatArray


@dataclass
class Iterate:
    """Unknowns, slacks and multipliers, and what the method remembers from step to step.

    Attributes:
        x: unknowns ``(n,)``.
        slack: of the inequalities ``(m,)``, positive: ``values(x) = slack`` at the solution.
        multipliers: of the inequalities ``(m,)``, positive.
        barrier: the barrier parameter ``mu``: slack times multiplier is to become ``mu``.
        violation_limit: points with a larger sum of ``|values(x) - slack|`` are never taken.
        damping: what was last added to the diagonal of the Newton matrix.
        curvature_share: which share of the inequalities' curvature the Newton matrix tries first.
        filter: pairs of barrier function and violation; a point that is worse than one of them in
            both is not taken.
    """

    x: FloatArray
    slack: FloatArray
    multipliers: FloatArray
    barrier: float
    violation_limit: float
    damping: float = 0.0
    curvature_share: float = 1.0
    filter: list[tuple[float, float]] = field(default_factory=list)
