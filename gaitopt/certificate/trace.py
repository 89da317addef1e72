"""A plan's motion by Pinocchio alone, cut finely enough that bounds between samples are small."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from scipy.spatial.transform import Rotation

from gaitopt.certificate.enclosure import Chain, Pieces, acceleration_bound, bulge, chain_to
from gaitopt.conventions import LEGS, BoolArray, FloatArray
from gaitopt.plan.plan import Plan

STANDING_BULGE = 1e-6
"""Aim for the departure of standing feet from their chords [m]."""
FLYING_BULGE = 1e-4
"""Aim for the departure of flying feet, and of the COM, from their chords [m]."""
MOST_CUTS = 256
MOST_PIECES = 4_000_000


@dataclass(frozen=True, eq=False)
class Motion:
    """Samples at the ends of pieces, and bounds in between.

    Attributes:
        pieces: the cut path.
        phase: index of the phase that owns each piece ``(P,)``.
        standing: which feet stand during it ``(P, 4)``.
        feet: foot frames at its start and end ``(2, P, 4, 3)`` [m].
        com: the model's centre of mass there ``(2, P, 3)`` [m].
        cog: the body centre that the plan assumes ``(2, P, 3)`` [m].
        feet_bulge, com_bulge, cog_bulge: bounds on the departure from the chord, ``(P, 4)``,
            ``(P,)`` and ``(P,)`` [m].
    """

    pieces: Pieces
    phase: np.ndarray
    standing: BoolArray
    feet: FloatArray
    com: FloatArray
    cog: FloatArray
    feet_bulge: FloatArray
    com_bulge: FloatArray
    cog_bulge: FloatArray

    @property
    def times(self) -> FloatArray:
        """Times of both ends of every piece ``(2, P)`` [s]."""
        return np.stack([self.pieces.starts, self.pieces.starts + self.pieces.lengths])


def trace(plan: Plan) -> Motion:
    """Follow a plan's stored path with Pinocchio."""
    feet = [foot_chain(plan, leg) for leg in LEGS]
    pieces = Pieces.of(plan.path)
    phase, standing = _owners(plan, pieces)
    rates, accelerations = pieces.largest(1), pieces.largest(2)
    bulges = np.stack(
        [bulge(acceleration_bound(c, rates, accelerations), pieces.lengths) for c in feet], axis=1
    )
    aim = np.where(standing, STANDING_BULGE, FLYING_BULGE)
    counts = np.ceil(np.sqrt((bulges / aim).max(axis=1))).astype(int)
    counts = np.clip(counts, 1, min(MOST_CUTS, max(MOST_PIECES // len(counts), 1)))
    owner = np.repeat(np.arange(len(counts)), counts)
    pieces = pieces.cut(counts)
    rates, accelerations = pieces.largest(1), pieces.largest(2)
    starts, ends = pieces.values()
    both = [_sample(plan, np.asarray(values)) for values in (starts, ends)]
    feet_at, com_at, cog_at = (np.stack(pair) for pair in zip(*both, strict=True))
    return Motion(
        pieces=pieces,
        phase=phase[owner],
        standing=standing[owner],
        feet=feet_at,
        com=com_at,
        cog=cog_at,
        feet_bulge=np.stack(
            [bulge(acceleration_bound(c, rates, accelerations), pieces.lengths) for c in feet],
            axis=1,
        ),
        com_bulge=bulge(_com_bound(plan, rates, accelerations), pieces.lengths),
        cog_bulge=bulge(
            acceleration_bound(
                Chain((), (), float(np.linalg.norm(plan.robot.centre))), rates, accelerations
            ),
            pieces.lengths,
        ),
    )


def foot_chain(plan: Plan, leg: str) -> Chain:
    """The hinges between the base and a foot's frame."""
    model = plan.robot.model
    frame = model.frames[model.getFrameId(plan.robot.legs[leg].foot)]
    return chain_to(model, frame.parentJoint, frame.placement.translation)


def configurations(values: FloatArray) -> FloatArray:
    """Pinocchio's configurations ``(N, nq)`` for path values ``(N, 6 + nj)``."""
    turn = Rotation.from_euler("ZYX", values[:, 5:2:-1]).as_quat()
    return np.concatenate([values[:, :3], turn, values[:, 6:]], axis=1)


def _owners(plan: Plan, pieces: Pieces) -> tuple[np.ndarray, BoolArray]:
    middle = pieces.starts + pieces.lengths / 2.0
    if not plan.phases:
        return np.zeros(len(middle), dtype=int), np.ones((len(middle), 4), dtype=np.bool_)
    starts = np.array([p.start for p in plan.phases])
    owner = np.clip(np.searchsorted(starts, middle, side="right") - 1, 0, None)
    table = np.array([[leg in p.support for leg in LEGS] for p in plan.phases])
    return owner, table[owner]


def _sample(plan: Plan, values: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Feet ``(N, 4, 3)``, COM and body centre ``(N, 3)`` at path values ``(N, 6 + nj)``."""
    model = plan.robot.model
    data = model.createData()
    frames = [model.getFrameId(plan.robot.legs[leg].foot) for leg in LEGS]
    count = len(values)
    feet, com, cog = np.empty((count, 4, 3)), np.empty((count, 3)), np.empty((count, 3))
    centre = plan.robot.body_axes @ plan.robot.centre
    for row, q in enumerate(configurations(values)):
        com[row] = pin.centerOfMass(model, data, q)
        pin.updateFramePlacements(model, data)
        cog[row] = data.oMi[1].act(centre)
        for i, frame in enumerate(frames):
            feet[row, i] = data.oMf[frame].translation
    return feet, com, cog


def _com_bound(plan: Plan, rates: FloatArray, accelerations: FloatArray) -> FloatArray:
    """Bound on the second derivative of the COM: the masses' mean of their bounds."""
    model = plan.robot.model
    total = np.zeros(len(rates))
    mass = 0.0
    for joint in range(1, model.njoints):
        inertia = model.inertias[joint]
        chain = chain_to(model, joint, inertia.lever)
        total += inertia.mass * acceleration_bound(chain, rates, accelerations)
        mass += inertia.mass
    return total / mass
