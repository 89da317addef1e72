"""Body postures on given feet."""
