"""Walks over an obstacle, for legs without a roll joint."""
