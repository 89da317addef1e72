"""From points, triangles and columns to heights on a grid, and changes of such heights."""
