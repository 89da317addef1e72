"""Controllers that follow a plan, usable with and without a simulator."""
