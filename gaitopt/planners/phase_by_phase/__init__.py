"""The walk planned phase by phase."""
