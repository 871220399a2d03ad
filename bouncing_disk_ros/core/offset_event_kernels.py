"""Compiles the searches for the next event for motions with an offset (see `offset_kernels`)."""

from __future__ import annotations

from bouncing_disk_ros.core.arithmetic import compile_also
from bouncing_disk_ros.core.layout import MOTION, OFFSET_MOTION
from bouncing_disk_ros.core.next_event import after_contact, after_flight, find_next

for _entry in (after_contact, after_flight, find_next):
    compile_also(_entry, MOTION.dtype, OFFSET_MOTION.dtype)
