"""Contact forces near the planned ones that make a wanted wrench on the body: a small QP."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gaitopt.control.forces import EFFORT, TOLERANCE, ForceShare, ForceStatus
from gaitopt.conventions import BoolArray, FloatArray
from gaitopt.dynamics.contacts import ForceLimits, tangents, unit_normals
from gaitopt.dynamics.many_programs import solve_quadratic_programs
from gaitopt.dynamics.small_programs import NO_BOUND

SIDES = 8
"""Sides of the friction pyramids. Eight keep 92 % of the friction where the four of a plan keep
71 %, so that feedback has some room also where the plan uses all that it may."""

LIGHT_FRICTION = 0.5
"""Share of the friction that the least normal force of a foot makes, which the foot does without.
What a plan keeps on a foot is not quite what physics has there, and friction goes with it: feet
that bore 2 % of the weight and used all of their friction slid by 20 to 26 mm under hyq on stairs
as slippery as planned, and by at most 17 mm so. Other feet bear next to nothing more."""

LEAST_SHARE = 0.1
"""Least share of a full load that differences are weighted by: the wrench is then wrong by at most
1 % where only such a foot can make it."""


class NearestForces:
    """Distributes wrenches over the feet that stand, near planned forces.

    It minimises the squared error of the wrench and, with a small weight, the squared differences
    from the planned forces. Each force keeps to a friction pyramid and to the least normal force
    that the plan promises, about the normal of the ground (:meth:`stand_on`). An instance remembers
    its last forces, so it serves one thread.

    Args:
        weight: of the robot [N], the unit of force.
        length: half the stance [m]; with ``weight`` the unit of torque.
        limits: those of the plan.
    """

    def __init__(self, weight: float, length: float, limits: ForceLimits) -> None:
        self._weight, self._limits = weight, limits
        self._scale = np.array([1.0] * 3 + [1.0 / length] * 3) / weight
        self._wrench_scale = (weight * self._scale)[:, None]
        self._last = np.zeros((4, 3))
        self.stand_on(np.tile([0.0, 0.0, 1.0], (4, 1)), np.full(4, limits.friction))

    def stand_on(self, normals: FloatArray, friction: FloatArray) -> None:
        """From now on feet stand on ground with these normals ``(4, 3)`` and friction ``(4,)``."""
        self._normals = unit_normals(normals)
        self._slopes = friction * np.cos(np.pi / SIDES)
        self._rows = _rows(self._normals, self._slopes)
        self._known: dict[tuple[bytes, bytes], _Feet] = {}

    def reset(self) -> None:
        """Forget the last forces, so that the next ones do not depend on earlier ones."""
        self._last = np.zeros((4, 3))

    def share(
        self,
        grasp: FloatArray,
        wrench: FloatArray,
        load: FloatArray,
        planned: FloatArray,
        contacts: BoolArray,
        legs: LegTorques | None = None,
    ) -> ForceShare:
        """Forces on the feet that make up ``wrench``.

        Args:
            grasp: wrench of unit forces on the feet ``(6, 12)``: force rows, then torque rows.
            wrench: force [N] and torque [N m] that the feet are to exert together ``(6,)``.
            load: share of a full load for each foot ``(4,)``; 0 for feet in the air.
            planned: forces of the plan ``(4, 3)`` [N].
            contacts: which feet touch the ground ``(4,)``. Those that should bear load and do not
                touch it press with the least normal force alone: a larger one would make them kick.
                The others make up what is left of the wrench without the planned forces of these:
                two feet on one side that are to carry a body that four carry have no such forces,
                and huge ones for a part of its moment.
            legs: what the forces ask of the joints. Forces that no joint is strong enough for do
                not come about, and what is missing of them lets the body fall to that side: other
                feet can take it over.

        Returns:
            The forces; where no forces make up the wrench, those that come nearest to it.
        """
        bearing = load > 0.0
        feet = self._feet_of(bearing, contacts)
        if not feet.all_touch:
            lost = np.where((bearing & ~contacts)[:, None], planned, 0.0).reshape(-1)
            wrench = wrench - grasp @ lost
        target = self._scale * wrench
        forces = feet.least_forces.copy()
        if not len(feet.legs):
            return ForceShare(forces, float(np.abs(target).max()), 0.0, ForceStatus.FREE)
        rows = feet.rows
        matrix = self._wrench_scale * grasp[:, feet.columns]
        wanted = planned[feet.legs].reshape(-1) / self._weight
        rest = target - matrix @ wanted
        hessian = matrix.T @ matrix
        hessian.flat[:: len(feet.columns) + 1] += EFFORT * np.repeat(
            np.maximum(load[feet.legs], LEAST_SHARE) ** -2.0, 3
        )
        gradient = -(matrix.T @ rest)
        low = feet.floor - rows @ wanted
        # The minimum without limits; where it keeps them it is that of the QP.
        x, status = np.linalg.solve(hessian, -gradient), ForceStatus.FREE
        if not (rows @ x - low).min() >= -TOLERANCE:
            inside = _minimum(hessian, gradient, rows, low, feet.unbounded)
            status = ForceStatus.KEPT if inside is None else ForceStatus.LIMITED
            # The forces of the last call are better than wrong ones.
            last = self._last[feet.legs].reshape(-1) / self._weight - wanted
            x = last if inside is None else inside
        if legs is not None and legs.exceeded(feet.legs, self._forces(wanted + x)):
            room, least_use, most_use = legs.rows(feet.legs, self._weight)
            held = room @ wanted
            inside = _minimum(
                hessian, gradient, np.concatenate([rows, room]),
                np.concatenate([low, least_use - held]),
                np.concatenate([feet.unbounded, most_use - held]),
            )  # fmt: skip
            x, status = (x, status) if inside is None else (inside, ForceStatus.LIMITED)
        forces[feet.legs] = self._forces(wanted + x)
        self._last = forces
        return ForceShare(
            forces=forces,
            residual=float(np.abs(matrix @ x - rest).max()),
            violation=max(-float((rows @ x - low).min()), 0.0),
            status=status,
        )

    def _forces(self, shares: FloatArray) -> FloatArray:
        """Forces ``(k, 3)`` [N] from shares of the weight ``(3 k,)``."""
        return self._weight * shares.reshape(-1, 3)

    def _feet_of(self, bearing: BoolArray, contacts: BoolArray) -> _Feet:
        """What depends only on which feet bear load and touch the ground, made once for each."""
        key = bearing.tobytes(), contacts.tobytes()
        if key not in self._known:
            least = self._limits.least_normal_shares(bearing)
            legs = np.flatnonzero(bearing & contacts)
            floor = np.zeros((len(legs), SIDES + 1))
            floor[:, :-1] = (LIGHT_FRICTION * self._slopes * least)[legs, None]
            floor[:, -1] = least[legs]
            self._known[key] = _Feet(
                legs=legs,
                columns=(3 * legs[:, None] + np.arange(3)).reshape(-1),
                all_touch=not (bearing & ~contacts).any(),
                least_forces=self._weight * least[:, None] * self._normals,
                rows=_side_by_side(self._rows[legs]),
                floor=floor.reshape(-1),
                unbounded=np.full(floor.size, NO_BOUND),
            )
        return self._known[key]


class LegTorques(NamedTuple):
    """Torques of the legs' joints, ``own - J' f``, under forces on their feet.

    Attributes:
        jacobians: ``J`` of each foot's contact point by the joints of its leg ``(4, 3, j)``.
        own: torques without forces on the feet ``(4, j)`` [N m].
        efforts: limits ``(4, j)`` [N m]; ``inf`` for joints without.
    """

    jacobians: FloatArray
    own: FloatArray
    efforts: FloatArray

    def exceeded(self, feet: np.ndarray, forces: FloatArray) -> bool:
        """Whether forces ``(k, 3)`` [N] on some ``feet (k,)`` ask more of a joint than it has."""
        pushed = (forces[:, None] @ self.jacobians[feet])[:, 0]
        return bool((np.abs(self.own[feet] - pushed) > self.efforts[feet]).any())

    def rows(self, feet: np.ndarray, weight: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Rows, and what they are to be at least and at most, of all forces on ``feet (k,)``.

        Forces are in units of ``weight``, and torques in units of their limits.
        """
        efforts, own = self.efforts[feet].reshape(-1), self.own[feet].reshape(-1)
        limited = np.isfinite(efforts)
        scale = np.where(limited, 1.0 / efforts, 0.0)
        rows = _side_by_side(np.swapaxes(self.jacobians[feet], 1, 2))
        rows = (weight * scale)[:, None] * rows
        return rows[limited], (own * scale - 1.0)[limited], (own * scale + 1.0)[limited]


class _Feet(NamedTuple):
    """Feet that bear load and touch the ground, on ground that does not change.

    Attributes:
        legs: their numbers ``(k,)``.
        columns: numbers of their forces ``(3 k,)``.
        all_touch: whether no other foot is to bear load.
        least_forces: least normal forces of all feet that bear load ``(4, 3)`` [N].
        rows: limits of the forces ``((SIDES + 1) k, 3 k)``.
        floor: what the rows are to be at least, as a share of the weight ``((SIDES + 1) k,)``.
        unbounded: the same for "at most" ``((SIDES + 1) k,)``.
    """

    legs: np.ndarray
    columns: np.ndarray
    all_touch: bool
    least_forces: FloatArray
    rows: FloatArray
    floor: FloatArray
    unbounded: FloatArray


def _minimum(
    hessian: FloatArray, gradient: FloatArray, rows: FloatArray, low: FloatArray, high: FloatArray
) -> FloatArray | None:
    """The minimum of a quadratic function within limits of rows; ``None`` where there is none."""
    points, solved = solve_quadratic_programs(
        hessian[None], gradient[None], rows[None], low[None], high[None]
    )
    return points[0] if solved[0] else None


def _rows(normals: FloatArray, slopes: FloatArray) -> FloatArray:
    """Rows of each foot ``(4, SIDES + 1, 3)``: its friction pyramid, and its normal force.

    Args:
        normals: unit normals of the ground below each foot ``(4, 3)``.
        slopes: largest ratio of the tangential force to the normal one ``(4,)``, square to every
            side.
    """
    turns = 2.0 * np.pi * np.arange(SIDES) / SIDES
    sides = np.stack([np.cos(turns), np.sin(turns)], axis=1) @ tangents(normals)
    sides += slopes[:, None, None] * normals[:, None]
    return np.concatenate([sides, normals[:, None]], axis=1)


def _side_by_side(rows: FloatArray) -> FloatArray:
    """Rows of ``k`` feet ``(k, r, 3)`` as one matrix of all their forces ``(k r, 3 k)``."""
    count, each, _ = rows.shape
    out = np.zeros((count, each, count, 3))
    for i in range(count):
        out[i, :, i] = rows[i]
    return out.reshape(count * each, 3 * count)
