"""Table II of [Wang2020]: the paper's method compared with two baselines."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Literal, cast

import numpy as np
from rich.table import Table
from rich.text import Text

from gaitopt.conventions import FloatArray
from gaitopt.errors import InfeasibleStepError, InputError
from gaitopt.inputs import check_kind
from gaitopt.plan.com_margin import com_margin
from gaitopt.plan.plan import Plan
from gaitopt.plan.settings.base import VELOCITY
from gaitopt.plan.settings.crawl import Speed
from gaitopt.planners.crawl import plan_crawl
from gaitopt.robots.quadruped import Quadruped
from gaitopt.studies.one_height import with_one_height
from gaitopt.terrain.footholds import Footholds


@dataclass(frozen=True)
class Method:
    """One way to plan a walk.

    Attributes:
        name: of the method in the table.
        objective, speed: as in :func:`gaitopt.plan_crawl`.
        paper_time: the time that the paper reports for it [s]; ``None`` where it reports none.
    """

    name: str
    objective: Literal["distance", "margin"]
    speed: Speed
    paper_time: float | None = None


METHODS: tuple[Method, ...] = (
    Method("proposed", "distance", "max", 205.0),
    Method("SSM", "margin", "max", 372.0),
    Method("fixed 5 mm/s", "distance", 0.005, 272.0),
    Method("fixed 50 mm/s", "distance", 0.050),
    Method("fixed 66 mm/s", "distance", 0.066),
)
"""The methods of [Wang2020], Section V. The paper gives 5 mm/s for the fixed speed. Its 272 s are
impossible at that speed (``docs/papers.md``, errata); 66 mm/s give about 272 s."""

PAPER_GAINS = {"SSM": 81.6, "fixed 5 mm/s": 32.8}
"""Speed-ups of the proposed method that the paper states [%]."""

MOST_SEEDS = 10
"""Seeds of infeasible terrains that are named below the table: as many as fit into a line."""

PAPER_DISTANCE = 1.5
"""Forward distance of the walk in [Wang2020], Section V [m]."""


@dataclass(frozen=True)
class Outcome:
    """The result of one method on one terrain.

    Attributes:
        seed: of the terrain; -1 for footholds of one's own.
        method: which method.
        time: duration [s].
        mean_speed: [m/s].
        cog_distance: length of the body centre's path [m].
        swing_share: share of the time in swing phases; the rest is stance phases.
        margin: smallest stability margin during swing phases, of what the walk is planned for:
            the body centre, or with forces the true centre of mass [m].
        com_margin: smallest stability margin of the model's true centre of mass [m].
    """

    seed: int
    method: Method
    time: float
    mean_speed: float
    cog_distance: float
    swing_share: float
    margin: float
    com_margin: float


@dataclass(frozen=True, eq=False)
class Comparison:
    """Outcomes of all methods on all terrains.

    Attributes:
        robot: the robot's name.
        methods: the methods. Speed-ups are those of the first.
        outcomes: one for each terrain and method.
        infeasible: ``(seed, reason)`` of the terrains on which a method found no plan. They are
            left out for all methods.
        plans: the plans on the first terrain, by method's name.
        timing: what bounds the speed: ``"velocity"`` or ``"forces"``.
    """

    robot: str
    methods: tuple[Method, ...]
    outcomes: tuple[Outcome, ...]
    infeasible: tuple[tuple[int, str], ...]
    plans: dict[str, Plan]
    timing: str = VELOCITY

    def values(self, method: str, quantity: str) -> FloatArray:
        """An attribute of :class:`Outcome` for each terrain ``(n,)``."""
        return np.array([getattr(o, quantity) for o in self.outcomes if o.method.name == method])

    def speed_up(self, baseline: str) -> FloatArray:
        """By how much the first method is faster than ``baseline``, for each terrain ``(n,)``.

        0.5 means that the baseline takes 1.5 times as long as the first method.
        """
        first = self.methods[0].name
        return np.asarray(self.values(baseline, "time") / self.values(first, "time") - 1.0)

    @property
    def seeds(self) -> tuple[int, ...]:
        """Seeds of the terrains that are not left out."""
        first = self.methods[0].name
        return tuple(o.seed for o in self.outcomes if o.method.name == first)

    def table(self) -> Table:
        """The comparison as a table to print."""
        return comparison_table(self)

    def __str__(self) -> str:
        from gaitopt.studies.tables import as_text

        return as_text(self.table())


def _pairs(terrains: object) -> list[tuple[int, Footholds]]:
    """Pairs of a seed and footholds.

    Raises:
        InputError: something is no such pair.
    """
    many = isinstance(terrains, Iterable) and getattr(terrains, "ndim", 1) > 0
    pairs: list[Any] = list(cast("Iterable[Any]", terrains)) if many else [terrains]
    for pair in pairs:
        if not (isinstance(pair, tuple) and len(pair) == 2 and isinstance(pair[1], Footholds)):
            raise InputError(
                "terrains must be Footholds, or pairs (seed, Footholds), got a "
                f"{type(pair if isinstance(terrains, list) else terrains).__name__}"
            )
    return pairs


def compare(
    robot: Quadruped,
    terrains: Iterable[tuple[int, Footholds]] | Footholds,
    *,
    methods: Sequence[Method] = METHODS,
    timing: str = VELOCITY,
    progress: Callable[[int, int], None] | None = None,
    **settings: Any,
) -> Comparison:
    """Plan every method on every terrain.

    Args:
        robot: from :func:`gaitopt.load_robot`.
        terrains: footholds, or pairs of a seed and its footholds.
        methods: the methods to compare. Speed-ups are those of the first.
        timing: of all methods: ``"velocity"``, that of [Wang2020], or ``"forces"``.
        progress: called with (plans made, plans in all).
        settings: passed to :func:`gaitopt.plan_crawl` (stability margin, heights, ...).

    Raises:
        InfeasibleStepError: on every terrain some method finds no plan; the error is the first one.
        InputError: no terrain or method was given, robot or terrains are something else, or a
            setting is out of range.
    """
    check_kind("robot", robot, Quadruped)
    todo = [(-1, terrains)] if isinstance(terrains, Footholds) else _pairs(terrains)
    if not todo or not methods:
        raise InputError("a comparison needs at least one terrain and one method")
    options = with_one_height(robot, todo[0][1], {"timing": timing, **settings})
    outcomes: list[Outcome] = []
    infeasible: list[tuple[int, str]] = []
    kept: dict[str, Plan] = {}
    failure: InfeasibleStepError | None = None
    for i, (seed, footholds) in enumerate(todo):
        plans: dict[str, Plan] = {}
        try:
            for j, method in enumerate(methods):
                own = {"objective": method.objective, "speed": method.speed}
                plans[method.name] = plan_crawl(robot, footholds, **{**options, **own})
                if progress is not None:
                    progress(i * len(methods) + j + 1, len(todo) * len(methods))
        except InfeasibleStepError as error:
            infeasible.append((seed, str(error)))
            failure = failure or error
            continue
        kept = kept or plans
        outcomes += [outcome(seed, method, plans[method.name]) for method in methods]
    if failure is not None and not outcomes:
        raise failure
    return Comparison(robot.name, tuple(methods), tuple(outcomes), tuple(infeasible), kept,
                      timing)  # fmt: skip


def outcome(seed: int, method: Method, plan: Plan) -> Outcome:
    """The numbers of one plan."""
    swings = [phase for phase in plan.phases if phase.kind == "swing"]
    return Outcome(
        seed=seed,
        method=method,
        time=plan.duration,
        mean_speed=plan.mean_speed,
        cog_distance=plan.cog_distance,
        swing_share=sum(p.duration for p in swings) / plan.duration if plan.duration else 0.0,
        margin=min((p.margin for p in swings), default=float("inf")),
        com_margin=float(com_margin(plan)[1].min()),
    )


def comparison_table(comparison: Comparison) -> Table:
    """Table II with the paper's numbers in brackets.

    Over several terrains it shows mean and standard deviation.
    """
    count = len(comparison.seeds)
    spread = f", mean ± standard deviation over {count} terrains" if count > 1 else ""
    table = Table(
        title=Text(
            f"{comparison.robot}: Table II{_timed_by(comparison)} over the same footholds"
            f"{' (paper)' if _is_papers(comparison) else ''}{spread}"
        ),
        caption=Text(_caption(comparison)),
        caption_justify="left",
        # So it fits into 80 letters.
        padding=(0, 0),
        show_edge=False,
    )
    table.add_column("method", no_wrap=True)
    for header in ("time [s]", "speed [mm/s]", "COG path [m]", "swing %", "stance %",
                   "margin [mm]", "true COM [mm]", "speed-up [%]"):  # fmt: skip
        table.add_column(Text(header), justify="right")
    for method in comparison.methods:
        table.add_row(*_row(comparison, method))
    return table


def _is_papers(comparison: Comparison) -> bool:
    """Whether the paper gives numbers for this robot and timing: it has only one of each."""
    return comparison.robot == "wang2020" and comparison.timing == VELOCITY


def _timed_by(comparison: Comparison) -> str:
    """What the title says of the timing."""
    by = "joint velocities" if comparison.timing == VELOCITY else "contact forces"
    return f", timed by {by},"


def _row(comparison: Comparison, method: Method) -> list[str]:
    """The cells of one method."""
    name = method.name
    paper = method.paper_time if _is_papers(comparison) else None

    def number(quantity: str, digits: int, scale: float = 1.0) -> str:
        return _mean_and_deviation(comparison.values(name, quantity) * scale, digits)

    swing = 100 * float(comparison.values(name, "swing_share").mean())
    least = [1e3 * float(comparison.values(name, q).min()) for q in ("margin", "com_margin")]
    return [
        name,
        number("time", 1) + ("" if paper is None else f" ({paper:.0f})"),
        number("mean_speed", 2, 1e3)
        + ("" if paper is None else f" ({1e3 * PAPER_DISTANCE / paper:.2f})"),
        number("cog_distance", 2),
        f"{swing:.0f}",
        f"{100 - swing:.0f}",
        f"{least[0]:.1f}",
        f"{least[1]:.1f}",
        "" if method is comparison.methods[0] else _speed_up(comparison, method),
    ]


def _speed_up(comparison: Comparison, method: Method) -> str:
    """The first method's speed-up over another, with the paper's in brackets [%]."""
    ours = f"+{_mean_and_deviation(100.0 * comparison.speed_up(method.name), 0)}"
    first = comparison.methods[0].paper_time
    if method.paper_time is None or first is None or not _is_papers(comparison):
        return ours
    papers = PAPER_GAINS.get(method.name)
    return ours if papers is None else f"{ours} ({papers:.1f})"


def _mean_and_deviation(values: FloatArray, digits: int) -> str:
    """The mean, with the standard deviation where there are several values."""
    mean = f"{values.mean():.{digits}f}"
    return mean if len(values) < 2 else f"{mean} ± {values.std(ddof=1):.{digits}f}"


def _caption(comparison: Comparison) -> str:
    """What the columns are, and which terrains are left out."""
    lines = [
        "COG: the body's centre, the mean of the four hips. SSM: the COG goes to the largest "
        "static stability margin, and not the shortest way.",
        "margin: smallest over all swings, of what the walks are planned for, and of the model's "
        "true COM.",
        f"speed-up: of {comparison.methods[0].name!r} over this method.",
    ]
    if _is_papers(comparison):
        lines.append(
            "In brackets: the paper, whose terrain, hip height and margin are not published."
        )
    if comparison.infeasible:
        seeds = ", ".join(str(seed) for seed, _ in comparison.infeasible[:MOST_SEEDS])
        lines.append(
            f"{len(comparison.infeasible)} terrains left out as infeasible (seeds {seeds}): "
            f"{comparison.infeasible[0][1]}"
        )
    return "\n".join(lines)
