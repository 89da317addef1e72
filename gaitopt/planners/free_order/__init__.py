"""The walk whose order of legs is searched for."""
