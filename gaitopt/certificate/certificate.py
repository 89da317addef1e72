"""The verdict on a plan: all its checks together."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import isnan

from rich.table import Table

from gaitopt.certificate.check import Check, Verdict
from gaitopt.errors import CertificateError, UnknownNameError


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
        return tuple(c for c in self.checks if c.status is Verdict.VIOLATED)

    def __iter__(self) -> Iterator[Check]:
        return iter(self.checks)

    def __getitem__(self, name: str) -> Check:
        for check in self.checks:
            if check.name == name:
                return check
        raise UnknownNameError(
            f"no check {name!r}; there are {', '.join(c.name for c in self.checks)}"
        )

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
            if c.status is Verdict.UNCHECKED:
                table.add_row(c.name, str(c.status), "", "", "", "", c.note)
                continue
            table.add_row(
                c.name, str(c.status), f"{c.worst:.6g} {c.unit}", f"{c.sense} {c.limit:.6g}",
                f"{c.bound:.2g}", "" if isnan(c.when) else f"{c.when:.3f}", c.where or c.note,
            )  # fmt: skip
        return table

    def report(self) -> str:
        """The report as plain text, a line a check."""
        verdict = "certified" if self.ok else "NOT certified"
        return "\n".join([f"{self.robot}: {verdict}", *(f"  {check}" for check in self.checks)])

    __str__ = report
