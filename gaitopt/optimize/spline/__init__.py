"""Time-optimal joint splines."""
