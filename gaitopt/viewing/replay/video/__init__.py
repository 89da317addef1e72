"""Replays as videos, drawn by a browser without a window."""
