"""xacro, expanded without ROS in a process of its own."""
