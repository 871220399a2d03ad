"""Controllers that juggle: impacts heard in, offset trajectories of the platform out; no ROS."""
