"""Where contact forces hold the robot during each swing, as half-planes for the body centre.

Area A of [Wang2020] is the support triangle, shrunken by the stability margin. Contact forces ask
for more where joints are weak or every foot keeps a large reserve: the true centre of mass (COM)
has to be in the region of :mod:`gaitopt.dynamics.feasible_region` as well. Its torque limits are
those of one posture, so it is computed for the body where it was found to be, with the change of
its sides when the body moves, and then anew. The body and the three legs that stand are at rest
during a swing, so one region holds for all of it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gaitopt.conventions import LEGS, BoolArray, FloatArray, rotation_z
from gaitopt.dynamics.contacts import ContactGround, ForceLimits
from gaitopt.dynamics.feasible_region import feasible_regions
from gaitopt.dynamics.region.result import FeasibleRegion
from gaitopt.dynamics.region.rows import FOOT_TOLERANCE
from gaitopt.dynamics.region.vertical import vertical_forces_hold
from gaitopt.motion.body_and_feet import base_poses
from gaitopt.planners.phase_by_phase.centre_of_mass import nearer
from gaitopt.planners.phase_by_phase.steps import CrawlSteps, feet_in_body
from gaitopt.robots.quadruped import Quadruped
from gaitopt.robots.whole_body import joints_from_feet_in_body

KEPT = 0.5
"""Share of the asked distance from a region's sides that is enough: the region moves a little with
the posture, so that the distance that was asked for is not met exactly."""
TRIED = 0.01
"""How far the body is moved to see how the region changes with its posture [m]."""


class SwingStances(NamedTuple):
    """The robot during swings, its body at rest, in the world.

    Attributes:
        feet: places of the feet, the flying one where it lifts off ``(S, 4, 3)`` [m].
        flying: index of the leg that flies ``(S,)``.
        postures: x, y, z [m], roll, pitch, yaw [rad] of the base ``(S, 6)``.
        coms: horizontal places of the COM ``(S, n, 2)`` [m].
        within: whether every standing leg reaches its foot within its joint limits ``(S,)``.
        ground: below the feet, for ``S`` samples.
    """

    feet: FloatArray
    flying: np.ndarray
    postures: FloatArray
    coms: FloatArray
    within: BoolArray
    ground: ContactGround

    @classmethod
    def of(
        cls,
        robot: Quadruped,
        steps: CrawlSteps,
        heading: float,
        cogs: FloatArray,
        offsets: FloatArray,
    ) -> SwingStances:
        """Those of a walk.

        Args:
            robot, steps: the walk.
            heading: of the walk [rad].
            cogs: body centre during each swing ``(S, 3)`` [m], in the heading frame.
            offsets: of the COM from it during each swing ``(S, n, 2)`` [m].
        """
        local = feet_in_body(robot, steps.feet, cogs, steps.swing_turns)
        with np.errstate(invalid="ignore"):
            joints = joints_from_feet_in_body(robot, local)[:, robot.leg_joint_columns]
        low, high = robot.position_limits[:, robot.leg_joint_columns]
        # Comparisons with NaN are false.
        kept = ((joints >= low) & (joints <= high)).reshape(*local.shape[:2], -1).all(axis=2)
        for i, name in enumerate(LEGS):
            kept[:, i] &= robot.legs[name].shortfall(local[:, i]) <= FOOT_TOLERANCE / 2.0
        kept[np.arange(len(kept)), steps.indices] = True
        to_world = rotation_z(heading).T
        coms = (cogs[:, None, :2] + offsets) @ to_world[:2, :2]
        within = kept.all(axis=1) & np.isfinite(coms).all(axis=(1, 2))
        tilts = np.zeros(3) if steps.tilts is None else steps.tilts[1:]
        return cls(steps.feet @ to_world, steps.indices, base_poses(robot, heading, cogs, tilts),
                   coms, within, steps.ground)  # fmt: skip


def half_planes_by_forces(
    robot: Quadruped,
    steps: CrawlSteps,
    heading: float,
    limits: ForceLimits,
    cogs: FloatArray,
    offsets: FloatArray,
    room: FloatArray,
) -> dict[int, FloatArray]:
    """Half-planes for the body centre, before the swings in which forces do not hold the robot.

    Steps whose legs do not reach their feet are not looked at: they are refused later, with the
    reason. Neither are those for which there is no place of the COM in this posture.

    Args:
        robot, steps: the walk.
        heading: of the walk [rad].
        limits: what is asked of forces and torques.
        cogs: body centre during each swing ``(S, 3)`` [m], in the heading frame.
        offsets: of the COM from it during each swing ``(S, n, 2)`` [m].
        room: distance that the COM is to keep from the sides of the region ``(S,)`` [m].

    Returns:
        By step: x and y of inward normals, and offsets [m] ``(k, 3)``, in the heading frame,
        without the room.
    """
    stances = SwingStances.of(robot, steps, heading, cogs, offsets)
    reached = np.flatnonzero(stances.within)
    if not reached.size:
        return {}
    feet, flying, postures, coms = (part[reached] for part in stances[:4])
    held = vertical_forces_hold(
        robot,
        feet,
        flying,
        postures,
        coms,
        limits,
        KEPT * room[reached],
        stances.ground.at(reached),
    )
    regions = {
        step: region
        for step, region in regions_in_swings(robot, stances, reached[~held], limits).items()
        if not region.empty and region.margin(stances.coms[step]).min() < KEPT * room[step]
    }
    if not regions:
        return {}
    # A region that is a single place has more half-planes than corners.
    changes = {step: np.zeros((len(r.half_planes.offsets), 2)) for step, r in regions.items()}
    for axis in range(2):
        moved = SwingStances.of(robot, steps, heading, cogs + TRIED * np.eye(3)[axis], offsets)
        which = np.array([step for step in regions if moved.within[step]], dtype=int)
        for step, other in regions_in_swings(robot, moved, which, limits).items():
            if not other.empty:
                planes = regions[step].half_planes
                shifted = (planes.normals @ other.vertices.T).min(axis=1) - planes.offsets
                changes[step][:, axis] = shifted / TRIED
    return {
        step: _for_body_centre(region, heading, cogs[step, :2], offsets[step], changes[step])
        for step, region in regions.items()
    }


def _for_body_centre(
    region: FeasibleRegion, heading: float, cog: FloatArray, offsets: FloatArray, change: FloatArray
) -> FloatArray:
    """Half-planes for the body centre ``(k, 3)``, from those of the COM.

    Args:
        region: for the body centre at ``cog``, in the world.
        heading: of the walk [rad].
        cog: in the heading frame ``(2,)`` [m].
        offsets: of the COM from it during the swing ``(n, 2)`` [m].
        change: of the distances of the region's sides from the origin, by the place of the body
            ``(k, 2)``.
    """
    planes = region.half_planes
    normals = planes.normals @ rotation_z(heading)[:2, :2]
    # n (p + o) >= d + change (p - cog) for the body centre p and all offsets o of the COM.
    least = planes.offsets + nearer(normals[None], offsets[None])[0] - change @ cog
    return np.column_stack([normals - change, least])


def regions_in_swings(
    robot: Quadruped, stances: SwingStances, which: np.ndarray, limits: ForceLimits
) -> dict[int, FeasibleRegion]:
    """Where the COM may be during swings, in the world, by the number of the stance.

    Args:
        robot: the robot.
        stances: the robot during swings.
        which: numbers of those that are looked at, whose legs reach their feet.
        limits: what is asked of forces and torques.
    """
    feet, flying, postures = (part[which] for part in stances[:3])
    standing = np.ones(feet.shape[:2], dtype=np.bool_)
    standing[np.arange(len(standing)), flying] = False
    ground = stances.ground.at(which)
    regions = feasible_regions(
        robot, feet, ground.normals, limits, standing, postures, grip=ground.grip
    )
    return dict(zip(which.tolist(), regions, strict=True))
