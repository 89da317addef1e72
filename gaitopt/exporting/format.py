"""What a format of files is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gaitopt.exporting.sampled import Exported, Source


@dataclass(frozen=True)
class Format:
    """A format that plans can be exported to.

    Attributes:
        name: by which it is asked for.
        summary: what it is, in a few words.
        suffixes: endings of files that mean it where no format is named.
        write: writes a file: ``write(source, path, dt, **options)``; ``dt`` is ``None`` where the
            user gave none.
        options: names of the further keyword arguments of ``write``.
        forces: whether the file has torques and contact forces where the user does not say: of all
            plans that promise them.
    """

    name: str
    summary: str
    suffixes: tuple[str, ...]
    write: Callable[..., Exported]
    options: tuple[str, ...] = ()
    forces: bool = True

    def __call__(self, source: Source, path: Path, dt: float | None, **options: Any) -> Exported:
        """Write the file; see :attr:`write`."""
        return self.write(source, path, dt, **options)
