"""Settings of the time-optimal walk."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

from gaitopt.dynamics.contacts import ForceLimits
from gaitopt.errors import InputError
from gaitopt.inputs import check_count
from gaitopt.plan.settings.base import MARGIN_SHARE, check_names, one_of, set_number
from gaitopt.plan.settings.freedoms import VARIANTS, Freedoms
from gaitopt.plan.settings.over_footholds import FootholdSettings
from gaitopt.robots.quadruped import Quadruped

SLOWEST_RAMP = 10.0
"""Longest time in which an acceleration limit may take a joint to its velocity limit [s]; a lower
limit is refused as a mistake, since a joint would hardly get to speed within a step."""
RAMP = 0.05
"""Time in which the slowest joint of a dynamic walk reaches its velocity limit, by default [s]."""
FORCE_MARGIN_SHARE = 0.09
"""Stability margin of walks with forces as a share of the standing height. With a larger margin
forces may change more quickly, so the walk is faster: 16 steps of anymal_c take 7.7 s in place of
the 9.5 s with 0.05, and every foot stays on its foothold in physics (seed 0)."""
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
            ``"dynamic"``: the ZMP of a point mass at the body centre keeps the stability margin at
            every instant, in place of the body centre itself, and joint accelerations are bounded.
            A ``body_height`` that is free begins at the one that is given.
        clearance: a foot that flies on a free curve is this much higher than the higher of its two
            footholds wherever it is not within the columns' radius of one of their axes [m].
        stance_knots, swing_knots: intervals of the problem in each phase.
        margin_reserve: added to the stability margin at knots, so that it holds between them [m].
        clearance_reserve: the same for the clearance [m].
        com: what keeps the stability margin: ``"body"``, the body's centre, as in [Wang2020];
            ``"model"``, the true centre of mass of the whole robot with its legs. With ``"model"``
            neither a dynamic walk nor an acceleration limit is planned.
        forces: limits within which contact forces and joint torques must make the motion at every
            instant; ``None`` promises nothing of forces. With them the walk is straight: the swing
            curve is not free, and body and foot stop wherever they change direction. By default
            ``com`` then is ``"model"``, and the stability margin is larger.
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
    com: str = "body"
    forces: ForceLimits | None = None
    horizon: int | None = None
    iterations: int = 300

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "free", Freedoms.of(self.free))
        one_of("com", self.com, ("body", "model"))
        set_number(self, "clearance", 0.0, 100.0, "m")
        set_number(self, "margin_reserve", 0.0, 1.0, "m")
        set_number(self, "clearance_reserve", 0.0, 1.0, "m")
        counts = [("stance_knots", 1, 64), ("swing_knots", 4, 64)]
        counts += [("iterations", 1, MOST_ITERATIONS)]
        counts += [] if self.horizon is None else [("horizon", 2, MOST_STEPS)]
        for name, least, most in counts:
            object.__setattr__(self, name, check_count(name, getattr(self, name), least, most))
        if isinstance(self.forces, Mapping):
            object.__setattr__(self, "forces", ForceLimits.from_dict(self.forces))
        if not isinstance(self.forces, (ForceLimits, type(None))):
            raise InputError(f"forces must be ForceLimits or None, got {self.forces!r}")
        if self.forces is not None and self.free.swing:
            raise InputError(
                "forces are planned for box swings only: take free='route' or 'overlap', or leave "
                "forces out"
            )
        if self.acceleration_limit is None and not self.static:
            raise InputError("free: a dynamic walk needs an acceleration_limit")
        if self.smooth and self.free.swing and not self.free.overlap:
            raise InputError(
                "acceleration_limit with a free 'swing' needs 'overlap' to be free, too: the "
                "swing's spline moves with the body's"
            )
        if self.true_com and self.smooth and self.free.swing:
            raise InputError(
                "com='model' keeps static stability at the joints' velocity limits only: leave "
                "'dynamic' and acceleration_limit out, or take com='body'"
            )

    @classmethod
    def for_robot(cls, robot: Quadruped, **options: Any) -> RouteSettings:
        """Settings that fit a robot, save for those that are given.

        Lengths fit its size; a dynamic walk's ``acceleration_limit`` takes the slowest joint to its
        velocity limit in :data:`RAMP`; knots are as many as the kind of walk needs.
        """
        check_names(cls, options)
        forces = options.get("forces") is not None
        free = Freedoms.of(options.get("free") or VARIANTS["route" if forces else "swing"])
        limit = _acceleration(robot, free, options.get("acceleration_limit"))
        bounded = limit is not None or forces
        stops, smooth = (bounded and free.swing is curved for curved in (False, True))
        knots = {
            "stance_knots": 1 if stops else 3 if smooth else 4 if free.posture else 2,
            "swing_knots": 8 if free.swing else 6 if stops else 12,
        }
        kept = {k: v for k, v in options.items() if not (v is None and k in knots)}
        if forces and options.get("com") is None:
            # Forces act at the true centre of mass, wherever the body's centre is.
            kept["com"] = "model"
        if forces and options.get("stability_margin") is None:
            kept["stability_margin"] = round(FORCE_MARGIN_SHARE * robot.standing_height, 4)
        return super().for_robot(robot, **{**knots, **kept, "free": free,
                                           "acceleration_limit": limit})  # fmt: skip

    @classmethod
    def fitted(cls, robot: Quadruped) -> dict[str, Any]:
        """The fields that depend on the robot's size, by name."""
        clearance = round(MARGIN_SHARE * robot.standing_height, 4)
        return {**super().fitted(robot), "clearance": clearance}

    @property
    def static(self) -> bool:
        """Whether static stability is promised; a dynamic walk keeps its ZMP inside instead."""
        return not self.free.dynamic

    @property
    def true_com(self) -> bool:
        """Whether the margin is promised of the true centre of mass, and not of the body's."""
        return self.com == "model"

    @property
    def zmp_margin(self) -> float | None:
        """The stability margin, of a dynamic walk."""
        return None if self.static else self.stability_margin

    @property
    def promised_forces(self) -> ForceLimits | None:
        """Limits within which forces and torques are promised to make the motion."""
        return self.forces

    @property
    def stops(self) -> bool:
        """Whether body and foot stop wherever they change direction."""
        return (self.smooth or self.forces is not None) and not self.free.swing

    @property
    def smooth(self) -> bool:
        """Whether joint accelerations are bounded."""
        return self.acceleration_limit is not None


def _acceleration(robot: Quadruped, free: Freedoms, asked: Any) -> Any:
    """The acceleration limit of every joint [rad/s^2], where there is one."""
    slowest = float(min(leg.velocity_limits.min() for leg in robot.legs.values()))
    if asked is None and free.dynamic:
        return round(slowest / RAMP, 6)
    if isinstance(asked, (int, float)) and 0.0 < asked < slowest / SLOWEST_RAMP:
        raise InputError(
            f"acceleration_limit is {asked:g} rad/s^2, with which a joint needs more than "
            f"{SLOWEST_RAMP:g} s to its velocity limit of {slowest:.3g} rad/s; take at least "
            f"{slowest / SLOWEST_RAMP:.3g}"
        )
    return asked
