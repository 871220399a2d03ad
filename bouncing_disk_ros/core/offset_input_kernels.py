"""Compiles events resolved and inputs for motions with an offset (see `offset_kernels`)."""

from __future__ import annotations

from bouncing_disk_ros.core import input_kernels
from bouncing_disk_ros.core.arithmetic import compile_also
from bouncing_disk_ros.core.event_store import store_event
from bouncing_disk_ros.core.layout import MOTION, OFFSET_MOTION
from bouncing_disk_ros.core.resolve_event import resolve

for _part in (store_event, resolve):
    compile_also(_part, MOTION.dtype, OFFSET_MOTION.dtype)
for _entry in (
    input_kernels.advance_to,
    input_kernels.take_due,
    input_kernels.apply_impulse,
    input_kernels.follow_platform,
    input_kernels.classify_after_input,
    input_kernels.change_disk,
    input_kernels.observe,
):
    compile_also(_entry, MOTION, OFFSET_MOTION)
