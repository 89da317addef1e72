"""A plan's motion by Pinocchio, cut so finely that bounds between samples are small."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gaitopt.certificate.enclosure import (
    Chain,
    Pieces,
    Places,
    acceleration_bounds,
    chain_to,
    chord_deviation,
)
from gaitopt.certificate.placements import Placements
from gaitopt.conventions import LEGS, BoolArray, FloatArray
from gaitopt.plan.plan import Plan

STANDING_DEVIATION = 1e-6
"""Aim for how far standing feet leave their chords at most [m]: a hundredth of the slip allowed."""
FLYING_DEVIATION = 1e-4
"""The same for flying feet [m]: a fifth of what they may sink. They are seldom near a limit."""
MOST_CUTS = 256
"""Most parts that a piece is cut into. The bound falls with their square: 256 parts take it from
65 mm to a micrometre."""
MOST_PIECES = 4_000_000
"""Most parts in all. Each takes about 1 kB of memory and some 20 us of Pinocchio's time."""


@dataclass(frozen=True, eq=False)
class Motion:
    """Samples at the ends of pieces of a plan's path, and bounds in between.

    Attributes:
        pieces: the path, cut into pieces.
        phase: index of the phase that each piece belongs to ``(P,)``.
        standing: which feet stand during it ``(P, 4)``.
        feet: foot frames at its start and end ``(2, P, 4, 3)`` [m].
        com: the model's centre of mass there ``(2, P, 3)`` [m].
        cog: the body centre there, the middle of the hips ``(2, P, 3)`` [m].
        feet_deviation, com_deviation, cog_deviation: how far each leaves the chord between its
            two places at most, ``(P, 4)``, ``(P,)`` and ``(P,)`` [m].
    """

    pieces: Pieces
    phase: np.ndarray
    standing: BoolArray
    feet: FloatArray
    com: FloatArray
    cog: FloatArray
    feet_deviation: FloatArray
    com_deviation: FloatArray
    cog_deviation: FloatArray
    places: Places
    foot_turns: tuple[FloatArray, ...]

    @property
    def times(self) -> FloatArray:
        """Times of both ends of every piece ``(2, P)`` [s]."""
        return np.stack([self.pieces.starts, self.pieces.starts + self.pieces.lengths])


def trace(plan: Plan) -> Motion:
    """Evaluate a plan's stored path with Pinocchio."""
    feet = [foot_chain(plan, leg) for leg in LEGS]
    pieces = Pieces.of(plan.path)
    phase, standing = owners(plan, pieces)
    aim = np.where(standing, STANDING_DEVIATION, FLYING_DEVIATION)
    counts = np.ceil(np.sqrt((deviations(feet, pieces) / aim).max(axis=1))).astype(int)
    counts = np.clip(counts, 1, min(MOST_CUTS, max(MOST_PIECES // len(counts), 1)))
    owner = np.repeat(np.arange(len(counts)), counts)
    return _evaluated(plan, pieces.cut(counts), phase[owner], standing[owner])


def cut_finer(plan: Plan, motion: Motion, which: np.ndarray, parts: int) -> Motion:
    """Some pieces of a motion, each cut into equal parts and evaluated anew.

    Args:
        plan: the motion's plan.
        motion: pieces and bounds.
        which: numbers of pieces ``(N,)``.
        parts: how many each is cut into; those of one piece follow one another.
    """
    pieces = motion.pieces.chosen(which).cut(np.full(len(which), parts))
    owner = np.repeat(which, parts)
    return _evaluated(plan, pieces, motion.phase[owner], motion.standing[owner])


def _evaluated(plan: Plan, pieces: Pieces, phase: np.ndarray, standing: BoolArray) -> Motion:
    """Where points are at the ends of pieces, and how far they leave their chords."""
    feet = [foot_chain(plan, leg) for leg in LEGS]
    centre = Chain((), (), float(np.linalg.norm(plan.robot.centre)))
    links, shares = _link_centres(plan)
    leaving = deviations([*feet, *links, centre], pieces)
    places = pieces.places()
    points, turns = _sample(plan, places.values)
    feet_at, com_at, cog_at = (each[places.ends] for each in points)
    return Motion(
        pieces=pieces,
        phase=phase,
        standing=standing,
        feet=feet_at,
        com=com_at,
        cog=cog_at,
        feet_deviation=leaving[:, : len(feet)],
        com_deviation=leaving[:, len(feet) : -1] @ shares,
        cog_deviation=leaving[:, -1],
        places=places,
        foot_turns=turns,
    )


def deviations(chains: Sequence[Chain], pieces: Pieces) -> FloatArray:
    """How far the points of ``n`` chains leave their chords at most ``(P, n)`` [m]."""
    rates, accelerations = pieces.largest(1), pieces.largest(2)
    return chord_deviation(acceleration_bounds(chains, rates, accelerations),
                           pieces.lengths[:, None])  # fmt: skip


def foot_chain(plan: Plan, leg: str) -> Chain:
    """The hinges between the base and a foot's frame."""
    model = plan.robot.model
    frame = model.frames[model.getFrameId(plan.robot.legs[leg].foot)]
    return chain_to(model, frame.parentJoint, frame.placement.translation)


def owners(plan: Plan, pieces: Pieces) -> tuple[np.ndarray, BoolArray]:
    """Index of each piece's phase ``(P,)``, and which feet stand during it ``(P, 4)``."""
    middle = pieces.starts + pieces.lengths / 2.0
    if not plan.phases:
        return np.zeros(len(middle), dtype=int), np.ones((len(middle), 4), dtype=np.bool_)
    starts = np.array([p.start for p in plan.phases])
    owner = np.clip(np.searchsorted(starts, middle, side="right") - 1, 0, None)
    table = np.array([[leg in p.support for leg in LEGS] for p in plan.phases])
    return owner, table[owner]


def _sample(
    plan: Plan, values: FloatArray
) -> tuple[tuple[FloatArray, FloatArray, FloatArray], tuple[FloatArray, ...]]:
    """Where points are at path values ``(N, 6 + nj)``, and rotations of the feet's links.

    The points are the feet ``(N, 4, 3)``, and COM and body centre ``(N, 3)`` [m].
    """
    robot, model = plan.robot, plan.robot.model
    placed = Placements.of(model, values)
    frames = [model.frames[model.getFrameId(robot.legs[leg].foot)] for leg in LEGS]
    feet = [placed.points(int(f.parentJoint), f.placement.translation) for f in frames]
    weighted, mass = np.zeros((len(values), 3)), 0.0
    for joint in range(1, model.njoints):
        inertia = model.inertias[joint]
        weighted += inertia.mass * placed.points(joint, inertia.lever)
        mass += inertia.mass
    com = weighted / mass if mass > 0.0 else placed.origins[1]
    centre = placed.points(1, robot.body_axes @ robot.centre)
    turns = tuple(placed.rotations[int(f.parentJoint)] for f in frames)
    return (np.stack(feet, axis=1), com, centre), turns


def _link_centres(plan: Plan) -> tuple[list[Chain], FloatArray]:
    """The chains of the links' centres of mass, and the links' shares of the mass ``(n,)``."""
    model = plan.robot.model
    joints = range(1, model.njoints)
    masses = np.array([model.inertias[joint].mass for joint in joints])
    chains = [chain_to(model, joint, model.inertias[joint].lever) for joint in joints]
    # A robot without masses has no centre of mass.
    return chains, masses / masses.sum() if masses.sum() > 0.0 else masses
