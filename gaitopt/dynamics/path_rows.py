"""What forces and torques allow at places of a path, as rows.

At a place the contact forces that make the motion are ``f = F (u, x, 1) + N z``: linear in the
path acceleration ``u``, the squared path speed ``x`` and free coordinates ``z``, of which there
are three on three feet and six on four. So all limits are rows of ``u``, ``x`` and ``z``. Those of
all places with the same standing feet are computed at once, without a loop.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import NamedTuple, cast

import numpy as np

from gaitopt.conventions import GRAVITY, BoolArray, FloatArray
from gaitopt.dynamics.contacts import ForceLimits, pyramid_rows
from gaitopt.dynamics.path_intervals import TimingLimits
from gaitopt.dynamics.small_programs import NO_BOUND
from gaitopt.dynamics.torque_limits import TorqueLines, effort_limits, torque_lines
from gaitopt.dynamics.whole_body import PathDynamics
from gaitopt.robots.files.joint_limits import PLACEHOLDER_VELOCITY
from gaitopt.robots.quadruped import Quadruped

RANK = {0: 0, 1: 3, 2: 5}
"""Rank of the base's six equations in the forces of so few feet; of more feet it is six. Three
feet on one line then ask for forces without bound, which no limit allows."""
ZERO_SINGULAR_VALUE = 1e-12
"""Least singular value that is divided by, so that feet on one line give no division by zero."""
LEAST_TOUCH = 0.02
"""Least speed of a joint, as a share of its limit (or of its speed without load, where the limit is
a placeholder), at which a tangent touches the root of the path speed's square: nearer to rest
tangents are too steep to be of use, but for lines that end there."""
KEPT_AT_REST = 0.7
"""Share of a torque that tangents leave at rest, where few joints need more: so the robot can rest
wherever it can rest with the whole torque, in nearly all places."""
SAME_GRASP = 1e-13
"""Largest difference of two grasp matrices, of order one, that are taken for the same: a few times
their rounding. While the body rests, feet that stand have the same matrix at every place."""


@dataclass(frozen=True, eq=False)
class PlaceRows:
    """Limits of forces and torques at places: ``low <= by_u u + by_x x + by_z z <= high``.

    In shares of the weight and of torque limits; arrays over ``n`` places, ``r`` rows and ``d``
    coordinates of the contact forces.
    """

    by_u: FloatArray
    by_x: FloatArray
    by_z: FloatArray
    low: FloatArray
    high: FloatArray


def place_rows(
    robot: Quadruped,
    dynamics: PathDynamics,
    limits: ForceLimits,
    pattern: BoolArray,
    samples: np.ndarray,
    timing: TimingLimits,
) -> PlaceRows:
    """The limits at samples at which the same feet stand.

    Args:
        robot: the robot.
        dynamics: at all samples.
        limits: on forces and torques.
        pattern: which feet stand ``(4,)``.
        samples: the places ``(n,)``.
        timing: what sides of friction pyramids keep, the speeds near which the torque falls, and
            largest normal forces.
    """
    feet, n = np.flatnonzero(pattern), len(samples)
    found = _force_rows(robot, dynamics, limits, pattern, samples)
    torques, missing = (rows.stop - rows.start for rows in (found.torques, found.missing))
    sides = len(feet) * limits.sides
    floor = np.concatenate([np.full(sides, timing.slack), limits.least_normal_shares(pattern)[feet],
                            -np.ones(torques), np.zeros(missing)])  # fmt: skip
    ceiling = np.concatenate([np.full(sides + len(feet), NO_BOUND), np.ones(torques),
                              np.zeros(missing)])  # fmt: skip
    rest = found.by_terms[..., 2]
    if timing.most is not None:
        ceiling = np.tile(ceiling, (n, 1))
        most = np.minimum(timing.most[np.ix_(samples, feet)], NO_BOUND)
        ceiling[:, sides : sides + len(feet)] = most
    high = np.where(ceiling < NO_BOUND, ceiling - rest, NO_BOUND)
    rows = PlaceRows(found.by_terms[..., 0], found.by_terms[..., 1], found.by_z, floor - rest, high)
    lines = torque_lines(robot, limits) if timing.falling else None
    if lines is None:
        return rows
    torque, turning = found.by_terms[:, found.torques], found.by_z[:, found.torques]
    return _joined(rows, _falling(robot, lines, timing, samples, torque, turning))


class _ForceRows(NamedTuple):
    """What limits look at, at ``n`` places: ``by_terms (u, x, 1) + by_z z``; arrays are read-only.

    Attributes:
        by_terms: ``(n, r, 3)``.
        by_z: ``(n, r, d)``.
        torques, missing: the rows of torques, and those of what the feet cannot make.
    """

    by_terms: FloatArray
    by_z: FloatArray
    torques: slice
    missing: slice


def _force_rows(
    robot: Quadruped, dynamics: PathDynamics, limits: ForceLimits, pattern: BoolArray,
    samples: np.ndarray,
) -> _ForceRows:  # fmt: skip
    """What does not depend on the timing; the same places are asked for several times."""
    key = "rows", limits, pattern.tobytes(), samples.tobytes()
    if key not in dynamics.kept:
        dynamics.kept[key] = _new_force_rows(robot, dynamics, limits, pattern, samples)
    return cast(_ForceRows, dynamics.kept[key])


def _new_force_rows(
    robot: Quadruped, dynamics: PathDynamics, limits: ForceLimits, pattern: BoolArray,
    samples: np.ndarray,
) -> _ForceRows:  # fmt: skip
    """:func:`_force_rows`, computed."""
    feet, n = np.flatnonzero(pattern), len(samples)
    weight, length = robot.mass * GRAVITY, robot.stance_size[0] / 2.0
    # (n, nv, 3): what u, x and 1 ask for.
    terms = np.stack(
        [dynamics.acceleration[samples], dynamics.speed[samples], dynamics.gravity[samples]], axis=2
    )
    scale = np.array([1.0] * 3 + [1.0 / length] * 3)[:, None]
    wrench = scale * terms[:, :6] / weight
    jacobians = dynamics.contacts.jacobians[np.ix_(samples, feet)]
    grasp = scale * np.moveaxis(jacobians[..., :6], -1, 1).reshape(n, 6, 3 * len(feet))
    left, values, right = _decomposed(grasp)
    rank = RANK.get(len(feet), 6)
    share = np.swapaxes(left[:, :, :rank], 1, 2) @ wrench
    share /= np.maximum(values[:, :rank, None], ZERO_SINGULAR_VALUE)
    plain = np.swapaxes(right[:, :rank], 1, 2) @ share
    basis = np.swapaxes(right[:, rank:], 1, 2)
    # What the feet cannot make must vanish by itself.
    missing = np.swapaxes(left[:, :, rank:], 1, 2) @ wrench
    own = np.ix_(samples, feet)
    normals, grip = dynamics.contacts.normals[own], dynamics.contacts.grip[own]
    forces = plain.reshape(n, len(feet), 3, 3)
    bases = basis.reshape(n, len(feet), 3, basis.shape[2])
    pyramids = np.zeros((n, 0, limits.sides, 3))
    if len(feet):
        pyramids = pyramid_rows(limits, normals, grip)
    slip = pyramids @ forces, pyramids @ bases
    upward = normals[:, :, None]
    press = (upward @ forces)[:, :, 0], (upward @ bases)[:, :, 0]
    torque, turning = _torques(robot, terms, jacobians, plain, basis, limits)
    free, sides = basis.shape[2], len(feet) * limits.sides
    by_terms = np.concatenate([slip[0].reshape(n, -1, 3), press[0], torque, missing], axis=1)
    by_z = np.concatenate(
        [slip[1].reshape(n, sides, free), press[1], turning, np.zeros((n, 6 - rank, free))], axis=1
    )
    first = sides + len(feet)
    last = first + torque.shape[1]
    for kept in (by_terms, by_z):
        kept.setflags(write=False)
    return _ForceRows(by_terms, by_z, slice(first, last), slice(last, by_terms.shape[1]))


def _falling(
    robot: Quadruped, lines: TorqueLines, timing: TimingLimits, samples: np.ndarray,
    torque: FloatArray, turning: FloatArray,
) -> PlaceRows:  # fmt: skip
    """Rows of torques that fall with the speed of their joints.

    From the knee on the torque that drives a joint, as a share of what may be used, is at most
    ``(no_load - speed) / (no_load - knee)``, where the speed goes with the root of ``x``. A root
    lies below its tangents, so a tangent makes a limit that is linear and nowhere higher; where it
    touches it is exact.

    Args:
        robot: the robot.
        lines: how torques fall.
        timing: the squared speeds near which tangents touch.
        samples: the places ``(n,)``.
        torque, turning: by u, x and 1 ``(n, t, 3)`` and by z ``(n, t, d)``, of joints with a limit.
    """
    known = np.flatnonzero(np.isfinite(effort_limits(robot).limits))
    own = np.flatnonzero(np.isfinite(lines.no_load[known]))
    joints = known[own]
    # Speeds along the path at unit speed.
    slope = (timing.first / timing.scales)[samples][:, joints]
    expected = timing.squares if timing.expected is None else timing.expected
    speed = np.abs(slope) * np.sqrt(np.minimum(expected[samples], NO_BOUND))[:, None]
    no_load, span = lines.no_load[joints], lines.span[joints]
    # A tangent that touches farther out takes more of the torque at rest; this is above 0.
    fastest = 2.0 * (no_load - KEPT_AT_REST * span)
    limit = robot.velocity_limits[joints]
    least = LEAST_TOUCH * np.where(limit < PLACEHOLDER_VELOCITY, limit, no_load)
    touch = np.clip(speed, np.minimum(least, fastest), fastest)
    signed = np.sign(slope)[..., None] * torque[:, own]
    return PlaceRows(
        by_u=signed[..., 0],
        by_x=signed[..., 1] + slope**2 / (2.0 * touch * span),
        by_z=np.sign(slope)[..., None] * turning[:, own],
        low=np.full(slope.shape, -NO_BOUND),
        high=(no_load - touch / 2.0) / span - signed[..., 2],
    )


def _joined(first: PlaceRows, second: PlaceRows) -> PlaceRows:
    """The rows of both."""
    return PlaceRows(*(
        np.concatenate([getattr(first, f.name), getattr(second, f.name)], axis=1)
        for f in fields(PlaceRows)
    ))  # fmt: skip


def _decomposed(grasp: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Singular value decompositions of ``grasp (n, 6, 3 k)``; of neighbours that agree only one."""
    new = np.ones(len(grasp), dtype=np.bool_)
    new[1:] = np.abs(np.diff(grasp, axis=0)).max(axis=(1, 2), initial=0.0) > SAME_GRASP
    left, values, right = np.linalg.svd(grasp[new])
    run = np.cumsum(new) - 1
    return left[run], values[run], right[run]


def _torques(
    robot: Quadruped, terms: FloatArray, jacobians: FloatArray, plain: FloatArray,
    basis: FloatArray, limits: ForceLimits,
) -> tuple[FloatArray, FloatArray]:  # fmt: skip
    """Torques as shares of what may be used: of u, x and 1 ``(n, t, 3)``, and of z ``(n, t, d)``.

    Joints without a known limit are left out.
    """
    weight, n = robot.mass * GRAVITY, len(terms)
    largest = limits.torque_share * effort_limits(robot).limits
    known = np.flatnonzero(np.isfinite(largest))
    levers = jacobians[..., 6 + known].reshape(n, plain.shape[1], len(known))
    by_force = weight / largest[known][:, None] * np.swapaxes(levers, 1, 2)
    torque = terms[:, 6 + known] / largest[known][:, None] - by_force @ plain
    return torque, -by_force @ basis
