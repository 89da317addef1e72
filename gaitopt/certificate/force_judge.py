"""What every limit leaves on the pieces of phases, with forces at both ends of each piece."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from gaitopt.certificate.derivative_bounds import product
from gaitopt.certificate.enclosure import Pieces, chord_deviation
from gaitopt.certificate.force_margins import Stances, TorqueLimits
from gaitopt.certificate.force_programs import ForcePrograms
from gaitopt.certificate.force_samples import ForceSamples, across, joints_of_legs
from gaitopt.certificate.inertial_deviations import InertialDeviations
from gaitopt.certificate.phase_forces import PhaseGround
from gaitopt.certificate.trace import deviations, foot_chain
from gaitopt.conventions import LEGS, BoolArray, FloatArray
from gaitopt.dynamics.contacts import ForceLimits
from gaitopt.plan.plan import Plan

MOST_WEIGHTS = 10.0
"""A largest normal force does not rise above so many weights: no foot bears more, and programs need
a number."""


class Left(NamedTuple):
    """What the limits leave on pieces.

    Attributes:
        left: the least that a limit leaves ``(P,)`` [N].
        bound: how much of it the time between samples took ``(P,)`` [N].
        column: whose limit, see :func:`limit_name` ``(P,)``.
    """

    left: FloatArray
    bound: FloatArray
    column: np.ndarray


@dataclass(frozen=True, eq=False)
class ForceJudge:
    """Pieces of phases in which equally many feet stand, with samples at both ends of each.

    Attributes:
        plan: the plan.
        pieces: of these phases.
        stances: the standing feet of each phase.
        owner: the phase of each piece, as ``stances`` count them ``(P,)``.
        samples: all samples.
        at: which samples are at the starts and at the ends ``(2, P)``.
        slip: how far each standing foot is from its contact point at most ``(P, k)`` [m].
        spans: when each standing foot has landed, and when it lifts off ``(S, k, 2)`` [s].
    """

    plan: Plan
    pieces: Pieces
    stances: Stances
    owner: np.ndarray
    samples: ForceSamples
    at: np.ndarray
    slip: FloatArray
    spans: FloatArray

    @classmethod
    def of(
        cls, plan: Plan, limits: ForceLimits, pieces: Pieces, phase: np.ndarray,
        standing: BoolArray, samples: ForceSamples, at: np.ndarray, ground: PhaseGround,
        spans: FloatArray,
    ) -> ForceJudge:  # fmt: skip
        """The judge of some pieces.

        Args:
            plan, limits: the plan, and what is asked.
            pieces: in order of time; no other judge has pieces of the same phases.
            phase: which phase each belongs to ``(P,)``.
            standing: which feet stand, equally many on all pieces ``(P, 4)``.
            samples: those at the ends of the pieces.
            at: which samples are at the starts and at the ends ``(2, P)``.
            ground: under the feet in all phases of the plan.
            spans: when feet land and lift off, in all phases ``(phases, 4, 2)`` [s].
        """
        numbers, first, owner = np.unique(phase, return_index=True, return_inverse=True)
        count = int(standing[0].sum())
        feet = np.nonzero(standing[first])[1].reshape(len(first), count)
        each = numbers[:, None], feet
        places = samples.feet[at[:, :, None], feet[owner]]
        middle = _middles(places, first)
        slip = np.linalg.norm(places - middle[owner], axis=3).max(axis=0)
        bulge = deviations([foot_chain(plan, leg) for leg in LEGS], pieces)
        slip += np.take_along_axis(bulge, feet[owner], axis=1)
        points = middle - plan.robot.foot_radius * ground.normals[each]
        # A robot that flies far from the world's origin is judged as one that flies near to it.
        centres = points.mean(axis=1) if count else _middles(samples.base[at], first)
        stances = Stances(plan.robot, limits, feet, points, ground.normals[each],
                          ground.friction[each], centres)  # fmt: skip
        return cls(plan, pieces, stances, owner, samples, at, slip, spans[each])

    def of_one_rank(self) -> list[tuple[np.ndarray, ForceJudge]]:
        """Judges of phases whose equations have one rank, and which of the pieces they have."""
        ranks, out = self.stances.ranks, []
        for rank in np.unique(ranks).tolist():
            same = ranks == rank
            if same.all():
                return [(np.arange(len(self.owner)), self)]
            mine = np.flatnonzero(same[self.owner])
            owner = (np.cumsum(same) - 1)[self.owner[mine]]
            judge = ForceJudge(
                self.plan, self.pieces.chosen(mine), self.stances.chosen(same), owner,
                self.samples, self.at[:, mine], self.slip[mine], self.spans[same],
            )  # fmt: skip
            out.append((mine, judge))
        return out

    @property
    def _off_centre(self) -> FloatArray:
        """How far the base is from the reference of moments at each start ``(P,)`` [m]."""
        away = self.samples.base[self.at[0]] - self.stances.centres[self.owner]
        return np.asarray(np.linalg.norm(away, axis=1))

    def left(self) -> Left:
        """What the tightest limit leaves on every piece."""
        stances = self.stances
        inertial = InertialDeviations.of(self.plan.robot, self.pieces, self._off_centre)
        used, at = np.unique(self.at, return_inverse=True)
        at = at.reshape(self.at.shape)
        forces, at_samples, unbalanced = self._at_samples(used, at)
        taken, rest = self._taken(forces[at], inertial)
        over = stances.tolerance - unbalanced[at].max(axis=0) - rest
        if stances.makes_any_wrench:
            over = np.full_like(over, np.inf)
        each = np.minimum(at_samples[at[0]], at_samples[at[1]]) - taken
        column, rows = each.argmin(axis=1), np.arange(len(each))
        left, bound = each[rows, column], taken[rows, column]
        unmade = over < left
        # What is no number stays no number.
        return Left(np.minimum(over, left), np.where(unmade, rest, bound),
                    np.where(unmade, each.shape[1], column))  # fmt: skip

    def _at_samples(
        self, used: np.ndarray, ends: np.ndarray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """The best forces, what limits leave, and what the feet cannot make, at samples [N].

        Args:
            used: numbers of the samples ``(n,)``.
            ends: which of these are at the starts and at the ends of the pieces ``(2, P)``.

        Returns:
            Of shapes ``(n, k, 3)``, ``(n, r)`` and ``(n,)``.
        """
        stances, at = self.stances, self.samples.chosen(used)
        owner = np.empty(len(used), dtype=np.intp)
        owner[ends] = self.owner
        limits = stances.torque_limits(at.speeds)
        arm = at.base - stances.centres[owner]
        wrench = np.concatenate([at.force, at.moment + across(arm, at.force)], axis=1)
        feet, rows = stances.feet[owner], np.arange(len(used))[:, None]
        columns = joints_of_legs(self.plan.robot)[feet]
        columns = columns.reshape(len(used), feet.shape[1] * columns.shape[2])
        jacobians, most = at.jacobians[rows, feet], self._most(owner, ends)
        # One joint more stands for those that a leg does not have. It has no limits.
        free = np.pad(at.torques, ((0, 0), (0, 1)))
        low, high = (np.pad(limit, ((0, 0), (0, 1)), constant_values=none)[rows, columns]
                     for limit, none in ((limits.low, -np.inf), (limits.high, np.inf)))  # fmt: skip
        programs = ForcePrograms.of(stances, owner, wrench, free[rows, columns], jacobians,
                                    TorqueLimits(low, high), most)  # fmt: skip
        legs = np.swapaxes(jacobians, 2, 3)

        def judged(z: FloatArray) -> tuple[FloatArray, FloatArray]:
            forces, torques = programs.forces(z), free.copy()
            torques[rows, columns] -= (legs @ forces[..., None]).reshape(columns.shape)
            return forces, stances.left(forces, torques[:, :-1], limits, most, owner)

        z = programs.solve()
        forces, left = judged(z)
        # A comparison with NaN is false.
        poor = np.flatnonzero(~(left >= 0.0).all(axis=1))
        if poor.size:
            forces, left = judged(programs.solve_again(z, poor))
        made = (stances.grasp[owner] @ forces.reshape(len(used), -1, 1))[..., 0]
        rest = wrench - made
        size = np.linalg.norm(rest[:, :3], axis=1)
        size += np.linalg.norm(rest[:, 3:], axis=1) / stances.reach
        return forces, left, size

    def _most(self, owner: np.ndarray, ends: np.ndarray) -> FloatArray:
        """Largest normal forces at samples ``(n, k)`` [N]; none: ``(n, 0)``.

        They are concave functions of time, so forces that change linearly and keep them at both
        ends of a piece keep them in between.
        """
        if self.stances.limits.transfer_time == 0.0:
            return np.empty((len(owner), 0))
        times = np.empty((len(owner), 1))
        times[ends[1], 0] = self.pieces.starts + self.pieces.lengths
        times[ends[0], 0] = self.pieces.starts
        spans = self.spans[owner]
        left = np.minimum(times - spans[..., 0], spans[..., 1] - times)
        longest = MOST_WEIGHTS * self.stances.limits.transfer_time
        return self.stances.most_normals(np.clip(left, 0.0, longest))

    def _taken(
        self, forces: FloatArray, inertial: InertialDeviations
    ) -> tuple[FloatArray, FloatArray]:
        """What the time between samples takes off each limit ``(P, r)``, and off the balance [N].

        Args:
            forces: at both ends ``(2, P, k, 3)`` [N].
            inertial: bounds on the inertial forces.
        """
        stances, force = self.stances, inertial.force
        sizes = np.linalg.norm(forces, axis=3).max(axis=0)
        moment = inertial.moment + (sizes * self.slip).sum(axis=1)
        more = stances.correction(force, moment, self.owner)
        torques = self._torque_deviations(inertial, forces, sizes, more)
        if stances.lines is not None:
            torques += self._torque_losses()
        torques /= stances.reach
        by_force = [np.repeat(more, stances.limits.sides, axis=1), more]
        if stances.limits.transfer_time > 0.0:
            by_force.append(more)
        # It counts where feet cannot make every wrench: few of them, or all on one line.
        return np.concatenate([*by_force, torques], axis=1), force + moment / stances.reach

    def _torque_losses(self) -> FloatArray:
        """How far limits that fall with the speed leave their chords ``(P, nj)`` [N m]."""
        pieces = self.pieces
        least, most = (each[:, 6:] for each in pieces.enclosure(1))
        ends = (self.samples.speeds[self.at[0]], self.samples.speeds[self.at[1]])
        jerk = pieces.largest(3)[:, 6:]
        return self.stances.torque_loss(ends, least, most, jerk, pieces.lengths)

    def _torque_deviations(
        self, inertial: InertialDeviations, forces: FloatArray, sizes: FloatArray,
        more: FloatArray,
    ) -> FloatArray:  # fmt: skip
        """How far each joint's torque leaves its chord ``(P, nj)`` [N m].

        With forces that may be ``more (P, k)`` than those that change linearly [N].
        """
        robot, lengths = self.plan.robot, self.pieces.lengths
        change = np.linalg.norm(forces[1] - forces[0], axis=2)
        # A robot that only stands has one piece, of no length.
        long = lengths[:, None]
        slope = np.divide(change, long, out=np.zeros_like(change), where=long > 0.0)
        # Of feet in the air all three are zero.
        of_legs = np.zeros((3, len(LEGS), len(lengths)))
        rows = np.arange(len(lengths))[:, None]
        for row, each in zip(of_legs, (sizes, slope, more), strict=True):
            row.T[rows, self.stances.feet[self.owner]] = each
        moment = inertial.joint_moments.copy()
        extra = np.zeros(moment.shape[1:])
        for leg, (size, rate, added) in zip(LEGS, np.swapaxes(of_legs, 0, 1), strict=True):
            columns = list(robot.leg_columns[leg])
            series = np.stack([size, rate, np.zeros_like(size)])[:, None]
            moment[:, columns] += product(inertial.arms[:, columns], series)
            extra[columns] = inertial.arms[0, columns] * added
        found = chord_deviation(product(inertial.axes, moment)[2], lengths) + extra
        found += inertial.motors
        return np.asarray(found.T)


def _middles(places: FloatArray, first: np.ndarray) -> FloatArray:
    """Middles of the boxes around the places of each phase ``(S, ..., 3)`` [m].

    Args:
        places: at both ends of the pieces ``(2, P, ..., 3)`` [m].
        first: number of the first piece of each phase ``(S,)``.
    """
    low = np.minimum.reduceat(places.min(axis=0), first, axis=0)
    high = np.maximum.reduceat(places.max(axis=0), first, axis=0)
    return np.asarray((low + high) / 2.0)
