"""The parts of meshcat that replays need: its commands, its geometries and its viewer.

``import meshcat`` would also load its server, and with that tornado, ZeroMQ, asyncio, TLS and
IPython: ten times as long. So its modules are imported as parts of a package of another name, of
which the rest of the program sees nothing: ``import meshcat`` is what it always was.
"""

from __future__ import annotations

import sys
from functools import cache
from importlib import import_module
from importlib.machinery import ModuleSpec
from importlib.util import find_spec, module_from_spec
from pathlib import Path
from typing import Any, Final

from gaitopt.errors import MissingPackageError
from gaitopt.hidden_packages import DRAWING, refuse_shadows

PACKAGE: Final = "gaitopt_meshcat"
"""Name under which the modules are imported."""


@cache
def meshcat_folder() -> Path:
    """The folder of the installed package meshcat, which is found and not imported.

    Raises:
        MissingPackageError: it is not installed, or another module hides it.
    """
    refuse_shadows(DRAWING)
    spec = find_spec("meshcat")
    folders = None if spec is None else spec.submodule_search_locations
    if not folders:
        raise MissingPackageError("meshcat is not installed; pip install meshcat")
    return Path(next(iter(folders)))


def meshcat_module(name: str) -> Any:
    """One of meshcat's modules that need no server: ``commands``, ``geometry`` or ``path``."""
    if PACKAGE not in sys.modules:
        spec = ModuleSpec(PACKAGE, None, is_package=True)
        spec.submodule_search_locations = [str(meshcat_folder())]
        sys.modules[PACKAGE] = module_from_spec(spec)
    return import_module(f"{PACKAGE}.{name}")
