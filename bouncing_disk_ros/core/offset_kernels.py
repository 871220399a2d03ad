"""The kernels for motions with an offset, compiled when an offset is used for the first time.

A start without an offset does not wait for them. `kernel_cache` compiles the searches and the
inputs in two processes side by side, and then the stepper, which calls both.
"""

from __future__ import annotations

from bouncing_disk_ros.core import (
    input_kernels,
    offset_motion,  # noqa: F401  what is compiled here calls its functions
)
from bouncing_disk_ros.core.arithmetic import compile_also
from bouncing_disk_ros.core.event_store import store_event
from bouncing_disk_ros.core.layout import MOTION, OFFSET_MOTION
from bouncing_disk_ros.core.next_event import after_contact, after_flight, find_next
from bouncing_disk_ros.core.resolve_event import resolve


def searches() -> None:
    """Declare the searches for the next event."""
    for part in (after_contact, after_flight, find_next):
        compile_also(part, MOTION.dtype, OFFSET_MOTION.dtype)


def inputs() -> None:
    """Declare what stores and resolves events; compile what Python calls for inputs."""
    for part in (store_event, resolve):
        compile_also(part, MOTION.dtype, OFFSET_MOTION.dtype)
    for entry in (
        input_kernels.advance_to,
        input_kernels.take_due,
        input_kernels.apply_impulse,
        input_kernels.follow_platform,
        input_kernels.classify_after_input,
        input_kernels.change_disk,
        input_kernels.observe,
    ):
        compile_also(entry, MOTION, OFFSET_MOTION)


def everything() -> None:
    """Compile all of them, or load them."""
    from bouncing_disk_ros.core.stepper import advance

    searches()
    inputs()
    compile_also(advance, MOTION, OFFSET_MOTION)
