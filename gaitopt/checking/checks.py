"""The checks of a certificate, one function each."""

from __future__ import annotations

from math import nan

import numpy as np
import pinocchio as pin
from scipy.spatial import ConvexHull, QhullError

from gaitopt.checking.certificate import Check
from gaitopt.checking.motion import Motion
from gaitopt.conventions import LEGS, FloatArray, frozen
from gaitopt.planning.plan import Phase, Plan

JUMP = 1e-9
"""Largest jump of body or joints at a knot [m, rad]."""
SLIP = 1e-4
"""Most that a standing foot may move [m]."""
OPEN_LANDING = 1e-3
"""How near to its foothold a foot must stand on open ground, and in height anywhere [m]."""
SINKING = 5e-4
"""Most that a flying foot may sink below the lower end of its swing [m]."""
RELATIVE = 1e-9
"""Relative excess of a joint's limits that counts as rounding."""
SHORT = 1e-6
"""Shortfall of swing height, reach and margin that counts as rounding [m]."""


def continuity(plan: Plan) -> Check:
    """Body and joints do not jump at knots."""
    path = plan.path
    powers = path.coefficients
    if powers.shape[1] < 2:
        return Check("continuity", "ok", 0.0, JUMP, "m or rad")
    end = np.zeros_like(powers[0])
    for c in powers:
        end = end * np.diff(path.times)[:, None] + c
    jumps = np.abs(powers[-1][1:] - end[:-1])
    segment, column = _place(jumps)
    return _judged("continuity", float(jumps[segment, column]), JUMP, "m or rad",
                   when=path.times[segment + 1], where=_column(plan, column))  # fmt: skip


def contact_sequence(plan: Plan) -> Check:
    """Phases follow one another, the legs step in order onto every foothold, three feet stand."""
    wrong = _sequence_faults(plan)
    return Check(
        "contact sequence", "violated" if wrong else "ok", float(len(wrong)), 0.0, "faults",
        where=wrong[0] if wrong else "",
    )  # fmt: skip


def _sequence_faults(plan: Plan) -> list[str]:
    faults = []
    expected = 0.0
    knots = plan.path.times
    for i, phase in enumerate(plan.phases):
        if abs(phase.start - expected) > 1e-9:
            faults.append(f"phase {i} starts at {phase.start:.6f} s, not at {expected:.6f} s")
        expected = phase.start + phase.duration
        if np.abs(knots - expected).min() > 1e-9:
            faults.append(f"phase {i} ends at {expected:.6f} s, where the path has no knot")
        faults += _support_faults(i, phase)
    if abs(expected - plan.path.duration) > 1e-9:
        faults.append(f"phases end at {expected:.6f} s, the path at {plan.path.duration:.6f} s")
    swings = [p.leg for p in plan.phases if p.kind == "swing"]
    order = plan.settings.sequence
    asked = [order[i % 4] for i in range(plan.footholds.steps)]
    if swings != asked:
        first = next((i for i, (a, b) in enumerate(zip(swings, asked, strict=False)) if a != b),
                     min(len(swings), len(asked)))  # fmt: skip
        faults.append(
            f"{len(swings)} swings where {len(asked)} are asked for; step {first} differs"
        )
    return faults


def _support_faults(i: int, phase: Phase) -> list[str]:
    standing = set(phase.support)
    if len(standing) < 3 or not standing <= set(LEGS):
        return [f"phase {i} stands on {len(standing)} feet"]
    if phase.kind == "swing" and phase.leg in standing:
        return [f"phase {i}: {phase.leg} stands while it swings"]
    if phase.kind == "stance" and len(standing) < 4:
        return [f"phase {i} stands on {len(standing)} feet without a swing"]
    return []


def slip(plan: Plan, motion: Motion) -> Check:
    """Standing feet do not move from where they touched down."""
    home = _expected(plan, motion)
    gaps = np.linalg.norm(motion.feet - _touchdown(motion, home), axis=3).max(axis=0)
    gaps = np.where(motion.standing, gaps + motion.feet_bulge, 0.0)
    piece, leg = _place(gaps)
    return _judged("slip of standing feet", float(gaps[piece, leg]), SLIP, "m",
                   bound=motion.feet_bulge[piece, leg], when=motion.pieces.starts[piece],
                   where=LEGS[leg])  # fmt: skip


def landings(plan: Plan, motion: Motion) -> Check:
    """Standing feet stand on their footholds: within the column, and at its height."""
    home = _expected(plan, motion)
    away = motion.feet - home
    radius = plan.footholds.radius or OPEN_LANDING
    flat = np.hypot(away[..., 0], away[..., 1]) / radius
    high = np.abs(away[..., 2]) / OPEN_LANDING
    use = np.maximum(flat, high).max(axis=0)
    use = np.where(motion.standing, use + motion.feet_bulge / min(radius, OPEN_LANDING), 0.0)
    end = np.linalg.norm(motion.feet[1, -1] - plan.footholds.array[:, -1], axis=1) / radius
    piece, leg = _place(use)
    worst, where = float(use[piece, leg]), LEGS[leg]
    if end.max() > max(worst, 1.0):
        worst, where, piece = float(end.max()), f"{LEGS[int(end.argmax())]} at the end", -1
    return _judged("feet on their footholds", worst, 1.0, "of column or 1 mm",
                   when=motion.pieces.starts[piece], where=where)  # fmt: skip


def swing_height(plan: Plan, motion: Motion) -> Check:
    """Every swing rises the swing height above the higher of its two ends."""
    shortfalls = [
        (_apex(motion, i, phase) - max(phase.foot_start[2], phase.foot_end[2])
         - plan.settings.swing_height, phase)
        for i, phase in enumerate(plan.phases) if phase.kind == "swing"
    ]  # fmt: skip
    if not shortfalls:
        return Check("swing height", "ok", 0.0, -SHORT, "m", ">=")
    least, phase = min(shortfalls, key=lambda pair: pair[0])
    return _judged("swing height", float(least), -SHORT, "m above what is asked", ">=",
                   when=phase.start, where=f"step {phase.step} ({phase.leg})")  # fmt: skip


def _apex(motion: Motion, index: int, phase: Phase) -> float:
    """Highest place seen of the phase's flying foot: a lower bound of its apex [m]."""
    mine = motion.phase == index
    heights = motion.feet[:, mine, LEGS.index(phase.leg), 2]
    return float(heights.max(initial=-np.inf))


def ground(plan: Plan, motion: Motion) -> Check:
    """Flying feet do not sink below the lower end of their swing."""
    lows = np.array([min(p.foot_start[2], p.foot_end[2]) for p in plan.phases] or [-np.inf])
    depth = lows[motion.phase][:, None] - (motion.feet[..., 2].min(axis=0) - motion.feet_bulge)
    depth = np.where(motion.standing, -np.inf, depth)
    piece, leg = _place(depth)
    worst = max(float(depth[piece, leg]), 0.0)
    return _judged("flying feet above ground", worst, SINKING, "m below",
                   bound=motion.feet_bulge[piece, leg] if worst else 0.0,
                   when=motion.pieces.starts[piece], where=LEGS[leg])  # fmt: skip


def joint_positions(plan: Plan, motion: Motion) -> Check:
    """Joints stay within their limits (exact: a polynomial lies within its Bernstein range)."""
    model = plan.robot.model
    low, high = model.lowerPositionLimit[7:], model.upperPositionLimit[7:]
    stated = low < high
    least, most = motion.pieces.enclosure()
    over = np.maximum(low - least[:, 6:], most[:, 6:] - high)
    over = np.where(stated, over, -np.inf)
    if not stated.any():
        return Check("joint positions", "ok", -np.inf, RELATIVE, "rad", note="no limits stated")
    piece, joint = _place(over)
    return _judged("joint positions", float(over[piece, joint]), RELATIVE, "rad beyond limits",
                   when=motion.pieces.starts[piece],
                   where=plan.robot.joint_names[joint])  # fmt: skip


def joint_velocities(plan: Plan, motion: Motion) -> Check:
    """Joints keep their velocity limits (exact on each piece)."""
    use = motion.pieces.largest(1)[:, 6:] / plan.robot.velocity_limits
    piece, joint = _place(use)
    return _judged("joint velocities", float(use[piece, joint]), 1.0 + RELATIVE, "of the limit",
                   when=motion.pieces.starts[piece],
                   where=plan.robot.joint_names[joint])  # fmt: skip


def reach(plan: Plan, motion: Motion) -> Check:
    """Legs are not straighter than the plan's reach fraction allows."""
    low, high = motion.pieces.enclosure()
    worst, place = -np.inf, (0, 0)
    for i, name in enumerate(LEGS):
        column = 6 + plan.robot.leg_columns[name][-1]
        a, b, c = _stretch_law(plan, name)
        greatest = _most_cosine(low[:, column], high[:, column], b, c)
        allowed = plan.settings.reach_fraction * _longest(plan, name, a, b, c)
        over = np.sqrt(np.maximum(a + greatest, 0.0)) - allowed
        if over.max() > worst:
            worst, place = float(over.max()), (int(over.argmax()), i)
    return _judged("reach", worst, SHORT, "m beyond", when=motion.pieces.starts[place[0]],
                   where=LEGS[place[1]])  # fmt: skip


def _stretch_law(plan: Plan, leg: str) -> tuple[float, float, float]:
    """``a, b, c`` of ``stretch**2 = a + b cos q + c sin q`` over the knee's angle, by Pinocchio.

    The stretch is the distance of the foot from the thigh's pitch axis.
    """
    model = plan.robot.model
    data = model.createData()
    thigh, knee = (model.getJointId(name) for name in plan.robot.legs[leg].joints[-2:])
    frame = model.getFrameId(plan.robot.legs[leg].foot)
    axis = _hinge_axis(model, thigh)
    squares = []
    for angle in (0.0, np.pi / 2, np.pi):
        q = pin.neutral(model)
        q[model.joints[knee].idx_q] = angle
        pin.framesForwardKinematics(model, data, q)
        local = data.oMi[thigh].actInv(data.oMf[frame].translation)
        squares.append(float(np.sum(np.cross(axis, local) ** 2)))
    a = (squares[0] + squares[2]) / 2.0
    return a, squares[0] - a, squares[1] - a


def _hinge_axis(model: pin.Model, joint: int) -> FloatArray:
    data = model.joints[joint].createData()
    model.joints[joint].calc(data, pin.neutral(model))
    return frozen(np.reshape(data.S, 6)[3:])


def _most_cosine(low: FloatArray, high: FloatArray, b: float, c: float) -> FloatArray:
    """Largest value of ``b cos q + c sin q`` for q from ``low`` to ``high``."""
    ends = np.maximum(b * np.cos(low) + c * np.sin(low), b * np.cos(high) + c * np.sin(high))
    turns = np.ceil((low - np.arctan2(c, b)) / (2 * np.pi))
    top = np.arctan2(c, b) + 2 * np.pi * turns
    return np.asarray(np.where(top <= high, np.hypot(b, c), ends))


def _longest(plan: Plan, leg: str, a: float, b: float, c: float) -> float:
    """The greatest stretch within the knee's limits [m]."""
    model = plan.robot.model
    k = model.joints[model.getJointId(plan.robot.legs[leg].joints[-1])].idx_q
    low, high = model.lowerPositionLimit[k], model.upperPositionLimit[k]
    if not low < high:
        low, high = -np.pi, np.pi
    most = _most_cosine(np.array([low]), np.array([high]), b, c)
    return float(np.sqrt(a + float(most.max())))


def margin_of_cog(plan: Plan, motion: Motion) -> Check:
    """While a foot flies, the body centre keeps the stability margin that was asked for."""
    margins = _margins(motion, motion.cog, motion.cog_bulge)
    flying = np.asarray(~motion.standing.all(axis=1))
    short = np.where(flying, margins - plan.settings.stability_margin, margins)
    piece = int(short.argmin())
    asked = plan.settings.stability_margin if flying[piece] else 0.0
    return _judged("margin of the body centre", float(margins[piece]), asked - SHORT, "m", ">=",
                   bound=motion.cog_bulge[piece], when=motion.pieces.starts[piece],
                   where=_phase_name(plan, int(motion.phase[piece])))  # fmt: skip


def margin_of_com(plan: Plan, motion: Motion) -> Check:
    """The model's true centre of mass never leaves the support polygon."""
    margins = _margins(motion, motion.com, motion.com_bulge)
    piece = int(margins.argmin())
    return _judged("margin of the true COM", float(margins[piece]), 0.0, "m", ">=",
                   bound=motion.com_bulge[piece], when=motion.pieces.starts[piece],
                   where=_phase_name(plan, int(motion.phase[piece])))  # fmt: skip


def _margins(motion: Motion, points: FloatArray, bulges: FloatArray) -> FloatArray:
    """Lower bound of the margin on every piece: hulls of the feet where the piece starts."""
    out = np.full(len(bulges), np.inf)
    for index in np.unique(motion.phase):
        mine = np.flatnonzero(motion.phase == index)
        standing = np.flatnonzero(motion.standing[mine[0]])
        feet = motion.feet[0, mine[0], standing, :2]
        moved = np.linalg.norm(
            (motion.feet[:, mine][:, :, standing, :2] - feet).reshape(-1, len(standing), 2), axis=2
        )
        try:
            sides = ConvexHull(feet).equations
        except (QhullError, ValueError):
            out[mine] = -np.inf
            continue
        # Qhull's distances are positive outside; the worse end of each piece counts.
        outside = (points[:, mine, :2] @ sides[:, :2].T + sides[:, 2]).max(axis=(0, 2))
        shift = moved.max() + motion.feet_bulge[mine][:, standing].max(axis=1)
        out[mine] = -outside - bulges[mine] - shift
    return out


def _expected(plan: Plan, motion: Motion) -> FloatArray:
    """Where each foot should stand during each piece ``(P, 4, 3)`` [m]."""
    counts = np.zeros((max(len(plan.phases), 1), 4), dtype=int)
    current = np.zeros(4, dtype=int)
    last = len(plan.footholds) - 1
    for i, phase in enumerate(plan.phases):
        counts[i] = current
        if phase.kind == "swing" and phase.leg in LEGS:
            current[LEGS.index(phase.leg)] = min(current[LEGS.index(phase.leg)] + 1, last)
    return np.asarray(plan.footholds.array[np.arange(4), counts[motion.phase]])


def _touchdown(motion: Motion, home: FloatArray) -> FloatArray:
    """Where each foot was when it began to stand on its present foothold ``(P, 4, 3)``."""
    out = np.empty_like(home)
    for leg in range(4):
        changed = (home[1:, leg] != home[:-1, leg]).any(axis=1)
        lifted = motion.standing[1:, leg] & ~motion.standing[:-1, leg]
        begins = np.concatenate([[True], changed | lifted])
        first = np.maximum.accumulate(np.where(begins, np.arange(len(begins)), 0))
        out[:, leg] = motion.feet[0, first, leg]
    return out


def _place(array: FloatArray) -> tuple[int, int]:
    row, column = np.unravel_index(int(np.argmax(array)), array.shape)
    return int(row), int(column)


def _column(plan: Plan, column: int) -> str:
    names: tuple[str, ...] = ("x", "y", "z", "roll", "pitch", "yaw", *plan.robot.joint_names)
    return names[column]


def _phase_name(plan: Plan, index: int) -> str:
    if not plan.phases:
        return "standing"
    phase = plan.phases[index]
    return f"{phase.kind} {phase.leg}, step {phase.step}"


def _judged(
    name: str,
    worst: float,
    limit: float,
    unit: str,
    sense: str = "<=",
    *,
    bound: float = 0.0,
    when: float = nan,
    where: str = "",
) -> Check:
    # A comparison with NaN is false: what cannot be compared is violated.
    good = worst <= limit if sense == "<=" else worst >= limit
    return Check(name, "ok" if good else "violated", worst, limit, unit, sense, float(bound),
                 float(when), where)  # fmt: skip
