"""Certificates: checks of plans at every instant."""
