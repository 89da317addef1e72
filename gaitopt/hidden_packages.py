"""Other packages with the names of those that gaitopt needs, in front of them on Python's path."""

from __future__ import annotations

from functools import cache
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Final

import numpy as np

from gaitopt.errors import MissingPackageError

NEEDED: Final = (
    ("pinocchio", "pin", "buildModelFromXML"),
    ("casadi", "casadi", "GlobalOptions"),
    ("mujoco", "mujoco", "FatalError"),
)
"""Modules, the packages that install them, and something that each of them has."""
DRAWING: Final = (("meshcat", "meshcat", "Visualizer"), ("yourdfpy", "yourdfpy", "URDF"))
"""The same, of what only replays need."""


def _packages() -> Path:
    """The folder of installed packages: that of NumPy, which has no other with its name."""
    return Path(np.__file__).parents[1]


@cache
def refuse_shadows(needed: tuple[tuple[str, str, str], ...] = NEEDED) -> None:
    """Look once whether modules that gaitopt needs are hidden by others of the same name.

    A folder on ``PYTHONPATH``, of ROS for instance, or a file beside a script may hold a module
    ``pinocchio`` that has nothing to do with it. One that has what gaitopt uses is taken.

    Args:
        needed: modules, the packages that install them, and something that each of them has.

    Raises:
        MissingPackageError: one is hidden; the message tells both places.
    """
    for module, package, attribute in needed:
        try:
            spec = find_spec(module)
        except (ImportError, ValueError):
            continue
        # A folder without __init__.py is a module, too, and has no origin.
        folders = None if spec is None else spec.submodule_search_locations
        place = (spec and spec.origin) or next(iter(folders or ()), None)
        if place is None:
            continue
        if Path(place).is_relative_to(_packages()):
            continue  # as nearly always
        from importlib import metadata  # late: it takes longer to import than all checks here

        try:
            home = Path(str(metadata.distribution(package).locate_file("")))
        except metadata.PackageNotFoundError:
            home = None
        if home is not None and Path(place).resolve().is_relative_to(home.resolve()):
            continue
        try:
            if hasattr(import_module(module), attribute):
                continue
            why = f"it has no {attribute}"
        except Exception as error:  # whatever a module that is not the right one does
            why = f"{type(error).__name__}: {error}"
        where = f"that of the package {package}" + (f" in {home}" if home else "")
        raise MissingPackageError(
            f"the module {module} at {place} hides {where}, which gaitopt needs ({why}): take its "
            "folder out of PYTHONPATH, or rename it"
        )
