"""``plan_stand_up``: from any state to rest on four feet, and where feet then stand or step to."""

from __future__ import annotations

import numpy as np

from gaitopt.conventions import GRAVITY, LEGS, FloatArray
from gaitopt.dynamics.contacts import ForceLimits
from gaitopt.entering.walking import plan_from_state
from gaitopt.inputs import check_kind, check_number
from gaitopt.motion.path import MotionPath
from gaitopt.plan.plan import Plan
from gaitopt.plan.record import CrawlRecord
from gaitopt.plan.settings.crawl import CrawlSettings
from gaitopt.plan.state import State
from gaitopt.robots.quadruped import Quadruped
from gaitopt.robots.rotations import rpy_to_matrix
from gaitopt.robots.standing import foot_below_hip
from gaitopt.robots.whole_body import base_of_body, feet_from_joints, joints_from_feet
from gaitopt.terrain.footholds import Footholds

STEPS = ("RH", "RF", "LH", "LF")
"""Order in which feet step into a stance: that of a crawl."""
RECORD = "contact forces; the robot rests in the end"
"""What such a plan says of its balance."""


def plan_stand_up(
    robot: Quadruped,
    state: State,
    footholds: Footholds | None = None,
    *,
    height: float | None = None,
    heading: float | None = None,
    forces: ForceLimits | None = None,
) -> Plan:
    """Plan the way from a state to standing: at rest on four feet, with the body level.

    A robot that sits, or lies with its feet below it, rises. One that walks or trots stops: the
    body brakes, feet in the air land, and the body moves above the middle of the feet. It is a plan
    without steps.

    Args:
        robot: from :func:`gaitopt.load_robot`.
        state: where it is, and how it moves.
        footholds: the first of each leg is where its foot stands, or lands. By default feet stand
            where they are, and others land below their hips, ahead by how far the body's speed
            would carry it, at the mean height of the feet that stand.
        height: of the hips above the mean height of the feet in the end [m]; by default
            :attr:`gaitopt.Quadruped.standing_height`.
        heading: direction that the body then faces [rad]; by default the one it faces.
        forces: limits on contact forces and joint torques; the defaults of :class:`ForceLimits`.

    Returns:
        The plan; all of its phases are part of its entry (:attr:`gaitopt.Plan.entry`).

    Raises:
        InputError: this is no robot or no state, the state is that of another robot, or a number is
            out of range.
        InfeasibleStateError: there is no such way; tells which limit is in the way.
    """
    check_kind("robot", robot, Quadruped)
    check_kind("state", state, State)
    robot.require_masses()
    yaw = body_yaw(robot, state)
    if heading is not None:
        yaw = check_number("heading", heading, -1e3, 1e3, "rad")
    rise = robot.standing_height if height is None else height
    rise = check_number("height", rise, 1e-3, 100.0, "m")
    limits = ForceLimits.or_default(forces)
    # A heading of settings is within a full turn.
    settings = CrawlSettings.for_robot(
        robot, body_height=rise, forces=limits, heading=float(np.remainder(yaw, 2.0 * np.pi))
    )
    stands = footholds_of(robot, state) if footholds is None else footholds
    check_kind("footholds", stands, Footholds)
    only = stands.with_(
        **{name: _firsts(getattr(stands, name)) for name in ("points", "normals", "friction")},
        order=None, swing_heights=None, postures=None, body_places=None,
    )  # fmt: skip

    def stand(over: Footholds, _: FloatArray) -> Plan:
        feet = np.array([over[leg][0] for leg in LEGS])
        centre = feet.mean(axis=0) + np.array([0.0, 0.0, rise])
        base = base_of_body(robot, centre, rpy_to_matrix([0.0, 0.0, yaw]))
        joints = joints_from_feet(robot, base[:3], base[3:], feet)
        path = MotionPath.polyline([0.0], [np.concatenate([base, joints])])
        return Plan(robot, over, settings, (), path, CrawlRecord(stability=RECORD))

    return plan_from_state(robot, only, state, settings, stand)


def _firsts(of_legs: object) -> dict[str, FloatArray] | None:
    return None if of_legs is None else {leg: of_legs[leg][:1] for leg in LEGS}  # type: ignore[index]


def body_yaw(robot: Quadruped, state: State) -> float:
    """Direction that the body of a state faces [rad]."""
    ahead = rpy_to_matrix(state.columns[3:6]) @ robot.body_axes[:, 0]
    return float(np.arctan2(ahead[1], ahead[0]))


def footholds_of(robot: Quadruped, state: State) -> Footholds:
    """Where the feet of a state stand, or where those in the air may land, one for each leg.

    The latter are below their hips, and ahead by how far the body's speed would carry a pendulum of
    its height until it is at rest.
    """
    place, rpy = state.columns[:3], state.columns[3:6]
    feet = feet_from_joints(robot, place, rpy, state.q[7:])
    standing = np.array([leg in state.support for leg in LEGS])
    level = float(feet[standing, 2].mean()) if standing.any() else float(feet[:, 2].min())
    turned = rpy_to_matrix([0.0, 0.0, body_yaw(robot, state)])
    height = max(float(place[2]) - level, 0.0)
    ahead = state.column_rates[:2] * np.sqrt(height / GRAVITY)
    for i in np.flatnonzero(~standing).tolist():
        below = turned @ foot_below_hip(robot.legs[LEGS[i]], height)
        feet[i] = np.append(place[:2] + below[:2] + ahead, level)
    return Footholds({leg: feet[i][None] for i, leg in enumerate(LEGS)})


def square_stance(robot: Quadruped, state: State) -> Footholds:
    """Footholds on which a robot steps into its usual stance, for ``plan_crawl(..., start=state)``.

    Feet that are too near to one another, or too far apart, step below the hips; those that are
    there already stay. The stance is around the middle of the feet, at their mean height, and faces
    where the body does.

    Args:
        robot: from :func:`gaitopt.load_robot`.
        state: where it is; feet in the air first land as for :func:`plan_stand_up`.

    Returns:
        For each leg where its foot stands, and where it steps to if it does. They name the order of
        the steps; there are none where the robot stands as usual.

    Raises:
        InputError: this is no robot or no state.
    """
    check_kind("robot", robot, Quadruped)
    check_kind("state", state, State)
    now = footholds_of(robot, state)
    feet = np.array([now[leg][0] for leg in LEGS])
    usual = np.array([foot_below_hip(robot.legs[leg], robot.standing_height) for leg in LEGS])
    turned = rpy_to_matrix([0.0, 0.0, body_yaw(robot, state)])
    places = feet.mean(axis=0) + (usual - usual.mean(axis=0)) * [1.0, 1.0, 0.0] @ turned.T
    far = np.linalg.norm((places - feet)[:, :2], axis=1) > now.landing_radius
    steps = {leg: [feet[i], places[i]][: 1 + far[i]] for i, leg in enumerate(LEGS)}
    order = [leg for leg in STEPS if far[LEGS.index(leg)]]
    return Footholds({leg: np.array(at) for leg, at in steps.items()}, order=order)
