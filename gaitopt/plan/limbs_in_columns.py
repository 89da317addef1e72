"""Limbs of a planned walk that go into columns, found when the walk is planned.

The certificate proves that all links are clear of all columns, at every instant
(:mod:`gaitopt.certificate.ground.limbs`). Planners ask the same question here, of the same parts of
the links, with code of their own: boxes around the parts settle most of a walk, and where they do
not, a part that is ``d`` away from a column is looked at again when it has moved by ``d``.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple
from weakref import finalize

import numpy as np

from gaitopt.conventions import LEGS, FloatArray, frozen
from gaitopt.plan.columns import Columns, stands_on_columns
from gaitopt.plan.plan import Plan
from gaitopt.robots.at_many_poses.chain import product, turned
from gaitopt.robots.collisions.limb_parts import LimbParts, Solid, limb_parts
from gaitopt.robots.rotations import rpy_to_matrix

LEAST_GAP = 3e-4
"""Distance from a column below which a part counts as within it [m]. The certificate asks for 0.01
mm. Chosen: parts are looked at again after they have moved by this at least, so that nothing is
missed between."""
STEP = 8e-3
"""About how far a foot moves between the instants at which boxes are looked at [m]."""
NEAR = 8e-3
"""Room between the box of a part and the columns below it from which on it is clear [m]: boxes move
by less until the next instant."""
LEVEL = 1e-3
"""Columns whose tops differ by less are level [m]. Feet of a walk are nowhere lower then, and a few
instants of each phase are enough."""
LEVEL_ROOM = 2e-3
"""Room over level columns that is enough at these instants [m]."""
MOST_COLUMNS = 16
"""Most columns whose distance from a part is computed at an instant; parts are near two or three of
them."""


class LimbInColumn(NamedTuple):
    """A part of a link that is within a column.

    Attributes:
        leg: whose link it is; ``""`` for the trunk.
        link: ``"hip"``, ``"thigh"``, ``"shank"`` or ``"trunk"``.
        column: leg whose foothold the column is.
        place: x and y of the column's middle ``(2,)`` [m].
        time: of the plan [s].
        step: in which it is.
        gap: distance from the column, negative within it [m].
    """

    leg: str
    link: str
    column: str
    place: FloatArray
    time: float
    step: int
    gap: float

    def in_words(self) -> str:
        """What is in the way, and what helps."""
        x, y = np.round(self.place, 3).tolist()
        part = f"the {self.link} of {self.leg}" if self.leg else f"the {self.link}"
        how, verdict = f"comes within {1e3 * self.gap:.1f} mm of", "may"
        if self.gap < 0.0:
            how, verdict = f"goes {-1e3 * self.gap:.1f} mm into", "will"
        return (
            f"step {self.step}: {part} {how} a column of {self.column}, at x = {x:g} m, y = {y:g} "
            f"m and {self.time:.1f} s after the start, and the certificate {verdict} call the plan "
            "violated; what helps: another body_height, a higher swing_height, moving one of the "
            "footholds, or thinner columns (radius)"
        )


def limb_in_column(plan: Plan) -> LimbInColumn | None:
    """The part of a link that is deepest within a column of a plan; ``None`` without one.

    A robot that lies at the begin may touch columns until it has entered the walk. Answers are kept
    for as long as their plans are.

    Args:
        plan: any. Without columns, or where nobody knows where legs end, nothing is found.
    """
    key = id(plan)
    if key not in _KNOWN:
        _KNOWN[key] = _found(plan)
        finalize(plan, _KNOWN.pop, key, None).atexit = False
    return _KNOWN[key]


_KNOWN: dict[int, LimbInColumn | None] = {}
"""By identity: two plans are compared number by number, which takes longer than to look again."""


def _found(plan: Plan) -> LimbInColumn | None:
    """What :func:`limb_in_column` finds."""
    if not stands_on_columns(plan) or not plan.phases:
        return None
    parts = limb_parts(plan.robot)
    if parts is None:
        return None
    columns = Columns.of(plan)
    if columns.spread < LEVEL:
        enough = float(columns.tops[:, 2].max()) + LEVEL_ROOM
        if parts.lowest(plan.path.evaluate(_few_times(plan)), enough) >= enough:
            return None
    return _Look.of(plan, parts, columns).deepest(_times(plan, STEP))


def _few_times(plan: Plan) -> FloatArray:
    """Both ends and the middle of each phase after the entry, and the plan's end ``(N,)`` [s]."""
    ends = np.array([[p.start, (p.start + p.end) / 2.0, p.end] for p in plan.phases])
    # Not by np.unique, which loads masked arrays: a first plan takes as long as its imports.
    return np.array(sorted({plan.path.duration, *ends[plan.entry :].ravel().tolist()}))


def _times(plan: Plan, step: float) -> FloatArray:
    """Instants between which no foot moves by much more than a step ``(N,)`` [s].

    Args:
        plan: the plan.
        step: in metres.
    """
    path, robot = plan.path, plan.robot
    change = np.abs(np.diff(path.knots(), axis=0))
    reach = max(leg.reach for leg in robot.legs.values())
    turned = np.stack([change[:, 6:][:, list(robot.leg_columns[leg])].sum(axis=1) for leg in LEGS])
    moved = change[:, :3].sum(axis=1) + reach * (change[:, 3:6].sum(axis=1) + turned.max(axis=0))
    way = np.concatenate([[0.0], np.cumsum(moved)])
    begin = plan.phases[plan.entry - 1].end if plan.entry else 0.0
    ways = np.arange(0.0, way[-1] + step, step)
    # Where nothing moves several knots have one way: any of them will do.
    times = np.interp(ways, way, path.times)
    return np.unique(np.concatenate([[begin], times[times > begin], [path.duration]]))


@dataclass(frozen=True, eq=False)
class _Look:
    """A look at the parts of a robot along a plan.

    Attributes:
        plan: the plan.
        parts: of the robot.
        columns: of the plan.
        column: coal's shape of one.
        depth: of this shape [m]: more than any part is long.
        data: Pinocchio's.
    """

    plan: Plan
    parts: LimbParts
    columns: Columns
    column: Any
    depth: float
    data: Any

    @classmethod
    def of(cls, plan: Plan, parts: LimbParts, columns: Columns) -> _Look:
        """A look at a plan over columns."""
        from pinocchio import coal

        depth = 2.0 * max(leg.reach for leg in plan.robot.legs.values())
        column = coal.Cylinder(plan.footholds.landing_radius, depth)
        data = plan.robot.model.createData()
        return cls(plan, parts, columns, column, depth, data)

    def _low(self, times: FloatArray) -> Iterator[tuple[int, Solid, FloatArray, FloatArray]]:
        """Parts whose joints come near the tops of the columns.

        Args:
            times: ``(N,)`` [s].

        Yields:
            Number of the part, the part, rotations ``(3, 3, N)`` and places ``(3, N)`` [m] of its
            joint.
        """
        values = self.plan.path.evaluate(times)
        base = np.moveaxis(rpy_to_matrix(values[:, 3:6]), 0, 2)
        turns, places = self.parts.chain.rows_of_places(values[:, 6:])
        place = values[:, :3].T
        top = float(self.columns.tops[:, 2].max())
        at: dict[int, tuple[FloatArray, FloatArray, float]] = {}
        for number, (part, end) in enumerate(zip(self.parts.solids, self.parts.ends, strict=True)):
            if part.joint not in at:
                own = turns[:, :, part.joint]
                turn = product(base, own)
                origin = place + turned(base, places[:, part.joint])
                at[part.joint] = turn, origin, float(origin[2].min())
            turn, origin, least = at[part.joint]
            if least - end < top + NEAR:
                yield number, part, turn, origin

    def deepest(self, times: FloatArray) -> LimbInColumn | None:
        """The part that is deepest within a column; ``None`` without one.

        Args:
            times: at which boxes around the parts are looked at ``(N,)`` [s].
        """
        worst: LimbInColumn | None = None
        top = float(self.columns.tops[:, 2].max())
        for number, part, turn, origin in self._low(times):
            bottoms = _bottoms(part, turn, origin)
            low = np.flatnonzero(bottoms < top + NEAR)
            if not len(low):
                continue
            corners = origin[:, None] + np.einsum("ijn,kj->ikn", turn, part.corners)
            below = self.columns.highest(*_sides(corners[:2, :, low]))
            near = np.zeros(len(times), dtype=np.bool_)
            near[low] = bottoms[low] < below + NEAR
            for first, last in _runs(near):
                here = slice(max(first - 1, 0), last + 1)
                found = self._follow(part, times[here], corners[..., here])
                if found is not None and (worst is None or found.gap < worst.gap):
                    leg, link = self.parts.legs[number], self.parts.links[number]
                    worst = found._replace(leg=leg, link=link)
        return worst

    def _follow(self, part: Solid, times: FloatArray, corners: FloatArray) -> LimbInColumn | None:
        """The deepest place of a part within a column between some instants.

        Args:
            part: the part.
            times: the instants ``(n,)`` [s].
            corners: of the box around it then ``(3, 8, n)`` [m].
        """
        steps = np.sqrt(np.square(np.diff(corners, axis=2)).sum(axis=0).max(axis=0))
        ways, way, worst = np.concatenate([[0.0], np.cumsum(steps)]), 0.0, None
        while True:
            time = float(np.interp(way, ways, times))
            gap, column = self._gap(part, time)
            if gap < LEAST_GAP and (worst is None or gap < worst.gap):
                worst = LimbInColumn(
                    "", "", self.columns.owners[column], frozen(self.columns.tops[column, :2]),
                    time, self.plan.phase_at(time).step, gap,
                )  # fmt: skip
            if way >= ways[-1]:
                return worst
            way = min(way + max(abs(gap), LEAST_GAP), float(ways[-1]))

    def _gap(self, part: Solid, time: float) -> tuple[float, int]:
        """Distance of a part from the nearest column [m], and the number of this column."""
        import pinocchio as pin
        from pinocchio import coal

        values = self.plan.path.evaluate([time])[0]
        q = np.concatenate([values[:3], [0.0, 0.0, 0.0, 1.0], values[6:]])
        q[3:7] = pin.Quaternion(rpy_to_matrix(values[3:6])).coeffs()
        pin.forwardKinematics(self.plan.robot.model, self.data, q)
        joint = self.data.oMi[part.joint]
        turn, origin = joint.rotation @ part.turn, joint.act(part.origin)
        columns = self.columns
        at_least = columns.distances(origin + turn @ part.centre) - part.radius
        place, best, nearest = coal.Transform3s(turn, origin), np.inf, 0
        for k in np.argsort(at_least)[:MOST_COLUMNS].tolist():
            if at_least[k] >= best:
                break
            there = columns.tops[k] - np.array([0.0, 0.0, self.depth / 2.0])
            gap = coal.distance(
                part.shape, place, self.column, coal.Transform3s(np.eye(3), there),
                coal.DistanceRequest(), coal.DistanceResult(),
            )  # fmt: skip
            if gap < best:
                best, nearest = float(gap), k
        return best, nearest


def _bottoms(part: Solid, turn: FloatArray, origin: FloatArray) -> FloatArray:
    """Heights of the lower sides of the upright boxes around a part ``(N,)`` [m].

    Args:
        part: the part.
        turn, origin: of its joint ``(3, 3, N)`` and ``(3, N)`` [m].
    """
    up = np.tensordot(part.turn, turn[2], axes=(0, 0))
    return np.asarray(origin[2] + part.middle @ turn[2] - part.half @ np.abs(up))


def _sides(corners: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Least and largest x and y of corners ``(2, 8, N)``, each ``(2, N)`` [m]."""
    return corners.min(axis=1), corners.max(axis=1)


def _runs(chosen: np.ndarray) -> list[list[int]]:
    """First and one past the last index of each run of true values."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], chosen.astype(np.int8), [0]])))
    pairs: list[list[int]] = edges.reshape(-1, 2).tolist()
    return pairs
