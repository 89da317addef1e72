"""Names that the shell completes."""

from __future__ import annotations

from collections.abc import Iterable


def complete_robot(begun: str) -> list[str]:
    """Names of robots that begin so."""
    from gaitopt.robots.catalog import robot_names

    return _beginning(robot_names(), begun)


def complete_gait(begun: str) -> list[str]:
    """Names of gaits that begin so."""
    from gaitopt.gait.gaits import GAITS

    return _beginning((name.replace("_", "-") for name in GAITS), begun)


def complete_ground(begun: str) -> list[str]:
    """Names of grounds that are made, and begin so."""
    from gaitopt.terrain.maps.catalogue import GROUNDS

    return _beginning(GROUNDS, begun)


def _beginning(names: Iterable[str], begun: str) -> list[str]:
    return [name for name in names if name.startswith(begun.lower())]
