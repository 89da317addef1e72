"""Support polygons and margins."""
