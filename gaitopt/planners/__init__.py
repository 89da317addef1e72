"""Planners, and the plan that all of them return."""
