"""The only door between ROS messages and the rest of the package."""
