"""What every limit leaves on the pieces of one phase, with forces at both ends of each piece."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from gaitopt.certificate.derivative_bounds import product
from gaitopt.certificate.enclosure import Pieces, chord_deviation
from gaitopt.certificate.force_margins import Stance
from gaitopt.certificate.force_programs import ForcePrograms
from gaitopt.certificate.force_samples import ForceSamples
from gaitopt.certificate.inertial_deviations import InertialDeviations
from gaitopt.conventions import LEGS, BoolArray, FloatArray
from gaitopt.dynamics.contacts import ForceLimits
from gaitopt.plan.plan import Plan

MOST_WEIGHTS = 10.0
"""A largest normal force does not rise above so many weights: no foot bears more, and programs need
a number."""


class PhaseGround(NamedTuple):
    """The ground under four feet in each phase; what is said of feet that fly means nothing.

    Attributes:
        normals: unit normals ``(P, 4, 3)``.
        friction: coefficients of friction ``(P, 4)``.
    """

    normals: FloatArray
    friction: FloatArray


def ground_in_phases(plan: Plan, friction: float) -> PhaseGround:
    """The ground under the feet in all phases of a plan; a plan without phases has one.

    Planners have a function for this as well (:mod:`gaitopt.plan.contact_ground`). This one counts
    the swings that have ended, so that an error in one of them is seen by the other.

    Args:
        plan: the plan.
        friction: of the limits. A foothold has no more than this, and it may have less.
    """
    phases, footholds = max(len(plan.phases), 1), plan.footholds
    landed = np.zeros((phases, len(LEGS)), dtype=int)
    for swing in plan.swings:
        if swing.index < 0:
            # The plan begins with this foot in the air: it lands on its first foothold.
            continue
        landed[swing.phases[1] + 1 :, LEGS.index(swing.leg)] += 1
    normals = np.zeros((phases, len(LEGS), 3))
    normals[..., 2] = 1.0
    least = np.full((phases, len(LEGS)), friction)
    for i, leg in enumerate(LEGS):
        on = np.minimum(landed[:, i], footholds.counts[leg] - 1)
        if footholds.normals is not None:
            normals[:, i] = footholds.normals[leg][on]
        if footholds.friction is not None:
            least[:, i] = np.minimum(footholds.friction[leg][on], friction)
    return PhaseGround(normals, least)


def times_of_stances(plan: Plan) -> FloatArray:
    """When each foot that stands in a phase has landed, and when it lifts off ``(P, 4, 2)`` [s].

    Infinite for a foot that stands from the begin, or to the end; NaN for feet in the air. Planners
    have a function for this as well (:mod:`gaitopt.plan.load_transfer`). This one goes through the
    phases, so that an error in one of them is seen by the other.
    """
    found = np.full((max(len(plan.phases), 1), len(LEGS), 2), np.nan)
    for i, leg in enumerate(LEGS):
        begin, landed, stood = 0, -np.inf, True
        for number, phase in enumerate(plan.phases):
            stands = leg in phase.support
            if stood and not stands:
                found[begin:number, i] = landed, phase.start
            elif stands and not stood:
                begin, landed = number, phase.start
            stood = stands
        if stood:
            found[begin:, i] = landed, np.inf
    return found


@dataclass(frozen=True, eq=False)
class PhaseJudge:
    """The pieces of one phase, with samples at both ends of each.

    Attributes:
        plan: the plan.
        pieces: those of the phase.
        stance: its standing feet.
        ends: samples at the starts and the ends.
        slip: how far each standing foot is from its contact point at most ``(P, k)`` [m].
        spans: when each standing foot has landed, and when it lifts off ``(k, 2)`` [s].
    """

    plan: Plan
    pieces: Pieces
    stance: Stance
    ends: tuple[ForceSamples, ForceSamples]
    slip: FloatArray
    spans: FloatArray

    @classmethod
    def of(
        cls, plan: Plan, limits: ForceLimits, pieces: Pieces, standing: BoolArray,
        ends: tuple[ForceSamples, ForceSamples], bulge: FloatArray, ground: PhaseGround,
        spans: FloatArray,
    ) -> PhaseJudge:  # fmt: skip
        """The judge of a phase.

        Args:
            plan, limits: the plan, and what is asked.
            pieces: those of the phase.
            standing: which feet stand ``(4,)``.
            ends: samples at the starts and the ends.
            bulge: how far each foot leaves its chord at most ``(P, 4)`` [m].
            ground: under the feet in this phase.
            spans: when each foot has landed, and when it lifts off ``(4, 2)`` [s].
        """
        feet = np.flatnonzero(standing)
        places = np.stack([end.feet[:, feet] for end in ends])
        middle = (places.min(axis=(0, 1)) + places.max(axis=(0, 1))) / 2.0
        slip = np.linalg.norm(places - middle, axis=3).max(axis=0) + bulge[:, feet]
        normals, friction = ground.normals[feet], ground.friction[feet]
        points = middle - plan.robot.foot_radius * normals
        stance = Stance(plan.robot, limits, feet, points, normals, friction)
        return cls(plan, pieces, stance, ends, slip, spans[feet])

    @property
    def centre(self) -> FloatArray:
        """Reference of moments: the middle of the contact points; of the base's places in flight.

        A robot that flies far from the world's origin is judged as one that flies near to it.
        """
        if len(self.stance.feet):
            return self.stance.centre
        bases = np.concatenate([end.base for end in self.ends])
        return np.asarray((bases.min(axis=0) + bases.max(axis=0)) / 2.0)

    @property
    def off_centre(self) -> FloatArray:
        """How far the base is from the reference of moments at each start ``(P,)`` [m]."""
        return np.asarray(np.linalg.norm(self.ends[0].base - self.centre, axis=1))

    def left(self, deviations: InertialDeviations) -> tuple[FloatArray, FloatArray, list[str]]:
        """What each limit leaves on every piece, how much of it the bounds took, and its name.

        Args:
            deviations: bounds on the inertial forces of these pieces.
        """
        stance = self.stance
        forces, at_samples, unbalanced = self._at_samples()
        taken, rest = self._taken(forces, deviations)
        over = stance.tolerance - unbalanced.max(axis=0) - rest
        if stance.makes_any_wrench:
            over = np.full_like(over, np.inf)
        each = np.concatenate([at_samples.min(axis=0) - taken, over[:, None]], axis=1)
        both = np.concatenate([taken, rest[:, None]], axis=1)
        return each, both, [*stance.names, "a wrench that the standing feet cannot make"]

    def _at_samples(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """The best forces, what limits leave, and what the feet cannot make, at both ends [N].

        Their shapes are ``(2, P, k, 3)``, ``(2, P, r)`` and ``(2, P)``.
        """
        stance, at = self.stance, ForceSamples.joined(*self.ends)
        limits = stance.torque_limits(at.speeds)
        moment = at.moment + np.cross(at.base - self.centre, at.force)
        wrench = np.concatenate([at.force, moment], axis=1)
        jacobians = at.jacobians[:, stance.feet]
        # Lengths that NumPy is to find for itself are not known of empty arrays, of feet in flight.
        shape = (len(wrench), 3 * len(stance.feet), at.torques.shape[1])
        flat = np.swapaxes(jacobians.reshape(shape), 1, 2)
        most = self._most()
        programs = ForcePrograms.of(stance, wrench, at.torques, jacobians, limits, most)

        def judged(z: FloatArray) -> tuple[FloatArray, FloatArray]:
            forces = programs.forces(z)
            made = (flat @ forces.reshape(len(forces), shape[1], 1))[..., 0]
            return forces, stance.left(forces, at.torques - made, limits, most)

        z = programs.solve()
        forces, left = judged(z)
        # A comparison with NaN is false.
        poor = np.flatnonzero(~(left >= 0.0).all(axis=1))
        if poor.size:
            forces, left = judged(programs.solve_again(z, poor))
        rest = wrench - forces.reshape(len(forces), shape[1]) @ stance.grasp.T
        size = np.linalg.norm(rest[:, :3], axis=1)
        size += np.linalg.norm(rest[:, 3:], axis=1) / stance.reach
        forces, left, size = (
            each.reshape(2, len(each) // 2, *each.shape[1:]) for each in (forces, left, size)
        )
        return forces, left, size

    def _most(self) -> FloatArray:
        """Largest normal forces at both ends of all pieces ``(2 P, k)`` [N]; none: ``(2 P, 0)``.

        They are concave functions of time, so forces that change linearly and keep them at both
        ends of a piece keep them in between.
        """
        starts = self.pieces.starts
        times = np.concatenate([starts, starts + self.pieces.lengths])[:, None]
        if self.stance.limits.transfer_time == 0.0:
            return np.empty((len(times), 0))
        left = np.minimum(times - self.spans[:, 0], self.spans[:, 1] - times)
        longest = MOST_WEIGHTS * self.stance.limits.transfer_time
        return self.stance.most_normals(np.clip(left, 0.0, longest))

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
        torques = self._torque_deviations(deviations, forces, more)
        if stance.lines is not None:
            torques += self._torque_losses()
        torques /= stance.reach
        by_force = [np.repeat(more, stance.limits.sides, axis=1), more]
        if stance.limits.transfer_time > 0.0:
            by_force.append(more)
        unbalanced = force + moment / stance.reach if len(stance.feet) < 3 else np.zeros_like(force)
        return np.concatenate([*by_force, torques], axis=1), unbalanced

    def _torque_losses(self) -> FloatArray:
        """How far limits that fall with the speed leave their chords ``(P, nj)`` [N m]."""
        pieces = self.pieces
        least, most = (each[:, 6:] for each in pieces.enclosure(1))
        ends = (self.ends[0].speeds, self.ends[1].speeds)
        jerk = pieces.largest(3)[:, 6:]
        return self.stance.torque_loss(ends, least, most, jerk, pieces.lengths)

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
        found += deviations.motors
        return np.asarray(found.T)
