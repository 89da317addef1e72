"""Replays: plans as HTML pages that play in a browser."""
