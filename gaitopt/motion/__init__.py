"""Paths of body and joints in time."""
