"""Phases of a walk that is planned phase by phase."""

from __future__ import annotations

from dataclasses import replace

from gaitopt import Plan


def test_phases_that_are_not_checked_one_by_one_pass_all_checks(short_plan: Plan) -> None:
    """Planners make hundreds of phases, limits and evidences without the checks of their classes;
    made again with them, they are the same."""
    for phase in short_plan.phases:
        again = replace(
            phase,
            limited_by=tuple(replace(limit) for limit in phase.limited_by),
            evidence=None if phase.evidence is None else replace(phase.evidence),
        )
        assert again == phase and vars(again).keys() == vars(phase).keys()
        for place in ("cog_start", "cog_end", "foot_start", "foot_end"):
            assert getattr(again, place) is getattr(phase, place)  # nobody can change it
