"""Wrong inputs of all kinds, by the thousand: robots, footholds, maps, plan files and calls."""
