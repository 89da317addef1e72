"""Two judges of the same plans: the certificate, and one that looks at samples only.

``python -m benchmarks.second_judge [--plans 100] [--seed 0] [--seconds 480] [--instants 40]
[--only terrain,stride] [--rows FILE]`` makes small plans of all planners, plants a random fault
into every second one, and lets ``gaitopt.verify`` and :func:`benchmarks.judge.judging.judge` judge
them. It prints how often they agree, and every disagreement. With ``--only`` the plans are of some
planners alone. With ``--rows`` every plan is a line of a file as soon as it is
judged, and a run that was stopped goes on where it stopped. Exit code 1 when the second
judge finds a violation that the certificate does not find: one of the two is then wrong. Where only
the certificate finds one, the second judge looks once more, and more closely.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from rich.console import Console
from rich.table import Table

import gaitopt
from benchmarks.judge.faults import planted
from benchmarks.judge.judging import INSTANTS, Judgement, judge
from benchmarks.judge.plans import FAMILIES
from gaitopt import GaitoptError, Plan

ERRORS = ("refused", "violated")
"""Verdicts that say that a plan is wrong."""
STRICTER = "the certificate is stricter"
CLOSER, CLOSER_INSTANTS = 5, 1000
"""Where only the certificate finds a fault, the second judge looks again: at so many times as many
samples, at so many instants for forces, and around those that the certificate names."""


class Case(NamedTuple):
    """One plan and both verdicts.

    Attributes:
        name: seed, planner, robot and fault.
        faulty: whether a fault was planted.
        certificate: the outcome of the certificate, or ``"refused"``.
        said: what it found to be violated, or why it refused the plan.
        second: what the second judge says.
        checks: names of the checks that the certificate finds violated.
        closer: whether the second judge had to look more closely.
        times: when what the certificate finds happens [s].
    """

    name: str
    faulty: bool
    certificate: str
    said: str
    second: Judgement
    checks: tuple[str, ...] = ()
    closer: bool = False
    times: tuple[float, ...] = ()

    @property
    def unseen(self) -> list[str]:
        """Checks that only the second judge finds violated, of a plan that both find wrong."""
        known = self.certificate == "violated" and self.second.verdict == "violated"
        names = {f.check.split(",")[0] for f in self.second.broken if known}
        return sorted(names - set(self.checks))

    @property
    def agreement(self) -> str:
        """``"agree"`` (at once or at a closer look), :data:`STRICTER` or ``"MISSED"``."""
        mine, theirs = self.second.verdict, self.certificate
        agree = "agree, at a closer look" if self.closer else "agree"
        if (mine in ERRORS) != (theirs in ERRORS):
            return "MISSED" if mine in ERRORS else STRICTER
        return "MISSED" if mine == "weak" and theirs == "certified" else agree

    def __str__(self) -> str:
        mine = "; ".join(map(str, self.second.broken)) or ", ".join(self.second.weak)
        mine = f"{self.second.verdict} {mine}{self.second.refused}"
        return f"{self.name}\n  certificate: {self.certificate} {self.said}\n  second: {mine}"


def both(plan: Plan, name: str, faulty: bool, seed: int = 0, instants: int = INSTANTS) -> Case:
    """Both verdicts of a plan."""
    try:
        certificate = gaitopt.verify(plan)
        found = certificate.violations
        outcome, said = certificate.outcome, "; ".join(map(str, found))
        checks = tuple(check.name for check in found)
        times = tuple(check.when for check in found if np.isfinite(check.when))
    except GaitoptError as error:
        outcome, said, checks, times = "refused", str(error), (), ()
    return Case(name, faulty, outcome, said, judge(plan, seed, instants), checks, times=times)


def made(number: int, seed: int, families: Sequence[str] | None = None) -> tuple[Plan, str] | None:
    """A plan and what it is; with a fault where the number is odd; ``None`` where none is found."""
    rng = np.random.default_rng([seed, number])
    names = list(families or FAMILIES)
    family = names[int(rng.integers(len(names)))]
    try:
        plan = FAMILIES[family](rng)
    except GaitoptError:
        return None
    name = f"{number}: {family}, {plan.robot.name}"
    if number % 2:
        plan, fault = planted(plan, rng)
        name += f", {fault}"
    return plan, name


class Row(NamedTuple):
    """What both judges said of one plan, as a file keeps it.

    Attributes:
        seed: that of the run.
        number: that of the plan.
        faulty: whether a fault was planted.
        certificate: what the certificate says, or ``""`` where the planner refused.
        second: what the second judge says.
        agreement: :attr:`Case.agreement`.
        unseen: :attr:`Case.unseen`.
        text: both verdicts in full, of plans on which they disagree.
    """

    seed: int
    number: int
    faulty: bool
    certificate: str = ""
    second: str = ""
    agreement: str = ""
    unseen: tuple[str, ...] = ()
    text: str = ""


def judged(
    number: int, seed: int, instants: int = INSTANTS, families: Sequence[str] | None = None
) -> Row:
    """One plan made and judged; where only the certificate finds a fault, more closely."""
    found, faulty = made(number, seed, families), bool(number % 2)
    if found is None:
        return Row(seed, number, faulty)
    case = both(*found, faulty=faulty, seed=number, instants=instants)
    if case.agreement == STRICTER:
        again = judge(found[0], number, CLOSER_INSTANTS, CLOSER, case.times)
        case = case._replace(second=again, closer=True)
    plain = case.agreement.startswith("agree") and not case.unseen
    return Row(seed, number, faulty, case.certificate, case.second.verdict, case.agreement,
               tuple(case.unseen), "" if plain else str(case))  # fmt: skip


def main(arguments: Sequence[str] | None = None) -> int:
    """Judge plans and print a table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.second_judge", description=__doc__)
    parser.add_argument("--plans", type=int, default=100, metavar="N")
    parser.add_argument("--seed", type=int, default=0, metavar="S")
    parser.add_argument(
        "--first", type=int, default=0, metavar="N", help="number of the first plan"
    )
    parser.add_argument("--seconds", type=float, default=480.0, help="stop after this time")
    parser.add_argument("--instants", type=int, default=INSTANTS, help="for contact forces")
    parser.add_argument("--only", metavar="NAMES", help=f"of {', '.join(FAMILIES)}")
    parser.add_argument("--rows", type=Path, metavar="FILE", help="keep a line for every plan")
    options = parser.parse_args(arguments)
    families = options.only.split(",") if options.only else None
    if not set(families or ()) <= set(FAMILIES):
        parser.error(f"--only takes names of {', '.join(FAMILIES)}, got {options.only}")
    begin, rows = time.monotonic(), _kept(options.rows)
    known = {(row.seed, row.number) for row in rows}
    for number in range(options.first, options.first + options.plans):
        if time.monotonic() - begin > options.seconds:
            break
        if (options.seed, number) in known:
            continue
        row = judged(number, options.seed, options.instants, families)
        _keep(options.rows, row)
        rows.append(row)
    for row in rows:
        if row.text:
            seen = f"the certificate finds {list(row.unseen)} kept"
            print(f"{seen if row.unseen else row.agreement}: {row.text}")
    cases = [row for row in rows if row.certificate]
    Console().print(_table(cases))
    print(f"{len(cases)} plans, {len(rows) - len(cases)} refused by their planners")
    return int(any(row.agreement == "MISSED" for row in cases))


def _kept(file: Path | None) -> list[Row]:
    """The rows of a file; a last line that is not whole is taken away."""
    if file is None or not file.exists():
        return []
    *lines, rest = file.read_text().split("\n")
    if rest:
        file.write_text("".join(f"{line}\n" for line in lines))
    return [Row(**{**row, "unseen": tuple(row["unseen"])}) for row in map(json.loads, lines)]


def _keep(file: Path | None, row: Row) -> None:
    if file is not None:
        with file.open("a") as lines:
            lines.write(json.dumps(row._asdict()) + "\n")


def _table(rows: Sequence[Row]) -> Table:
    """How often both judges say what."""
    table = Table(title="two judges")
    for title in ("fault", "certificate", "second judge", "plans", ""):
        table.add_column(title)
    counts = Counter((r.faulty, r.certificate, r.second, r.agreement) for r in rows)
    for (faulty, theirs, mine, agreement), count in sorted(counts.items()):
        table.add_row("yes" if faulty else "no", theirs, mine, str(count), agreement)
    return table


if __name__ == "__main__":
    sys.exit(main())
