"""What is asked only of steps that the beam would keep, because it costs most.

The flying leg must be clear of the ground between the places that were looked at before: on stairs
a foot rises by more than a tread's width, and its knee may go through an edge meanwhile. Links must
not touch one another while the body moves and the foot flies, and contact forces must hold the
robot on the three feet that stand, with the friction of the ground and the torques of the joints.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from gaitopt.conventions import LEGS, BoolArray, FloatArray
from gaitopt.dynamics.contacts import ContactGround, ForceLimits
from gaitopt.dynamics.feasible_region import feasible_regions
from gaitopt.dynamics.region.vertical import vertical_forces_hold
from gaitopt.optimize.route.centre_of_mass import MassDistribution
from gaitopt.planners.over_terrain.links.beside_trunk import BETWEEN_LINKS, gaps_to_keep
from gaitopt.planners.over_terrain.links.limbs import Limbs
from gaitopt.planners.over_terrain.pairs import Cause
from gaitopt.planners.over_terrain.states import Candidate, Layer
from gaitopt.robots.collisions.pairs import CollisionPairs
from gaitopt.robots.quadruped import Quadruped
from gaitopt.robots.rotations import rpy_to_matrix
from gaitopt.robots.whole_body import base_of_body

SHARES = (0.0, 0.5, 1.0)
"""Places along the top of a swing at which links are looked at."""
FINE = 0.06
"""Distance of the places along a swing at which its leg is looked at, as a share of the standing
height. Chosen: anymal_c lifts a foot by half of its height up steep stairs, and with places that
are a quarter of it apart its shank went 10 mm into an edge between two of them."""
MOST_FINE = 24
"""Most places along each part of a swing: up, over and down."""
FINE_SHARE = 0.5
"""Share of the limbs' clearance that is kept at these places: the plan's body may be some
millimetres from where the search puts it."""
ROOM = 1e-3
"""Distance that the centre of mass keeps from the sides of the region in which forces hold the
robot [m]: the planner of the walk moves the body farther inside."""
TOLERANCE = 1e-3
"""Largest distance of the region that is computed from the true one [m]; it lies inside."""


def box_swing(start: FloatArray, end: FloatArray, rise: float, spacing: float) -> FloatArray:
    """Places along a swing straight up, over and straight down ``(n, 3)`` [m], without its ends.

    Args:
        start, end: of the swing ``(3,)`` [m].
        rise: of its top above the higher end [m].
        spacing: of the places [m].
    """
    top = max(start[2], end[2]) + rise
    corners = np.array([start, [*start[:2], top], [*end[:2], top], end])
    parts = []
    for one, other in pairwise(corners):
        way = float(np.linalg.norm(other - one))
        count = min(int(np.ceil(way / spacing)), MOST_FINE)
        parts.append(one + np.linspace(0.0, 1.0, count + 1)[1:, None] * (other - one))
    return np.concatenate(parts)[:-1]


@dataclass(frozen=True, eq=False)
class LastLook:
    """Looks at steps for one robot.

    Attributes:
        robot, limbs: whose steps, and its links.
        masses: where the robot's mass is.
        shapes: pairs of links that must not touch; ``None`` where they are not known.
        gaps: distances that these keep ``(k,)`` [m].
        normals: of the ground at all stands ``(n, 3)``.
        limits: of contact forces and torques.
    """

    robot: Quadruped
    limbs: Limbs
    masses: MassDistribution
    shapes: CollisionPairs | None
    gaps: FloatArray
    normals: FloatArray
    limits: ForceLimits

    @classmethod
    def of(
        cls, robot: Quadruped, limbs: Limbs, normals: FloatArray, limits: ForceLimits
    ) -> LastLook:
        """The look at a robot's steps on the stands of a map."""
        shapes = CollisionPairs.of(robot)
        gaps = np.empty(0) if shapes is None else gaps_to_keep(robot, shapes)
        return cls(robot, limbs, MassDistribution.of(robot), shapes, gaps, normals, limits)

    def kept(self, layer: Layer, steps: Sequence[Candidate], refused: Counter[Cause]) -> BoolArray:
        """Which steps from the states of a layer are possible ``(K,)``; counts why others not."""
        kept = self._flies_clear(layer, steps)
        refused[Cause.LIMB] += int((~kept).sum())
        some = np.flatnonzero(kept)
        if not some.size:
            return kept
        joints = self._joints(layer, [steps[int(k)] for k in some])
        apart = self._apart(joints)
        refused[Cause.TOUCH] += int((~apart).sum())
        some, joints = some[apart], joints[apart]
        held = self._held(layer, [steps[int(k)] for k in some], joints[:, 1:])
        refused[Cause.FORCE] += int((~held).sum())
        kept[:] = False
        kept[some[held]] = True
        return kept

    def _flies_clear(self, layer: Layer, steps: Sequence[Candidate]) -> BoolArray:
        """Whether the flying leg is clear of the ground all along its box swing ``(K,)``."""
        out = np.ones(len(steps), dtype=np.bool_)
        limbs = replace(self.limbs, clearance=FINE_SHARE * self.limbs.clearance)
        spacing = FINE * self.robot.standing_height
        paths = [
            box_swing(layer.feet[step.state, step.leg], step.target, step.rise, spacing)
            for step in steps
        ]
        for leg in sorted({step.leg for step in steps}):
            own = [k for k, step in enumerate(steps) if step.leg == leg]
            number = np.repeat(own, [len(paths[k]) for k in own])
            poses = np.array([steps[k].body for k in own])[np.searchsorted(own, number)]
            places = np.concatenate([paths[k] for k in own])
            out[number[~limbs.leg_clear(leg, places[:, None], poses)]] = False
        return out

    def _joints(self, layer: Layer, steps: Sequence[Candidate]) -> FloatArray:
        """Angles of the legs ``(K, n, 4, 3)`` [rad] halfway to the new place, and in the swing."""
        state = [step.state for step in steps]
        body = np.array([step.body for step in steps])
        target = np.array([step.target for step in steps])
        leg = np.array([step.leg for step in steps])
        own = np.arange(len(steps))
        start = layer.feet[state, leg]
        top = np.maximum(start[:, 2], target[:, 2]) + np.array([step.rise for step in steps])
        over = start[:, None] + np.array(SHARES)[:, None] * (target - start)[:, None]
        over[..., 2] = top[:, None]
        flown = np.concatenate([start[:, None], start[:, None], over, target[:, None]], axis=1)
        count = flown.shape[1]
        feet = np.repeat(layer.feet[state][:, None], count, axis=1)
        feet[own, :, leg] = flown
        poses = np.repeat(body[:, None], count, axis=1)
        poses[:, 0] = (body + layer.body[state]) / 2.0
        local = self.limbs.local(feet.reshape(-1, 4, 3), poses.reshape(-1, 6))
        angles = [self.robot.legs[leg].inverse(local[:, k]) for k, leg in enumerate(LEGS)]
        return np.stack(angles, axis=1).reshape(len(steps), count, 4, 3)

    def _apart(self, joints: FloatArray) -> BoolArray:
        """Whether links keep apart at angles ``(K, n, 4, 3)`` [rad]: ``(K,)``."""
        if self.shapes is None or not len(joints):
            return np.ones(len(joints), dtype=np.bool_)
        poses = joints.reshape(-1, 12)
        near = self.shapes.near(poses, BETWEEN_LINKS)
        if not near:
            return np.ones(len(joints), dtype=np.bool_)
        kept = (self.shapes.distances(poses, near) >= self.gaps[near]).all(axis=1)
        return np.asarray(kept.reshape(joints.shape[:2]).all(axis=1), dtype=np.bool_)

    def _held(self, layer: Layer, steps: Sequence[Candidate], swings: FloatArray) -> BoolArray:
        """Whether contact forces hold the robot during swings with angles ``(K, n, 4, 3)``."""
        if not steps:
            return np.ones(0, dtype=np.bool_)
        state = [step.state for step in steps]
        flying = np.array([step.leg for step in steps])
        body = np.array([step.body for step in steps])
        turn = rpy_to_matrix(body[:, 3:])
        count = swings.shape[1]
        offsets = self.masses.com_in_body(swings.reshape(-1, 4, 3)).reshape(len(steps), count, 3)
        coms = body[:, None, :2] + (turn[:, None] @ offsets[..., None])[..., :2, 0]
        feet, normals = layer.feet[state], self.normals[layer.stands[state]]
        ground = ContactGround(normals, np.ones(feet.shape[:2]))
        postures = base_of_body(self.robot, body[:, :3], turn)
        room = np.full(len(steps), ROOM)
        held = vertical_forces_hold(
            self.robot, feet, flying, postures, coms, self.limits, room, ground
        )
        left = np.flatnonzero(~held)
        standing = np.ones((len(left), len(LEGS)), dtype=np.bool_)
        standing[np.arange(len(left)), flying[left]] = False
        regions = feasible_regions(
            self.robot, feet[left], normals[left], self.limits, standing, postures[left],
            tolerance=TOLERANCE,
        )  # fmt: skip
        for k, region in zip(left, regions, strict=True):
            held[k] = not region.empty and float(region.margin(coms[k]).min()) >= ROOM
        return held
