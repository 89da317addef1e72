"""The time-optimal walk: all steps in one optimisation."""
