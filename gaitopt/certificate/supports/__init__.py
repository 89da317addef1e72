"""The support polygons of standing feet, and how deep points lie in them."""
