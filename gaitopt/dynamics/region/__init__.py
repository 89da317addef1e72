"""Regions in which a robot can stand: their rows, linear programs and polygons."""
