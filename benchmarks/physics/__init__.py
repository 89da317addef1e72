"""What becomes of plans after planning: in physics, and in a robot's controller."""
