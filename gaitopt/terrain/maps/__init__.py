"""Height maps that are made: rubble, stepping stones, stairs and others, by seed and difficulty."""
