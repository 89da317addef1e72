"""Distances of the robot's shapes from each other and from obstacles."""
