"""What a plan says of its robot, its promises and itself."""
