"""A certificate: what holds of a plan at every instant, and not only at samples.

Worked out from the robot's URDF and the stored path by Pinocchio alone; no code is shared with the
planners. Between samples, bounds take over (:mod:`gaitopt.checking.enclosure`).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

from gaitopt.errors import GaitoptError, RobotError

if TYPE_CHECKING:
    from rich.table import Table

    from gaitopt.planning.plan import Plan
    from gaitopt.robots.quadruped import Quadruped


class CertificateError(GaitoptError):
    """A plan violates what was to be certified; the message lists the violations.

    Attributes:
        certificate: the certificate with all checks.
    """

    def __init__(self, message: str, certificate: Certificate) -> None:
        super().__init__(message)
        self.certificate = certificate

    def __reduce__(self) -> tuple[object, ...]:
        return (CertificateError, (str(self), self.certificate))


@dataclass(frozen=True)
class Check:
    """One thing that was checked.

    Attributes:
        name: what.
        status: ``"ok"``, ``"violated"``, or ``"unchecked"`` where it could not be judged.
        worst: its worst value over all instants, bounds included; ``nan`` when unchecked.
        limit: what the worst value is held against.
        unit: of both.
        sense: ``"<="`` or ``">="``: how the worst value must compare with the limit.
        bound: how much of the worst value is a bound for the time between samples.
        when: time of the worst value [s]; ``nan`` where no single time is to blame.
        where: the leg, joint, phase or pair that it belongs to.
        note: what a reader should know.
    """

    name: str
    status: str
    worst: float
    limit: float
    unit: str
    sense: str = "<="
    bound: float = 0.0
    when: float = float("nan")
    where: str = ""
    note: str = ""

    def __str__(self) -> str:
        if self.status == "unchecked":
            return f"{self.name}: unchecked ({self.note})"
        place = f" at {self.when:.4f} s" if self.when == self.when else ""
        return (
            f"{self.name}: {self.status}, {self.worst:.6g} {self.sense} {self.limit:.6g} "
            f"{self.unit}{place}{f' ({self.where})' if self.where else ''}"
        )


@dataclass(frozen=True)
class Certificate:
    """All checks of one plan.

    Attributes:
        robot: the robot's name.
        sha256: fingerprint of the URDF that was judged.
        checks: every check.
        samples: how many configurations were evaluated.
    """

    robot: str
    sha256: str
    checks: tuple[Check, ...]
    samples: int

    @property
    def ok(self) -> bool:
        """Whether nothing is violated. What is unchecked is listed in :meth:`report`."""
        return not any(self.violations)

    @property
    def violations(self) -> tuple[Check, ...]:
        """The checks that failed."""
        return tuple(c for c in self.checks if c.status == "violated")

    def __iter__(self) -> Iterator[Check]:
        return iter(self.checks)

    def __getitem__(self, name: str) -> Check:
        for check in self.checks:
            if check.name == name:
                return check
        raise KeyError(f"no check {name!r}; there are {', '.join(c.name for c in self.checks)}")

    def raise_for_violations(self) -> Certificate:
        """The certificate itself when nothing is violated.

        Raises:
            CertificateError: lists every violation with its numbers.
        """
        if not self.ok:
            listed = "; ".join(str(check) for check in self.violations)
            raise CertificateError(f"{self.robot}: the plan is not certified: {listed}", self)
        return self

    def table(self) -> Table:
        """The report as a table to print."""
        from rich.markup import escape
        from rich.table import Table

        verdict = "certified" if self.ok else "NOT certified"
        table = Table(title=f"{self.robot}: {verdict} for every instant",
                      caption=f"{self.samples} configurations by Pinocchio, bounds in between; "
                      f"URDF {self.sha256[:12]}")  # fmt: skip
        for header in ("check", "verdict", "worst", "limit", "bound used", "when [s]", "where"):
            table.add_column(escape(header))
        for c in self.checks:
            if c.status == "unchecked":
                table.add_row(c.name, c.status, "", "", "", "", c.note)
                continue
            table.add_row(
                c.name, c.status, f"{c.worst:.6g} {c.unit}", f"{c.sense} {c.limit:.6g}",
                f"{c.bound:.2g}", "" if c.when != c.when else f"{c.when:.3f}", c.where or c.note,
            )  # fmt: skip
        return table

    def report(self) -> str:
        """The report as plain text, a line a check."""
        verdict = "certified" if self.ok else "NOT certified"
        return "\n".join([f"{self.robot}: {verdict}", *(f"  {check}" for check in self.checks)])

    __str__ = report


def verify(plan: Plan, robot: Quadruped | None = None, *, collisions: bool = True) -> Certificate:
    """Judge a plan at every instant.

    Args:
        plan: any planner's plan.
        robot: the robot it is to run on; the plan's own by default.
        collisions: whether to look for self-collisions, which takes most of the time.

    Returns:
        The certificate. A violated check is no error: see :meth:`Certificate.raise_for_violations`.

    Raises:
        RobotError: the plan was made for another URDF than that of ``robot``, or than the one that
            gaitopt ships under the same name.
    """
    from gaitopt.checking import (
        check_balance,
        check_clearance,
        check_contacts,
        check_joints,
        check_obstacles,
        collision,
        motion,
    )

    _refuse_other_robot(plan, robot)
    traced = motion.trace(plan)
    found: list[Check | None] = [
        check_contacts.continuity(plan),
        check_contacts.contact_sequence(plan),
        check_contacts.slip(plan, traced),
        check_contacts.landings(plan, traced),
        check_contacts.swing_height(plan, traced),
        check_contacts.ground(plan, traced),
        check_clearance.swing_clearance(plan, traced),
        check_joints.joint_positions(plan, traced),
        check_joints.joint_velocities(plan, traced),
        check_joints.joint_accelerations(plan, traced),
        check_joints.joint_jerks(plan, traced),
        check_joints.reach(plan, traced),
        check_balance.margin_of_cog(plan, traced),
        check_balance.margin_of_com(plan, traced),
        check_balance.zmp(plan, traced),
        check_obstacles.obstacles_cleared(plan),
        collision.self_collision(plan)
        if collisions
        else Check("self-collision", "unchecked", float("nan"), 0.0, "m", note="not asked for"),
    ]
    judged = tuple(check for check in found if check is not None)
    return Certificate(plan.robot.name, plan.robot.sha256, judged, len(traced.feet_bulge) + 1)


def _refuse_other_robot(plan: Plan, robot: Quadruped | None) -> None:
    from gaitopt.robots.catalog import OWN_ROBOTS, VARIANTS, load_robot

    name = plan.robot.name
    if robot is None and name in (*OWN_ROBOTS, *VARIANTS):
        robot = load_robot(name)
    if robot is not None and robot.sha256 != plan.robot.sha256:
        raise RobotError(
            f"the plan was made for a {name} whose URDF has the fingerprint "
            f"{plan.robot.sha256[:12]}, and {robot.name} here has {robot.sha256[:12]}; plan again "
            "for this robot"
        )
