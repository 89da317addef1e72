"""Robot files of many kinds, read into one: a URDF that the rest of gaitopt takes as it is."""
