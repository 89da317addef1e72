"""Where the body centre goes before each swing."""
