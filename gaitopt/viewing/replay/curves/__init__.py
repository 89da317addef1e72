"""Curves under the replay's scrubber: joints, margin, forces, and which feet stand."""
