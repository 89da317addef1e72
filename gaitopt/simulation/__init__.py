"""Plans walked in physics (MuJoCo)."""
