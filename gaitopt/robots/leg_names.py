"""The names that people give to legs: ``LF``, ``FL``, ``front_left``, ``rear-right``, ``HL``."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from typing import Any, Final, Generic, TypeVar

from gaitopt.conventions import LEGS
from gaitopt.errors import InputError, UnknownNameError
from gaitopt.inputs import as_text

_SHORT: Final = {
    "lf": "LF", "fl": "LF", "rf": "RF", "fr": "RF",
    "lh": "LH", "hl": "LH", "rl": "LH", "lr": "LH", "bl": "LH", "lb": "LH",
    "rh": "RH", "hr": "RH", "rr": "RH", "br": "RH", "rb": "RH",
}  # fmt: skip
"""Short names: of two letters for the end and the side, the first may be ``R`` for rear."""
_ENDS: Final = {"front": "F", "fore": "F", "hind": "H", "rear": "H", "back": "H"}
_SIDES: Final = {"left": "L", "right": "R"}
_NAMES: Final = _SHORT | {
    name: _SIDES[side] + _ENDS[end]
    for side in _SIDES for end in _ENDS for name in (side + end, end + side)
}  # fmt: skip
Value = TypeVar("Value")
_WORD: Final = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+")


class LegMapping(Mapping[str, Value], Generic[Value]):
    """Values by leg, in the order of :data:`gaitopt.LEGS`, which any name of a leg finds.

    Args:
        values: by the names of :data:`gaitopt.LEGS`; nobody can write into the copy.
    """

    def __init__(self, values: Mapping[str, Value]) -> None:
        self._values = {leg: values[leg] for leg in LEGS}

    def __getitem__(self, name: str) -> Value:
        leg = as_leg(name)
        if not isinstance(leg, str) or leg not in self._values:
            raise UnknownNameError(
                f"{as_text(name)} is no leg; legs are {', '.join(LEGS)} (FL, RL, RR, FR and "
                "front_left are understood, too)"
            )
        return self._values[leg]

    def __iter__(self) -> Iterator[str]:
        return iter(self._values)

    def __len__(self) -> int:
        return len(self._values)

    def __repr__(self) -> str:
        return repr(self._values)


def as_leg(name: Any) -> Any:
    """The leg with this name, as :data:`gaitopt.LEGS` has it; what is no name of one as it is."""
    return (leg_named(name) or name) if isinstance(name, str) and name not in LEGS else name


def leg_of(name: str) -> str | None:
    """The leg that a name tells: one of :data:`gaitopt.LEGS`, or ``None``.

    Letters count in any case, and the leg may be anywhere in the name: ``"RL_calf_joint"`` is a
    name of LH.
    """
    side, end = parts_of(name)
    leg = side + end
    return leg if leg in LEGS else None


def leg_named(name: str) -> str | None:
    """The leg that has this name, and not only within a longer one; ``None`` where none has.

    Letters count in any case: ``"FL"``, ``"rh"``, ``"front_left"``, ``"Rear-Right"``.
    """
    return _NAMES.get(re.sub(r"[\s_-]+", "", name).lower())


def parts_of(name: str) -> tuple[str, str]:
    """Side and end that a name tells: ``L`` or ``R``, ``F`` or ``H``; empty for neither."""
    side = end = ""
    for word in _WORD.findall(name):
        low = word.lower()
        if low in _SHORT and not (side or end):
            return _SHORT[low][0], _SHORT[low][1]
        for text, letter in _SIDES.items():
            side = side or (letter if text in low else "")
        for text, letter in _ENDS.items():
            end = end or (letter if low.startswith(text) or low.endswith(text) else "")
    return side, end


def leg_of_names(names: Iterable[str]) -> str | None:
    """The leg that most of some names tell; ``None`` where they tell none."""
    told = [leg for leg in map(leg_of, names) if leg is not None]
    return max(sorted(set(told)), key=told.count) if told else None


def by_leg(what: str, given: Mapping[str, Any]) -> dict[str, Any]:
    """A mapping whose keys are legs under any name, with the names of :data:`gaitopt.LEGS`.

    Raises:
        InputError: it is no mapping, a key names no leg, or two name the same.
    """
    if not isinstance(given, Mapping):
        raise InputError(f"{what} must map legs to values, got {as_text(given)}")
    out: dict[str, Any] = {}
    for key, value in given.items():
        leg = leg_of(str(key))
        if leg is None or leg in out:
            raise InputError(
                f"{what}: {key!r} is no leg, or a second name of one; legs are {', '.join(LEGS)} "
                "(FL, RL, RR, FR and front_left are understood, too)"
            )
        out[leg] = value
    return {leg: out[leg] for leg in LEGS if leg in out}
