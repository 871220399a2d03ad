"""What a motor settles on: means of speed, powers and losses of one disk after another.

Each disk is run by the functions of the stepper, with all of its loads, and looked at once a period
of the platform at one forcing phase. The axial motion does not depend on the rotation, and friction
and brake only ever bring two speeds of the disk closer together. So:

- Where the axial motion comes back after n periods, the speed after them is a function of the one
  before that rises, by no more than its argument: the settled speed is its fixed point, bracketed
  and found by its root however slowly the disk would come to it. The means are over n periods.
- Else two disks begin far on either side, on the same axial motion. What they begin with is
  forgotten when they have met; then the means are over a stretch that grows until the speed is
  known well enough. Two that do not meet have not settled.

Where roundings decide how the motion goes on from one contact to the next
(`map_tangent.largest_error`), it would come back all the same, for contact ends in one state. The
next one there begins with a restitution that is one rounding less: the means are those of motors
that are equal within roundings.

Disks that differ in their loads alone have the same axial motion. The end of each flight is found
once, and looked up by the disks that fly it after that (`Flights`), to the same bits.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numba import typeof, types

from bouncing_disk_ros.core.arithmetic import TWO_PI, sincos, sincos_excess
from bouncing_disk_ros.core.chatter import SLOW
from bouncing_disk_ros.core.compilation import entry, kernel, rare_kernel
from bouncing_disk_ros.core.energy_ledger import Ledger
from bouncing_disk_ros.core.forcing_clock import Clock, instant_of, seconds_between
from bouncing_disk_ros.core.impact_log import Rows
from bouncing_disk_ros.core.layout import (
    CHATTER_ENDS,
    DISK,
    DISK_DTYPE,
    FAULT,
    FLIGHT,
    IMPACT,
    LEDGER_FIELDS,
    MOTION,
    NEVER,
    NOTHING,
    STATE_DTYPE,
    UNKNOWN,
)
from bouncing_disk_ros.core.model import IMPACT_DTYPE
from bouncing_disk_ros.core.next_event import find_next
from bouncing_disk_ros.core.platform import Record
from bouncing_disk_ros.core.propagate import classify_contact, propagate
from bouncing_disk_ros.core.resolve_event import resolve
from bouncing_disk_ros.maps.axial_map import turned_tangent
from bouncing_disk_ros.maps.map_tangent import LARGEST_ERROR, carried, error_size, rounded

Floats = Any  # float64 arrays, of one or two dimensions
Ints = Any  # int64 arrays

LOOK_AT = 1.5 * math.pi
"""Forcing phase at which the state is looked at, rad: the platform's lowest point."""
LONGEST_CYCLE = 64
"""Most periods of the platform after which the axial motion is found to come back."""
BATCHES = 32
"""Parts of a stretch whose means give the standard error of the whole."""
_COMES_BACK = 1e-11
"""Within so much of its scales."""
_NEARLY = 1e-4
"""What comes back within so much only may yet settle on a shorter cycle."""
_SURE = 3.0
"""So many standard errors are to be within what is asked for."""
_MET = 1e-6
"""Two disks have met within this part of the scale of the speed."""
_MOST_EVENTS = 100_000  # in one period: far more than any has
_MOST_STEPS = 200  # of the search for a fixed point: far more than any takes
_ROUNDING = 2.0**-52
_ONE_LESS = 1.0 - 2.0**-53  # what a number is multiplied by to become the one below it

SEEN_TAU, SEEN_GAP, SEEN_U, SEEN_OMEGA, SEEN_AT, SEEN_ANGLE, SEEN_CONTACT, SEEN_CONTACTS = range(8)
SEEN_DECIDED, SEEN_ROWS, SEEN_LEDGER = 8, 9, 10
"""What a look sees: the state and its time (s); since the start, the angle turned, seconds and
number of contacts, how many of them roundings have decided, impacts, and the entries of the energy
ledger."""
_ENTRIES = len(LEDGER_FIELDS) - 1  # without the throughput
SEEN = SEEN_LEDGER + _ENTRIES
RUN_CONTACT, RUN_CONTACTS, RUN_DECIDED, RUN_TAU, RUN_U, RUN_CYCLES, RUN_W = range(7)
RUN_SINE, RUN_COSINE, RUN_ERROR, RUN_LARGEST, RUN_CARRIED = 7, 8, 9, 12, 13
"""What a run keeps: seconds and number of contacts, and how many roundings have decided; of the
last impact its forcing phase, u after it, cycles, w_A (πg/ω; 0: contact since), and sine and cosine
of the phase; error by roundings since contact (three numbers) and its largest size, since contact
and since the start."""
_RUN = RUN_CARRIED + 1

BEGIN_TAU, BEGIN_U, BEGIN_SETTLING, BEGIN_PRECISION, BEGIN_BOUND = range(5)
"""Of a start: forcing phase, relative speed after an impact there (0: the disk lies on the
platform); periods to leave out (negative: this one is passed over), error of the speed to reach
(rad/s), which is also its scale over PRECISION_PART; speed that two disks begin with, forwards and
backwards."""
BEGINS = BEGIN_BOUND + 1
MEAN_SPEED, SPEED_ERROR, PERIODS, CONTACT_SHARE, CONTACT_RATE, IMPACT_RATE, POWERS = range(7)
"""Columns of the means, SI units; from POWERS on the entries of the energy ledger per second."""
CYCLE = POWERS + _ENTRIES
CYCLE_IMPACTS = CYCLE + 1
"""Periods of the platform after which the state comes back, and impacts in them; 0: it does not."""
RISE = CYCLE_IMPACTS + 1
"""Seconds from rest to the RISES of the settled speed; nan where the state does not come back."""
RISES = (1.0 - math.exp(-1.0), 0.95)
OUTCOME = RISE + len(RISES)
"""DONE, NOT_SETTLED or FAULTY; nan: passed over."""
CARRIED = OUTCOME + 1
"""How far roundings carry an axial motion that comes back (rad, πg/ω): the part of its means that
is not known."""
MEANS_COLUMNS = CARRIED + 1
PRECISION_PART = 1e-3
"""Error of a mean speed that is asked for, in its scale ωΦ."""
DONE, NOT_SETTLED, FAULTY = range(3)
"""What becomes of a disk: measured; its speed has not settled within the periods allowed; a fault
of the simulator."""


FLIGHT_DTYPE = np.dtype(
    [(name, STATE_DTYPE[name]) for name in (
        "ns", "sub", "tau", "gap", "u", "event", "event_delay", "event_value", "event_ns",
        "event_sub", "event_cycles", "event_tau",
    )]
)  # fmt: skip
"""The launch of a flight, and what ends it; as in a state."""
_MOST_FLIGHTS = 2**15  # that are kept: some MB for each thread


class Flights(NamedTuple):
    """The first flights of one axial motion, in the order of their launches."""

    found: Record  # array of FLIGHT_DTYPE
    count: Ints  # one number: how many are known
    motion: Floats  # what the axial motion depends on: A, f, g + P/m, ε; τ and u at its start


class Rotor(NamedTuple):
    """A disk that is run; arrays of one state, its disk and an open row, and what it gathers."""

    states: Record
    disks: Record
    ledger: Ledger
    rows: Rows
    open_row: Rows
    run: Floats
    flights: Flights  # shared by all
    place: Ints  # one number: where it is among the flights


@rare_kernel
def _forget(rotor: Rotor) -> None:
    """Empty what a rotor has gathered."""
    rotor.ledger[:] = 0.0
    rotor.run[:] = 0.0
    rotor.open_row[0].count = 0


@rare_kernel
def _set_speed(rotor: Rotor, motion: Record, omega: float) -> None:
    """Another α̇ for a rotor, at its instant."""
    state = rotor.states[0]
    state.omega = omega
    state.event = UNKNOWN
    if state.phase != FLIGHT:
        classify_contact(state, motion, rotor.disks[0])


@rare_kernel
def _begin(rotor: Rotor, motion: Record, tau: float, u: float, omega: float) -> None:
    """Put a rotor just after an impact at τ, or on the platform."""
    state = rotor.states[0]
    state.ns, state.sub = instant_of(motion, 0, tau)
    state.cycles = 0
    state.tau = tau
    state.sine, state.cosine = sincos(tau)
    state.phase = FLIGHT
    state.slip_sign = 0
    state.spin_sign = 0
    state.drag = rotor.disks[0].lag
    state.rows_entered = 0
    state.gap = 0.0
    state.u = u
    state.turns = 0
    state.angle = 0.0
    state.omega = omega
    state.event = UNKNOWN
    state.rows = 0
    _forget(rotor)
    if u == 0.0:
        classify_contact(state, motion, rotor.disks[0])


@kernel
def _note_impact(state: Record, motion: Record, disk: Record, run: Floats, w: float) -> None:
    """Carry the error by roundings over the flight that has ended with an impact of w_A (m/s).

    Not one beyond LARGEST_ERROR: roundings decide, and it counts as 1.
    """
    unit = math.pi * disk.g / motion.omega
    forcing = motion.a * motion.omega / unit
    w /= unit
    p = rounded(0.0, 0.0)
    if run[RUN_LARGEST] > LARGEST_ERROR:
        run[RUN_CARRIED] = 1.0
    elif run[RUN_W] < 0.0:
        delay = TWO_PI * (float(state.cycles) - run[RUN_CYCLES]) + (state.tau - run[RUN_TAU])
        t = turned_tangent(
            run[RUN_SINE], run[RUN_COSINE], sincos_excess(delay), run[RUN_W], delay, w, forcing,
            disk.restitution,
        )  # fmt: skip
        before = (run[RUN_ERROR], run[RUN_ERROR + 1], run[RUN_ERROR + 2])
        p = carried(before, t, delay, w)
        run[RUN_LARGEST] = max(run[RUN_LARGEST], error_size(p))
        run[RUN_CARRIED] = max(run[RUN_CARRIED], run[RUN_LARGEST])
    run[RUN_ERROR], run[RUN_ERROR + 1], run[RUN_ERROR + 2] = p
    run[RUN_CYCLES], run[RUN_W] = float(state.cycles), w
    run[RUN_TAU], run[RUN_U] = state.tau, state.u
    run[RUN_SINE], run[RUN_COSINE] = state.sine, state.cosine


@kernel
def _note_contact(disk: Record, run: Floats) -> None:
    """Count a contact; after one that roundings have decided, the next motion is another one."""
    run[RUN_CONTACTS] += 1.0
    if run[RUN_LARGEST] > LARGEST_ERROR:
        disk.restitution *= _ONE_LESS
        run[RUN_DECIDED] += 1.0
    run[RUN_LARGEST] = run[RUN_W] = 0.0


@rare_kernel
def _share_flights(flights: Flights, motion: Record, disk: Record, tau: float, u: float) -> None:
    """Forget flights that are not those of a disk that starts at τ with u."""
    given = (motion.a, motion.f, disk.g, disk.restitution, tau, u)
    for i in range(len(given)):
        if flights.motion[i] != given[i]:
            flights.motion[i] = given[i]
            flights.count[0] = 0


@kernel
def _is_shared(state: Record, motion: Record, disk: Record) -> bool:
    """Whether all disks on this axial motion have the flight that begins here.

    Not where chattering may end: that depends on the rotation too (`chatter_end`). Nor where the
    rotation is beyond the range of numbers.
    """
    chatters = state.gap == 0.0 and state.u * motion.omega_max <= SLOW * (disk.g + motion.s2)
    if state.phase != FLIGHT or (chatters and state.u != 0.0):
        return False
    return math.isfinite(state.omega + state.angle)


@kernel
def _place_in(found: Record, count: int, place: int, state: Record) -> int:
    """How many launches are before the instant of a state; searched for from `place` on."""
    at = min(place, count)
    while at > 0 and not _is_before(found[at - 1], state):
        at -= 1
    while at < count and _is_before(found[at], state):
        at += 1
    return at


@kernel
def _is_before(flight: Record, state: Record) -> bool:
    """Whether a flight's launch is before the instant of a state."""
    return flight.ns < state.ns or (flight.ns == state.ns and flight.sub < state.sub)


@kernel
def _is_launch(flight: Record, state: Record) -> bool:
    """Whether a flight begins with the axial state of a disk, to the bit."""
    same_instant = flight.ns == state.ns and flight.sub == state.sub and flight.tau == state.tau
    return same_instant and flight.gap == state.gap and flight.u == state.u


@kernel
def _copy_event(one: Record, other: Record) -> None:
    """Give one state or flight the event of another."""
    one.event, one.event_delay, one.event_value = other.event, other.event_delay, other.event_value
    one.event_ns, one.event_sub = other.event_ns, other.event_sub
    one.event_cycles, one.event_tau = other.event_cycles, other.event_tau


@kernel
def _next_event(
    state: Record, motion: Record, disk: Record, found: Record, count: Ints, place: Ints
) -> None:
    """`find_next`, looked up where the flight is known and kept where it is the next one."""
    shared = _is_shared(state, motion, disk)
    at = count[0]
    if shared:
        at = place[0] = _place_in(found, count[0], place[0], state)
        if at < count[0] and _is_launch(found[at], state):
            _copy_event(state, found[at])
            return
    find_next(state, motion, disk, NEVER)
    if shared and at == count[0] and at < len(found):
        flight = found[at]
        flight.ns, flight.sub, flight.tau = state.ns, state.sub, state.tau
        flight.gap, flight.u = state.gap, state.u
        _copy_event(flight, state)
        count[0] += 1


@rare_kernel
def _run_until(rotor: Rotor, motion: Record, cycles: int, tau: float) -> bool:
    """Resolve all events up to an instant, and a chatter's tail that it lies in; False: a fault."""
    state, disk = rotor.states[0], rotor.disks[0]
    ledger, rows, open_row, run = rotor.ledger, rotor.rows, rotor.open_row, rotor.run
    found, count, place = rotor.flights.found, rotor.flights.count, rotor.place
    ns, sub = instant_of(motion, cycles, tau)
    for _ in range(_MOST_EVENTS):
        if state.event == UNKNOWN:
            _next_event(state, motion, disk, found, count, place)
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
        kind, before, w = state.event, state.phase, state.event_value
        if before != FLIGHT:
            run[RUN_CONTACT] += seconds_between(
                state.ns, state.sub, state.event_ns, state.event_sub
            )
        resolve(state, motion, disk, ledger, rows, 0, open_row)
        if kind == IMPACT:
            _note_impact(state, motion, disk, run, w)
        if before == FLIGHT and state.phase != FLIGHT:
            _note_contact(disk, run)
    return False


@rare_kernel
def _stop_at(rotor: Rotor, motion: Record, cycles: int, tau: float) -> float:
    """Propagate a rotor to an instant before its next event; returns the seconds, 0 if past it."""
    state = rotor.states[0]
    ns, sub = instant_of(motion, cycles, tau)
    d = seconds_between(state.ns, state.sub, ns, sub)
    if d > 0.0:
        propagate(state, motion, rotor.disks[0], rotor.ledger, d, Clock(ns, sub, cycles, tau))
    return max(d, 0.0)


@rare_kernel
def _look(rotor: Rotor, probe: Rotor, motion: Record, seen: Floats, cycles: int) -> None:
    """Write what is to be seen when LOOK_AT comes in a cycle; the rotor itself goes on.

    The probe's state is the one that is seen. It comes later where a chatter's tail lies there.
    """
    probe.states[0] = rotor.states[0]
    probe.disks[0] = rotor.disks[0]
    state = probe.states[0]
    for i in range(rotor.ledger.shape[0]):
        for j in range(rotor.ledger.shape[1]):
            probe.ledger[i, j] = rotor.ledger[i, j]
    seconds = _stop_at(probe, motion, cycles, LOOK_AT)
    seen[SEEN_CONTACT] = rotor.run[RUN_CONTACT] + (seconds if state.phase != FLIGHT else 0.0)
    seen[SEEN_TAU] = state.tau
    seen[SEEN_GAP] = state.gap
    seen[SEEN_U] = state.u
    seen[SEEN_OMEGA] = state.omega
    seen[SEEN_AT] = (float(state.ns) + state.sub) / 1e9
    seen[SEEN_ANGLE] = TWO_PI * float(state.turns) + state.angle
    seen[SEEN_CONTACTS] = rotor.run[RUN_CONTACTS]
    seen[SEEN_DECIDED] = rotor.run[RUN_DECIDED]
    seen[SEEN_ROWS] = float(state.rows)
    for i in range(_ENTRIES):
        seen[SEEN_LEDGER + i] = probe.ledger[0, i] + probe.ledger[1, i]


@rare_kernel
def _is_near(now: Floats, then: Floats, part: float, length: float, height: float) -> bool:
    """Whether two looks see the same axial motion within a part of the scales.

    Not where roundings have decided how it came from one to the other.
    """
    same_phase = abs(now[SEEN_TAU] - then[SEEN_TAU]) <= part
    same_gap = abs(now[SEEN_GAP] - then[SEEN_GAP]) <= part * length
    same_u = abs(now[SEEN_U] - then[SEEN_U]) <= part * height
    return same_phase and same_gap and same_u and now[SEEN_DECIDED] == then[SEEN_DECIDED]


@rare_kernel
def _cycle_of(ring: Floats, k: int, looks: int, length: float, height: float) -> int:
    """Periods after which the axial motion of look k has come back; 0: it has not, or not clearly.

    `looks` have been at periods in a row. What approaches a cycle of n from both sides in turn
    comes back after 2n long before.
    """
    now = ring[k % LONGEST_CYCLE]
    nearly = 0
    for n in range(1, min(looks, LONGEST_CYCLE)):
        then = ring[(k - n) % LONGEST_CYCLE]
        if _is_near(now, then, _COMES_BACK, length, height):
            return n if nearly == 0 or n % nearly != 0 else 0
        if nearly == 0 and _is_near(now, then, _NEARLY, length, height):
            nearly = n
    return 0


class Cycle(NamedTuple):
    """An axial motion that repeats: a rotor just before it, one to be run, and how long it is."""

    base: Rotor
    rotor: Rotor
    periods: int


@rare_kernel
def _after(cycle: Cycle, motion: Record, omega: float) -> float:
    """α̇ after a cycle that begins with this one; nan: a fault."""
    base, rotor = cycle.base.states[0], cycle.rotor
    rotor.states[0] = base
    _forget(rotor)
    _set_speed(rotor, motion, omega)
    cycles = base.cycles + cycle.periods
    if not _run_until(rotor, motion, cycles, base.tau):
        return math.nan
    _stop_at(rotor, motion, cycles, base.tau)
    return float(rotor.states[0].omega)


@kernel
def _noise(scale: float, omega: float) -> float:
    """What roundings change a speed by in a cycle: no change below it is known."""
    return 4.0 * _ROUNDING * max(scale, abs(omega))


@rare_kernel
def _bracket(
    cycle: Cycle, motion: Record, omega: float, scale: float
) -> tuple[float, float, float, float]:
    """Two speeds and what a cycle changes them by, of opposite signs; the first is `omega`'s side.

    A cycle never takes a speed past the fixed point: steps as large as the change stay before it,
    and they are doubled until one does not. One speed twice where its change is noise; nan: no
    change of sign up to some thousand times the scale.
    """
    most = 1e3 * scale + 2.0 * abs(omega)
    a = omega
    fa = _after(cycle, motion, a) - a
    step = fa
    while not abs(fa) <= _noise(scale, a) and abs(a) <= most:
        b = a + step
        fb = _after(cycle, motion, b) - b
        if not fa * fb > 0.0:
            return a, fa, b, fb
        a, fa, step = b, fb, 2.0 * step
    return a, fa, (a if abs(fa) <= _noise(scale, a) else math.nan), fa


@rare_kernel
def _turned(cycle: Cycle) -> float:
    """The angle turned in the cycle that was run last."""
    first, last = cycle.base.states[0], cycle.rotor.states[0]
    return TWO_PI * float(last.turns - first.turns) + (last.angle - first.angle)


@rare_kernel
def _settled_speed(cycle: Cycle, motion: Record, omega: float, scale: float) -> tuple[float, float]:
    """The fixed point that a disk with α̇ = `omega` comes to, and its error by roundings.

    By false position (Illinois), with a bisection after each step that has not halved the bracket,
    up to a change that is noise. The error is what roundings of a speed amount to, over the slope
    of the change beside the fixed point: infinite where no torque brings the disk back.
    """
    a, fa, b, fb = _bracket(cycle, motion, omega, scale)
    for _ in range(_MOST_STEPS):
        width = abs(b - a)
        if abs(fb) <= _noise(scale, b) or not width > _ROUNDING * max(abs(a), abs(b)):
            break
        x = b - fb * (b - a) / (fb - fa)
        fx = _after(cycle, motion, x) - x
        if fx * fb > 0.0:
            fa *= 0.5
        else:
            a, fa = b, fb
        b, fb = x, fx
        if abs(b - a) > 0.5 * width:
            x = 0.5 * (a + b)
            fx = _after(cycle, motion, x) - x
            if fx * fb > 0.0:
                b, fb = x, fx
            else:
                a, fa = b, fb
                b, fb = x, fx
    if math.isnan(fb):
        return math.nan, math.nan
    around = 1e-6 * scale
    above = _after(cycle, motion, b + around) - (b + around)
    below = _after(cycle, motion, b - around) - (b - around)
    noise = _noise(scale, b)
    slope = (below - above - noise) / (2.0 * around)
    return b, ((abs(fb) + noise) / slope if slope > 0.0 else math.inf)


@rare_kernel
def _rise_times(cycle: Cycle, motion: Record, settled: float, most: int, out: Floats) -> None:
    """Write when the mean speed of a cycle, from rest on, reaches RISES of the settled one.

    A mean is that of the middle of its cycle, between them is a straight line. nan where that takes
    more than `most` periods.
    """
    length = cycle.periods / motion.f
    omega, at, mean, reached = 0.0, 0.0, 0.0, 0
    for i in range(most // cycle.periods + 1):
        omega = _after(cycle, motion, omega)
        now, before, then = (i + 0.5) * length, mean, at
        mean, at = _turned(cycle) / length, now
        while reached < len(RISES) and mean / settled >= RISES[reached]:
            part = (RISES[reached] * settled - before) / (mean - before)
            out[RISE + reached] = then + part * (now - then)
            reached += 1
        if reached == len(RISES):
            return


@rare_kernel
def _write_means(first: Floats, last: Floats, frequency: float, out: Floats) -> None:
    """The means between two looks."""
    t = last[SEEN_AT] - first[SEEN_AT]
    out[MEAN_SPEED] = (last[SEEN_ANGLE] - first[SEEN_ANGLE]) / t
    out[PERIODS] = math.floor(t * frequency + 0.5)
    out[CONTACT_SHARE] = (last[SEEN_CONTACT] - first[SEEN_CONTACT]) / t
    out[CONTACT_RATE] = (last[SEEN_CONTACTS] - first[SEEN_CONTACTS]) / t
    out[IMPACT_RATE] = (last[SEEN_ROWS] - first[SEEN_ROWS]) / t
    for i in range(_ENTRIES):
        out[POWERS + i] = (last[SEEN_LEDGER + i] - first[SEEN_LEDGER + i]) / t
    out[CYCLE] = out[CYCLE_IMPACTS] = 0.0


@rare_kernel
def _measure_cycle(
    cycle: Cycle, motion: Record, start: Floats, at: int, longest: int, looks: Floats, out: Floats
) -> int:
    """Write the means over one cycle at the settled speed; what becomes of the disk.

    The cycle begins with the look of period `at`.
    """
    scale = start[BEGIN_PRECISION] / PRECISION_PART
    omega, error = _settled_speed(cycle, motion, cycle.base.states[0].omega, scale)
    if not error <= start[BEGIN_PRECISION]:
        return FAULTY if math.isnan(error) else NOT_SETTLED
    omega = _after(cycle, motion, omega)
    settled = _turned(cycle) / (cycle.periods / motion.f)
    if abs(settled) > start[BEGIN_PRECISION]:
        _rise_times(cycle, motion, settled, longest, out)
    _after(cycle, motion, omega)  # and on: the row that is open then is that of the cycle
    for i in range(2):
        cycles = at + (i + 1) * cycle.periods
        if not _run_until(cycle.rotor, motion, cycles, LOOK_AT):
            return FAULTY
        _look(cycle.rotor, cycle.base, motion, looks[i], cycles)
    _write_means(looks[0], looks[1], motion.f, out)
    out[CARRIED] = cycle.rotor.run[RUN_CARRIED]
    out[SPEED_ERROR] = error + out[CARRIED] * scale
    out[CYCLE], out[CYCLE_IMPACTS] = cycle.periods, looks[1, SEEN_ROWS] - looks[0, SEEN_ROWS]
    return DONE


@entry(types.float64(types.Array(types.float64, 1, "A")))
def standard_error(parts: Floats) -> float:
    """Standard error of the mean of BATCHES parts that follow each other.

    The largest of those of the parts, of their pairs, and so on up to the two halves: parts that
    are not independent of the next ones scatter less than their mean, and a speed that has not
    settled differs between the halves.
    """
    largest, size = 0.0, 1
    while size <= BATCHES // 2:
        count = BATCHES // size
        mean = squares = 0.0
        for i in range(BATCHES):
            mean += parts[i] / BATCHES
        for i in range(count):
            part = 0.0
            for j in range(size):
                part += parts[i * size + j] / size
            squares += (part - mean) * (part - mean)
        largest = max(largest, math.sqrt(squares / (count * (count - 1))))
        size *= 2
    return largest


@rare_kernel
def _speeds(marks: Floats, parts: Floats) -> None:
    """The mean speed of each part of a stretch."""
    for i in range(BATCHES):
        first, last = marks[i], marks[i + 1]
        parts[i] = (last[SEEN_ANGLE] - first[SEEN_ANGLE]) / (last[SEEN_AT] - first[SEEN_AT])


@rare_kernel
def _write_stretch(marks: Floats, frequency: float, batches: Floats, out: Floats) -> None:
    """The means over a stretch and over its parts."""
    _write_means(marks[0], marks[BATCHES], frequency, out)
    for i in range(BATCHES):
        _write_means(marks[i], marks[i + 1], frequency, batches[i])


@rare_kernel
def _next_stretch(marks: Floats, parts: Floats) -> int:
    """Make room for the second half of a longer stretch; how many times as long its parts are.

    Twice, and all of this one is its first half; or as long, and only the second half of this one
    is, where the first clearly was another speed.
    """
    half = BATCHES // 2
    first, last = parts[:half], parts[half:]
    sums = (0.0, 0.0)
    for i in range(half):
        sums = (sums[0] + first[i] / half, sums[1] + last[i] / half)
    spread = 0.0
    for i in range(half):
        spread += (first[i] - sums[0]) ** 2 + (last[i] - sums[1]) ** 2
    error = math.sqrt(spread / (half * (half - 1)))
    drops = abs(sums[1] - sums[0]) > _SURE * error
    for i in range(half + 1):
        marks[i] = marks[half + i] if drops else marks[2 * i]
    return 1 if drops else 2


class Bench(NamedTuple):
    """Work space: the disk that is measured, one beside it, what is seen of both, and tables."""

    rotor: Rotor
    other: Rotor
    probe: Rotor
    ring: Floats  # the last looks
    marks: Floats  # looks between the parts of a stretch
    parts: Floats  # their mean speeds


@rare_kernel
def _apart(bench: Bench, motion: Record, omega: float, first: int, cycles: int) -> float:
    """By how much α̇ of the disk beside the one that is measured differs; inf: a fault.

    It is run through the cycles from the first on.
    """
    for i in range(first, cycles + 1):
        if not _run_until(bench.other, motion, i, LOOK_AT):
            return math.inf
    seen = bench.marks[BATCHES]
    _look(bench.other, bench.probe, motion, seen, cycles)
    return float(abs(omega - seen[SEEN_OMEGA]))


@rare_kernel
def _measure(
    bench: Bench,
    motion: Record,
    start: Floats,
    measured: int,
    longest: int,
    batches: Floats,
    out: Floats,
) -> int:
    """Run one disk until its means are known, and write them; what becomes of it."""
    rotor, other, ring, marks = bench.rotor, bench.other, bench.ring, bench.marks
    height = math.pi * rotor.disks[0].g / motion.omega
    tau, u, bound = start[BEGIN_TAU], start[BEGIN_U], start[BEGIN_BOUND]
    other.disks[0] = rotor.disks[0]
    _share_flights(rotor.flights, motion, rotor.disks[0], tau, u)
    _begin(rotor, motion, tau, u, bound)
    _begin(other, motion, tau, u, -bound)
    ahead, settling = int(tau >= LOOK_AT), int(start[BEGIN_SETTLING])
    until, looks = settling + measured, 0  # the end and the number of looks at each period
    length, count, begin = max(measured // BATCHES, 1), -1, 0  # of the parts of the stretch
    apart, k = math.inf, 0
    while k <= longest:
        if not _run_until(rotor, motion, k + ahead, LOOK_AT):
            return FAULTY
        seen = ring[k % LONGEST_CYCLE]
        _look(rotor, bench.probe, motion, seen, k + ahead)
        looks += 1
        cycle = _cycle_of(ring, k, looks, height / motion.omega, height)
        if cycle > 0:
            other.disks[0] = rotor.disks[0]
            found = Cycle(bench.probe, other, cycle)
            return _measure_cycle(found, motion, start, k + ahead, longest, marks, out)
        if count < 0 and k >= settling:
            first = ahead if k == settling else k + ahead
            apart = _apart(bench, motion, seen[SEEN_OMEGA], first, k + ahead)
            if apart <= _MET * start[BEGIN_PRECISION] / PRECISION_PART:
                count, begin = 0, k
                marks[0] = seen
        elif count >= 0 and k == begin + (count + 1) * length:
            count += 1
            marks[count] = seen
        if count == BATCHES:
            _speeds(marks, bench.parts)
            error = apart + standard_error(bench.parts)
            if _SURE * error <= start[BEGIN_PRECISION] or k + BATCHES * length > longest:
                _write_stretch(marks, motion.f, batches, out)
                out[SPEED_ERROR] = error
                return DONE
            length *= _next_stretch(marks, bench.parts)
            count = BATCHES // 2
            begin, until = k - count * length, k + 2 * LONGEST_CYCLE
        if count >= 0 and k >= until and length > 1:
            k, looks = begin + (count + 1) * length, 0
        else:
            k += 1
    return NOT_SETTLED


def workspace() -> Bench:
    """What one thread works in: three disks that are run or looked at, looks, and flights."""
    flights = Flights(np.empty(_MOST_FLIGHTS, FLIGHT_DTYPE), np.zeros(1, np.int64), np.zeros(6))
    rows = np.zeros(4, IMPACT_DTYPE)
    rotor, other, probe = (
        Rotor(
            np.zeros(1, STATE_DTYPE), np.zeros(1, DISK_DTYPE), np.zeros((2, len(LEDGER_FIELDS))),
            rows, np.zeros(1, IMPACT_DTYPE), np.zeros(_RUN), flights, np.zeros(1, np.int64),
        )
        for _ in range(3)
    )  # fmt: skip
    ring, marks = np.zeros((LONGEST_CYCLE, SEEN)), np.zeros((BATCHES + 1, SEEN))
    return Bench(rotor, other, probe, ring, marks, np.zeros(BATCHES))


_TABLE = types.Array(types.float64, 2, "C")
_TABLES = types.Array(types.float64, 3, "C")


@entry(
    types.void(
        typeof(workspace()), MOTION, DISK, _TABLE, types.int64, types.int64, types.int64, _TABLES,
        _TABLE,
    )
)  # fmt: skip
def measure_motors(
    bench: Bench,
    motions: Record,
    disks: Record,
    begins: Floats,
    row: int,
    measured: int,
    longest: int,
    batches: Floats,
    out: Floats,
) -> None:
    """Write the means of each disk on its platform into out (n, MEANS_COLUMNS), nan where unknown.

    `bench` is a `workspace`. `begins` (n, BEGINS) says where each one starts. In rows of `row`
    disks (0: none) each but the first one starts where the one before has ended: just after its
    last impact, or on the platform. `measured` and `longest` are the periods of the first stretch
    and of all. batches (n, BATCHES, MEANS_COLUMNS): the means over the parts of a stretch; nan
    where the state comes back.
    """
    rotor = bench.rotor
    for i in range(len(out)):
        motion = motions[i]
        out[i, :] = math.nan
        batches[i, :] = math.nan
        known = begins[i, BEGIN_SETTLING] >= 0.0
        if known:
            rotor.disks[0] = disks[i]
            out[i, OUTCOME] = _measure(
                bench, motion, begins[i], measured, longest, batches[i], out[i]
            )
        if row == 0 or (i + 1) % row == 0:
            continue
        begins[i + 1, BEGIN_TAU], begins[i + 1, BEGIN_U] = LOOK_AT, 0.0
        if not known:
            begins[i + 1, BEGIN_TAU : BEGIN_U + 1] = begins[i, BEGIN_TAU : BEGIN_U + 1]
        elif rotor.run[RUN_U] > 0.0 and out[i, IMPACT_RATE] != 0.0:
            scale = disks[i + 1].g * motion.omega / (disks[i].g * motions[i + 1].omega)
            begins[i + 1, BEGIN_TAU] = rotor.run[RUN_TAU]
            begins[i + 1, BEGIN_U] = rotor.run[RUN_U] * scale
