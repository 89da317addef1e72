"""Checks of balance: static margins of the body's centre and of the true centre of mass."""

from __future__ import annotations

import numpy as np

from gaitopt.certificate.check import SHORT, Check, judged, phase_name, unchecked
from gaitopt.certificate.supports.margins import margins
from gaitopt.certificate.supports.zero_moment import ground_below, traced_zmp
from gaitopt.certificate.trace import Motion
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
    flying = np.asarray(~motion.standing.all(axis=1))
    asked = np.where(flying, plan.settings.stability_margin, 0.0) - SHORT
    walks = _after_entry(plan, motion)
    if not walks.any():
        return unchecked("margin of the body centre", "m", ENTRY, needed=False)
    found = margins(plan, motion, _cog, np.where(walks, asked, -np.inf), -np.inf)
    piece = int(np.where(walks, found - asked, np.inf).argmin())
    return judged("margin of the body centre", float(found[piece]), float(asked[piece]), "m", ">=",
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
    promised = plan.settings.stability_margin - SHORT if plan.settings.true_com else 0.0
    asked = np.where(motion.phase > plan.entry, promised, 0.0)
    walks = _after_entry(plan, motion)
    if not walks.any():
        return unchecked("margin of the true COM", "m", ENTRY, needed=False)
    found = margins(plan, motion, _com, np.where(walks, asked, -np.inf), -np.inf)
    piece = int(np.where(walks, found - asked, np.inf).argmin())
    return judged("margin of the true COM", float(found[piece]), float(asked[piece]), "m", ">=",
                   bound=motion.com_deviation[piece], when=motion.pieces.starts[piece],
                   where=phase_name(plan, int(motion.phase[piece])))  # fmt: skip


def zmp(plan: Plan, motion: Motion) -> Check | None:
    """The ZMP of a point mass at the body's centre keeps its margin while any foot stands.

    The margin is the one that the settings ask for, or else the one in the plan's record. Where
    the settings ask for one, the ZMP stays inside the support, without a margin, in the first
    stance phase, which begins wherever the robot stands. Where the base's velocity jumps, or the
    load on the ground may vanish, the margin counts as minus infinity. ``None`` where there is no
    margin to check, or where contact forces are promised instead. See
    :mod:`gaitopt.certificate.supports.zero_moment`.
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
    slack = ZMP_SLACK if promised is None else SHORT
    asked = np.where((motion.phase > plan.entry) | (promised is None), claimed - slack, 0.0)
    arm, ground = plan.robot.body_axes @ plan.robot.centre, ground_below(plan, motion)
    found = margins(plan, motion, lambda m, owner: traced_zmp(m.pieces, arm, ground[owner]),
                    asked, np.inf)  # fmt: skip
    jumps = plan.path.jumps(1)[:, :6].max(axis=1, initial=0.0)
    # A velocity that jumps asks for an infinite acceleration, and so for a ZMP infinitely far away.
    jumping = plan.path.times[1:-1][jumps > VELOCITY_JUMP]
    found[np.isin(motion.pieces.starts, jumping)] = -np.inf
    piece = int((found - asked).argmin())
    return judged(name, float(found[piece]), float(asked[piece]), "m", ">=",
                  when=motion.pieces.starts[piece],
                  where=phase_name(plan, int(motion.phase[piece])))  # fmt: skip


def _after_entry(plan: Plan, motion: Motion) -> BoolArray:
    """Pieces on which a static margin is promised ``(P,)``.

    A plan that promises no forces promises it from its first instant on.
    """
    if plan.settings.promised_forces is None:
        return np.ones(len(motion.phase), dtype=np.bool_)
    return np.asarray(motion.phase >= plan.entry)


def _cog(motion: Motion, _owner: np.ndarray) -> tuple[FloatArray, FloatArray]:
    """The body centre, and how far it leaves its chords."""
    return motion.cog, motion.cog_deviation


def _com(motion: Motion, _owner: np.ndarray) -> tuple[FloatArray, FloatArray]:
    """The true centre of mass, and how far it leaves its chords."""
    return motion.com, motion.com_deviation
