"""Whether a plan is right: consumers of plans that judge."""
