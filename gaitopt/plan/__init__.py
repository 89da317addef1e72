"""The plan: the one result of every planner, and the one input of every consumer."""
