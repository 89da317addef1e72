"""Replays of plans that play in a browser."""
