"""A robot's links over the ground while footholds are searched for, and how its feet roll."""
