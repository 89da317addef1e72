"""What notebooks show of robots, footholds, ground, plans and certificates."""
