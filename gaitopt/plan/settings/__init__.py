"""What a planner was asked for, as data."""
