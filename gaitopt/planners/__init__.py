"""Planners: each of them returns a :class:`gaitopt.Plan`."""
