"""The check of forces: contact forces and joint torques that make the motion, at every instant.

At the samples forces are looked for by a linear program, and judged afresh. Between two samples
they are taken to change linearly. Friction pyramids and least normal forces are convex, so they
hold in between where they hold at both ends. The equations of motion then are off by at most an
eighth of a bound on their second derivative times the squared time between samples. Forces that
make up for this exist and are bounded; what they may use is taken off what the limits leave.
Torques deviate from their chords likewise.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from gaitopt.certificate.check import FORCES, Check, column_name, judged, phase_name, unchecked
from gaitopt.certificate.derivative_bounds import LinkBounds, product
from gaitopt.certificate.enclosure import Pieces, acceleration_bound, chord_deviation
from gaitopt.certificate.force_margins import Stance
from gaitopt.certificate.force_samples import ForceSamples, chain_model, sample_ends
from gaitopt.certificate.inertial_deviations import InertialDeviations
from gaitopt.certificate.trace import foot_chain, owners
from gaitopt.conventions import GRAVITY, LEGS, BoolArray, FloatArray
from gaitopt.dynamics.contacts import ForceLimits
from gaitopt.plan.plan import Plan

JUMP = 1e-6
"""Largest jump of a velocity at a knot that counts as rounding [m/s, rad/s]: otherwise it is a
force without bound."""
AIM = 1e-3
"""Share of the weight that the bound between samples aims for: a twentieth of the usual reserve."""
MOST_CUTS = 64
"""Most parts that a piece is cut into; the bound falls with their square."""
REFINEMENT = 8
"""Most parts that a piece is cut into again where its bound is too weak."""
MOST_REFINEMENTS = 4
"""Most times that this is done: the bound then is 8**8 times as small."""
MOST_PIECES = 60_000
"""Most pieces in all. Each takes about 0.3 ms."""
UNBALANCED = 1e-3
"""Share of the weight up to which a wrench that the standing feet cannot make counts as none: of
two point feet the moment about their line, of feet in flight everything."""


def contact_forces(plan: Plan, limits: ForceLimits) -> Check:
    """Forces exist at every instant that keep the limits.

    The worst value is the least that any limit leaves [N]: of a friction pyramid's side, of a
    normal force over its least one, or of a joint's torque over the reach of a leg.
    """
    robot = plan.robot
    if not robot.mass > 0.0:
        return unchecked(FORCES, "N", f"{robot.name} has no mass")
    jumps = plan.path.jumps(1)
    if jumps.size and not jumps.max() <= JUMP:
        knot, column = np.unravel_index(int(jumps.argmax()), jumps.shape)
        what = f"the velocity of {column_name(plan, int(column))} jumps by {jumps.max():.2g}"
        return judged(FORCES, float("-inf"), 0.0, "N", ">=", when=plan.path.times[knot + 1],
                      where=what)  # fmt: skip
    left, bound, where, starts, phases = _least_left(plan, limits)
    worst = int(left.argmin())
    return judged(
        FORCES, float(left[worst]), 0.0, "N", ">=", bound=float(bound[worst]), when=starts[worst],
        where=f"{where[worst]}, {phase_name(plan, int(phases[worst]))}",
    )  # fmt: skip


class _Judged(NamedTuple):
    """Judged pieces.

    Attributes:
        left: the least that a limit leaves on each piece ``(P,)`` [N].
        bound: how much of it the time between samples took ``(P,)`` [N].
        where: whose limit.
        starts: of the pieces ``(P,)`` [s].
        phases: of the pieces ``(P,)``.
    """

    left: FloatArray
    bound: FloatArray
    where: list[str]
    starts: FloatArray
    phases: np.ndarray


def _least_left(plan: Plan, limits: ForceLimits) -> _Judged:
    """Judge every piece; those whose bound is too weak are cut and judged again."""
    pieces = Pieces.of(plan.path)
    pieces = pieces.cut(_cuts(plan, pieces))
    kept: list[_Judged] = []
    for again in range(MOST_REFINEMENTS + 1):
        judged_pieces = _judge_pieces(plan, limits, pieces)
        left, bound = judged_pieces.left, judged_pieces.bound
        weak = (left < 0.0) & (left + bound >= 0.0)
        if again == MOST_REFINEMENTS or not weak.any():
            kept.append(judged_pieces)
            break
        kept.append(_some(judged_pieces, np.flatnonzero(~weak)))
        # What is over falls with the square of the length.
        parts = np.ceil(np.sqrt(bound[weak] / np.maximum(bound[weak] + left[weak], 1e-9)))
        pieces = pieces.chosen(weak).cut(np.clip(parts, 2, REFINEMENT).astype(int))
    return _Judged(
        np.concatenate([k.left for k in kept]), np.concatenate([k.bound for k in kept]),
        [name for k in kept for name in k.where], np.concatenate([k.starts for k in kept]),
        np.concatenate([k.phases for k in kept]),
    )  # fmt: skip


def _some(judged_pieces: _Judged, which: np.ndarray) -> _Judged:
    """Some of the judged pieces."""
    left, bound, where, starts, phases = judged_pieces
    return _Judged(left[which], bound[which], [where[i] for i in which.tolist()], starts[which],
                   phases[which])  # fmt: skip


def _judge_pieces(plan: Plan, limits: ForceLimits, pieces: Pieces) -> _Judged:
    """Of every piece the least that a limit leaves, with samples at both of its ends."""
    phase, standing = owners(plan, pieces)
    ends = sample_ends(plan.robot, pieces)
    left, bound = np.empty(len(phase)), np.empty(len(phase))
    where = [""] * len(phase)
    groups = [np.flatnonzero(phase == p) for p in np.unique(phase)]
    judges = [_PhaseJudge.of(plan, limits, pieces, mine, standing[mine[0]], ends)
              for mine in groups]  # fmt: skip
    off = np.empty(len(phase))
    for mine, judge in zip(groups, judges, strict=True):
        off[mine] = judge.off_centre
    deviations = InertialDeviations.of(plan.robot, pieces, off)
    for mine, judge in zip(groups, judges, strict=True):
        each, taken, names = judge.left(deviations.chosen(mine))
        tightest = each.argmin(axis=1)
        rows = np.arange(len(mine))
        left[mine], bound[mine] = each[rows, tightest], taken[rows, tightest]
        for i, column in zip(mine.tolist(), tightest.tolist(), strict=True):
            where[i] = names[column]
    return _Judged(left, bound, where, pieces.starts, phase)


def _cuts(plan: Plan, pieces: Pieces) -> np.ndarray:
    """How many parts each piece is cut into, so that the bound between samples is small."""
    bounds = LinkBounds.of(chain_model(plan.robot), pieces)
    links = range(1, bounds.model.njoints)
    second = np.sum([bounds.inertial_force(j)[2] for j in links], axis=0)
    aim = AIM * plan.robot.mass * GRAVITY
    counts = np.ceil(np.sqrt(chord_deviation(second, pieces.lengths) / aim)).astype(int)
    return np.asarray(np.clip(counts, 1, min(MOST_CUTS, max(MOST_PIECES // len(counts), 1))))


@dataclass(frozen=True, eq=False)
class _PhaseJudge:
    """The pieces of one phase, with samples at both ends of each.

    Attributes:
        plan: the plan.
        pieces: those of the phase.
        stance: its standing feet.
        ends: samples at the starts and the ends.
        slip: how far each standing foot is from its contact point at most ``(P, k)`` [m].
    """

    plan: Plan
    pieces: Pieces
    stance: Stance
    ends: tuple[ForceSamples, ForceSamples]
    slip: FloatArray

    @classmethod
    def of(
        cls, plan: Plan, limits: ForceLimits, pieces: Pieces, mine: np.ndarray,
        standing: BoolArray, ends: tuple[ForceSamples, ForceSamples],
    ) -> _PhaseJudge:  # fmt: skip
        """Those of the pieces ``mine``."""
        pieces = pieces.chosen(mine)
        both = (ends[0].chosen(mine), ends[1].chosen(mine))
        feet = np.flatnonzero(standing)
        places = np.stack([end.feet[:, feet] for end in both])
        middle = (places.min(axis=(0, 1)) + places.max(axis=(0, 1))) / 2.0
        rates, accelerations = pieces.largest(1), pieces.largest(2)
        bulge = np.stack([
            chord_deviation(acceleration_bound(foot_chain(plan, LEGS[i]), rates, accelerations),
                            pieces.lengths) for i in feet
        ], axis=1) if len(feet) else np.zeros((len(mine), 0))  # fmt: skip
        slip = np.linalg.norm(places - middle, axis=3).max(axis=0) + bulge
        points = middle - np.array([0.0, 0.0, plan.robot.foot_radius])
        return cls(plan, pieces, Stance(plan.robot, limits, feet, points), both, slip)

    @property
    def off_centre(self) -> FloatArray:
        """How far the base is from the middle of the contact points at each start ``(P,)`` [m]."""
        return np.asarray(np.linalg.norm(self.ends[0].base - self.stance.centre, axis=1))

    def left(self, deviations: InertialDeviations) -> tuple[FloatArray, FloatArray, list[str]]:
        """What each limit leaves on every piece, how much of it the bounds took, and its name.

        Args:
            deviations: bounds on the inertial forces of these pieces.
        """
        stance = self.stance
        at_ends, forces, unbalanced = [], [], []
        for end in self.ends:
            force, torques, rest = self._forces(end)
            forces.append(force)
            unbalanced.append(rest)
            at_ends.append(stance.left(force, torques))
        taken, rest = self._taken(np.stack(forces), deviations)
        over = UNBALANCED * stance.weight - np.maximum(*unbalanced) - rest
        if stance.makes_any_wrench:
            over = np.full_like(over, np.inf)
        each = np.concatenate([np.minimum(*at_ends) - taken, over[:, None]], axis=1)
        both = np.concatenate([taken, rest[:, None]], axis=1)
        return each, both, [*stance.names, "a wrench that the standing feet cannot make"]

    def _forces(self, end: ForceSamples) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Contact forces, joint torques, and what the feet cannot make as a force, at samples."""
        stance = self.stance
        moment = end.moment + np.cross(end.base - stance.centre, end.force)
        wrench = np.concatenate([end.force, moment], axis=1)
        jacobians = end.jacobians[:, stance.feet]
        forces = stance.best_forces(wrench, end.torques, jacobians)
        torques = end.torques - np.einsum("nkdj,nkd->nj", jacobians, forces)
        rest = wrench - forces.reshape(len(forces), -1) @ stance.grasp.T
        size = np.linalg.norm(rest[:, :3], axis=1) + np.linalg.norm(rest[:, 3:], axis=1) / (
            stance.reach
        )
        return forces, torques, size

    def _taken(
        self, forces: FloatArray, deviations: InertialDeviations
    ) -> tuple[FloatArray, FloatArray]:
        """What the time between samples takes off each limit ``(P, r)``, and off the balance [N].

        Args:
            forces: at both ends ``(2, P, k, 3)`` [N].
            deviations: bounds on the inertial forces.
        """
        stance, force = self.stance, deviations.force
        sizes = np.linalg.norm(forces, axis=3).max(axis=0)
        moment = deviations.moment + (sizes * self.slip).sum(axis=1)
        more = stance.correction(force, moment)
        torques = self._torque_deviations(deviations, forces, more) / stance.reach
        sides = len(stance.friction_rows)
        unbalanced = force + moment / stance.reach if len(stance.feet) < 3 else np.zeros_like(force)
        return np.concatenate([np.repeat(more, sides, axis=1), more, torques], axis=1), unbalanced

    def _torque_deviations(
        self, deviations: InertialDeviations, forces: FloatArray, more: FloatArray
    ) -> FloatArray:
        """How far each joint's torque leaves its chord ``(P, nj)`` [N m].

        With forces that may be ``more (P, k)`` than those that change linearly [N].
        """
        robot, lengths = self.plan.robot, self.pieces.lengths
        moment = deviations.joint_moments.copy()
        extra = np.zeros(moment.shape[1:])
        for k, foot in enumerate(self.stance.feet.tolist()):
            columns = list(robot.leg_columns[LEGS[foot]])
            size = np.linalg.norm(forces[:, :, k], axis=2).max(axis=0)
            change = np.linalg.norm(forces[1, :, k] - forces[0, :, k], axis=1)
            # A robot that only stands has one piece, of no length.
            slope = np.divide(change, lengths, out=np.zeros_like(change), where=lengths > 0.0)
            series = np.stack([size, slope, np.zeros_like(size)])[:, None]
            moment[:, columns] += product(deviations.arms[:, columns], series)
            extra[columns] = deviations.arms[0, columns] * more[:, k]
        found = chord_deviation(product(deviations.axes, moment)[2], lengths) + extra
        return np.asarray(found.T)
