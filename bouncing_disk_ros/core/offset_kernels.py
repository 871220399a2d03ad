"""Compiles the kernels for motions with an offset, or loads them, when it is imported.

That is where an offset is used for the first time: a start without one does not wait for them.
"""

from __future__ import annotations

from bouncing_disk_ros.core import offset_event_kernels, offset_input_kernels
from bouncing_disk_ros.core.arithmetic import compile_also
from bouncing_disk_ros.core.layout import MOTION, OFFSET_MOTION
from bouncing_disk_ros.core.stepper import advance

PARTS = (offset_event_kernels, offset_input_kernels)
"""Modules of what is called by those here; compiled in processes of their own (kernel_cache)."""

compile_also(advance, MOTION, OFFSET_MOTION)
