"""Walks without acceleration limits, straight between knots."""
