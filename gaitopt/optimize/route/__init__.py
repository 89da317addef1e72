"""The time-optimal walk as a problem of inequalities."""
