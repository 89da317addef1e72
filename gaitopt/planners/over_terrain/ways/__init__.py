"""Ways of walking that are tried one after the other, and searches that get ever wider."""
