"""Timings of chains along which the robot cannot rest: a linear program for each interval."""
