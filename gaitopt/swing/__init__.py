"""How a foot flies, one file a shape."""
