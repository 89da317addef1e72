"""Following a plan on a robot that can fall: controllers, usable without a simulator."""
