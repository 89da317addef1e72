"""Reading ground from files: images, arrays, meshes, clouds of points, and messages of ROS."""
