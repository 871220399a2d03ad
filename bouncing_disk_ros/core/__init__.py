"""Numbers in, numbers out: the exact event-driven model; knows no clock, log, file or ROS."""
