"""In which order legs move."""
