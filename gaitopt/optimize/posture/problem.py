"""The posture problem: where to hold the body over given feet, with all six degrees of freedom.

The unknowns are the body's pose and, for each place that a foot must reach, the joint angles of its
leg. Every knee has one side to which it points, so reach and joint limits are bounds on angles, and
each closed chain is an equation without square roots or cases. The problem is to move the body as
little as possible, in a weighted sense, from the pose before, while the body centre keeps a margin
inside the support polygon.

The foot of a leg without roll joint stays in the plane of thigh and shank. With point feet that do
not slide this leaves a body little freedom. Let the feet of a level robot be ``2 w`` apart, as the
planes of its legs are. A body with a roll angle of ``phi`` needs them ``2 w / cos(phi)`` apart:
each must slide by ``w (1 / cos(phi) - 1)``, 1 mm for frog1 at 5 degrees. Yaw, and a shift sideways,
move the planes away from the feet in proportion. So x, z and pitch remain, unless feet may be a
little beside their planes (``plane_tolerance``), as the paper's were: its Section V.B reports that
feet slip and that joints have play.

Source: [Shao2011], Section IV, which describes the postures in words.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Final, Literal

import numpy as np
from numpy.typing import ArrayLike

from gaitopt.conventions import LEGS, FloatArray, frozen
from gaitopt.errors import InputError
from gaitopt.inputs import as_text, check_number
from gaitopt.optimize.posture.formulation import PostureFormulation, posture_formulation
from gaitopt.robots.leg_angles import pitch_angles
from gaitopt.robots.leg_names import as_leg, by_leg
from gaitopt.robots.quadruped import Quadruped
from gaitopt.robots.rotations import rpy_to_matrix
from gaitopt.robots.whole_body import base_of_body
from gaitopt.stability.support import support_half_planes

FREEDOMS: Final[tuple[str, ...]] = ("x", "y", "z", "roll", "pitch", "yaw")
"""The body's degrees of freedom, in the order of a pose."""
LEVEL = 1e-9
"""Roll angle below which a body counts as level [rad], for rounding."""
Objective = Literal["motion", "margin"]
Reaching = tuple[str, FloatArray]


@dataclass(frozen=True, eq=False)
class BodyPose:
    """Position and orientation of the body in the world.

    Attributes:
        centre: of the body, :attr:`Quadruped.centre`, in the world ``(3,)`` [m].
        rpy: roll, pitch and yaw of the body frame, x forward and z up ``(3,)`` [rad].
    """

    centre: FloatArray
    rpy: FloatArray

    def __post_init__(self) -> None:
        for name in ("centre", "rpy"):
            object.__setattr__(self, name, _three_numbers(name, getattr(self, name)))

    @cached_property
    def axes(self) -> FloatArray:
        """Axes of the body frame as columns in the world ``(3, 3)``."""
        return frozen(rpy_to_matrix(self.rpy))

    @property
    def numbers(self) -> FloatArray:
        """x, y, z, roll, pitch, yaw ``(6,)``."""
        return np.concatenate([self.centre, self.rpy])

    def origin(self, robot: Quadruped) -> FloatArray:
        """Origin of the body frame in the world ``(3,)`` [m]."""
        return np.asarray(self.centre - self.axes @ robot.centre)

    def base(self, robot: Quadruped) -> FloatArray:
        """The base's x, y, z, roll, pitch, yaw ``(6,)``, as in a :class:`gaitopt.Plan`."""
        return base_of_body(robot, self.centre, self.axes)

    def in_body(self, robot: Quadruped, points: ArrayLike) -> FloatArray:
        """World ``points (..., 3)`` in the body frame [m]."""
        return np.asarray((np.asarray(points, np.float64) - self.origin(robot)) @ self.axes)


@dataclass(frozen=True, eq=False)
class PostureProblem:
    """The posture problem with numbers.

    Attributes:
        robot: the robot.
        start: the pose before.
        feet: where the feet are ``(4, 3)`` [m].
        support: the legs that stand.
        reaching: legs and the places ``(3,)`` [m] that they must reach without moving the body.
        margin: least static stability margin [m].
        reach_fraction: share of each leg's reach that may be used.
        plane_tolerance: how far a foot may be beside the plane of a leg without roll [m].
        free: the degrees of freedom that may change.
        weights: of squared changes of the six degrees of freedom, [1] and [m^2/rad^2].
        height_weight: additional weight of a squared change of height [1].
        objective: ``"motion"``, or ``"margin"`` for the pose of the largest margin.
    """

    robot: Quadruped
    start: BodyPose
    feet: FloatArray
    support: tuple[str, ...]
    reaching: tuple[Reaching, ...]
    margin: float
    reach_fraction: float
    plane_tolerance: float
    free: tuple[str, ...]
    weights: FloatArray
    height_weight: float
    objective: Objective = "motion"

    @property
    def formulation(self) -> PostureFormulation:
        """The symbolic problem."""
        return posture_formulation(self.robot, tuple(leg for leg, _ in self.reaching))

    @property
    def has_planar_leg(self) -> bool:
        """Whether a leg has no roll joint, and so keeps its foot in a plane of the body."""
        return not all(leg.has_roll for leg in self.robot.legs.values())

    def starting_at(self, start: BodyPose) -> PostureProblem:
        """The same problem from another pose."""
        return replace(self, start=start)

    def largest_margin(self) -> PostureProblem:
        """The same problem, asking for the largest margin."""
        return replace(self, objective="margin")


def build_posture_problem(
    robot: Quadruped,
    feet: Mapping[str, ArrayLike],
    start: BodyPose,
    *,
    swing: str | None = None,
    places: Sequence[ArrayLike] = (),
    margin: float = 0.02,
    reach_fraction: float = 1.0,
    plane_tolerance: float = 0.0,
    free: Sequence[str] = FREEDOMS,
    weights: ArrayLike | None = None,
    height_weight: float = 0.0,
    objective: Objective = "motion",
) -> PostureProblem:
    """Build the problem of holding the body over given feet.

    Args:
        robot: the robot.
        feet: where each foot is ``(3,)`` [m].
        start: the pose before, from which motion is measured.
        swing: the leg that lifts off next; ``None`` for four feet that stand.
        places: further places that the swinging leg must reach from the same pose, for instance
            its next foothold ``(n, 3)`` [m].
        margin: least distance of the body centre's projection from the sides of the support
            polygon of the standing feet [m].
        reach_fraction: share of each leg's reach that may be used.
        plane_tolerance: how far a foot may be beside its leg's plane [m], for legs without roll
            joint.
        free: which of ``"x" "y" "z" "roll" "pitch" "yaw"`` may change.
        weights: of the squared changes of these six ``(6,)``; by default 1 for positions, and for
            angles the squared distance of the hips from the axis: half the length or width of the
            stance.
        height_weight: additional weight of a squared change of the body's height.
        objective: ``"motion"``, or ``"margin"`` for the largest margin.

    Raises:
        InputError: a name is unknown, a number out of range, or the feet support no area.
    """
    stands, swing = _feet(feet), as_leg(swing)
    if swing is not None and not (isinstance(swing, str) and swing in LEGS):
        raise InputError(f"swing must be one of {', '.join(LEGS)} or None, got {as_text(swing)}")
    if swing is None and len(places):
        raise InputError("places are for the leg that swings; name it, or leave them out")
    support = tuple(leg for leg in LEGS if leg != swing)
    support_half_planes(stands[[LEGS.index(leg) for leg in support]])
    unknown = [name for name in free if name not in FREEDOMS]
    if unknown:
        raise InputError(f"free names {unknown[0]!r}; there are {', '.join(FREEDOMS)}")
    if objective not in ("motion", "margin"):
        raise InputError(f"objective must be 'motion' or 'margin', got {as_text(objective)}")
    reaching = [(leg, frozen(stands[i])) for i, leg in enumerate(LEGS)]
    reaching += [(str(swing), _three_numbers("a foot's place", point)) for point in places]
    return PostureProblem(
        robot=robot, start=start, feet=frozen(stands), support=support, reaching=tuple(reaching),
        margin=check_number("margin", margin, -10.0, 10.0),
        reach_fraction=check_number("reach_fraction", reach_fraction, 1e-3, 1.0),
        plane_tolerance=check_number("plane_tolerance", plane_tolerance, 0.0, 1.0),
        free=tuple(free), weights=_weights(robot, weights),
        height_weight=check_number("height_weight", height_weight, 0.0, 1e6), objective=objective,
    )  # fmt: skip


def angle_bounds(
    robot: Quadruped, leg: str, reach_fraction: float
) -> tuple[FloatArray, FloatArray]:
    """Least and greatest joint angles of a leg ``(nj,)`` [rad]: limits, knee side and reach."""
    one = robot.legs[leg]
    low, high = one.position_limits[0].copy(), one.position_limits[1].copy()
    # The knee's angle is between that of the longest leg that is allowed, and half a turn.
    _, least = pitch_angles(0.0, -reach_fraction * one.reach, one.upper, one.lower, one.knee)
    ends = np.sort(one.signs[-1] * (np.array([least, one.knee * np.pi]) - one.zeros[1]))
    low[-1], high[-1] = max(low[-1], ends[0]), min(high[-1], ends[1])
    return low, high


def feet_by_leg(feet: Mapping[str, Any]) -> dict[str, Any]:
    """Places of the feet with the names of :data:`gaitopt.LEGS`, under whatever names they come.

    Raises:
        InputError: a leg is missing, unknown, or comes twice.
    """
    named = by_leg("feet", feet)
    missing = [leg for leg in LEGS if leg not in named]
    if missing:
        raise InputError(f"feet need exactly {', '.join(LEGS)}, got {', '.join(map(str, feet))}")
    return named


def _feet(feet: Mapping[str, ArrayLike]) -> FloatArray:
    named = feet_by_leg(feet)
    return np.array([_three_numbers("a foot's place", named[leg]) for leg in LEGS])


def _three_numbers(name: str, given: ArrayLike) -> FloatArray:
    """``given`` as a read-only array ``(3,)``.

    Raises:
        InputError: it is not three finite numbers.
    """
    try:
        values = frozen(given)
    except (TypeError, ValueError):
        values = frozen([])
    if values.shape != (3,) or not np.isfinite(values).all():
        raise InputError(f"{name} must be three finite numbers, got {as_text(given)}")
    return values


def _weights(robot: Quadruped, weights: ArrayLike | None) -> FloatArray:
    """Six checked weights, or the default ones."""
    if weights is None:
        length, width = (size / 2.0 for size in robot.stance_size)
        return frozen([1.0, 1.0, 1.0, width**2, length**2, length**2 + width**2])
    given = np.asarray(weights, dtype=np.float64)
    if given.shape != (6,) or not (np.isfinite(given).all() and (given > 0.0).all()):
        raise InputError(f"weights must be six positive numbers, got {as_text(weights)}")
    return frozen(given)
