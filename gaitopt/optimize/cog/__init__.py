"""The COG problem of [Wang2020]: where the body centre goes before each swing."""
