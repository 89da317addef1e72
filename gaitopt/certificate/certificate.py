"""The verdict on a plan: all its checks together."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import isnan

from rich.table import Table

from gaitopt.certificate.check import ASKED_FORCES, FORCES, Check, Verdict
from gaitopt.conventions import TextEnum
from gaitopt.errors import CertificateError, UnknownNameError
from gaitopt.inputs import as_text


class Outcome(TextEnum):
    """The verdict on a whole plan."""

    CERTIFIED = "certified"
    """Every check that is needed was made and holds at every instant, that of contact forces
    included, and no setting is so weak that a check means nothing."""
    INCOMPLETE = "not all checked"
    """All checks that were made hold, that of contact forces included. But another one that is
    needed could not be made, or settings are too weak: its note says why."""
    KINEMATICS_ONLY = "kinematics only"
    """Nothing that the plan promises is violated. But contact forces were not checked, or do not
    exist at every instant: nothing is said of what physics does."""
    VIOLATED = "violated"
    """Something that the plan promises does not hold."""


@dataclass(frozen=True)
class Certificate:
    """All checks of one plan.

    It says what holds of the robot in the plan's URDF, along the plan's path, at every instant:
    no more than its checks, and each against what the plan's settings promise, or what was asked
    for. :attr:`outcome` sums them up in one of four words. What is assumed (rigid links and ground,
    point contacts, a known friction, the masses of the URDF) is in docs/trust.md.

    Attributes:
        robot: the robot's name.
        sha256: fingerprint of the URDF that was judged.
        checks: every check.
        samples: at how many configurations feet and balance were evaluated; checks look at more
            where they need them.
    """

    robot: str
    sha256: str
    checks: tuple[Check, ...]
    samples: int

    def __repr__(self) -> str:
        needed = [check for check in self.checks if check.promised]
        kept = sum(check.status is Verdict.OK for check in needed)
        broken = f", violated: {', '.join(c.name for c in self.violations)}" * (not self.ok)
        return (
            f"Certificate({self.robot!r}, {self.outcome}, {kept} of {len(needed)} checks "
            f"hold{broken})"
        )

    @property
    def ok(self) -> bool:
        """Whether nothing that the plan promises is violated; see :attr:`outcome` for more."""
        return not any(self.violations)

    @property
    def outcome(self) -> Outcome:
        """The verdict on the plan. What is unchecked can never be certified."""
        if not self.ok:
            return Outcome.VIOLATED
        forces = [c.status is Verdict.OK for c in self.checks if c.name in (FORCES, ASKED_FORCES)]
        if not forces or not all(forces):
            return Outcome.KINEMATICS_ONLY
        missing = any(c.status is Verdict.UNCHECKED and c.promised for c in self.checks)
        return Outcome.INCOMPLETE if missing else Outcome.CERTIFIED

    @property
    def violations(self) -> tuple[Check, ...]:
        """The checks of promises that failed."""
        return tuple(c for c in self.checks if c.status is Verdict.VIOLATED and c.promised)

    def __iter__(self) -> Iterator[Check]:
        return iter(self.checks)

    def __getitem__(self, name: str) -> Check:
        for check in self.checks:
            if isinstance(name, str) and check.name == name:
                return check
        raise UnknownNameError(
            f"no check {as_text(name)}; there are {', '.join(c.name for c in self.checks)}"
        )

    def raise_for_violations(self) -> Certificate:
        """The certificate itself when nothing is violated.

        Raises:
            CertificateError: lists every violation with its numbers.
        """
        if not self.ok:
            listed = "; ".join(str(check) for check in self.violations)
            raise CertificateError(f"{self.robot}: the plan is wrong: {listed}", self)
        return self

    def _repr_html_(self) -> str:
        """The checks as a coloured table, in notebooks."""
        from gaitopt.certificate.as_html import certificate_html

        return certificate_html(self.robot, str(self.outcome), self.checks)

    def table(self) -> Table:
        """The report as a table to print."""
        from rich.table import Table
        from rich.text import Text

        told = [f"{c.name}: {c.note}" for c in self.checks if c.status is Verdict.UNCHECKED]
        samples = (
            f"{self.samples} configurations by Pinocchio, bounds in between; "
            f"URDF {self.sha256[:12]}"
        )
        table = Table(
            title=Text(f"{self.robot}: {self.outcome}, judged at every instant"),
            caption=Text("\n".join([*told, samples])), caption_justify="left",
        )  # fmt: skip
        for header in ("check", "verdict", "worst", "limit", "where"):
            table.add_column(Text(header))
        for c in self.checks:
            status = str(c.status) if c.promised else f"{c.status} (not promised)"
            if c.status is Verdict.UNCHECKED:
                table.add_row(c.name, str(c.status))
                continue
            when = "" if isnan(c.when) else f"{c.when:.3f} s; "
            table.add_row(
                c.name, status, f"{c.worst:.3g} {c.unit}", f"{c.sense} {c.limit:.3g}",
                Text(f"{when}{c.about}"),
            )  # fmt: skip
        return table

    def report(self) -> str:
        """The report as plain text, a line a check."""
        return "\n".join(
            [f"{self.robot}: {self.outcome}", *(f"  {check}" for check in self.checks)]
        )

    __str__ = report
