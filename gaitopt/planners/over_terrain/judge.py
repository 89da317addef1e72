"""Judges possible steps: where the body goes, and whether anything is in the way.

The questions are asked in the order in which they cost least for what they refuse.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from gaitopt.conventions import LEGS, OTHER_LEGS, BoolArray, FloatArray
from gaitopt.planners.over_terrain.heights import (
    Attempt,
    Heights,
    feet_and_poses,
)
from gaitopt.planners.over_terrain.links.beside_trunk import BesideTrunk
from gaitopt.planners.over_terrain.links.limbs import Limbs
from gaitopt.planners.over_terrain.pairs import Cause, Judged, Pairs
from gaitopt.planners.over_terrain.places import BodyPlaces
from gaitopt.planners.over_terrain.settings import TerrainSettings
from gaitopt.planners.over_terrain.surfaces import Surfaces
from gaitopt.planners.over_terrain.triangles import new_places
from gaitopt.planners.over_terrain.ways.fineness import USUAL, Fineness
from gaitopt.robots.quadruped import Quadruped
from gaitopt.robots.rotations import rpy_to_matrix

ANGLE_RESERVE = 0.02
"""How far joints keep from their limits [rad]. Chosen: the plan's body may be some millimetres from
where the search puts it."""
APART = 0.01
"""Distance that feet keep from each other beside their radii [m]."""
CROSSING = 0.25
"""Least distance, ahead and sideways, of feet that must not cross, as a share of the stance."""
SWING_SHARES = (0.0, 0.25, 0.5, 0.75, 1.0)
"""Places along the top of a box swing that are looked at."""
SAME = 2e-3
"""Places of the body that are nearer to each other than this are not both tried [m]."""
AHEAD = (0.4, 0.8)
"""How far ahead the body is when a new foothold is judged once more, in step lengths."""


@dataclass(frozen=True, eq=False)
class Judge:
    """Judges pairs for one robot on one map.

    Attributes:
        robot, settings, surfaces: whose steps, what is asked for, and the ground.
        limbs: the robot's links over the ground.
        hips: usual places of the feet from the body centre, body frame ``(4, 2)`` [m].
        foot_size: number of the feet's table of :class:`Surfaces` ``(1,)``.
    """

    robot: Quadruped
    settings: TerrainSettings
    surfaces: Surfaces
    limbs: Limbs
    hips: FloatArray
    foot_size: np.ndarray

    @cached_property
    def usual_feet(self) -> FloatArray:
        """Where feet usually stand, from the body centre, as seen from above ``(4, 2)`` [m]."""
        return np.asarray(self.hips * np.array([self.settings.stance, 1.0]))

    @cached_property
    def places(self) -> BodyPlaces:
        """Places that the body may go to."""
        return BodyPlaces.of(self.robot, self.limbs, self.settings, self.hips)

    @cached_property
    def heights(self) -> Heights:
        """Heights of the body from which legs reach their feet."""
        return Heights.of(self.robot, self.limbs, self.settings)

    @cached_property
    def beside_trunk(self) -> BesideTrunk:
        """Angles at which thighs would touch the trunk."""
        return BesideTrunk.of(self.robot)

    @classmethod
    def of(cls, robot: Quadruped, settings: TerrainSettings, surfaces: Surfaces) -> Judge:
        """The judge of a robot's steps."""
        legs = [robot.legs[leg] for leg in LEGS]
        hips = np.array([leg.hip[:2] + leg.axes[:2, 1] * leg.lateral for leg in legs])
        limbs = Limbs.of(robot, surfaces, settings.limb_clearance)
        foot = surfaces.sizes([robot.foot_radius])
        return cls(robot, settings, surfaces, limbs, hips - robot.centre[:2], foot)

    def judge(self, pairs: Pairs, fineness: Fineness = USUAL) -> Judged:
        """Which pairs are possible, and how.

        What is not possible in the usual way is tried in others, as many as ``fineness`` says.
        """
        found = self._tried(pairs, fineness.attempts[0], fineness.grid)
        # Where a leg reaches its foot at no height, no other height has to be tried.
        none = np.zeros(len(pairs.target), dtype=np.bool_)
        hopeless: dict[float, BoolArray] = {}
        for attempt in (*fineness.attempts[1:], *fineness.rare):
            most = 1.0 - fineness.few if attempt in fineness.rare else fineness.enough
            if (~found.possible).sum() <= most * len(pairs.target):
                break
            left = np.flatnonzero(~found.possible & ~hopeless.get(attempt.pitch, none))
            if not left.size:
                continue
            other = self._tried(pairs.chosen(left), attempt, fineness.grid)
            now = left[other.possible]
            for mine, its in zip(found[:4], other[:4], strict=True):
                mine[now] = its[other.possible]
            if attempt.fitted:
                hopeless[attempt.pitch] = none.copy()
                hopeless[attempt.pitch][left[~other.reached]] = True
        return found

    def _tried(self, pairs: Pairs, attempt: Attempt, grid: int) -> Judged:
        """Which pairs are possible in one way."""
        count = len(pairs.target)
        body, rise, prospects = np.full((count, 6), np.nan), np.zeros(count), np.zeros(count)
        possible, within = (np.zeros(count, dtype=np.bool_) for _ in range(2))
        refused: Counter[Cause] = Counter()
        left = np.arange(count)

        def keep(kept: BoolArray, cause: Cause) -> None:
            nonlocal left
            refused[cause] += int((~kept).sum())
            left = left[kept]

        apart: BoolArray = self._apart(pairs)
        keep(apart, Cause.APART)
        now = pairs.chosen(apart)
        posture = self.postures(now, attempt.height)
        posture[:, 2] += attempt.pitch
        places, there = self.places.of_pairs(now, posture, grid)
        keep(there, Cause.MARGIN)
        now, posture, places = self._kept(there, now, posture, places)
        if attempt.fitted:
            places[..., 2] = self.heights.fitted(now, posture, places)
        reached = self._reached(now, posture, places) & new_places(places, SAME)
        somewhere = np.array(reached.any(axis=1), dtype=np.bool_)
        keep(somewhere, Cause.REACH)
        within[left] = True
        now, posture, places, reached = self._kept(somewhere, now, posture, places, reached)
        paths, rise[left] = self._swings(now, attempt.low)
        # The first place that is reached is most often clear. If not, all others are tried at once.
        first = np.zeros_like(reached)
        first[np.arange(len(left)), reached.argmax(axis=1)] = True
        others = reached & ~first
        for asked in (first, others):
            own, place = np.nonzero(asked & ~possible[left, None])
            if not own.size:
                break
            poses = np.concatenate([places[own, place], posture[own, 1:]], axis=1)
            clear = np.flatnonzero(self._clear(now.chosen(own), poses, paths[own], refused))
            own, row = np.unique(own[clear], return_index=True)
            poses, at = poses[clear[row]], left[own]
            body[at], possible[at] = poses, True
            prospects[at] = self._prospects(now.chosen(own), poses)
        return Judged(possible, body, rise, prospects, within, refused)

    def _clear(
        self, pairs: Pairs, poses: FloatArray, paths: FloatArray, refused: Counter[Cause]
    ) -> BoolArray:
        """Whether a swing is reached, and nothing touches the ground ``(K,)``; counts why not."""
        clear = np.zeros(len(poses), dtype=np.bool_)
        left = np.arange(len(poses))
        for cause in (Cause.SWING, Cause.TRUNK, Cause.LIMB):
            now, there = pairs.chosen(left), poses[left]
            if cause is Cause.TRUNK:
                kept = self.limbs.trunk_clear(now, there)
            else:
                asked = self._flown if cause is Cause.SWING else self.limbs.limbs_clear
                kept = asked(now, there, paths[left])
            refused[cause] += int((~kept).sum())
            left = left[kept]
        clear[left] = True
        return clear

    def _prospects(self, pairs: Pairs, poses: FloatArray) -> FloatArray:
        """At how many places of the body ahead the foothold would be of no use ``(K,)``.

        A foothold may be good now, and its leg touch the ground, or not reach it, when the body has
        moved on.
        """
        out = np.zeros(len(poses))
        # The body goes on as it faces, uphill and downhill as it is pitched.
        ahead = rpy_to_matrix(poses[:, 3:])[:, :, 0] * self.settings.step_length
        for share in AHEAD:
            later = poses.copy()
            later[:, :3] += share * ahead
            local = self.limbs.local(pairs.target[:, None], later)
            reached = self.within(pairs.leg, local[:, 0])[1]
            out += ~(reached & self.limbs.leg_clear(pairs.leg, pairs.target[:, None], later))
        return out

    def postures(self, pairs: Pairs, share: float = 1.0) -> FloatArray:
        """Height, roll, pitch and yaw of the body over the feet ``(K, 4)``.

        The body lies as the plane that fits best to the feet before and after the step.
        """
        after = pairs.feet.copy()
        after[:, pairs.leg] = pairs.target
        return self.posture_over((pairs.feet + after) / 2.0, pairs.yaw, share)

    def posture_over(self, feet: FloatArray, yaw: FloatArray, share: float = 1.0) -> FloatArray:
        """The same over feet ``(K, 4, 3)``, for a body that is turned by ``yaw (K,)``."""
        middle = feet.mean(axis=1)
        cosine, sine = np.cos(yaw), np.sin(yaw)
        turn = np.stack([np.stack([cosine, sine]), np.stack([-sine, cosine])]).transpose(2, 0, 1)
        away = feet - middle[:, None]
        flat = np.einsum("kij,klj->kli", turn, away[..., :2])
        gram = np.einsum("kli,klj->kij", flat, flat)
        slope = np.linalg.solve(gram, np.einsum("kli,kl->ki", flat, away[..., 2])[..., None])
        slope = self.settings.follow * slope[..., 0]
        pitch = -np.arctan(slope[:, 0])
        # After pitching, the y axis rises by sin(roll) cos(pitch) for each unit of its length.
        roll = np.arctan(slope[:, 1] * np.cos(pitch))
        height = middle[:, 2] + share * self.settings.body_height
        return np.column_stack([height, roll, pitch, yaw])

    @staticmethod
    def _kept(which: BoolArray, pairs: Pairs, *arrays: np.ndarray) -> tuple:  # type: ignore[type-arg]
        return (pairs.chosen(which), *(a[which] for a in arrays))

    def _apart(self, pairs: Pairs) -> BoolArray:
        """Whether the foot keeps apart from the others, and legs do not cross."""
        others = pairs.feet[:, OTHER_LEGS[pairs.leg]]
        away = np.linalg.norm(others - pairs.target[:, None], axis=2).min(axis=1)
        after = pairs.feet.copy()
        after[:, pairs.leg] = pairs.target
        cosine, sine = np.cos(pairs.yaw)[:, None], np.sin(pairs.yaw)[:, None]
        ahead = cosine * after[..., 0] + sine * after[..., 1]
        left = -sine * after[..., 0] + cosine * after[..., 1]
        lf, lh, rh, rf = range(4)
        length = CROSSING * float(np.ptp(self.hips[:, 0]))
        width = CROSSING * float(np.ptp(self.hips[:, 1]))
        kept = away >= 2.0 * self.robot.foot_radius + APART
        for front, hind in ((lf, lh), (rf, rh)):
            kept &= ahead[:, front] - ahead[:, hind] >= length
        for one, other in ((lf, rf), (lh, rh)):
            kept &= left[:, one] - left[:, other] >= width
        return np.array(kept, dtype=np.bool_)

    def within(self, leg: int, points: FloatArray) -> tuple[FloatArray, BoolArray]:
        """Joint angles for places ``(..., 3)`` of a foot in the body frame, and if all is kept."""
        own = self.robot.legs[LEGS[leg]]
        angles = own.inverse(points)
        low, high = own.position_limits
        kept = ((angles >= low + ANGLE_RESERVE) & (angles <= high - ANGLE_RESERVE)).all(axis=-1)
        kept &= self.beside_trunk.clear(leg, angles)
        share = own.straightness(*np.moveaxis(points, -1, 0))
        kept &= own.shortfall(points) <= 0.0
        kept &= share <= (self.settings.reach_fraction * own.reach) ** 2
        return angles, kept

    def _reached(self, pairs: Pairs, posture: FloatArray, places: FloatArray) -> BoolArray:
        """Whether all feet and the foothold are reached from places of the body ``(K, P)``."""
        count, choices = places.shape[:2]
        local = self.limbs.local(*feet_and_poses(pairs, posture, places))
        kept = np.ones(len(local), dtype=np.bool_)
        for k in range(5):
            kept &= self.within(k if k < 4 else pairs.leg, local[:, k])[1]
        return kept.reshape(count, choices)

    def _swings(self, pairs: Pairs, low: bool) -> tuple[FloatArray, FloatArray]:
        """Places along the box swings ``(K, n, 3)``, and how far they rise ``(K,)`` [m]."""
        rise = 0.0 if low else self.settings.swing_height
        start, end = pairs.feet[:, pairs.leg], pairs.target
        cell = self.surfaces.ground.resolution
        longest = float(np.linalg.norm((end - start)[:, :2], axis=1).max(initial=0.0))
        share = np.linspace(0.0, 1.0, int(np.ceil(longest / cell)) + 2)[:, None]
        line = start[:, None, :2] + share * (end - start)[:, None, :2]
        below = self.surfaces.clear_heights(line, self.foot_size).max(axis=1)
        higher = np.maximum(start[:, 2], end[:, 2])
        top = np.maximum(below + self.settings.clearance, higher + rise)
        shares = np.array(SWING_SHARES)[:, None]
        over = start[:, None] + shares * (end - start)[:, None]
        over[..., 2] = top[:, None]
        halfway = np.stack([start, end], axis=1)
        halfway[..., 2] = (halfway[..., 2] + top[:, None]) / 2.0
        return np.concatenate([over, halfway], axis=1), top - higher

    def _flown(self, pairs: Pairs, poses: FloatArray, paths: FloatArray) -> BoolArray:
        """Whether the leg reaches all places of its swing ``(K,)``."""
        finite = np.isfinite(paths).all(axis=(1, 2))
        local = self.limbs.local(np.nan_to_num(paths, posinf=1e3), poses)
        return np.asarray(finite & self.within(pairs.leg, local)[1].all(axis=1))
