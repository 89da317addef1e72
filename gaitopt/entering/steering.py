"""Entries whose body is steered, so that the ZMP of the whole robot stays where the feet stand.

Where a body cannot simply brake along its velocity, as on two feet of a trot, x and y of its base
are found. Their accelerations are linear between knots. The ZMP of the whole robot, with all links'
momentum, is to lie on the line between two standing feet, or inside the polygon of three or four.
Each round computes it for the path so far, and a quadratic program corrects the path by what a
point mass on the ground would change; the rest is seen in the next round.

Source: [Kajita2003] corrects a path of a point mass in this way by the dynamics of all links.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from gaitopt.conventions import GRAVITY, LEGS, BoolArray, FloatArray
from gaitopt.dynamics.whole_body import motion_of_path
from gaitopt.entering.accelerations import SHARES, Accelerations
from gaitopt.entering.begin import Begin
from gaitopt.entering.braking import Braking, Entry
from gaitopt.entering.flights import Flight, landings
from gaitopt.entering.judging import Judge
from gaitopt.errors import GaitoptError
from gaitopt.motion.body_and_feet import path_states
from gaitopt.motion.pieces import States, piece_values
from gaitopt.optimize.sparse_quadratic import solve_sparse
from gaitopt.stability.support import support_half_planes
from gaitopt.stability.zmp import whole_body_zmp

ROUNDS = 8
"""Most corrections. Usual are three to five."""
CLOSE = 2e-5
"""How far from the line between two feet the ZMP may be at the knots [m]: a tenth of what the usual
tolerance of the balance allows."""
MARGINS = (0.12, 0.3)
"""Margins of the ZMP that are wished for inside the feet, as shares of the stance's shorter side.
With the larger one a foot that hardly carries anything at the begin is loaded sooner, so that it
has friction; with the smaller one the body is accelerated less."""
WISH = 30.0
"""Weight of this wish against the mean squared acceleration, by that of 1 m/s^2."""
BRAKE_TIMES = (1.0, 2.0, 0.5, 4.0, 8.0)
"""Times from the last landing to rest that are tried, in units of that of a pendulum of the body's
height."""
MOST_MISSING = 2
"""After so many of them without a path the way in which feet land is given up."""
MOST_LANDINGS = 24
"""Most ways in which feet land that are tried, the quickest ones that joints allow."""


@dataclass(frozen=True, eq=False)
class Steered:
    """A body whose x and y are given by accelerations that are linear between knots.

    Attributes:
        others: how z, roll, pitch and yaw come to rest.
        edges_: knots ``(K + 1,)`` [s].
        coefficients: of x and y between them, highest power first ``(4, K, 2)``.
    """

    others: Braking
    knots: FloatArray
    coefficients: FloatArray

    @property
    def duration(self) -> float:
        """When it is at rest [s]."""
        return float(self.knots[-1])

    @property
    def edges(self) -> list[float]:
        """Times between which it is one polynomial [s]."""
        return [float(knot) for knot in self.knots]

    def at(self, times: FloatArray) -> States:
        """Columns of the base ``(N, 6)`` and two derivatives."""
        inside = np.clip(times, 0.0, self.duration)
        piece = np.clip(np.searchsorted(self.knots, inside, side="right") - 1, 0,
                        len(self.knots) - 2)  # fmt: skip
        out = [np.array(part) for part in self.others.at(times)]
        for order, part in enumerate(out):
            part[:, :2] = piece_values(self.coefficients, inside - self.knots[piece], piece, order)
        return out[0], out[1], out[2]


def steered_entries(
    begin: Begin, judge: Judge, swing_height: float, margin: float
) -> Iterator[Iterator[Entry]]:
    """Entries with a steered body; those with the quickest landings first, and each way to land.

    Args:
        begin: the state.
        judge: knows joint limits.
        swing_height: how far feet may rise on their way down [m].
        margin: of the ZMP that is wished for, one of :data:`MARGINS`.
    """
    if begin.standing.sum() < 2:
        return
    height = float(begin.base[0, 2] - begin.feet[0, begin.standing, 2].mean())
    if not height > 0.0:
        return
    pendulum = float(np.sqrt(height / GRAVITY))
    ways = sorted(landings(begin, swing_height), key=_landing)
    goes_on = [Entry(begin, Braking(begin.base, 1.0, 2, _landing(down)), down) for down in ways]
    allowed = judge.fast_enough(goes_on)[:MOST_LANDINGS] if begin.flying else goes_on
    for entry in allowed:
        yield _with_bodies(begin, entry.down, pendulum, height, margin)


def _with_bodies(
    begin: Begin, down: tuple[Flight, ...], pendulum: float, height: float, margin: float
) -> Iterator[Entry]:
    """Entries in which feet land in one way, with the body at rest sooner or later.

    Args:
        begin, down: the state, and the flights.
        pendulum: time unit of a pendulum of the body's height [s].
        height: of the body above the feet [m].
        margin: of the ZMP that is wished for, as a share of the stance's shorter side.
    """
    missing = 0
    for share in BRAKE_TIMES:
        body = steered(begin, down, share * pendulum, height, margin)
        if body is not None:
            yield Entry(begin, body, down)
            continue
        missing += 1
        if missing == MOST_MISSING:
            break


def _landing(down: tuple[Flight, ...]) -> float:
    """When the last foot lands [s]."""
    return max((flight.duration for flight in down), default=0.0)


def steered(
    begin: Begin, down: tuple[Flight, ...], brake: float, height: float, margin: float
) -> Steered | None:
    """The body with its ZMP where feet stand; ``None`` where there is no such path.

    Args:
        begin: the state.
        down: flights of the feet in the air.
        brake: time from the last landing to rest [s].
        height: of the body above the feet [m].
        margin: of the ZMP that is wished for, as a share of the stance's shorter side.
    """
    # Accelerations jump where feet land, and where the polynomials of flights meet.
    edges = [0.0, *(edge for flight in down for edge in flight.edges), _landing(down) + brake]
    phases = np.unique(np.round(edges, 12))
    table = Accelerations.of(phases)
    others = Braking(begin.base, float(phases[-1]), 2)
    rows = _rows(begin, down, table)
    solution = np.zeros((table.size, 2))
    worst = np.inf
    for _ in range(ROUNDS):
        body = Steered(others, table.knots, table.coefficients(begin.base[:, :2], solution))
        zmp = _zmp(Entry(begin, body, down), table.times)
        if zmp is None:
            return None
        off = float(np.abs(rows.on_line(zmp)).max(initial=0.0))
        if off <= CLOSE and np.isfinite(worst):
            return body
        if not off < worst and np.isfinite(worst):
            return None
        worst = max(off, CLOSE) if np.isfinite(worst) else 1e3
        step = _corrected(begin, table, rows, zmp, solution, height, margin)
        if step is None:
            return None
        solution = step
    return None


def _zmp(entry: Entry, times: FloatArray) -> FloatArray | None:
    """ZMP of the whole robot on the ground ``(N, 2)`` [m]; ``None`` where legs do not reach."""
    robot = entry.begin.robot
    try:
        values = path_states(robot, entry.body.at(times), entry.feet(times))
    except GaitoptError:
        return None
    stands = entry.begin.feet[0, entry.begin.standing, 2].mean() - robot.foot_radius
    found = whole_body_zmp(robot.model, *motion_of_path(robot, *values), float(stands))
    return found if np.isfinite(found).all() else None


@dataclass(frozen=True, eq=False)
class _Rows:
    """Where the ZMP is to be at the instants.

    Attributes:
        samples: the instant of each row ``(R,)``.
        normals: ``(R, 2)``; ``normals . zmp - offsets`` is to be 0, or at least the margin.
        offsets: ``(R,)`` [m].
        equal: rows that are to be 0 ``(R,)``.
    """

    samples: np.ndarray
    normals: FloatArray
    offsets: FloatArray
    equal: BoolArray

    def on_line(self, zmp: FloatArray) -> FloatArray:
        """Distances from lines between two feet ``(E,)`` [m]."""
        value = (self.normals * zmp[self.samples]).sum(axis=1) - self.offsets
        return np.asarray(value[self.equal])


def _rows(begin: Begin, down: tuple[Flight, ...], table: Accelerations) -> _Rows:
    """The rows of all instants."""
    goals = np.array([begin.footholds[leg][0] for leg in LEGS])[:, :2]
    samples, normals, offsets, equal = [], [], [], []
    for phase in range(int(table.phase.max()) + 1):
        own = np.flatnonzero(table.phase == phase)
        standing = np.array(begin.standing)
        for flight in down:
            standing[flight.leg] = flight.duration < table.times[own[0]]
        for normal, offset, on in zip(*_sides(goals[standing]), strict=True):
            # As many equations as a phase has accelerations: at each knot one.
            at = np.append(own[:: len(SHARES)], own[-1]) if on else own
            samples.append(at)
            normals.append(np.tile(normal, (len(at), 1)))
            offsets.append(np.full(len(at), offset))
            equal.append(np.full(len(at), on))
    return _Rows(
        np.concatenate(samples), np.concatenate(normals), np.concatenate(offsets),
        np.concatenate(equal),
    )  # fmt: skip


def _sides(feet: FloatArray) -> tuple[FloatArray, FloatArray, BoolArray]:
    """Normals, offsets, and whether it is an equation, of the support of two feet or more."""
    if len(feet) > 2:
        planes = support_half_planes(feet)
        return planes.normals, planes.offsets, np.zeros(len(planes.offsets), dtype=np.bool_)
    unit = (feet[1] - feet[0]) / np.linalg.norm(feet[1] - feet[0])
    across = np.array([-unit[1], unit[0]])
    normals = np.array([across, unit, -unit])
    offsets = np.array([across @ feet[0], unit @ feet[0], -unit @ feet[1]])
    return normals, offsets, np.array([True, False, False])


def _corrected(
    begin: Begin,
    table: Accelerations,
    rows: _Rows,
    zmp: FloatArray,
    now: FloatArray,
    height: float,
    margin: float,
) -> FloatArray | None:
    """Accelerations ``(n, 2)`` with which a point mass would mend what the ZMP misses.

    Args:
        begin, table, rows: of the entry.
        zmp: of the whole robot with the accelerations of now ``(N, 2)`` [m].
        now: these ``(n, 2)``.
        height: of the body [m].
        margin: of the ZMP that is wished for, as a share of the stance's shorter side.
    """
    from scipy.sparse import block_diag, csr_array, hstack, vstack

    n = table.size
    # A point mass: the ZMP is its place less height / g times its acceleration.
    moves = table.place - height / GRAVITY * table.acceleration
    inside = rows.normals[:, :1] * moves[rows.samples], rows.normals[:, 1:] * moves[rows.samples]
    wanted = np.where(rows.equal, 0.0, -1.0)[:, None]
    matrix = np.concatenate([*inside, wanted], axis=1)
    gap = (rows.normals * zmp[rows.samples]).sum(axis=1) - rows.offsets
    known = (np.concatenate(inside, axis=1) @ now.T.ravel()) - gap
    low, high = known, np.where(rows.equal, known, np.inf)
    stop = block_diag([table.stop, table.stop])
    ends = np.array([[-rate, 0.0] for rate in begin.base[1, :2]]).ravel()
    target = margin * min(begin.robot.stance_size)
    whole = vstack([
        csr_array(matrix), hstack([stop, csr_array((4, 1))]),
        csr_array(([1.0], ([0], [2 * n])), shape=(1, 2 * n + 1)),
    ])  # fmt: skip
    weight = table.acceleration.T @ table.acceleration / len(table.times) + 1e-6 * np.eye(n)
    hessian = block_diag([weight, weight, csr_array(np.array([[WISH / target**2]]))])
    gradient = np.append(np.zeros(2 * n), -WISH / target)
    found, good = solve_sparse(
        csr_array(hessian), gradient, whole,
        np.concatenate([low, ends, [0.0]]), np.concatenate([high, ends, [target]]),
        refinement=True,
    )  # fmt: skip
    if not good or not np.isfinite(found).all():
        return None
    return np.asarray(found[: 2 * n].reshape(2, n).T)
