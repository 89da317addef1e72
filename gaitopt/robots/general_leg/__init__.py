"""Legs of three hinges with any axes."""
