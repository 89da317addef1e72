"""Settings of the search for footholds on a map."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from gaitopt.inputs import check_count, check_kind, check_number
from gaitopt.plan.settings.base import check_names
from gaitopt.plan.settings.over_footholds import force_margin
from gaitopt.robots.quadruped import Quadruped
from gaitopt.robots.standing import foot_below_hip

STEP_SHARE = 0.55
"""Length of a step as a share of the standing height. Chosen: longer ones reach the limits of hind
legs uphill, shorter ones take more time."""
FREEDOM_SHARE = 0.4
"""How far from its usual place a foot may step, as a share of the standing height."""
SWING_SHARE = 0.12
"""Least height of a swing above its higher end, as a share of the standing height."""
CLEARANCE_SHARE = 0.05
"""Clearance of flying feet above what lies between, as a share of the standing height."""
LIMB_SHARE = 0.03
"""Clearance of limbs and trunk, as a share of the standing height."""
START_TIME, METRE_TIME = 4.0, 2.0
"""Processor time after which a search ends without a way, for each search and for each metre of it
[s], with the usual `width_limit`; a wider search may take longer in the same proportion. Chosen:
nearly all walks over the hardest ground that are found take less (docs/terrain_table.md)."""
LONGER = 8.0
"""Time after which all searches for one goal end, as a multiple of that of one. Chosen: six ways of
walking take half of it, the same ways beside the course a quarter, and the rest is for finer
searches; a refusal over 3 m takes 80 s at most."""
WALKS_LONGER = 4.0
"""The same for walks that are planned over what was found. Chosen: anymal_c over rubble (seed 20,
3 m) needs 26 to 32 s of the 40 s that this gives over 3 m."""
EXHAUSTIVE_TIMES = 2.5
"""Time of an exhaustive search, in times of the usual ones: 200 s over 3 m for all searches."""

HEIGHT_SHARE = 1.15
"""Height of the body as a share of the standing height, where the joints allow it. Chosen: limbs
are then higher above the ground, and legs still reach footholds that are lower than others."""


def usual_height(robot: Quadruped) -> float:
    """Height of the hips above the mean of the feet where none is asked for [m]."""
    height = round(HEIGHT_SHARE * robot.standing_height, 4)
    for leg in robot.legs.values():
        foot = foot_below_hip(leg, height)
        low, high = leg.position_limits
        angles = leg.inverse(foot)
        if leg.shortfall(foot) > 0.0 or (angles < low).any() or (angles > high).any():
            return robot.standing_height
    return height


@dataclass(frozen=True)
class TerrainSettings:
    """What the search for footholds asks for.

    Attributes:
        step_length: how far each leg moves on in a cycle [m].
        stance: how far front and hind feet usually are from one another, as a share of the distance
            of the standing robot.
        freedom: how far a foot may step from its usual place [m].
        body_height: of the hips above the mean of the feet [m].
        swing_height: least height of a swing above its higher end [m].
        clearance: of flying feet above the ground between their footholds [m].
        limb_clearance: of limbs and trunk from the ground [m].
        stability_margin: static stability margin of the centre of mass [m].
        reach_fraction: share of the legs' reach that is used.
        follow: share of the ground's slope that the body takes, 0 for a level body.
        friction: coefficient of friction of the ground.
        edge_margin: least distance of a foothold from an edge [m].
        width: states that are kept after each step (the beam's width).
        width_limit: width up to which the search is repeated where it finds no way.
        time_budget: time, from the search's begin on, until which it goes on for a better walk
            once it has one [s]. What it then finds depends on how fast the machine is; with 0 it
            does not.
        time_limit: time after which the search ends at a dead end, and after twice this time
            anyway [s]; by default :meth:`longest_in_all`, and at least the time budget. Both are
            processor time.
        detours: whether the course goes round what the robot cannot cross; not for goals with yaw.
        exhaustive: whether steps are looked at as finely as there is a way to, in all orders of the
            legs and with more ways of walking: a check of refusals, which takes up to 2.5 times as
            long.

    Raises:
        InputError: a value is out of range.
    """

    step_length: float
    freedom: float
    body_height: float
    swing_height: float
    clearance: float
    limb_clearance: float
    stability_margin: float
    stance: float = 1.0
    reach_fraction: float = 0.98
    follow: float = 1.0
    friction: float = 0.6
    edge_margin: float = 0.02
    width: int = 6
    width_limit: int = 192
    time_budget: float = 0.0
    time_limit: float | None = None
    detours: bool = True
    exhaustive: bool = False

    def __post_init__(self) -> None:
        for name, low in (
            ("step_length", 1e-3), ("freedom", 1e-3), ("body_height", 1e-3), ("swing_height", 0.0),
            ("clearance", 0.0), ("limb_clearance", 0.0), ("stability_margin", 0.0),
        ):  # fmt: skip
            object.__setattr__(self, name, check_number(name, getattr(self, name), low, 1e3, "m"))
        check_number("stance", self.stance, 0.1, 2.0)
        check_number("reach_fraction", self.reach_fraction, 0.05, 1.0)
        check_number("follow", self.follow, 0.0, 1.0)
        check_number("edge_margin", self.edge_margin, 0.0, 10.0, "m")
        check_number("friction", self.friction, 1e-3, 10.0)
        check_count("width", self.width, 1, 10_000)
        check_number("time_budget", self.time_budget, 0.0, 1e6, "s")
        if self.time_limit is not None:
            check_number("time_limit", self.time_limit, 0.0, 1e6, "s")
        check_kind("detours", self.detours, bool)
        check_kind("exhaustive", self.exhaustive, bool)
        check_count("width_limit", self.width_limit, 1, 100_000)

    def longest(self, metres: float) -> float:
        """Processor time after which one search ends, for a course of some length [m], in seconds.

        Where no time limit is given, other ways of walking and wider beams are then tried.
        """
        check_number("metres", metres, 0.0, 1e9)
        if self.time_limit is not None:
            return self.time_limit
        usual = TerrainSettings.width_limit
        longest = (START_TIME + METRE_TIME * metres) * max(self.width_limit / usual, 1.0)
        longest *= EXHAUSTIVE_TIMES if self.exhaustive else 1.0
        # A small budget for a better walk must not cost the first one.
        return max(longest, self.time_budget)

    def longest_in_all(self, metres: float) -> float:
        """Processor time after which all searches over some length [m] end, in seconds."""
        return self.longest(metres) * (LONGER if self.time_limit is None else 1.0)

    def longest_for_walks(self, metres: float) -> float:
        """Processor time in which other walks are planned where one is refused, in seconds."""
        return self.longest(metres) * (WALKS_LONGER if self.time_limit is None else 1.0)

    @classmethod
    def for_robot(cls, robot: Quadruped, **options: Any) -> TerrainSettings:
        """Settings to a robot's size, save for those that are given by name.

        Raises:
            InputError: an option is unknown, or a value is out of range.
        """
        check_kind("robot", robot, Quadruped)
        height = robot.standing_height
        fitted = {
            "step_length": round(STEP_SHARE * height, 4),
            "freedom": round(FREEDOM_SHARE * height, 4),
            "body_height": usual_height(robot),
            "swing_height": round(SWING_SHARE * height, 4),
            "clearance": round(CLEARANCE_SHARE * height, 4),
            "limb_clearance": round(LIMB_SHARE * height, 4),
            "stability_margin": force_margin(robot),
        }
        check_names(cls, options)
        given = {name: value for name, value in options.items() if value is not None}
        return cls(**{**fitted, **given})
