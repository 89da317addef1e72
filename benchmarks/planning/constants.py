"""What the constants of the time-optimal planner do.

``python -m benchmarks.planning.constants NAME VALUE``

Plans a fixed set of walks with the constants as they are, then with another value of one of them,
and prints for each how many walks are found, their time against those with the constants as they
are, and the work that planning took. Several values may be given; without any, the values as they
are are measured. ``--smooth`` plans walks with bounded accelerations in place of straight ones.
Where modules have different constants of one name it is ``MODULE.NAME``, such as ``pacing.ENOUGH``.
"""

from __future__ import annotations

import argparse
import ast
import difflib
import importlib
import pkgutil
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from time import process_time
from typing import Any, NamedTuple

import gaitopt
import gaitopt.planners.time_optimal
import gaitopt.retiming
from gaitopt.errors import InputError
from gaitopt.terrain.columns import s_columns

Case = Callable[[], gaitopt.Plan]


class Outcome(NamedTuple):
    """What planning a set of walks gave: their times, ``None`` without a plan, and the work."""

    durations: tuple[float | None, ...]
    iterations: int
    seconds: float

    def against(self, known: Outcome) -> str:
        """One line for people."""
        pairs = [
            (a, b) for a, b in zip(self.durations, known.durations, strict=True) if a and b
        ]  # fmt: skip
        ratios = [a / b for a, b in pairs]
        mean = sum(ratios) / len(ratios) if ratios else float("nan")
        return (
            f"{sum(d is not None for d in self.durations)} of {len(self.durations)} walks, time "
            f"x {mean:.5f} (at most x {max(ratios, default=float('nan')):.4f}), "
            f"{self.iterations} iterations, {self.seconds:.1f} s"
        )


def straight_cases() -> list[Case]:
    """Straight walks: all variants, both kinds of margin, rough ground, windows, other robots."""
    wang = gaitopt.load_robot("wang2020")
    rough = [gaitopt.s_columns(seed, columns=4, height_jitter=0.03) for seed in (0, 1)]
    return [
        *(_case(wang, ground, free=free, com=com)
          for ground in rough for free in ("swing", "height", "posture")
          for com in ("body", "model")),
        *(_case(wang, ground, free="swing", clearance=0.05) for ground in rough),
        *(_case(wang, rough[0], free=free, horizon=6) for free in ("overlap", "posture")),
        *(_on_columns(name, free="height") for name in ("a1", "anymal_c")),
        _case(wang, rough[0], free="overlap", acceleration_limit=6.0),
    ]  # fmt: skip


def smooth_cases() -> list[Case]:
    """Smooth walks: dynamic ones, bounded accelerations, rough ground, windows, other robots."""
    wang = gaitopt.load_robot("wang2020")
    level = [gaitopt.s_columns(seed, columns=4) for seed in (0, 1, 2)]
    rough = gaitopt.s_columns(0, columns=3, height_jitter=0.03)
    return [
        *(_case(wang, ground, free="dynamic") for ground in (*level, rough)),
        *(_case(wang, rough, free=free, acceleration_limit=6.0)
          for free in ("swing", "height", "posture")),
        _case(wang, level[0], free="dynamic", horizon=6),
        _case(wang, level[0], free="dynamic", cog_start=(0.0, 0.14)),
        *(_on_columns(name, free="dynamic") for name in ("wang2020-fast", "anymal_c")),
    ]  # fmt: skip


def _case(robot: gaitopt.Quadruped, footholds: gaitopt.Footholds, **options: Any) -> Case:
    return lambda: gaitopt.plan_route(
        robot, footholds, body_height=0.40, **options, timing="velocity"
    )


def _on_columns(name: str, **options: Any) -> Case:
    robot = gaitopt.load_robot(name)
    height = robot.standing_height
    footholds = s_columns(0, columns=3, robot=robot)
    return lambda: gaitopt.plan_route(
        robot, footholds, body_height=height, **options, timing="velocity"
    )


def measured(cases: Sequence[Case]) -> Outcome:
    """Plan all walks."""
    began, iterations = process_time(), 0
    durations: list[float | None] = []
    for case in cases:
        try:
            plan = case()
        except gaitopt.GaitoptError:
            durations.append(None)
        else:
            durations.append(plan.duration)
            assert isinstance(plan.record, gaitopt.RouteRecord)
            iterations += plan.record.solver_iterations or 0
    return Outcome(tuple(durations), iterations, process_time() - began)


@contextmanager
def changed(name: str, value: object) -> Iterator[None]:
    """Let a constant have another value in all modules that use it.

    Args:
        name: of the constant, with its module or without.
        value: the other one; for a named tuple a tuple will do.

    Raises:
        InputError: no module has this constant, or modules have different ones of this name.
    """
    old = present(name)
    kind: Any = type(old)
    if hasattr(old, "_fields") and isinstance(value, tuple):
        value = kind(*value)
    own = name.split(".")[-1]
    users = _users(name)
    for module in users:
        setattr(module, own, value)
    try:
        yield
    finally:
        for module in users:
            setattr(module, own, old)


def present(name: str) -> object:
    """The value of a constant as it is.

    Raises:
        InputError: no module has this constant, or modules have different ones of this name.
    """
    own = name.split(".")[-1]
    if not own.isupper():
        raise InputError(f"{name!r} is no constant: give a name in capitals, such as RESERVE_KEPT")
    values = {m.__name__: getattr(m, own) for m in _users(name)}
    if not values:
        known = sorted({n for m in _modules() for n in vars(m) if n.isupper()})
        close = difflib.get_close_matches(own, known, n=3, cutoff=0.4)
        raise InputError(f"no constant {name!r} in the time-optimal planner; close: {close}")
    first, *others = values.values()
    if any(other != first for other in others):
        raise InputError(f"{name} has different values in different modules: {values}")
    return first


def _users(name: str) -> list[Any]:
    """Modules that have a constant, or the one module that is named with it."""
    module, _, own = name.rpartition(".")
    found = [m for m in _modules() if hasattr(m, own)]
    return [m for m in found if m.__name__.endswith(f".{module}")] if module else found


def _modules() -> list[Any]:
    """All modules of the time-optimal planner and of the timing by forces."""
    names = [
        module.name
        for package in (gaitopt.planners.time_optimal, gaitopt.retiming)
        for module in pkgutil.walk_packages(package.__path__, package.__name__ + ".")
    ]
    return [importlib.import_module(name) for name in names]


def main(arguments: Sequence[str] | None = None) -> int:
    """Measure, and print a line for each value."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.planning.constants", description=__doc__
    )
    parser.add_argument("name", nargs="?", help="a constant, such as RESERVE_KEPT")
    parser.add_argument("values", nargs="*", help="values to try, as Python literals")
    parser.add_argument("--smooth", action="store_true", help="walks with bounded accelerations")
    options = parser.parse_args(arguments)
    if options.name and not options.values:
        parser.error(f"give one or more values for {options.name}")
    try:
        values = [(text, ast.literal_eval(text)) for text in options.values]
        was = present(options.name) if options.name else None
    except (InputError, ValueError, SyntaxError) as error:
        parser.error(str(error))
    cases = smooth_cases() if options.smooth else straight_cases()
    known = measured(cases)
    kept = f" ({options.name} = {was})" if options.name else ""
    print(f"as it is{kept}: {known.against(known)}", flush=True)
    for text, value in values:
        with changed(options.name, value):
            print(f"{options.name} = {text}: {measured(cases).against(known)}", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
