"""How finely a search looks at steps: how many footholds, places of the body and ways to stand."""

from __future__ import annotations

from dataclasses import dataclass, replace

from gaitopt.planners.over_terrain.heights import ATTEMPTS, RARE_ATTEMPTS, Attempt


@dataclass(frozen=True)
class Fineness:
    """How finely steps are looked at.

    Attributes:
        candidates: most footholds that are tried for a step.
        block: side of the squares of which each gives one foothold to try, as a share of the step's
            freedom.
        chunks: most times that further pairs are judged for a layer of the least width; more for
            wider ones.
        rare_chunks: times that pairs of a layer are tried in the rare ways, too: the cheapest tell
            if these help.
        grid: places of the body along each side of the shrunken support triangle, of a grid that
            fills it; 0 for the usual eight places alone.
        attempts, rare: heights and pitches of the body that are tried one after the other.
        enough, few: share of pairs that may be left impossible without another of the attempts, and
            share that have to be possible without the rare ones.
        all_legs: whether all legs that may step next are tried at once, and not one after the other
            where the one before cannot.
    """

    candidates: int
    block: float
    chunks: int
    rare_chunks: int
    grid: int
    attempts: tuple[Attempt, ...]
    rare: tuple[Attempt, ...]
    enough: float
    few: float
    all_legs: bool


USUAL = Fineness(
    candidates=28, block=0.24, chunks=12, rare_chunks=3, grid=0, attempts=ATTEMPTS,
    rare=RARE_ATTEMPTS, enough=0.5, few=0.1, all_legs=False,
)  # fmt: skip
"""That of the usual search. Chosen: neighbouring footholds differ too little to try both; a lower
body reaches footholds farther down, a higher one lifts limbs; at a dead end the rare attempts cost
most."""
AT_DEAD_ENDS = replace(USUAL, candidates=112, block=0.12, chunks=48)
"""That of the usual search from where it went back from a dead end. Chosen: on the hardest ground
one foothold of a square leads on, and its neighbours do not. wang2020 crosses stones and hills in
this way on which it found none with the usual footholds (docs/terrain_table.md)."""
FINE = Fineness(
    candidates=112, block=0.12, chunks=1000, rare_chunks=1000, grid=5,
    attempts=ATTEMPTS,
    rare=(
        *RARE_ATTEMPTS,
        *(Attempt(height) for height in (0.76, 0.68, 0.96, 1.03)),
        *(Attempt(height, pitch) for pitch in (-0.3, 0.3) for height in (1.0, 0.88)),
        *(Attempt(0.84, pitch) for pitch in (-0.15, 0.15)),
    ),
    enough=0.0, few=1.0, all_legs=True,
)  # fmt: skip
"""That of an exhaustive search: four times the footholds, 23 places of the body in place of eight,
twenty attempts in place of ten, all of them for each pair, and all orders of the legs in a
cycle."""
