"""What is walked on: footholds and test terrains."""
