"""The height map below a plan, in its replay."""
