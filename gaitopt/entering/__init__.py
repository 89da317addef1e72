"""Plans that begin in a given state: from there to rest on four feet, and then the walk."""
