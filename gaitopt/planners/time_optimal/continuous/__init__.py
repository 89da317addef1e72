"""Continuous walks of robots with quick joints: the body moves on while feet fly.

The times of the first guess are given, so where the body goes is one convex problem (``body``).
Feet fly along given splines (``swings``). Contact forces then set the timing of this motion
(:mod:`gaitopt.retiming`).
"""
