"""Where a robot can stand: the horizontal places of its centre of mass at which it can rest.

On level ground, with enough friction and strong joints, this is the support polygon. In general it
is the projection of all contact forces that hold the robot at rest, that lie in their friction
pyramids, that press each foot to the ground, and that the joints can bear. It is convex, larger
than the support polygon where tilted contacts hold the robot from both sides, and smaller where
joints are weak. Sources: [Bretl2008] without torque limits, [Orsolino2020] with them.

Joint torques depend on the joint angles, and these on where the body is. Here the torque limits are
those of *one* posture of the robot: the region is exact for a centre of mass anywhere, if the joint
angles and the contacts stay those of this posture. Its error grows with the distance of the centre
of mass from the place that it has in this posture (:meth:`FeasibleRegion.distance_from_posture`).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from gaitopt.conventions import LEGS, FloatArray, frozen
from gaitopt.dynamics.contacts import Contacts, ForceLimits
from gaitopt.dynamics.region.polygon import corner_indices, hull_indices
from gaitopt.dynamics.region.programs import has_slack
from gaitopt.dynamics.region.projection import EMPTY_SLACK, LEAST_TOLERANCE, project
from gaitopt.dynamics.region.result import FeasibleRegion, RegionStatus
from gaitopt.dynamics.region.rows import (
    LARGEST_NORMAL_SHARE,
    StandingLegs,
    friction_rows,
    standing_legs,
    torque_rows,
)
from gaitopt.dynamics.region.stance import Stance, stances
from gaitopt.errors import InputError
from gaitopt.inputs import as_text, check_number, check_shape
from gaitopt.robots.leg_names import as_leg
from gaitopt.robots.quadruped import Quadruped

DEFAULT_TOLERANCE: Final = 5e-4
"""Distance between inner and outer polygon [m]: half a millimetre, a hundredth of the stability
margins of walks."""


def feasible_region(
    robot: Quadruped,
    feet: ArrayLike,
    normals: ArrayLike = (0.0, 0.0, 1.0),
    limits: ForceLimits | None = None,
    support: Sequence[str] = LEGS,
    posture: ArrayLike | None = None,
    *,
    torques: bool = True,
    tolerance: float = DEFAULT_TOLERANCE,
    grip: ArrayLike = 1.0,
) -> FeasibleRegion:
    """The horizontal places of the COM at which ``robot`` can rest on its feet.

    Args:
        robot: the robot.
        feet: foot frames ``(4, 3)`` [m], in the order of :data:`gaitopt.LEGS`; those in the air
            may be anything.
        normals: of the ground below the feet, of any length, broadcast to ``(4, 3)``.
        limits: friction, least normal forces, share of the torques; ``ForceLimits()`` by default.
        support: the legs that stand, two at least.
        posture: x, y, z [m], roll, pitch, yaw [rad] of the base ``(6,)``, for which torques are
            limited. By default the body is level over the middle of the standing feet, at
            :attr:`Quadruped.standing_height`.
        torques: whether joint torques are limited. Those of legs in the air are not looked at.
        tolerance: largest distance between the inner and the outer polygon [m].
        grip: friction of each contact as a share of that of the limits, from 0 to 1, broadcast to
            ``(4,)``.

    Raises:
        InputError: robot or limits are something else, shapes do not fit, a number is outside its
            range, a leg is unknown or does not reach its foot, fewer than two feet stand, or all at
            one place.
        SolverError: the linear programs were not solved.
    """
    support = [as_leg(leg) for leg in support]
    unknown = [leg for leg in support if leg not in LEGS]
    if unknown:
        raise InputError(f"support: {unknown[0]!r} is unknown; legs are {', '.join(LEGS)}")
    places = check_shape("feet", feet, 4, 3)
    if places.ndim != 2:
        raise InputError(f"feet must be (4, 3), got {places.shape}; see feasible_regions for many")
    standing = np.array([[leg in support for leg in LEGS]])
    return feasible_regions(
        robot, places[None], normals, limits, standing, posture,
        torques=torques, tolerance=tolerance, grip=grip,
    )[0]  # fmt: skip


def feasible_regions(
    robot: Quadruped,
    feet: ArrayLike,
    normals: ArrayLike = (0.0, 0.0, 1.0),
    limits: ForceLimits | None = None,
    standing: ArrayLike | None = None,
    postures: ArrayLike | None = None,
    *,
    torques: bool = True,
    tolerance: float = DEFAULT_TOLERANCE,
    grip: ArrayLike = 1.0,
) -> tuple[FeasibleRegion, ...]:
    """The regions of many stances: :func:`feasible_region`, with all matrices made at once.

    Args:
        robot: the robot.
        feet: foot frames ``(B, 4, 3)`` [m].
        normals: broadcast to ``(B, 4, 3)``.
        limits: for all stances.
        standing: which feet stand ``(B, 4)``; all by default.
        postures: ``(B, 6)``, or one for all.
        torques: whether joint torques are limited.
        tolerance: largest distance between the inner and the outer polygon [m].
        grip: friction of each contact as a share of that of the limits, broadcast to ``(B, 4)``.

    Raises:
        InputError: as in :func:`feasible_region`.
        SolverError: the linear programs were not solved.
    """
    if not isinstance(robot, Quadruped):
        raise InputError(f"robot must be a Quadruped (from load_robot), got {as_text(robot)}")
    check_number("tolerance", tolerance, LEAST_TOLERANCE, 1.0, "m")
    limits = ForceLimits.or_default(limits)
    places = check_shape("feet", feet, 4, 3)
    if places.ndim != 3:
        raise InputError(f"feet must be (B, 4, 3), got {places.shape}")
    if not len(places):
        return ()
    flags = np.ones(places.shape[:2], dtype=np.bool_) if standing is None else standing
    contacts = Contacts.below_feet(places, flags, robot.foot_radius, normals, grip)
    count = contacts.standing.sum(axis=1)
    if (count < 2).any():
        raise InputError(
            f"{int(count.min())} feet stand at sample {int(count.argmin())}; a robot rests on two "
            "feet at least"
        )
    legs = standing_legs(robot, contacts, limits, places, postures) if torques else None
    limited = None if legs is None else torque_rows(robot, contacts, legs)
    friction = friction_rows(contacts, limits)
    regions: list[FeasibleRegion | None] = [None] * len(places)
    for stance in stances(robot, contacts, limits, friction, limited):
        regions[stance.sample] = _region(stance, tolerance, legs)
    return tuple(region for region in regions if region is not None)


def _region(stance: Stance, tolerance: float, legs: StandingLegs | None) -> FeasibleRegion:
    """The region of one stance."""
    found = _on_level_ground(stance) or _by_projection(stance, tolerance)
    coms, forces = found.coms, found.forces
    return FeasibleRegion(
        status=found.status,
        legs=tuple(LEGS[i] for i in stance.feet),
        vertices=frozen(coms),
        outer_vertices=frozen(found.outer),
        gap=found.gap,
        tolerance=tolerance,
        points=frozen(stance.points),
        forces=frozen(stance.weight * forces),
        residual=stance.residual(forces, coms) if len(coms) else 0.0,
        violation=stance.violation(forces) if len(coms) else 0.0,
        posture=None if legs is None else frozen(legs.postures[stance.sample]),
        posture_com=None if legs is None else frozen(legs.com[stance.sample]),
    )


class _Polygons(NamedTuple):
    """Inner and outer polygon, and forces at the vertices of the inner one."""

    status: RegionStatus
    coms: FloatArray
    forces: FloatArray
    outer: FloatArray
    gap: float


def _on_level_ground(stance: Stance) -> _Polygons | None:
    """The region on level ground in closed form; ``None`` where it does not apply.

    All forces act at one height, so the COM is over the mean of the feet weighted by the vertical
    forces, whatever the horizontal ones are. Each foot keeps its least share, and at a vertex one
    foot carries all the rest. Vertical forces do it, and the region is found if the joints bear
    those at the vertices.
    """
    if not stance.level:
        return None
    m = len(stance.points)
    shares = stance.least + max(1.0 - m * stance.least, 0.0) * np.eye(m)
    forces = np.zeros((m, m, 3))
    forces[..., 2] = shares
    if stance.torques is not None:
        needed = np.einsum("mri,kmi->kmr", stance.torques.matrix, forces)
        if not (needed <= stance.torques.bounds).all():
            return None
    middle = stance.balanced.com
    coms = middle + shares @ (stance.points[:, :2] - middle)
    corners = hull_indices(coms)
    status = RegionStatus.SOLVED if len(corners) >= 3 else RegionStatus.SEGMENT
    return _Polygons(status, coms[corners], forces[corners], coms[corners], 0.0)


def _by_projection(stance: Stance, tolerance: float) -> _Polygons:
    """The region by linear programs."""
    projection = project(stance.polytope(stance.rows), tolerance)
    if projection is None:
        nothing = np.empty((0, 2))
        forces = np.empty((0, len(stance.points), 3))
        return _Polygons(_why_empty(stance), nothing, forces, nothing, 0.0)
    forces = stance.balanced.forces + np.einsum(
        "mij,kj->kmi", stance.balanced.basis, projection.points
    )
    coms = stance.balanced.com + projection.points @ stance.balanced.com_basis.T
    corners = corner_indices(coms)
    outer = projection.outer[corner_indices(projection.outer)]
    # The last of the friction rows is the normal force, which is bounded from above.
    pressing = np.einsum("mi,kmi->km", stance.friction.matrix[:, -1], forces[corners])
    if pressing.max() > LARGEST_NORMAL_SHARE * (1.0 - 1e-6):
        status = RegionStatus.FORCE_LIMITED
    elif len(corners) < 3:
        status = RegionStatus.SEGMENT
    else:
        status = RegionStatus.SOLVED
    return _Polygons(status, coms[corners], forces[corners], outer, projection.gap)


def _why_empty(stance: Stance) -> RegionStatus:
    """Whether forces are missing, or the torques for them."""
    if stance.torques is None:
        return RegionStatus.NO_FORCES
    without_torques = stance.polytope([stance.friction])
    return (
        RegionStatus.NO_TORQUES
        if has_slack(without_torques, EMPTY_SLACK)
        else RegionStatus.NO_FORCES
    )
