"""Conversions between ROS messages and the rest of the package; only here are both known."""
