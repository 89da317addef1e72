"""Checks of balance: static margins of the body's centre and of the true centre of mass."""

from __future__ import annotations

import numpy as np

from gaitopt.certificate.check import SHORT, Check, judged, phase_name, unchecked
from gaitopt.certificate.polygons import Polygons
from gaitopt.certificate.trace import Motion
from gaitopt.certificate.zero_moment import zmp_of_centre
from gaitopt.conventions import BoolArray, FloatArray
from gaitopt.plan.plan import Plan

ZMP_SLACK = 1e-5
"""How far the ZMP's margin may fall short of one that was found at samples [m]: on 400
random gaits (benchmarks/planning/certify.py) no more was lost between the samples."""
VELOCITY_JUMP = 1e-6
"""Largest jump of the base's velocity that counts as rounding [m/s, rad/s]. The rate on a piece of
1 ms is known to about 1e-10."""
DYNAMIC = "a dynamic walk promises no static margin: see its ZMP"
TRUE_COM = "the margin is promised of the true COM"
ENTRY = "a plan that only enters from a state promises contact forces alone"


def margin_of_cog(plan: Plan, motion: Motion) -> Check:
    """While a foot flies, the body centre keeps the stability margin that was asked for."""
    if not plan.settings.static:
        return unchecked("margin of the body centre", "m", DYNAMIC, needed=False)
    if plan.settings.true_com:
        return unchecked("margin of the body centre", "m", TRUE_COM, needed=False)
    margins = _margins(motion, motion.cog, motion.cog_deviation, -np.inf)
    flying = np.asarray(~motion.standing.all(axis=1))
    short = np.where(flying, margins - plan.settings.stability_margin, margins)
    walks = _after_entry(plan, motion)
    if not walks.any():
        return unchecked("margin of the body centre", "m", ENTRY, needed=False)
    piece = int(np.where(walks, short, np.inf).argmin())
    asked = plan.settings.stability_margin if flying[piece] else 0.0
    return judged("margin of the body centre", float(margins[piece]), asked - SHORT, "m", ">=",
                   bound=motion.cog_deviation[piece], when=motion.pieces.starts[piece],
                   where=phase_name(plan, int(motion.phase[piece])))  # fmt: skip


def margin_of_com(plan: Plan, motion: Motion) -> Check:
    """The model's true centre of mass never leaves the support polygon.

    Where the plan promises its stability margin of the true centre of mass, that is kept, too, at
    every instant after the first stance phase, which begins wherever the robot stands. While the
    robot enters from a given state contact forces are what is promised, and no margin.
    """
    if not plan.settings.static:
        return unchecked("margin of the true COM", "m", DYNAMIC, needed=False)
    if not plan.robot.mass > 0.0:
        return unchecked("margin of the true COM", "m", f"{plan.robot.name} has no mass")
    margins = _margins(motion, motion.com, motion.com_deviation, -np.inf)
    promised = plan.settings.stability_margin - SHORT if plan.settings.true_com else 0.0
    asked = np.where(motion.phase > plan.entry, promised, 0.0)
    walks = _after_entry(plan, motion)
    if not walks.any():
        return unchecked("margin of the true COM", "m", ENTRY, needed=False)
    piece = int(np.where(walks, margins - asked, np.inf).argmin())
    return judged("margin of the true COM", float(margins[piece]), float(asked[piece]), "m", ">=",
                   bound=motion.com_deviation[piece], when=motion.pieces.starts[piece],
                   where=phase_name(plan, int(motion.phase[piece])))  # fmt: skip


def zmp(plan: Plan, motion: Motion) -> Check | None:
    """The ZMP of a point mass at the body's centre keeps its margin while any foot stands.

    The margin is the one that the settings ask for, or else the one in the plan's record. Where
    the settings ask for one, the ZMP stays inside the support, without a margin, in the first
    stance phase, which begins wherever the robot stands. Where the base's velocity jumps, or the
    load on the ground may vanish, the margin counts as minus infinity. ``None`` where there is no
    margin to check, or where contact forces are promised instead. See
    :mod:`gaitopt.certificate.zero_moment`.
    """
    name = "ZMP of the body centre"
    promised = plan.settings.zmp_margin
    if promised is None and plan.settings.promised_forces:
        # Contact forces are what is promised, and the ZMP follows from them.
        return None
    claimed = plan.record.zmp_margin if promised is None else promised
    if not isinstance(claimed, float) or not np.isfinite(claimed):
        if plan.settings.static:
            return None
        return unchecked(name, "m", "the plan's record holds no zmp_margin")
    points, deviations = zmp_of_centre(plan, motion)
    margins = _margins(motion, points, deviations, np.inf)
    jumps = plan.path.jumps(1)[:, :6].max(axis=1, initial=0.0)
    # A velocity that jumps asks for an infinite acceleration, and so for a ZMP infinitely far away.
    jumping = plan.path.times[1:-1][jumps > VELOCITY_JUMP]
    margins[np.isin(motion.pieces.starts, jumping)] = -np.inf
    slack = ZMP_SLACK if promised is None else SHORT
    asked = np.where((motion.phase > plan.entry) | (promised is None), claimed - slack, 0.0)
    piece = int((margins - asked).argmin())
    return judged(name, float(margins[piece]), float(asked[piece]), "m", ">=",
                  bound=deviations[piece], when=motion.pieces.starts[piece],
                  where=phase_name(plan, int(motion.phase[piece])))  # fmt: skip


def _after_entry(plan: Plan, motion: Motion) -> BoolArray:
    """Pieces on which a static margin is promised ``(P,)``.

    A plan that promises no forces promises it from its first instant on.
    """
    if plan.settings.promised_forces is None:
        return np.ones(len(motion.phase), dtype=np.bool_)
    return np.asarray(motion.phase >= plan.entry)


def _margins(
    motion: Motion, points: FloatArray, deviations: FloatArray, in_flight: float
) -> FloatArray:
    """Lower bound ``(P,)`` of the margin of a moving point on every piece [m].

    The support polygon of a phase is that of the feet at its start, and what feet move afterwards
    is taken off the margin. The signed distance from a convex polygon is a convex function along
    a chord, so it is largest at one of the chord's ends.

    Args:
        motion: the motion.
        points: the point at both ends of every piece ``(2, P, 2)`` or ``(2, P, 3)`` [m].
        deviations: how far it leaves its chord ``(P,)`` [m].
        in_flight: the margin where no foot stands [m].
    """
    _, first, owner = np.unique(motion.phase, return_index=True, return_inverse=True)
    feet, standing = motion.feet[0, first][..., :2], motion.standing[first]
    stands = standing.any(axis=1)
    moved = np.linalg.norm(motion.feet[..., :2] - feet[owner], axis=-1).max(axis=0)
    most = np.zeros(len(first))
    np.maximum.at(most, owner, np.where(motion.standing, moved, 0.0).max(axis=1))
    shift = most[owner] + np.where(motion.standing, motion.feet_deviation, 0.0).max(axis=1)
    on_ground = np.flatnonzero(np.asarray(stands)[owner])
    outside = Polygons.of(feet, standing).outside(points[:, on_ground, :2], owner[on_ground])
    out = np.full(len(deviations), in_flight)
    out[on_ground] = -outside.max(axis=0) - deviations[on_ground] - shift[on_ground]
    return out
