"""Entry point from Python: advance a state from event to event."""

from __future__ import annotations

from numba import types

from bouncing_disk_ros.core.arithmetic import entry
from bouncing_disk_ros.core.energy_ledger import Ledger
from bouncing_disk_ros.core.impact_log import ROWS, Rows
from bouncing_disk_ros.core.layout import DISK, FAULT, LEDGER, MOTION, STATE, UNKNOWN
from bouncing_disk_ros.core.next_event import find_next
from bouncing_disk_ros.core.platform import Record
from bouncing_disk_ros.core.resolve_event import resolve

DONE, FULL, BEHIND, FAULTY = 0, 1, 2, 3
_INT = types.int64


@entry(types.UniTuple(_INT, 3)(STATE, MOTION, DISK, LEDGER, ROWS, ROWS, _INT, _INT, _INT))
def advance(
    state: Record,
    motion: Record,
    disk: Record,
    ledger: Ledger,
    rows: Rows,
    open_row: Rows,
    boundary_ns: int,
    until_ns: int,
    budget: int,
) -> tuple[int, int, int]:
    """Resolve the events up to until_ns; boundary_ns bounds the search for the next one.

    Returns (rows written, work done in events, status): DONE, FULL (no room for the rows of one
    more event), BEHIND (the budget is used up: a call may pass it by one search) or FAULTY (the
    state is not finite, or a root was not found).
    """
    n = work = 0
    while work < budget:
        if state[0].event == UNKNOWN:
            work += find_next(state[0], motion[0], disk[0], boundary_ns) - 1
        if state[0].event == FAULT:
            return n, work, FAULTY
        ns = state[0].event_ns
        if ns > until_ns or (ns == until_ns and state[0].event_sub > 0.0):
            return n, work, DONE
        if n + 2 > len(rows):
            return n, work, FULL
        n = resolve(state[0], motion[0], disk[0], ledger, rows, n, open_row)
        work += 1
    return n, work, BEHIND
