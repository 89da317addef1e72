"""The walk over any ground: footholds are searched for on a height map."""
