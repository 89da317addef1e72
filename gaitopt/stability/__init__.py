"""Support polygons, stability margins and the ZMP."""
