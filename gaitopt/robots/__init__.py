"""Robots: their legs, kinematics, joint limits and collision shapes, and where they come from."""
