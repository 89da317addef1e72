"""Gaits by velocity: walk, trot, pace and others."""
