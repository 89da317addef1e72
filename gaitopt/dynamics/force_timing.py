"""How fast a path may be followed so that contact forces and joint torques can make the motion.

Along a path ``q(s)`` the equations of motion are linear in the path acceleration ``u = s''``, in
the squared path speed ``x = s'^2`` and in the contact forces, and so are all limits on forces and
torques [Hauser2014] [Pham2015]. From rest to rest the fastest timing then takes two sweeps of small
linear programs, as with limits on joints alone [Pham2018]: backward for the largest speeds from
which the path can still be followed to its end, and forward with the largest acceleration that
these allow. With limits on joint velocities alone it is the question of [Wang2020], Section IV.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from gaitopt.conventions import GRAVITY, BoolArray, FloatArray
from gaitopt.dynamics.contacts import ForceLimits, effort_limits, pyramid_rows
from gaitopt.dynamics.small_programs import NO_BOUND, LinearSolution, solve_linear
from gaitopt.dynamics.whole_body import PathDynamics
from gaitopt.robots.quadruped import Quadruped

RANK = 1e-9
"""Share of the largest singular value of the contact matrix below which one is zero: rounding."""
SLOWER = 1.0 - 1e-9
"""Share of a largest squared speed that is used: the next sweep then never fails by rounding."""


@dataclass(frozen=True, eq=False)
class TimingLimits:
    """What bounds the timing besides forces.

    Attributes:
        squares: largest squared path speeds at all grid points ``(N + 1, L)`` [1/s^2]: joint
            velocities.
        first, second: derivatives of the joints whose acceleration is limited, by the path's
            parameter ``(N + 1, L, n)``.
        acceleration: limit of their accelerations [rad/s^2]; infinite for none.
    """

    squares: FloatArray
    first: FloatArray
    second: FloatArray
    acceleration: float = np.inf


@dataclass(frozen=True, eq=False)
class ForceTiming:
    """The fastest timing of ``L`` paths.

    Attributes:
        squares: squared path speeds at all grid points ``(N + 1, L)`` [1/s^2].
        stuck: paths along which not even rest is possible at some grid point ``(L,)``.
        places: of each path the first such grid point, from the end ``(L,)``; -1 for none.
    """

    squares: FloatArray
    stuck: BoolArray
    places: np.ndarray


def fastest_with_forces(
    robot: Quadruped,
    dynamics: PathDynamics,
    standing: BoolArray,
    grid: FloatArray,
    limits: ForceLimits,
    timing: TimingLimits,
) -> ForceTiming:
    """The fastest timing from rest to rest, with forces, of many paths.

    Between grid points the path acceleration is constant. Limits hold at both ends of every
    interval with that same acceleration.

    Args:
        robot: the robot.
        dynamics: at all grid points of all paths, grid point by grid point: sample ``i L + l`` is
            grid point ``i`` of path ``l``.
        standing: which feet stand along each path ``(L, 4)``.
        grid: the parameter at grid points ``(N + 1,)``, increasing.
        limits: on forces and torques.
        timing: on joint velocities and accelerations.
    """
    count, paths = len(grid), len(standing)
    squares = np.zeros((count, paths))
    stuck, places = np.zeros(paths, dtype=np.bool_), np.full(paths, -1)
    for path in range(paths):
        rows = _PathRows(robot, dynamics, standing[path], grid, limits, timing, path)
        found = rows.controllable()
        if isinstance(found, int):
            stuck[path], places[path] = True, found
            continue
        squares[:, path] = rows.fastest(found)
    return ForceTiming(squares, stuck, places)


class _Controllable(NamedTuple):
    """What the backward sweep finds.

    Attributes:
        squares: largest squared speeds from which the path can be followed ``(N + 1,)``.
        after: what follows each of them at the interval's end ``(N,)``.
    """

    squares: FloatArray
    after: FloatArray


class _PathRows:
    """Linear programs along one path.

    Unknowns are the path acceleration, the squared speed at an interval's begin, and at both ends
    the coordinates of the contact forces, all in units that make them of order one.
    """

    def __init__(
        self,
        robot: Quadruped,
        dynamics: PathDynamics,
        standing: BoolArray,
        grid: FloatArray,
        limits: ForceLimits,
        timing: TimingLimits,
        path: int,
    ) -> None:
        paths = timing.squares.shape[1]
        samples = path + paths * np.arange(len(grid))
        self._steps = np.diff(grid)
        self._top = timing.squares[:, path]
        self._points = [_point_rows(robot, dynamics, standing, limits, int(i)) for i in samples]
        first, second = timing.first[:, path], timing.second[:, path]
        bend = np.stack([first, second], axis=2)
        self._accelerations = bend, timing.acceleration
        # A force of half the weight, or the joints' velocities, whichever is less.
        reach = max(float(np.abs(p.wrench[:, 0]).max()) for p in self._points)
        unit = 0.5 / reach if reach > 0.0 else np.inf
        fastest = float(self._top[1:-1].max(initial=1.0))
        self._unit = min(unit, fastest) if np.isfinite(fastest) else unit

    def controllable(self) -> _Controllable | int:
        """From where the path can be followed to its end; or the grid point where it cannot."""
        squares, after = np.zeros(len(self._top)), np.zeros(len(self._steps))
        for i in reversed(range(len(self._steps))):
            found = self._solve(i, squares[i + 1], speed=None)
            if found is None:
                return i
            u, x = found
            after[i] = max(x + 2.0 * float(self._steps[i]) * u, 0.0)
            squares[i] = max(SLOWER * x, 0.0) if i else 0.0
        return _Controllable(squares, after)

    def fastest(self, controllable: _Controllable) -> FloatArray:
        """Squared speeds that gain as much as the controllable ones allow ``(N + 1,)``."""
        most, out = controllable.squares, np.zeros(len(controllable.squares))
        for i, step in enumerate(self._steps.tolist()):
            found = self._solve(i, most[i + 1], speed=float(out[i]))
            if found is None:
                # Rounding: follow the largest speeds, slowed by one factor. Limits are convex, and
                # hold at rest, so they hold there.
                share = out[i] / most[i] if most[i] > 0.0 else 0.0
                out[i + 1] = min(share * controllable.after[i], most[i + 1])
            else:
                out[i + 1] = np.clip(out[i] + 2.0 * step * found[0], 0.0, most[i + 1])
        return out

    def _solve(self, i: int, after: float, speed: float | None) -> tuple[float, float] | None:
        """Path acceleration and squared speed of interval ``i``.

        Args:
            i: the interval.
            after: largest squared speed where it ends.
            speed: squared speed where it begins, and the acceleration is to be largest; or
                ``None``: the speed is to be largest.
        """
        step, unit = float(self._steps[i]), self._unit
        here, there = self._points[i], self._points[i + 1]
        a, b = here.coordinates, there.coordinates
        blocks, lows = [], []
        for point, columns, at_end in ((here, slice(2, 2 + a), False),
                                       (there, slice(2 + a, 2 + a + b), True)):  # fmt: skip
            rows = np.zeros((len(point.low), 2 + a + b))
            rows[:, 0] = unit * (point.by_u + (2.0 * step * point.by_x if at_end else 0.0))
            rows[:, 1] = unit * point.by_x
            rows[:, columns] = point.by_z
            blocks.append(rows)
            lows.append(point.low)
        bend, limit = self._accelerations
        if np.isfinite(limit):
            for k, at_end in ((i, False), (i + 1, True)):
                gain = bend[k, :, 0] + (2.0 * step * bend[k, :, 1] if at_end else 0.0)
                pair = np.zeros((2 * len(gain), 2 + a + b))
                pair[:, 0] = unit / limit * np.concatenate([gain, -gain])
                pair[:, 1] = unit / limit * np.concatenate([bend[k, :, 1], -bend[k, :, 1]])
                blocks.append(pair)
                lows.append(np.full(len(pair), -1.0))
        edge = np.zeros((2, 2 + a + b))
        edge[0, 1], edge[1, :2] = 1.0, (2.0 * step, 1.0)
        matrix = np.concatenate([*blocks, edge])
        top = min(float(self._top[i]), NO_BOUND) / unit
        begin = (0.0, top) if speed is None else (speed / unit,) * 2
        low = np.concatenate([*lows, [begin[0], 0.0]])
        high = np.concatenate([np.full(sum(map(len, lows)), NO_BOUND), [begin[1], after / unit]])
        size = np.linalg.norm(matrix, axis=1)
        size[size == 0.0] = 1.0
        high = np.where(high < NO_BOUND, high / size, NO_BOUND)
        cost = np.zeros(2 + a + b)
        cost[1 if speed is None else 0] = -1.0
        program = (cost, matrix / size[:, None], low / size, high)
        found: LinearSolution | None = solve_linear(*program)
        if found is None:
            found = solve_linear(*program, by_highs=True)
        if found is None:
            return None
        return unit * float(found.point[0]), unit * float(found.point[1])


@dataclass(frozen=True, eq=False)
class _PointRows:
    """Limits of forces and torques at a grid point: ``by_u u + by_x x + by_z z >= low``.

    Attributes:
        by_u, by_x, low: ``(r,)``; by_z: ``(r, d)``; in shares of the weight and of torque limits.
        wrench: ``A``, ``B``, ``g`` of the base's equations, in units of the weight ``(6, 3)``.
    """

    by_u: FloatArray
    by_x: FloatArray
    by_z: FloatArray
    low: FloatArray
    wrench: FloatArray

    @property
    def coordinates(self) -> int:
        """How many coordinates the contact forces have."""
        return int(self.by_z.shape[1])


def _point_rows(
    robot: Quadruped, dynamics: PathDynamics, standing: BoolArray, limits: ForceLimits, i: int
) -> _PointRows:
    """The limits at sample ``i``."""
    feet = np.flatnonzero(standing)
    weight = robot.mass * GRAVITY
    terms = np.stack([dynamics.acceleration[i], dynamics.speed[i], dynamics.gravity[i]], axis=1)
    jacobians = dynamics.contacts.jacobians[i, feet]
    grasp = np.moveaxis(jacobians[..., :6], -1, 0).reshape(6, -1)
    left, values, right = np.linalg.svd(grasp)
    rank = int((values > RANK * values[0]).sum())
    wrench = terms[:6] / weight
    plain = right[:rank].T @ ((left[:, :rank].T @ wrench) / values[:rank, None])
    basis = right[rank:].T
    normals = dynamics.contacts.normals[i, feet]
    pyramids = pyramid_rows(limits, normals)
    blocks, forces = basis.reshape(len(feet), 3, -1), plain.reshape(len(feet), 3, 3)
    slip = (pyramids @ forces).reshape(-1, 3), (pyramids @ blocks).reshape(-1, basis.shape[1])
    press = np.einsum("fi,fik->fk", normals, forces), np.einsum("fi,fid->fd", normals, blocks)
    least = limits.least_normal_shares(standing)[feet]
    largest = limits.torque_share * effort_limits(robot).limits
    known = np.isfinite(largest)
    levers = jacobians[..., 6:].reshape(-1, len(largest))[:, known]
    share = weight / largest[known]
    torque = terms[6:][known] / largest[known, None] - share[:, None] * (levers.T @ plain)
    turning = -share[:, None] * (levers.T @ basis)
    by_terms = np.concatenate([slip[0], press[0], torque, -torque])
    floor = np.concatenate([np.zeros(len(slip[0])), least, -np.ones(2 * len(torque))])
    return _PointRows(
        by_terms[:, 0], by_terms[:, 1], np.concatenate([slip[1], press[1], turning, -turning]),
        floor - by_terms[:, 2], wrench,
    )  # fmt: skip
