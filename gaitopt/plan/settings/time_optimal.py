"""Settings of the time-optimal walk."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np

from gaitopt.dynamics.contacts import ForceLimits
from gaitopt.errors import InputError
from gaitopt.inputs import check_count
from gaitopt.plan.settings.base import FORCES, MARGIN_SHARE, check_names, set_number
from gaitopt.plan.settings.freedoms import VARIANTS, Freedoms
from gaitopt.plan.settings.over_footholds import FootholdSettings
from gaitopt.robots.abilities import has_quick_joints
from gaitopt.robots.quadruped import Quadruped

SLOWEST_RAMP = 10.0
"""Longest time in which an acceleration limit may take a joint to its velocity limit [s]; a lower
limit is refused as a mistake, since a joint would hardly get to speed within a step."""
RAMP = 0.05
"""Time in which the slowest joint of a dynamic walk reaches its velocity limit, by default [s]."""
FINE_KNOTS = {"stance_knots": 4, "swing_knots": 12}
"""Intervals of the phases of a walk along splines whose timing forces set, on robots with slow
joints. Such a walk has sharp turns, where joints change their directions, and each takes two knots.
16 steps of wang2020 (``swing``, seed 0) take 28.7 s with these, 29.5 s with 3 and 10, 30.0 s with 3
and 8, and 28.7 s with 5 and 16."""
DYNAMIC_KNOTS = {"stance_knots": 2, "swing_knots": 12}
"""The same of dynamic walks, whose stances are as short as the shortest spans let them be. 64 steps
of wang2020 (seeds 0 to 3) take 41.83 to 41.93 s with these and 42.54 to 42.66 s with 4 and 12, and
the planner 11 to 34 % less time. With one knot a stance they take another 0.8 % less, but joints
reach 127 to 130 % of their velocity limits in physics, where 130 % are tolerated (121 % with
two)."""
FINE_SIDES = 8
"""Sides of friction pyramids where such a walk turns sharply: with a level body. 64 steps of
``swing`` take 0.15 % less time than with the usual four, of ``height`` 0.28 %, and the timing a
tenth more processor time."""
MOST_STEPS = 10_000
"""Longest horizon, so that a wrong number is refused."""
MOST_ITERATIONS = 100_000
"""Most Newton steps that may be asked for, so that a wrong number is refused."""


@dataclass(frozen=True)
class RouteSettings(FootholdSettings):
    """Settings of a walk over given footholds whose steps are all optimised at once.

    Attributes:
        free: what is free beyond the body's targets (:class:`gaitopt.Freedoms`), the name of a
            variant, or the names of what is free. The variants: ``"route"`` frees nothing;
            ``"overlap"``: the body moves during swings; ``"swing"``: the swing curve, too;
            ``"height"``: the body's height, too; ``"posture"``: its roll, pitch and yaw, too;
            ``"dynamic"``: contact forces keep the balance, and no static margin is kept; with the
            timing ``"velocity"`` the ZMP of a point mass at the body centre keeps the stability
            margin at every instant, and joint accelerations are bounded.
            A ``body_height`` that is free begins at the one that is given.
        clearance: a foot that flies on a free curve is this much higher than the higher of its two
            footholds wherever it is not within the columns' radius of one of their axes [m].
        stance_knots, swing_knots: intervals of the problem in each phase.
        margin_reserve: added to the stability margin at knots, so that it holds between them [m].
        clearance_reserve: the same for the clearance [m].
        horizon: plan in windows of this many steps, as a robot would that knows no more of its way,
            and keep the first half of each; ``None`` for all steps at once.
        iterations: most Newton steps of each solution.

    ``acceleration_limit`` bounds every joint [rad/s^2]. Where the swing curve is free the motion
    then is a spline; a box is flown with a stop at each corner, and wherever else body or foot
    change direction. With the sequence ``"free"`` each of the six cycles is planned, and the order
    that is searched for, and the fastest plan is taken. The other fields are those of
    :class:`FootholdSettings` and :class:`PlanSettings`.

    Raises:
        InputError: a value is out of range, or settings exclude one another.
    """

    planner: ClassVar[str] = "route"

    free: Freedoms = VARIANTS["swing"]
    clearance: float = 0.02
    stance_knots: int = 2
    swing_knots: int = 8
    margin_reserve: float = 2e-5
    clearance_reserve: float = 5e-4
    horizon: int | None = None
    iterations: int = 300

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "free", Freedoms.of(self.free))
        set_number(self, "clearance", 0.0, 100.0, "m")
        set_number(self, "margin_reserve", 0.0, 1.0, "m")
        set_number(self, "clearance_reserve", 0.0, 1.0, "m")
        counts = [("stance_knots", 1, 64), ("swing_knots", 4, 64)]
        counts += [("iterations", 1, MOST_ITERATIONS)]
        counts += [] if self.horizon is None else [("horizon", 2, MOST_STEPS)]
        for name, least, most in counts:
            object.__setattr__(self, name, check_count(name, getattr(self, name), least, most))
        if self.true_com and not self.static and self.forces is None:
            raise InputError(
                "com='model' does not go with a dynamic walk of the timing 'velocity', whose ZMP "
                "is that of the body centre; leave com out, or take timing='forces'"
            )
        if not (self.smooth or self.static):
            raise InputError("free: a dynamic walk needs an acceleration_limit")
        if self.smooth and self.free.swing and not self.free.overlap:
            raise InputError(
                "a free 'swing' needs 'overlap' to be free, too, with an acceleration_limit or the "
                "timing 'forces': the swing's spline moves with the body's"
            )

    @classmethod
    def for_robot(cls, robot: Quadruped, **options: Any) -> RouteSettings:
        """Settings that fit a robot, save for those that are given.

        Lengths fit its size; a dynamic walk's ``acceleration_limit`` takes the slowest joint to its
        velocity limit in :data:`RAMP`; knots are as many as the kind of walk needs, and friction
        pyramids finer where joints are slow and the body is level.
        """
        check_names(cls, options)
        forces = options.get("timing") in (None, FORCES)
        wanted = options.get("free")
        free = Freedoms.of(VARIANTS["swing"] if wanted is None else wanted)
        lowest = float(robot.acceleration_limits.min(initial=np.inf))
        # A foot on a free curve goes on without a stop, so forces ask for a smooth path.
        limit = _acceleration(robot, free.dynamic and not forces, options.get("acceleration_limit"))
        bounded = limit is not None or forces or bool(np.isfinite(lowest))
        stops, smooth = (bounded and free.swing is curved for curved in (False, True))
        knots = {
            "stance_knots": 1 if stops else 3 if smooth else 4 if free.posture else 2,
            "swing_knots": 8 if free.swing else 6 if stops else 12,
        }
        if forces and smooth and not has_quick_joints(robot):
            knots = DYNAMIC_KNOTS if free.dynamic else FINE_KNOTS
            if options.get("forces") is None and not (free.posture or free.dynamic):
                options = {**options, "forces": ForceLimits(sides=FINE_SIDES)}
        kept = {k: v for k, v in options.items() if not (v is None and k in knots)}
        return super().for_robot(robot, **{**knots, **kept, "free": free,
                                           "acceleration_limit": limit})  # fmt: skip

    @classmethod
    def fitted(cls, robot: Quadruped) -> dict[str, Any]:
        """The fields that depend on the robot's size, by name."""
        clearance = round(MARGIN_SHARE * robot.standing_height, 4)
        return {**super().fitted(robot), "clearance": clearance}

    def within(self, robot: Quadruped) -> RouteSettings:
        """The same, with no limit above the lowest of the robot's joints where joints time it.

        Where forces do, each joint keeps its own.
        """
        lowest = float(robot.acceleration_limits.min(initial=np.inf))
        now = np.inf if self.acceleration_limit is None else self.acceleration_limit
        if self.forces is not None or lowest >= now:
            return self
        return replace(self, acceleration_limit=lowest)

    @property
    def static(self) -> bool:
        """Whether static stability is promised; a dynamic walk keeps its ZMP inside instead."""
        return not self.free.dynamic

    @property
    def zmp_margin(self) -> float | None:
        """The stability margin, of a dynamic walk that promises no forces."""
        return None if self.static or self.forces else self.stability_margin

    @property
    def smooth(self) -> bool:
        """Whether the motion is to have no corners but at stops.

        So it is where joint accelerations are bounded, and where forces set the timing of a free
        swing curve.
        """
        return self.acceleration_limit is not None or (self.forces is not None and self.free.swing)


def _acceleration(robot: Quadruped, bounded: bool, asked: Any) -> Any:
    """The acceleration limit of every joint [rad/s^2], where there is one."""
    slowest = float(min(leg.velocity_limits.min() for leg in robot.legs.values()))
    if asked is None and bounded:
        return round(slowest / RAMP, 6)
    if isinstance(asked, (int, float)) and 0.0 < asked < slowest / SLOWEST_RAMP:
        raise InputError(
            f"acceleration_limit is {asked:g} rad/s^2, with which a joint needs more than "
            f"{SLOWEST_RAMP:g} s to its velocity limit of {slowest:.3g} rad/s; take at least "
            f"{slowest / SLOWEST_RAMP:.3g}"
        )
    return asked
