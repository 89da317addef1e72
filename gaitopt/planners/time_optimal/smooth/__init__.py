"""Walks with bounded joint accelerations."""
