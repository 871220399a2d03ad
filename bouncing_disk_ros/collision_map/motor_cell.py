"""What a motor settles on: means of speed, powers and losses of one disk after another.

Each disk is run by the functions of the stepper, with all of its loads, and looked at once a period
of the platform at one forcing phase. Where its state comes back after n periods the means over the
next n stand for all; else they are over a stretch that grows until the speed is known well enough.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import types

from bouncing_disk_ros.core.arithmetic import TWO_PI, entry, rare_kernel, sincos
from bouncing_disk_ros.core.energy_ledger import Ledger
from bouncing_disk_ros.core.forcing_clock import instant_of, seconds_between
from bouncing_disk_ros.core.impact_log import ROWS, Rows
from bouncing_disk_ros.core.layout import (
    CHATTER_ENDS,
    DISK,
    FAULT,
    FLIGHT,
    IMPACT,
    LEDGER_FIELDS,
    MOTION,
    NEVER,
    NOTHING,
    STATE,
    STATE_DTYPE,
    UNKNOWN,
)
from bouncing_disk_ros.core.model import IMPACT_DTYPE
from bouncing_disk_ros.core.next_event import find_next
from bouncing_disk_ros.core.platform import Record
from bouncing_disk_ros.core.propagate import classify_contact, propagate
from bouncing_disk_ros.core.resolve_event import resolve

Floats = Any  # float64 arrays, of one or two dimensions

LOOK_AT = 1.5 * math.pi
"""Forcing phase at which the state is looked at, rad: the platform's lowest point."""
LONGEST_CYCLE = 64
"""Most periods of the platform after which a state is found to come back."""
BATCHES = 32
"""Parts of a stretch whose means give the standard error of the whole."""
_COMES_BACK = 1e-11
"""Within so much of its scales. What changes less in a cycle changes by less than 1e-3 of them in a
hundred million cycles."""
_TABLES = 5  # rows of the work space before those of the looks
_NEARLY = 1e-4
"""What comes back within so much only may yet settle on a shorter cycle."""
_SURE = 3.0
"""So many standard errors are to be within what is asked for."""
_MOST_EVENTS = 100_000  # in one period: far more than any has

SEEN_TAU, SEEN_GAP, SEEN_U, SEEN_OMEGA, SEEN_AT, SEEN_ANGLE, SEEN_CONTACT, SEEN_CONTACTS = range(8)
SEEN_ROWS, SEEN_LEDGER = 8, 9
"""What a look sees: the state and its time (s); since the start, the angle turned, seconds and
number of contacts, impacts, and the entries of the energy ledger."""
_ENTRIES = len(LEDGER_FIELDS) - 1  # without the throughput
_SEEN = SEEN_LEDGER + _ENTRIES
RUN_CONTACT, RUN_CONTACTS, RUN_TAU, RUN_U, RUN_OMEGA = range(5)
"""What a run keeps: seconds and number of contacts, and the state after the last impact."""

BEGIN_TAU, BEGIN_U, BEGIN_OMEGA, BEGIN_SETTLING, BEGIN_PRECISION = range(5)
"""Of a start: forcing phase, relative speed after an impact there (0: the disk lies on the
platform), α̇; periods to leave out (negative: this one is passed over), error of the speed to reach
(rad/s), which is also its scale over PRECISION_PART."""
MEAN_SPEED, SPEED_ERROR, PERIODS, CONTACT_SHARE, CONTACT_RATE, IMPACT_RATE, POWERS = range(7)
"""Columns of the means, SI units; from POWERS on the entries of the energy ledger per second."""
CYCLE = POWERS + _ENTRIES
CYCLE_IMPACTS = CYCLE + 1
"""Periods of the platform after which the state comes back, and impacts in them; 0: it does not."""
MEANS_COLUMNS = CYCLE_IMPACTS + 1
PRECISION_PART = 1e-3
"""Error of a mean speed that is asked for, in its scale ωΦ."""


@rare_kernel
def _begin(state: Record, motion: Record, disk: Record, tau: float, u: float, omega: float) -> None:
    """Put a state just after an impact at τ, or on the platform."""
    state.ns, state.sub = instant_of(motion, 0, tau)
    state.cycles = 0
    state.tau = tau
    state.sine, state.cosine = sincos(tau)
    state.phase = FLIGHT
    state.slip_sign = 0.0
    state.spin_sign = 0.0
    state.drag = disk.lag
    state.gap = 0.0
    state.u = u
    state.turns = 0
    state.angle = 0.0
    state.omega = omega
    state.event = UNKNOWN
    state.rows = 0
    if u == 0.0:
        classify_contact(state, motion, disk)


@rare_kernel
def _run_until(
    state: Record,
    motion: Record,
    disk: Record,
    ledger: Ledger,
    rows: Rows,
    open_row: Rows,
    run: Floats,
    ns: int,
    sub: float,
) -> bool:
    """Resolve all events up to an instant, and a chatter's tail that it lies in; False: a fault."""
    for _ in range(_MOST_EVENTS):
        if state.event == UNKNOWN:
            find_next(state, motion, disk, NEVER)
        if state.event == FAULT:
            return False
        if state.event == NOTHING:
            return True
        later = seconds_between(ns, sub, state.event_ns, state.event_sub) > 0.0
        # but a chatter's tail that has begun is not to be looked into
        in_tail = (
            state.event == CHATTER_ENDS and seconds_between(state.ns, state.sub, ns, sub) > 0.0
        )
        if later and not in_tail:
            return True
        kind, before = state.event, state.phase
        if before != FLIGHT:
            run[RUN_CONTACT] += seconds_between(
                state.ns, state.sub, state.event_ns, state.event_sub
            )
        resolve(state, motion, disk, ledger, rows, 0, open_row)
        if before == FLIGHT and state.phase != FLIGHT:
            run[RUN_CONTACTS] += 1.0
        if kind == IMPACT:
            run[RUN_TAU], run[RUN_U], run[RUN_OMEGA] = state.tau, state.u, state.omega
    return False


@rare_kernel
def _look(
    states: Record,
    motion: Record,
    disk: Record,
    ledgers: Ledger,
    run: Floats,
    seen: Floats,
    ns: int,
    sub: float,
) -> None:
    """Write what is to be seen at an instant before the next event; the run itself goes on."""
    states[1] = states[0]
    probe = states[1]
    for i in range(ledgers.shape[1]):
        for j in range(ledgers.shape[2]):
            ledgers[1, i, j] = ledgers[0, i, j]
    d = seconds_between(probe.ns, probe.sub, ns, sub)
    seen[SEEN_CONTACT] = run[RUN_CONTACT]
    if d > 0.0:
        if probe.phase != FLIGHT:
            seen[SEEN_CONTACT] += d
        propagate(probe, motion, disk, ledgers[1], d, ns, sub, probe.cycles, LOOK_AT)
    seen[SEEN_TAU] = probe.tau
    seen[SEEN_GAP] = probe.gap
    seen[SEEN_U] = probe.u
    seen[SEEN_OMEGA] = probe.omega
    seen[SEEN_AT] = (float(probe.ns) + probe.sub) / 1e9
    seen[SEEN_ANGLE] = TWO_PI * float(probe.turns) + probe.angle
    seen[SEEN_CONTACTS] = run[RUN_CONTACTS]
    seen[SEEN_ROWS] = float(probe.rows)
    for i in range(_ENTRIES):
        seen[SEEN_LEDGER + i] = ledgers[1, 0, i] + ledgers[1, 1, i]


@rare_kernel
def _is_near(now: Floats, then: Floats, part: float, scale: tuple[float, float, float]) -> bool:
    """Whether two looks see the same state within a part of the scales."""
    length, height, speed = scale
    same_phase = abs(now[SEEN_TAU] - then[SEEN_TAU]) <= part
    same_gap = abs(now[SEEN_GAP] - then[SEEN_GAP]) <= part * length
    same_u = abs(now[SEEN_U] - then[SEEN_U]) <= part * height
    return (
        same_phase
        and same_gap
        and same_u
        and abs(now[SEEN_OMEGA] - then[SEEN_OMEGA]) <= part * speed
    )


@rare_kernel
def _cycle_of(ring: Floats, k: int, scale: tuple[float, float, float]) -> int:
    """Periods after which the state of look k has come back; 0: it has not, or not clearly.

    What approaches a cycle of n from both sides in turn comes back after 2n long before.
    """
    now = ring[k % LONGEST_CYCLE]
    nearly = 0
    for n in range(1, min(k, LONGEST_CYCLE - 1) + 1):
        then = ring[(k - n) % LONGEST_CYCLE]
        if _is_near(now, then, _COMES_BACK, scale):
            return n if nearly == 0 or n % nearly != 0 else 0
        if nearly == 0 and _is_near(now, then, _NEARLY, scale):
            nearly = n
    return 0


@rare_kernel
def _write_means(first: Floats, last: Floats, frequency: float, cycle: int, out: Floats) -> None:
    """The means between two looks, `cycle` periods apart; 0: the state has not come back."""
    t = last[SEEN_AT] - first[SEEN_AT]
    out[MEAN_SPEED] = (last[SEEN_ANGLE] - first[SEEN_ANGLE]) / t
    out[PERIODS] = math.floor(t * frequency + 0.5)
    out[CONTACT_SHARE] = (last[SEEN_CONTACT] - first[SEEN_CONTACT]) / t
    out[CONTACT_RATE] = (last[SEEN_CONTACTS] - first[SEEN_CONTACTS]) / t
    out[IMPACT_RATE] = (last[SEEN_ROWS] - first[SEEN_ROWS]) / t
    for i in range(_ENTRIES):
        out[POWERS + i] = (last[SEEN_LEDGER + i] - first[SEEN_LEDGER + i]) / t
    out[CYCLE] = float(cycle)
    out[CYCLE_IMPACTS] = last[SEEN_ROWS] - first[SEEN_ROWS] if cycle > 0 else 0.0


@rare_kernel
def _standard_error(angles: Floats, times: Floats) -> float:
    """Of the mean speed of a stretch, from those of its parts."""
    mean = (angles[BATCHES] - angles[0]) / (times[BATCHES] - times[0])
    squares = 0.0
    for i in range(BATCHES):
        speed = (angles[i + 1] - angles[i]) / (times[i + 1] - times[i])
        squares += (speed - mean) * (speed - mean)
    return math.sqrt(squares / (BATCHES * (BATCHES - 1)))


@rare_kernel
def _pooled(
    first: Floats,
    since: Floats,
    seen: Floats,
    angles: Floats,
    times: Floats,
    known: float,
    error: float,
) -> tuple[float, float]:
    """Mean speed and its error with one stretch more, which begins at `since` and ends at `seen`.

    What came before it, from `first` on, counts unless it was clearly another speed.
    """
    latest = _standard_error(angles, times)
    mean = (angles[BATCHES] - angles[0]) / (times[BATCHES] - times[0])
    if error == math.inf or abs(mean - known) > _SURE * math.sqrt(error * error + latest * latest):
        first[:] = since
        error = math.inf
    if error < math.inf:
        latest *= error / math.sqrt(error * error + latest * latest)
    speed = (seen[SEEN_ANGLE] - first[SEEN_ANGLE]) / (seen[SEEN_AT] - first[SEEN_AT])
    return speed, latest


@rare_kernel
def _measure(
    states: Record,
    motion: Record,
    disk: Record,
    ledgers: Ledger,
    rows: Rows,
    open_row: Rows,
    work: Floats,
    begin: Floats,
    measured: int,
    longest: int,
    out: Floats,
) -> bool:
    """Run one disk until its means are known, and write them; False: a fault."""
    run, first, angles, times, since = work[0], work[1], work[2], work[3], work[4]
    ring, known, error = work[_TABLES:], 0.0, math.inf
    run[:] = 0.0
    ledgers[:] = 0.0
    open_row[0].count = 0
    speed = begin[BEGIN_PRECISION] / PRECISION_PART
    height = math.pi * disk.g / motion.omega
    _begin(states[0], motion, disk, begin[BEGIN_TAU], begin[BEGIN_U], begin[BEGIN_OMEGA])
    settling, cycle = int(begin[BEGIN_SETTLING]), 0
    window, until = measured // BATCHES * BATCHES, -1
    ahead = int(begin[BEGIN_TAU] >= LOOK_AT)
    k, part = 0, 1
    while k <= longest + LONGEST_CYCLE:
        ns, sub = instant_of(motion, k + ahead, LOOK_AT)
        if not _run_until(states[0], motion, disk, ledgers[0], rows, open_row, run, ns, sub):
            return False
        seen = ring[k % LONGEST_CYCLE]
        _look(states, motion, disk, ledgers, run, seen, ns, sub)
        if k == until:
            _write_means(first, seen, motion.f, cycle, out)
            out[SPEED_ERROR] = 0.0
            return True
        if part == 1 and cycle == 0:
            scale = (height / motion.omega, height, max(speed, abs(seen[SEEN_OMEGA])))
            cycle = _cycle_of(ring, k, scale)
            if cycle > 0:
                first[:] = seen
                until = k + cycle
        length = window // BATCHES
        if cycle == 0 and k >= settling and (k - settling) % length == 0:
            i = (k - settling) // length
            angles[i], times[i] = seen[SEEN_ANGLE], seen[SEEN_AT]
            if i == BATCHES:
                known, error = _pooled(first, since, seen, angles, times, known, error)
                if _SURE * error <= begin[BEGIN_PRECISION] or k + 2 * window > longest:
                    _write_means(first, seen, motion.f, 0, out)
                    out[SPEED_ERROR] = error
                    return True
                window *= 2
                part = window // BATCHES  # what has not come back so far will not: look seldom
                settling = k
                angles[0], times[0] = seen[SEEN_ANGLE], seen[SEEN_AT]
            if k == settling:
                since[:] = seen
        k += part
    return False


_TABLE = types.Array(types.float64, 2, "C")


@entry(
    types.int64(
        STATE, MOTION, DISK, types.Array(types.float64, 3, "C"), ROWS, ROWS, _TABLE, _TABLE,
        types.int64, types.int64, types.int64, _TABLE,
    )
)  # fmt: skip
def measure_motors(
    states: Record,
    motions: Record,
    disks: Record,
    ledgers: Ledger,
    rows: Rows,
    open_row: Rows,
    work: Floats,
    begins: Floats,
    row: int,
    measured: int,
    longest: int,
    out: Floats,
) -> int:
    """Write the means of each disk on its platform into out (n, MEANS_COLUMNS); nan: a fault.

    `begins` (n, 5) says where each one starts. In rows of `row` disks (0: none) each but the first
    one starts where the one before has ended: just after its last impact, or on the platform.
    `measured` and `longest` are the periods of the first stretch and of all. Returns how many were
    measured.
    """
    done = 0
    for i in range(len(out)):
        motion, disk = motions[i], disks[i]
        out[i, :] = math.nan
        if begins[i, BEGIN_SETTLING] < 0.0:
            if row > 0 and (i + 1) % row != 0:
                begins[i + 1, BEGIN_TAU : BEGIN_OMEGA + 1] = begins[i, BEGIN_TAU : BEGIN_OMEGA + 1]
            continue
        if _measure(
            states, motion, disk, ledgers, rows, open_row, work, begins[i], measured, longest,
            out[i],
        ):  # fmt: skip
            done += 1
        if row > 0 and (i + 1) % row != 0:
            bounces = out[i, IMPACT_RATE] > 0.0
            scale = disks[i + 1].g * motion.omega / (disk.g * motions[i + 1].omega)
            begins[i + 1, BEGIN_TAU] = work[0, RUN_TAU] if bounces else LOOK_AT
            begins[i + 1, BEGIN_U] = work[0, RUN_U] * scale if bounces else 0.0
            begins[i + 1, BEGIN_OMEGA] = work[0, RUN_OMEGA] if bounces else states[0].omega
    return done


def workspace() -> tuple[Any, ...]:
    """What one thread works in: states, ledgers, rows of the impact log and tables."""
    return (
        np.zeros(2, STATE_DTYPE),
        np.zeros((2, 2, len(LEDGER_FIELDS))),
        np.zeros(4, IMPACT_DTYPE),
        np.zeros(1, IMPACT_DTYPE),
        np.zeros((_TABLES + LONGEST_CYCLE, max(_SEEN, BATCHES + 1))),
    )
