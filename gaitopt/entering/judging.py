"""Whether an entry keeps joint limits and has contact forces, and what is in its way."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from gaitopt.conventions import LEGS, BoolArray, FloatArray
from gaitopt.dynamics.contact_forces import ContactForces
from gaitopt.dynamics.contacts import ForceLimits
from gaitopt.dynamics.forces import build_force_problem, solve_forces
from gaitopt.dynamics.whole_body import motion_of_path
from gaitopt.entering.begin import Begin
from gaitopt.entering.braking import Entry
from gaitopt.entering.joint_limits import ACCELERATION, AT_BEGIN, Fault, JointLimits, bent_knees
from gaitopt.errors import InfeasibleStateError
from gaitopt.motion.body_and_feet import path_states
from gaitopt.motion.path import BASE_COLUMNS, MotionPath
from gaitopt.plan.com_margin import true_com
from gaitopt.plan.contact_ground import ground_on
from gaitopt.plan.load_transfer import most_normal_shares
from gaitopt.retiming.reserves import MIDDLE_SHARE, PLANNED_SHARE, SHARE_OF_WEIGHT, tightened
from gaitopt.robots.quadruped import Quadruped
from gaitopt.stability.margins import static_stability_margin
from gaitopt.terrain.footholds import Footholds

INSTANTS = 13
"""Instants at which entries are looked at first, many together."""
INSIDE = 1e-7
"""Share of an interval by which its first and last sample lie inside: forces may jump at knots."""
WAY_OUT = (
    "begin when the robot is slower, give other first footholds, or allow more friction or torque"
)
"""What the user can do."""
LIES = ", or, where the robot lies on its trunk, put its feet down by gaitopt.feet_down"
"""The same where a robot rests with feet in the air."""
MORE_ACCELERATION = (
    "raise acceleration_limit, or stop with gaitopt.plan_stand_up(robot, state), and begin there"
)
"""The same where joints are to be accelerated less than the way to rest needs."""


def at_rest(limits: ForceLimits) -> ForceLimits:
    """The limits of a robot that rests on four feet, and of its first move: no foot bears less than
    each of three does later.

    Usually feet bear half of it while four stand. But near tipping hardly anything moves a body
    back: one of wang2020 whose centre of mass was 7.5 mm inside its feet fell in physics, while its
    controller still swung in.
    """
    return replace(limits, reserve_on_four=limits.reserve)


@dataclass(frozen=True, eq=False)
class Judge:
    """Holds entries against what is promised.

    Attributes:
        robot: the robot.
        limits: on forces and torques, that are promised.
        joints: their limits.
        footholds: their first ones are those of the entry.
    """

    robot: Quadruped
    limits: ForceLimits
    joints: JointLimits
    footholds: Footholds

    @classmethod
    def of(
        cls, begin: Begin, limits: ForceLimits, accelerations: FloatArray, reach_fraction: float
    ) -> Judge:
        """The judge of entries from a state.

        Args:
            begin: the state.
            limits: on forces and torques.
            accelerations: that joints keep ``(nj,)`` [rad/s^2]; infinite for none.
            reach_fraction: share of the legs' reach that is used.
        """
        angles = bent_knees(begin.robot, reach_fraction, begin.joints)
        joints = JointLimits(begin.robot, accelerations, angles)
        return cls(begin.robot, limits, joints, begin.footholds)

    def quick(self, entries: list[Entry]) -> tuple[list[Entry], Fault | None]:
        """Entries that keep all limits at a few instants, and what the best of the others lack.

        Args:
            entries: any number ``C`` of them.
        """
        # The last instant is of the robot at rest, after the end.
        shares = np.append(np.linspace(INSIDE, 1.0 - INSIDE, INSTANTS), 1.0 + INSIDE)
        times = np.array([entry.duration for entry in entries])[:, None] * shares
        base = [np.stack(entry.body.at(t)) for entry, t in zip(entries, times, strict=True)]
        feet = [np.stack(entry.feet(t)) for entry, t in zip(entries, times, strict=True)]
        return self._quick(entries, times, np.stack(base, axis=1), np.stack(feet, axis=1))

    def fast_enough(self, entries: list[Entry]) -> list[Entry]:
        """Entries whose joints keep their velocity limits until the last foot lands."""
        shares = np.linspace(INSIDE, 1.0 - INSIDE, INSTANTS)
        ends = np.array([max(entry.landings.values(), default=0.0) for entry in entries])
        times = ends[:, None] * shares
        base = [np.stack(entry.body.at(t)) for entry, t in zip(entries, times, strict=True)]
        feet = [np.stack(entry.feet(t)) for entry, t in zip(entries, times, strict=True)]
        use = self.joints.velocity_use(np.stack(base, axis=1), np.stack(feet, axis=1))
        kept = use.max(axis=(1, 2)) <= 1.0 + AT_BEGIN
        return [entry for entry, good in zip(entries, kept, strict=True) if good]

    def _quick(
        self, entries: list[Entry], times: FloatArray, base: FloatArray, feet: FloatArray
    ) -> tuple[list[Entry], Fault | None]:
        """The same.

        Args:
            entries: ``C`` of them.
            times: instants of each ``(C, N)`` [s].
            base: columns of the base and two derivatives ``(3, C, N, 6)``.
            feet: in the world, and two derivatives ``(3, C, N, 4, 3)``.
        """
        use = self.joints.velocity_use(base, feet)
        worst = use.max(axis=(1, 2))
        fast = np.flatnonzero(worst <= 1.0 + AT_BEGIN)
        if not len(fast):
            best = int(worst.argmin())
            reached = worst[best] < np.inf
            return [], self.joints.velocity(use[best], times[best]) if reached else None
        flat = len(fast) * times.shape[1]
        values = path_states(
            self.robot,
            (*base[:, fast].reshape(3, flat, BASE_COLUMNS),),
            (*feet[:, fast].reshape(3, flat, len(LEGS), 3),),
        )
        rows = np.arange(flat).reshape(len(fast), -1)
        angles, _, bends = (part[:, BASE_COLUMNS:] for part in values)
        faults = [
            self.joints.at_instants(angles[own], bends[own], times[i])
            for own, i in zip(rows, fast, strict=True)
        ]
        within = [k for k, fault in enumerate(faults) if fault is None]
        if not within:
            return [], min((f for f in faults if f is not None), key=lambda fault: fault.share)
        return self._with_forces(
            [entries[i] for i in fast[within].tolist()], times[fast[within]],
            [part[rows[within].ravel()] for part in values],
        )  # fmt: skip

    def _with_forces(
        self, entries: list[Entry], times: FloatArray, values: list[FloatArray]
    ) -> tuple[list[Entry], Fault | None]:
        """Entries that have contact forces at some instants, and what the best of the others lack.

        Args:
            entries: ``C`` of them.
            times: instants of each ``(C, N)`` [s].
            values: of their paths there, and two derivatives ``(C N, 6 + nj)`` each.
        """
        landings = np.array([[entry.landings.get(leg, -1.0) for leg in LEGS] for entry in entries])
        since = (times[..., None] - landings[:, None]).reshape(-1, len(LEGS))
        standing = since > 0.0
        since[np.repeat(landings < 0.0, times.shape[1], axis=0)] = np.inf
        forces = self._forces(values, standing, times.ravel(), since)
        beyond = np.where(forces.feasible, 0.0, forces.excess.max(axis=1)).reshape(times.shape)
        lacks = beyond.max(axis=1)
        kept = [entry for entry, lack in zip(entries, lacks, strict=True) if lack <= 0.0]
        if kept:
            return kept, None
        best = int(lacks.argmin())
        row = best * times.shape[1] + int(beyond[best].argmax())
        one = slice(row, row + 1)
        again = self._forces(
            [v[one] for v in values], standing[one], times.ravel()[one], since[one]
        )
        return [], _worst(again)

    def path(self, path: MotionPath, landings: dict[str, float]) -> Fault | None:
        """Joint limits at every instant of a path, and contact forces at many.

        Args:
            path: the entry.
            landings: when each foot lands that was in the air [s].
        """
        fault = self.joints.along(path)
        if fault is not None:
            return fault
        times = _samples(path)
        since = np.full((len(times), len(LEGS)), np.inf)
        for leg, landing in landings.items():
            since[:, LEGS.index(leg)] = times - landing
        values = [path.evaluate(times, order) for order in range(3)]
        fault = _worst(self._forces(values, since > 0.0, times, since))
        if fault is not None:
            return fault
        # The robot goes on from where it rests, with the reserve of a move that is timed by forces.
        end = path.evaluate(path.times[-1:])
        rest = [end, 0.0 * end, 0.0 * end]
        return _worst(self._forces(rest, np.ones((1, 4), dtype=np.bool_), path.times[-1:],
                                   share=PLANNED_SHARE))  # fmt: skip

    def check_rest(self, begin: Begin) -> None:
        """Refuse a robot at rest that no contact forces hold.

        Raises:
            InfeasibleStateError: names the limit.
        """
        rest = np.zeros((1, BASE_COLUMNS))
        feet = begin.feet[:1]
        states = path_states(self.robot, (begin.base[:1], rest, rest),
                             (feet, 0.0 * feet, 0.0 * feet))  # fmt: skip
        strict = replace(self, limits=at_rest(self.limits))
        fault = _worst(strict._forces(list(states), np.ones((1, 4), dtype=np.bool_), np.zeros(1)))
        if fault is None:
            return
        centre = true_com(self.robot, motion_of_path(self.robot, *states).q)
        margin = float(static_stability_margin(feet, centre)[0])
        if margin < 0.0:
            raise InfeasibleStateError(
                f"start: the centre of mass is {-margin:.4f} m outside the polygon of the feet, "
                "and the robot rests: it falls over, whatever forces the feet make; move the body "
                "over the feet first, or begin while it moves there",
                "support margin", margin, 0.0, "m",
            )  # fmt: skip
        raise self.refusal(fault)

    def refusal(self, fault: Fault | None, *, lies: bool = False) -> InfeasibleStateError:
        """The error of the entry that exceeds its limits least.

        Args:
            fault: what it exceeds.
            lies: whether the robot may lie on its trunk: it rests, with feet in the air.
        """
        more = LIES if lies else ""
        if fault is None or not np.isfinite(fault.share):
            return InfeasibleStateError(
                "start: no way to rest on four feet keeps the legs within their reach and above "
                f"the ground; {WAY_OUT}{more}", "reach", 1.0, 1.0, "", 0.0,
            )  # fmt: skip
        needs = f"needs {fault.value:.4g} {fault.unit}, {fault.allowed:.4g} {fault.unit} are there"
        if fault.of_forces:
            needs = f"is exceeded by {fault.value:.4g} {fault.unit}"
        way_out = MORE_ACCELERATION if fault.limit.startswith(ACCELERATION) else WAY_OUT
        return InfeasibleStateError(
            f"start: no way to rest on four feet keeps all limits. In the best one {fault.limit} "
            f"{needs}, at {fault.time:.3f} s; {way_out}{more}",
            fault.limit, fault.value, fault.allowed, fault.unit, fault.time,
        )  # fmt: skip

    def _forces(
        self, values: list[FloatArray], standing: BoolArray, times: FloatArray,
        since: FloatArray | float = np.inf, share: float = MIDDLE_SHARE,
    ) -> ContactForces:  # fmt: skip
        """Forces of a motion at instants ``(N,)``, with a share of the limits left.

        Args:
            values: of the path and two derivatives ``(N, 6 + nj)`` each.
            standing: which feet stand ``(N, 4)``.
            times: of the instants [s].
            since: how long feet stand that have landed on the way ``(N, 4)`` [s]; infinite for
                others.
            share: of the limits that is left.
        """
        limits = tightened(self.limits, share)
        most = most_normal_shares(self.limits, since, np.inf) - SHARE_OF_WEIGHT * share
        ground = ground_on(self.footholds, np.zeros((len(times), 4), dtype=int), limits.friction)
        problem = build_force_problem(
            self.robot, motion_of_path(self.robot, *values), standing, limits,
            normals=ground.normals, grip=ground.grip, times=times, most=most,
        )  # fmt: skip
        return solve_forces(problem)


def _worst(forces: ContactForces) -> Fault | None:
    """The limit on forces that is exceeded most, if one is."""
    worst = forces.worst()
    if worst is None:
        return None
    names = forces.conflicts(worst.sample) or (f"{worst.kind.words} {worst.name}",)
    # Lifting any one of the limits that contradict each other would help.
    limit = " and ".join(names)
    return Fault(worst.share, limit, worst.amount, 0.0, worst.unit, worst.time, of_forces=True)


def _samples(path: MotionPath) -> FloatArray:
    """Begin, middle and end of all segments, a little inside ``(3 S,)`` [s]."""
    lengths = np.diff(path.times)[:, None]
    return np.asarray((path.times[:-1, None] + lengths * [INSIDE, 0.5, 1.0 - INSIDE]).ravel())
