"""Where standing feet are held that bear hardly any load.

The leg of a standing foot brings the body to the reference, with the foot where it is. A foot that
bears hardly any load slides by that, and each of its places is as good as the last one: over the
steps of hyq down stairs feet slid by up to 23 mm so. Such a foot is held where it landed, and from
there on where its ball rolls.
"""

from __future__ import annotations

import numpy as np

from gaitopt.conventions import LEGS, BoolArray, FloatArray

FULL_LOAD = 0.03
"""Share of the weight from which on a standing foot counts as where it is. Chosen: feet that plans
leave the least load bear 1 or 2 % of the weight; with 6 % bodies leave their plans twice as far."""


class Anchors:
    """How far standing feet are from where the reference has them, since they landed.

    Args:
        weight: of the robot [N].
        grounded: feet that stand at the start ``(4,)``, where the reference has them.
    """

    def __init__(self, weight: float, grounded: BoolArray) -> None:
        self._full_load = FULL_LOAD * weight
        self._away: FloatArray = np.zeros((len(LEGS), 3))
        self._grounded = grounded

    def places(
        self, planned: FloatArray, feet: FloatArray, grounded: BoolArray, forces: FloatArray,
        normals: FloatArray,
    ) -> FloatArray:  # fmt: skip
        """Places of the feet with which standing legs bring the body to its reference ``(4, 3)``.

        Args:
            planned: where the reference has the feet, which roll there ``(4, 3)`` [m].
            feet: where they are ``(4, 3)`` [m].
            grounded: which of them stand and have found the ground ``(4,)``.
            forces: that they are to bear ``(4, 3)`` [N].
            normals: of the ground below them ``(4, 3)``.
        """
        landed = grounded & ~self._grounded
        self._grounded = grounded
        if landed.any():
            self._away[landed] = (feet - planned)[landed]
        back = planned + self._away - feet
        back -= (back * normals).sum(axis=1)[:, None] * normals
        load = (forces * normals).sum(axis=1) / self._full_load
        share = np.minimum(np.maximum(1.0 - load, 0.0), 1.0)
        return np.asarray(feet + share[:, None] * back)
