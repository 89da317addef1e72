"""Optimisation problems of walking: where the COG goes, how fast, postures, splines, routes."""
