"""Ways of walking that are tried: lengths of the steps and of the stance."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from gaitopt.planners.over_terrain.settings import TerrainSettings

STEP_SHARES = (1.0, 0.7, 0.5)
"""Lengths of steps that are tried one after the other where none is given, as shares of the usual
one. Shorter steps go up and down higher stairs, and take more time."""
SHORT_STANCES = ((0.7, 0.7), (0.8, 0.6), (0.5, 0.55))
"""Shares of the usual step and of the standing robot's stance that are tried after these, where no
stance is given. Chosen: with the first anymal_c goes up risers of 17 and 18 cm on treads of 28 cm,
and not with a stance of 0.85; with the last risers of 17 cm on treads of 25 cm; with the second
wang2020 crosses stones on which other ways end."""
FURTHER = ((0.85, 0.85), (0.35, 0.7), (1.2, 0.85))
"""The same, which only an exhaustive search tries besides."""
PATIENT = (0.5, 0.7)
"""Shares of the usual step and stance of the way of walking that is tried last of all. Chosen:
anymal_c waits so at the rim of a valley (hills of seed 25, docs/terrain_table.md)."""


def ways_of(usual: TerrainSettings, asked: Mapping[str, Any]) -> tuple[TerrainSettings, ...]:
    """Ways of walking to try one after the other; what was asked for stays.

    Args:
        usual: the settings of the first one.
        asked: settings by name that were given.
    """
    shares = STEP_SHARES if asked.get("step_length") is None else (1.0,)
    pairs = [(share, usual.stance) for share in shares]
    if asked.get("stance") is None:
        given = len(shares) == 1
        stances = SHORT_STANCES + (FURTHER if usual.exhaustive else ())
        pairs += [(1.0 if given else share, stance) for share, stance in stances]
    return tuple(
        replace(usual, step_length=round(share * usual.step_length, 4), stance=stance)
        for share, stance in pairs
    )


def shorter_steps(usual: float, settings: TerrainSettings, asked: Mapping[str, Any]) -> list[float]:
    """Shorter lengths of steps [m] than those of some settings, where none is asked for.

    Args:
        usual: length of the usual steps [m].
        settings: of a search.
        asked: settings by name that were given.
    """
    lengths = [round(share * usual, 4) for share in STEP_SHARES]
    if asked.get("step_length") is not None or settings.step_length not in lengths:
        return []
    return [length for length in lengths if length < settings.step_length]
