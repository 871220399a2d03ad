"""The executable `workbench`: a page to see and touch a run, over ROS, without it, or of a bag."""
