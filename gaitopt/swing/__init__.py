"""Swing curves: how a foot flies over time, and its paths over obstacles."""
