"""What walks: robots, their legs, and where they come from."""
