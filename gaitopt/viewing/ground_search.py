"""What replays and figures show of a search for footholds over a height map."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol

from gaitopt.conventions import FloatArray
from gaitopt.terrain.footholds import Footholds
from gaitopt.terrain.layers import GroundLayers


class Way(Protocol):
    """The way of the body that was asked for: ``poses`` x, y [m] and yaw [rad] ``(n, 3)``."""

    @property
    def poses(self) -> FloatArray:
        """Poses along the way."""
        ...


class GroundSearch(Protocol):
    """A search for footholds, such as that of ``plan_terrain``: what is shown of it.

    Attributes:
        footholds: those of the way that was found; of its first part, where the goal was not
            reached.
        complete: whether the goal was reached.
        layers: of the ground.
        tried: footholds that were tried ``(n, 3)`` [m].
        course: the way of the body that was asked for.
        refused: at the first step that was not possible, how many steps were refused for what.
    """

    @property
    def footholds(self) -> Footholds: ...
    @property
    def complete(self) -> bool: ...
    @property
    def layers(self) -> GroundLayers: ...
    @property
    def tried(self) -> FloatArray: ...
    @property
    def course(self) -> Way: ...
    @property
    def refused(self) -> Mapping[Any, int]: ...
