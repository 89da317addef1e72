"""A robot's collision shapes for planners: beside obstacles, and links against one another."""
