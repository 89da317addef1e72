"""How a search for footholds ended, and what that says of the ground."""

from __future__ import annotations

from gaitopt.conventions import TextEnum


class Ending(TextEnum):
    """How a search ended."""

    GOAL = "it reached the goal"
    NO_GOAL = "no pose of the body that is searched for stands at the goal"
    NO_START = "no pose of the body that is searched for stands at the start"
    WALLED = "something lies across the whole map, in which no pose of the body stands"
    EXHAUSTED = "every way at this fineness ended"
    TRIES = "its tries were used up"
    TIME = "its time was over"
