"""What happened when a plan was walked in physics, for its replay."""
