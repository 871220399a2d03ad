"""Compiles contact for motions with an offset (see `offset_kernels`)."""

from __future__ import annotations

from bouncing_disk_ros.core.arithmetic import compile_also
from bouncing_disk_ros.core.contact_event import after_contact
from bouncing_disk_ros.core.layout import MOTION, OFFSET_MOTION

compile_also(after_contact, MOTION.dtype, OFFSET_MOTION.dtype)
