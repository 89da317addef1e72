"""The flights of the feet, from the phases of a plan."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from gaitopt.conventions import LEGS, ByValue, FloatArray
from gaitopt.plan.phase import Phase
from gaitopt.terrain.footholds import Footholds


@dataclass(frozen=True, eq=False)
class Swing(ByValue):
    """One foot's flight, which may span several phases.

    Attributes:
        step: its index among all swings of the plan, by time of lift-off.
        leg: the leg.
        index: the leg's foothold that it leaves; it touches down on ``index + 1``. It is -1 where
            the plan begins with this foot in the air.
        start, end: lift-off and touch-down [s].
        foot_start, foot_end: these footholds, or where the foot is in the air ``(3,)`` [m].
        phases: indices of the first and the last phase of the flight.
    """

    step: int
    leg: str
    index: int
    start: float
    end: float
    foot_start: FloatArray
    foot_end: FloatArray
    phases: tuple[int, int]

    def __repr__(self) -> str:
        places = (", ".join(f"{x:.3f}" for x in at) for at in (self.foot_start, self.foot_end))
        return (
            f"Swing({self.leg}, step {self.step}, {self.start:.3f} to {self.end:.3f} s, "
            f"({') to ('.join(places)}) m)"
        )

    @property
    def duration(self) -> float:
        """``end - start`` [s]."""
        return self.end - self.start


def find_swings(
    phases: Sequence[Phase], footholds: Footholds, in_the_air: Mapping[str, FloatArray]
) -> tuple[Swing, ...]:
    """All flights of a plan, by time of lift-off, then by leg.

    A leg's k-th flight leads from its foothold k to the next one; a plan with more flights than
    footholds ends them all on the last. The first flight of a foot that is in the air when the plan
    begins leads to its first foothold.

    Args:
        phases, footholds: of the plan.
        in_the_air: where such feet are when it begins ``(3,)`` each [m].
    """
    found: list[tuple[int, int, str, int]] = []
    for leg in LEGS:
        for first, last in _flights(phases, leg):
            found.append((first, LEGS.index(leg), leg, last))
    found.sort()
    made = {leg: -1 if leg in in_the_air else 0 for leg in LEGS}
    swings = []
    for step, (first, _, leg, last) in enumerate(found):
        last_index = footholds.counts[leg] - 1
        index = min(made[leg], last_index)
        made[leg] += 1
        begin = footholds[leg][index] if index >= 0 else in_the_air[leg]
        swings.append(
            Swing(
                step, leg, index, phases[first].start, phases[last].end, begin,
                footholds[leg][min(index + 1, last_index)], (first, last),
            )
        )  # fmt: skip
    return tuple(swings)


def _flights(phases: Sequence[Phase], leg: str) -> list[tuple[int, int]]:
    """The first and the last phase of each flight of a leg.

    A flight ends where the foot stands, and where the leg's next step begins without a stance.
    """
    found: list[tuple[int, int]] = []
    for k, phase in enumerate(phases):
        if leg in phase.support:
            continue
        if k and leg not in phases[k - 1].support and not _next_step(phases[k - 1], phase, leg):
            found[-1] = (found[-1][0], k)
        else:
            found.append((k, k))
    return found


def _next_step(before: Phase, after: Phase, leg: str) -> bool:
    """Whether two phases are different steps of the same leg."""
    swings = before.kind == after.kind == "swing" and before.leg == after.leg == leg
    return swings and before.step != after.step
