"""What an executable does before its work: signals, surroundings, its command line. No ROS."""
