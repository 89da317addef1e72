"""Comparisons over methods and terrains, and their tables."""
