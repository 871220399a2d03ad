"""One run of the disk without ROS: clocks, validation of commands, record of inputs, session.

The node and the library function `simulate` drive the core through the same `Session`, so that what
one of them records the other replays. Imports the core and the tables only.
"""
