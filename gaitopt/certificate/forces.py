"""The check of forces: contact forces and joint torques that make the motion, at every instant.

At the samples forces are looked for by a linear program, and judged afresh. Between two samples
they are taken to change linearly. Friction pyramids and least normal forces are convex, so they
hold in between where they hold at both ends. The equations of motion then are off by at most an
eighth of a bound on their second derivative times the squared time between samples. Forces that
make up for this exist and are bounded; what they may use is taken off what the limits leave.
Torques deviate from their chords likewise.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from gaitopt.certificate.check import FORCES, Check, column_name, judged, phase_name, unchecked
from gaitopt.certificate.derivative_bounds import LinkBounds
from gaitopt.certificate.enclosure import Pieces, chord_deviation
from gaitopt.certificate.force_judge import ForceJudge
from gaitopt.certificate.force_margins import limit_name
from gaitopt.certificate.force_samples import chain_model, sample_ends
from gaitopt.certificate.phase_forces import ground_in_phases, times_of_stances
from gaitopt.certificate.trace import owners
from gaitopt.conventions import GRAVITY, LEGS, FloatArray
from gaitopt.dynamics.contacts import ForceLimits
from gaitopt.dynamics.torque_limits import torque_lines
from gaitopt.plan.plan import Plan

JUMP = 1e-6
"""Largest jump of a velocity at a knot that counts as rounding [m/s, rad/s]: otherwise it is a
force without bound."""
DRIFT = 1e-4
"""Largest sum of all jumps of a velocity that counts as rounding, by the plan's duration or by one
second [m/s^2, rad/s^2]: many small jumps are a force as well. That of go2 over 64 steps is 1e-7."""
AIM = 1e-3
"""Share of the weight that the bound between samples aims for: a twentieth of the usual reserve."""
MOST_CUTS = 64
"""Most parts that a piece is cut into; the bound falls with their square."""
REFINEMENT = 8
"""Most parts that a piece is cut into again where its bound is too weak."""
MOST_REFINEMENTS = 4
"""Most times that this is done: the bound then is 8**8 times as small."""
MOST_PIECES = 60_000
"""Most pieces that are judged at a time, but for a path that has more. Each takes about 0.05 ms."""
AT_ONCE = 4000
"""Pieces that are looked at in one call of NumPy, or a few more: some 40 MB."""


def contact_forces(plan: Plan, limits: ForceLimits) -> Check:
    """Forces exist at every instant that keep the limits.

    The worst value is the least that any limit leaves [N]: of a friction pyramid's side, of a
    normal force over its least one, or of a joint's torque over the reach of a leg.
    """
    robot = plan.robot
    if not robot.mass > 0.0:
        return unchecked(FORCES, "N", f"{robot.name} has no mass")
    jump = _jump(plan)
    if jump is not None:
        when, what = jump
        check = judged(FORCES, float("-inf"), 0.0, "N", ">=", when=when, where=what)
        return replace(check, note=_in_words(plan, limits))
    left, bound, columns, starts, phases = _least_left(plan, limits)
    worst = int(left.argmin())
    phase = int(phases[worst])
    standing = plan.phases[phase].support if plan.phases else LEGS
    where = limit_name(plan.robot, limits, standing, int(columns[worst]))
    check = judged(
        FORCES, float(left[worst]), 0.0, "N", ">=", bound=float(bound[worst]), when=starts[worst],
        where=f"{where}, {phase_name(plan, phase)}",
    )  # fmt: skip
    return replace(check, note=_in_words(plan, limits))


def _jump(plan: Plan) -> tuple[float, str] | None:
    """Time and words of a velocity that jumps at a knot; ``None`` where none does."""
    jumps = plan.path.jumps(1)
    if not jumps.size:
        return None
    knot, column = (int(i) for i in np.unravel_index(int(jumps.argmax()), jumps.shape))
    if not jumps.max() <= JUMP:
        what = f"the velocity of {column_name(plan, column)} jumps by {jumps.max():.2g}"
        return float(plan.path.times[knot + 1]), what
    drift = jumps.sum(axis=0) / max(plan.duration, 1.0)
    if not drift.max() <= DRIFT:
        column = int(drift.argmax())
        what = f"the velocity of {column_name(plan, column)} jumps by {drift.max():.2g} a second"
        return float(plan.path.times[int(jumps[:, column].argmax()) + 1]), what
    return None


def _in_words(plan: Plan, limits: ForceLimits) -> str:
    """The limits, and the motors' inertia, for a reader of the certificate."""
    falls = torque_lines(plan.robot, limits) is not None
    line = ", which falls with the speed" if falls else ""
    inertia = float(plan.robot.motor_inertia.max(initial=0.0))
    motors = f", motors of up to {inertia:.3g} kg m²" if inertia > 0.0 else ""
    given = plan.footholds.friction
    least = min((float(own.min()) for own in given.values()), default=1.0) if given else np.inf
    less = f", down to {least:g} on footholds" if least < limits.friction else ""
    transfer = ""
    if limits.transfer_time > 0.0:
        transfer = f", a foot takes over the weight in {1e3 * limits.transfer_time:g} ms"
    return (
        f"friction {limits.friction:g}{less}, a reserve of {100.0 * limits.reserve:g} %, "
        f"{100.0 * limits.torque_share:g} % of the torque{line}{motors}{transfer}"
    )


class _Judged(NamedTuple):
    """Judged pieces.

    Attributes:
        left: the least that a limit leaves on each piece ``(P,)`` [N].
        bound: how much of it the time between samples took ``(P,)`` [N].
        columns: which limit, see :func:`limit_name` ``(P,)``.
        starts: of the pieces ``(P,)`` [s].
        phases: of the pieces ``(P,)``.
    """

    left: FloatArray
    bound: FloatArray
    columns: np.ndarray
    starts: FloatArray
    phases: np.ndarray

    def chosen(self, which: np.ndarray) -> _Judged:
        """Some of the pieces, by a mask."""
        return _Judged(*(part[which] for part in self))


def _least_left(plan: Plan, limits: ForceLimits) -> _Judged:
    """Judge every piece; those whose bound is too weak are cut and judged again.

    Once a sample has no forces the verdict is known: weak pieces are then left out.
    """
    pieces = Pieces.of(plan.path)
    pieces = pieces.cut(_cuts(plan, pieces))
    most = max(MOST_PIECES, len(pieces.starts))
    kept: list[_Judged] = []
    for again in range(MOST_REFINEMENTS + 1):
        judged_pieces = _judge_pieces(plan, limits, pieces)
        left, bound = judged_pieces.left, judged_pieces.bound
        weak = (left < 0.0) & (left + bound >= 0.0)
        # What is over falls with the square of the length.
        parts = np.ceil(np.sqrt(bound[weak] / np.maximum(bound[weak] + left[weak], 1e-9)))
        counts = np.clip(parts, 2, REFINEMENT).astype(int)
        if again == MOST_REFINEMENTS or counts.sum() > most:
            kept.append(judged_pieces)
            break
        kept.append(judged_pieces.chosen(~weak))
        if not weak.any() or (left + bound < 0.0).any():
            break
        pieces = pieces.chosen(weak).cut(counts)
    return _Judged(*(np.concatenate(parts) for parts in zip(*kept, strict=True)))


def _judge_pieces(plan: Plan, limits: ForceLimits, pieces: Pieces) -> _Judged:
    """Of every piece the least that a limit leaves, with samples at both of its ends."""
    phase, standing = owners(plan, pieces)
    ground, spans = ground_in_phases(plan, limits.friction), times_of_stances(plan)
    samples, at = sample_ends(plan.robot, pieces, ground.normals[phase], phase)
    left, bound = np.empty(len(phase)), np.empty(len(phase))
    columns = np.empty(len(phase), dtype=np.intp)
    for mine in _together(phase, standing.sum(axis=1)):
        judge = ForceJudge.of(plan, limits, pieces.chosen(mine), phase[mine], standing[mine],
                              samples, at[:, mine], ground, spans)  # fmt: skip
        for part, each in judge.of_one_rank():
            own = mine[part]
            left[own], bound[own], columns[own] = each.left()
    return _Judged(left, bound, columns, pieces.starts, phase)


def _together(phase: np.ndarray, feet: np.ndarray) -> list[np.ndarray]:
    """Numbers of the pieces that are judged at once.

    Args:
        phase: of each piece ``(P,)``, in order.
        feet: how many stand on each piece ``(P,)``, the same all through a phase.

    Whole phases in which equally many feet stand, some :data:`AT_ONCE` pieces in all.
    """
    out = []
    for count in np.unique(feet).tolist():
        mine = np.flatnonzero(feet == count)
        begins = np.flatnonzero(np.diff(phase[mine], prepend=-1))
        share = begins // AT_ONCE
        cuts = begins[1:][share[1:] != share[:-1]]
        out += np.split(mine, cuts.tolist())
    return out


def _cuts(plan: Plan, pieces: Pieces) -> np.ndarray:
    """How many parts each piece is cut into, so that the bound between samples is small."""
    bounds = LinkBounds.of(chain_model(plan.robot), pieces)
    links = range(1, bounds.model.njoints)
    second = np.sum([bounds.inertial_force(j)[2] for j in links], axis=0)
    aim = AIM * plan.robot.mass * GRAVITY
    counts = np.ceil(np.sqrt(chord_deviation(second, pieces.lengths) / aim)).astype(int)
    return np.asarray(np.clip(counts, 1, min(MOST_CUTS, max(MOST_PIECES // len(counts), 1))))
