"""Plans to look at: replay and figures."""
