"""The command line of gaitopt."""
