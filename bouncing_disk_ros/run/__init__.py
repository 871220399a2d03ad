"""One run of the disk without ROS: clocks, rulings on commands, the record of inputs, the session.

The node and the library function `simulate` drive the core through the same `Session`, so that what
one of them records the other replays. Imports the core and the tables only.
"""
