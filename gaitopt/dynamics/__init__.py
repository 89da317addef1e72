"""Contact forces, joint torques, and where a robot can stand."""
