"""Where a robot's joints and collision shapes are at many poses, all computed at once."""
