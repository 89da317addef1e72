"""Simulation of plans in MuJoCo."""
