"""Tools that read bags without ROS: `bag_report`, `bag_recover`; a run read out of a bag."""
