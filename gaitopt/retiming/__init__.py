"""Timing of plans by contact forces: the same course, as fast as forces and torques allow."""
