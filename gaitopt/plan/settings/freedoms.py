"""What a time-optimal walk may choose beyond the targets of the body centre."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields
from typing import Final

import numpy as np

from gaitopt.errors import InputError
from gaitopt.inputs import as_text, check_choice


@dataclass(frozen=True)
class Freedoms:
    """What is optimised beyond where the body centre goes before each swing.

    Attributes:
        overlap: the body moves during swings, and not only while all feet stand.
        swing: the curve of the flying foot.
        height: the body's height.
        posture: the body's roll, pitch and yaw.
        dynamic: the ZMP keeps the stability margin in place of the body centre, and joint
            accelerations are bounded.

    Raises:
        InputError: ``dynamic`` without ``overlap`` and ``swing``.
    """

    overlap: bool = False
    swing: bool = False
    height: bool = False
    posture: bool = False
    dynamic: bool = False

    def __post_init__(self) -> None:
        for item in fields(self):
            value = getattr(self, item.name)
            if not isinstance(value, (bool, np.bool_)):
                raise InputError(f"{item.name} must be True or False, got {as_text(value)}")
        if self.dynamic and not (self.overlap and self.swing):
            raise InputError("free: a dynamic walk needs 'overlap' and 'swing' to be free, too")

    @classmethod
    def from_name(cls, name: str) -> Freedoms:
        """The freedoms of a variant by its name (:data:`VARIANTS`).

        Raises:
            InputError: no variant has this name.
        """
        check_choice("free", name, VARIANTS)
        return VARIANTS[name]

    @classmethod
    def of(cls, given: Freedoms | str | Iterable[str]) -> Freedoms:
        """Freedoms from a value object, the name of a variant, or the names of what is free.

        Raises:
            InputError: a name is unknown.
        """
        if isinstance(given, Freedoms):
            return given
        if isinstance(given, str):
            return cls.from_name(given)
        single = not isinstance(given, Iterable) or getattr(given, "ndim", 1) == 0
        single |= isinstance(given, Mapping)
        single |= getattr(getattr(given, "dtype", None), "kind", "U") != "U"
        named = {_name_of(given)} if single else {_name_of(name) for name in given}
        known = [f.name for f in fields(cls)]
        unknown = sorted(named - {*known, "route"})
        if unknown:
            raise InputError(
                f"free names {as_text(unknown[0])}; what can be freed is {', '.join(known)} "
                "(the targets of the body centre always are)"
            )
        return cls(**{name: name in named for name in known})

    @property
    def names(self) -> tuple[str, ...]:
        """The names of what is free."""
        return tuple(f.name for f in fields(self) if getattr(self, f.name))

    @property
    def variant(self) -> str:
        """The name of the variant, or the free things joined by ``+``."""
        found = [name for name, free in VARIANTS.items() if free == self]
        return found[0] if found else "+".join(self.names)

    def __str__(self) -> str:
        return self.variant

    def to_dict(self) -> list[str]:
        """The names of what is free, as a plan file stores them."""
        return list(self.names)


VARIANTS: Final[dict[str, Freedoms]] = {
    "route": Freedoms(),
    "overlap": Freedoms(overlap=True),
    "swing": Freedoms(overlap=True, swing=True),
    "height": Freedoms(overlap=True, swing=True, height=True),
    "posture": Freedoms(overlap=True, swing=True, height=True, posture=True),
    "dynamic": Freedoms(overlap=True, swing=True, height=True, posture=True, dynamic=True),
}
"""The variants of the time-optimal walk (docs/time_optimal.md): each frees one thing more."""


def _name_of(given: object) -> str:
    """A name, also where a text was given that is a member of an enumeration."""
    return str(given) if isinstance(given, str) else as_text(given)
