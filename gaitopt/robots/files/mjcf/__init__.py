"""MJCF, the models of MuJoCo: read by MuJoCo itself, written as a URDF, and compared with it."""
