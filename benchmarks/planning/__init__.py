"""What planners find and refuse, and whether a change of the code changed it."""
