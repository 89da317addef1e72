"""Pure mathematics: where to put the COG, and how fast to go."""
