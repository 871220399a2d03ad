"""Compile the kernels for motions with an offset: where one is used for the first time.

A start without one does not wait for them. They are cached as all others are.
"""

from __future__ import annotations

from functools import cache

from bouncing_disk_ros.core import stepper
from bouncing_disk_ros.core.arithmetic import compile_also
from bouncing_disk_ros.core.contact_event import after_contact
from bouncing_disk_ros.core.flight_event import after_flight
from bouncing_disk_ros.core.layout import MOTION, OFFSET_MOTION
from bouncing_disk_ros.core.next_event import find_next
from bouncing_disk_ros.core.resolve_event import resolve

INNER = (after_flight, after_contact, resolve, find_next)
"""Entries that others call, with a record of a motion, in the order of their compilation."""
OUTER = (
    stepper.advance,
    stepper.advance_to,
    stepper.apply_impulse,
    stepper.keep_sticking,
    stepper.classify_after_input,
    stepper.change_disk,
    stepper.observe,
)


@cache
def compile_for_offsets() -> None:
    """Compile or load all of them; later calls do nothing."""
    for entry in INNER:
        compile_also(entry, MOTION.dtype, OFFSET_MOTION.dtype)
    for entry in OUTER:
        compile_also(entry, MOTION, OFFSET_MOTION)
