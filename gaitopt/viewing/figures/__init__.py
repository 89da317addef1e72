"""Figures of plans, drawn with Matplotlib."""
