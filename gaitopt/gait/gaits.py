"""Gaits with names, as schedules.

In a gait of evenly spaced steps each leg touches down a quarter of a cycle after the leg before it.
In a wave gait (:func:`wave`) the front leg of each side lifts off when the hind leg touches down.
Depending on the duty factor a wave is the trot, the critical walk, or the crawl with the largest
longitudinal stability margin.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from types import MappingProxyType
from typing import Final

from gaitopt.conventions import LEGS
from gaitopt.errors import InputError
from gaitopt.gait.crawl import WANG_SEQUENCE, check_sequence
from gaitopt.gait.schedule import SNAP, GaitSchedule
from gaitopt.inputs import as_text, check_number

CRITICAL: Final = 0.75
"""Below this duty factor no gait keeps three feet on the ground."""


def walk(cycle_time: float, duty_factor: float = CRITICAL) -> GaitSchedule:
    """The walk: legs swing one by one in the order LF, RH, RF, LH, evenly spaced.

    With the duty factor 0.75, the critical walk, a leg lifts off when the one before it touches
    down, so that three feet stand at every instant; no faster walk does. With a larger one there
    are times on four feet between the swings. LF touches down at the cycle's start, so that RH is
    the first to swing.

    Source: [Wang2024], Section 2, Figs. 1-3.

    Args:
        cycle_time: duration of a cycle [s].
        duty_factor: 0.75 or more.

    Raises:
        InputError: the duty factor is below 0.75 or not below 1.
    """
    return _one_by_one("walk", WANG_SEQUENCE, cycle_time, duty_factor)


def crawl(
    sequence: Iterable[str], cycle_time: float, duty_factor: float = CRITICAL
) -> GaitSchedule:
    """A crawl: legs swing one by one in any order, evenly spaced.

    The first leg of the sequence is the first to lift off in the cycle, and the last one touches
    down at the cycle's start. ``gaitopt.gait.crawl.CRAWL_SEQUENCES`` are the six orders that there
    are; :func:`walk` has the order ``WANG_SEQUENCE``.

    Args:
        sequence: the legs in the order in which they swing.
        cycle_time: duration of a cycle [s].
        duty_factor: 0.75 or more.

    Raises:
        InputError: the sequence does not name each leg once, or the duty factor is below 0.75.
    """
    order = check_sequence(sequence)
    return _one_by_one("crawl " + " ".join(order), order, cycle_time, duty_factor)


def trot(cycle_time: float, duty_factor: float = 0.5) -> GaitSchedule:
    """The trot: the diagonal pairs LF, RH and RF, LH step in turn.

    With the duty factor 0.5, the critical trot, one pair lifts off when the other touches down.
    [XiLing] recommends 0.3 to 0.5. Below 0.5 there are times of flight (``has_flight``), in which
    there is no support polygon and no ZMP. Above 0.5 there are times on four feet.

    Source: [XiLing], eqs. (32)-(38) and the first (43);
    [Wang2024], Section 3, Figs. 4 and 5.
    """
    return _pairs("trot", ("LF", "RH"), cycle_time, duty_factor)


def pace(cycle_time: float, duty_factor: float = 0.5) -> GaitSchedule:
    """The pace: the legs of the left side and those of the right side step in turn."""
    return _pairs("pace", ("LF", "LH"), cycle_time, duty_factor)


def bound(cycle_time: float, duty_factor: float = 0.5) -> GaitSchedule:
    """The bound: the front legs and the hind legs step in turn."""
    return _pairs("bound", ("LF", "RF"), cycle_time, duty_factor)


def pronk(cycle_time: float, duty_factor: float = 0.7) -> GaitSchedule:
    """The pronk: all legs step together, and the robot jumps once in a cycle.

    With the duty factor 0.7 and a cycle of 0.5 s the body flies for 0.15 s, and rises by about
    30 mm in that time.
    """
    return GaitSchedule(cycle_time, duty_factor, dict.fromkeys(LEGS, 0.0), "pronk")


def quasi_static(cycle_time: float, duty_factor: float = 0.625) -> GaitSchedule:
    """The gaits between trot and walk: sometimes two feet stand, sometimes three.

    The paper gives no offsets. Those used here are those of :func:`wave`, which change continuously
    from the trot (duty factor 0.5) to the critical walk (0.75): LF 0, RF 0.5, and the hind legs RH
    and LH later than in the trot by the duty factor minus 0.5. Three feet stand for the share
    ``4 duty_factor - 2`` of the cycle, and a diagonal pair for the rest.

    Source: [Wang2024], Section 4.

    Args:
        cycle_time: duration of a cycle [s].
        duty_factor: from 0.5 to 0.75.

    Raises:
        InputError: the duty factor is out of that range.
    """
    duty = check_number("duty_factor", duty_factor, SNAP, 1.0 - SNAP)
    if not 0.5 - SNAP <= duty <= CRITICAL + SNAP:
        other = "trot, which has times of flight there," if duty < 0.5 else "walk or wave"
        raise InputError(
            f"quasi_static needs a duty_factor from 0.5 to 0.75, got {duty:g}; use {other} instead"
        )
    return _wave("quasi_static", cycle_time, duty)


def wave(cycle_time: float, duty_factor: float = 0.8) -> GaitSchedule:
    """The wave: on each side the front leg lifts off when the hind leg touches down.

    The sides are half a cycle apart. From 0.75 on no gait of that duty factor has a larger
    longitudinal stability margin (:mod:`gaitopt.gait.longitudinal`), as long as the stride is not
    longer than the body ([McGhee1968]). At 0.5 it is the trot, at 0.75 the critical walk.

    Args:
        cycle_time: duration of a cycle [s].
        duty_factor: 0.5 or more.

    Raises:
        InputError: the duty factor is below 0.5 or not below 1.
    """
    duty = check_number("duty_factor", duty_factor, SNAP, 1.0 - SNAP)
    if duty < 0.5 - SNAP:
        raise InputError(f"wave needs a duty_factor of 0.5 or more, got {duty:g}; use trot instead")
    return _wave("wave", cycle_time, duty)


GAITS: Final[Mapping[str, Callable[..., GaitSchedule]]] = MappingProxyType(
    {g.__name__: g for g in (walk, quasi_static, trot, pace, bound, pronk, wave)}
)
"""Gaits by name; each takes a cycle time and a duty factor. A crawl needs its order too."""


def gait(name: str, cycle_time: float, duty_factor: float | None = None) -> GaitSchedule:
    """The gait of that name, with its own duty factor by default.

    Args:
        name: in any case, with ``-`` or ``_`` between words; or the order of a :func:`crawl`, with
            commas: ``"RH,RF,LF,LH"``.
        cycle_time: duration of a cycle [s].
        duty_factor: the gait's own by default.

    Raises:
        InputError: there is no gait of that name, or it does not go with the duty factor.
    """
    rest = (cycle_time,) if duty_factor is None else (cycle_time, duty_factor)
    if isinstance(name, str) and "," in name:
        return crawl(name, *rest)
    known = name.strip().lower().replace("-", "_") if isinstance(name, str) else ""
    if known not in GAITS:
        names = ", ".join(GAITS).replace("_", "-")
        raise InputError(
            f"gait must be one of {names}, or an order of legs such as RH,RF,LF,LH; got "
            f"{as_text(name)}"
        )
    return GAITS[known](*rest)


def _one_by_one(
    name: str, order: tuple[str, ...], cycle_time: float, duty_factor: float
) -> GaitSchedule:
    duty = check_number("duty_factor", duty_factor, SNAP, 1.0 - SNAP)
    if duty < CRITICAL - SNAP:
        raise InputError(
            f"{name.split()[0]} needs a duty_factor of 0.75 or more, so that three feet stand, got "
            f"{duty:g}; use quasi_static from 0.5 on, or raise it"
        )
    offsets = {leg: (place + 1) / 4 % 1.0 for place, leg in enumerate(order)}
    return GaitSchedule(cycle_time, duty, offsets, name)


def _pairs(
    name: str, first: tuple[str, str], cycle_time: float, duty_factor: float
) -> GaitSchedule:
    offsets = {leg: 0.0 if leg in first else 0.5 for leg in LEGS}
    return GaitSchedule(cycle_time, duty_factor, offsets, name)


def _wave(name: str, cycle_time: float, duty: float) -> GaitSchedule:
    offsets = {"LF": 0.0, "LH": duty, "RH": max(duty - 0.5, 0.0), "RF": 0.5}
    return GaitSchedule(cycle_time, duty, offsets, name)
