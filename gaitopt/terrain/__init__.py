"""What robots walk on: footholds, test terrains and obstacles."""
