"""How one leg of a robot that lies on its trunk puts its foot on the ground.

Places of the foot are tried, the nearest to the usual one first, and at each place orders in which
the joints of the leg turn, until the links stay above the ground and apart from one another.
"""

from __future__ import annotations

from itertools import combinations, pairwise, permutations
from typing import NamedTuple

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.plan.state import State
from gaitopt.robots.at_many_poses.outlines import Outline, lowest_points
from gaitopt.robots.collisions.pairs import TOUCHING, CollisionPairs
from gaitopt.robots.quadruped import Quadruped
from gaitopt.robots.rotations import rpy_to_matrix
from gaitopt.robots.standing import foot_below_hip

INTO = 3e-3
"""How far links may be below the ground on the way [m]: collision shapes are inexact by that."""
CELL, CELLS = 0.03, 20
"""Distance between places of a foot that are tried, and how many to each side of where it stands
usually, as shares of the leg's reach."""
TRIED = 40
"""Most places of each foot that are looked at, the nearest to the usual one first."""
INSIDE = 2e-3
"""How far inside its limits every joint is in the end [rad]."""
BETWEEN = 10
"""Postures of each motion that are looked at, its begin counted."""


def put_down(
    robot: Quadruped, state: State, joints: FloatArray, leg: str, ground: float,
    limbs: list[Outline],
) -> list[FloatArray] | str:  # fmt: skip
    """Postures of all joints on the way to where a leg's foot is down ``(nj,)`` [rad]; or why not.

    Args:
        robot, state: the robot, with its trunk where it stays.
        joints: angles of all joints now ``(nj,)`` [rad].
        leg: which one.
        ground: height of the ground [m].
        limbs: shapes of the legs.
    """
    own, part = list(robot.leg_columns[leg]), robot.legs[leg]
    low, high = (limit[own] for limit in robot.position_limits)
    axes = rpy_to_matrix(state.columns[3:6])
    usual = state.q[:3] + axes @ robot.body_axes @ foot_below_hip(part, robot.standing_height)
    steps = np.arange(-CELLS, CELLS + 1) * CELL * part.reach
    places = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
    places = places[np.argsort(np.linalg.norm(places, axis=1), kind="stable")]
    points = np.column_stack([usual[:2] + places, np.full(len(places), ground)])
    points[:, 2] += robot.foot_radius
    local = (points - state.q[:3]) @ axes @ robot.body_axes
    reached = np.asarray(part.shortfall(local)) <= 0.0
    angles = part.inverse(local[reached])
    within = ((angles >= low + INSIDE) & (angles <= high - INSIDE)).all(axis=1)
    mine = [shape for shape in limbs if _on_leg(robot, shape.joint, leg)]
    clear = _Clear(robot, state, mine, ground)
    for found in angles[within][:TRIED]:
        way = _clear_way(clear, joints, own, found)
        if way is not None:
            return way
    if within.any():
        return "links of the leg touch the ground or others on every way that was tried"
    return (
        f"{int(reached.sum())} of {len(places)} places are within its reach, and none of them "
        "within the limits of its joints"
    )


def _on_leg(robot: Quadruped, joint: int, leg: str) -> bool:
    """Whether a joint is one of a leg, or moved by one."""
    model = robot.model
    own = {int(model.getJointId(name)) for name in robot.legs[leg].joints}
    while joint > 1 and joint not in own:
        joint = int(model.parents[joint])
    return joint > 1


class _Clear(NamedTuple):
    """Whether links of a leg are above the ground and apart from others.

    Attributes:
        robot, state: the robot, with its trunk where it stays.
        limbs: shapes of the leg.
        ground: height of the ground [m].
    """

    robot: Quadruped
    state: State
    limbs: list[Outline]
    ground: float

    def lowest(self, joints: FloatArray) -> float:
        """How low the leg's links are with some angles of all joints ``(nj,)`` [m]."""
        q = np.append(self.state.q[:7], joints)
        points = lowest_points(self.robot, self.limbs, q)
        return min((float(each[:, 2].min()) for each in points), default=np.inf)

    def apart(self, joints: list[FloatArray]) -> bool:
        """Whether all links are apart with some angles of all joints."""
        pairs = CollisionPairs.of(self.robot)
        return pairs is None or bool(
            (pairs.distances(np.array(joints)[:, pairs.columns]) >= TOUCHING).all()
        )


def _clear_way(
    clear: _Clear, joints: FloatArray, own: list[int], angles: FloatArray
) -> list[FloatArray] | None:
    """Postures of all joints between which a leg's links stay clear ``(nj,)`` [rad].

    ``None`` where there are none: its joints turn all at once, or one after another.

    Args:
        clear: tells of postures.
        joints: angles of all joints now ``(nj,)`` [rad].
        own: columns of the leg's joints.
        angles: of these in the end ``(n,)`` [rad].
    """
    # Where links lie on the ground they may stay as low.
    allowed = min(clear.ground, clear.lowest(joints)) - INTO
    end = np.array(joints)
    end[own] = angles
    if clear.lowest(end) < allowed or not clear.apart([end]):
        return None
    shares = np.linspace(0.0, 1.0, BETWEEN)[1:]
    for groups in _orders(len(own)):
        way = [joints]
        for group in groups:
            columns = [own[k] for k in group]
            way.append(np.where(np.isin(np.arange(len(joints)), columns), end, way[-1]))
        between = [a + share * (b - a) for a, b in pairwise(way) for share in shares]
        if all(clear.lowest(each) >= allowed for each in between) and clear.apart(between):
            return way[1:]
    return None


def _orders(count: int) -> list[tuple[tuple[int, ...], ...]]:
    """Ways in which a leg's joints turn: groups that turn at once, one group after another."""
    joints = tuple(range(count))
    split = [
        (group, tuple(j for j in joints if j not in group))
        for size in range(1, count)
        for group in combinations(joints, size)
    ]
    single = [tuple((j,) for j in order) for order in permutations(joints)]
    return [(joints,), *split, *single]
