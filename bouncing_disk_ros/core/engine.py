"""The records of one run, and what steps them from event to event; knows no future inputs."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Self

import numpy as np
from numba import types
from numpy.typing import NDArray

from bouncing_disk_ros.core import checkpoint, input_kernels, platform
from bouncing_disk_ros.core.arithmetic import TWO_PI, sine_and_cosine
from bouncing_disk_ros.core.chatter import SHOWN_BOUNCES
from bouncing_disk_ros.core.compilation import entry, rare_kernel
from bouncing_disk_ros.core.energy_ledger import Ledger
from bouncing_disk_ros.core.flight import separation_phase
from bouncing_disk_ros.core.impact_log import ROWS, Rows, keep_last
from bouncing_disk_ros.core.input_kernels import Observed, Values
from bouncing_disk_ros.core.layout import (
    CHATTER_ENDS,
    DISK,
    FADE,
    FAULT,
    FLIGHT,
    LEDGER,
    LEDGER_FIELDS,
    MOTION,
    MOTION_DTYPE,
    STATE,
    STATE_DTYPE,
    STEADY,
    STICKING,
    THROUGHPUT,
    UNKNOWN,
    disk_record,
)
from bouncing_disk_ros.core.model import (
    IMPACT_DTYPE,
    Disk,
    Energy,
    InitialState,
    Motion,
    Phase,
    Sample,
    SimulationError,
)
from bouncing_disk_ros.core.next_event import find_next
from bouncing_disk_ros.core.offset import Segment, hold
from bouncing_disk_ros.core.offset_record import with_offset
from bouncing_disk_ros.core.platform import Record
from bouncing_disk_ros.core.resolve_event import resolve
from bouncing_disk_ros.core.roots import INSTANT
from bouncing_disk_ros.field_checks import with_names

_ROOM, _MOST_ROOM = 4096, 65536  # rows of one call of the stepper, at first and at most
_MOST_AT_AN_INSTANT = 100_000  # events, in units of work
Blocks = list[NDArray[np.void]]
"""Rows of the impact log, in the order in which they were written."""
Segments = tuple[Segment, Segment]  # axial, angular

DONE, FULL, BEHIND, FAULTY = 0, 1, 2, 3
_INT = types.int64


ADVANCE, ADVANCE_TO, OBSERVE, OBSERVE_AT, TAKE_DUE = range(5)
APPLY_IMPULSE, FOLLOW_PLATFORM, CLASSIFY, CHANGE_DISK = range(5, 9)
"""Numbers of the functions that `act` calls: `advance`, and functions of `input_kernels`."""


@rare_kernel
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
    if motion.kind == STEADY and motion.separation_g != disk.g:
        motion.separation_phase = separation_phase(motion, disk.g)
        motion.separation_g = disk.g
    status = BEHIND
    while work < budget:
        if state.event == UNKNOWN:
            work += find_next(state, motion, disk, boundary_ns) - 1
        if state.event == FAULT:
            status = FAULTY
            break
        ns = state.event_ns
        if ns > until_ns or (ns == until_ns and state.event_sub > 0.0):
            status = DONE
            break
        if n + 2 > len(rows):
            status = FULL
            break
        n = resolve(state, motion, disk, ledger, rows, n, open_row)
        work += 1
    keep_last(open_row, rows, n)
    return n, work, status


@entry(
    types.UniTuple(_INT, 3)(
        _INT, STATE, MOTION, DISK, LEDGER, ROWS, ROWS, types.float64[::1], _INT, _INT, _INT
    )
)  # fmt: skip
def act(
    what: int,
    states: Record,
    motions: Record,
    disks: Record,
    ledger: Ledger,
    rows: Rows,
    open_row: Rows,
    values: Values,
    ns: int,
    until_ns: int,
    budget: int,
) -> tuple[int, int, int]:
    """One function of this module or of `input_kernels`, by its number, on the records of a run.

    One entry for all: what they call is compiled once. Returns what `advance` does; of ADVANCE_TO
    (rows written, 0, DONE), of TAKE_DUE (1 if it did, 0, DONE). OBSERVE_AT does ADVANCE_TO before.
    APPLY_IMPULSE takes the impulses in `values`, CHANGE_DISK two disks, that in force and the new
    one, FOLLOW_PLATFORM `jumps` as ns.
    """
    state, motion, disk = states[0], motions[0], disks[0]
    if what == ADVANCE:
        return advance(state, motion, disk, ledger, rows, open_row, ns, until_ns, budget)
    n = 0
    if what in (ADVANCE_TO, OBSERVE_AT):
        n = input_kernels.advance_to(state, motion, disk, ledger, rows, open_row, ns)
    if what in (OBSERVE, OBSERVE_AT):
        input_kernels.observe(state, motion, disk, values)
    elif what == TAKE_DUE:
        n = int(input_kernels.take_due(state, motion, disk, ns))
    elif what == APPLY_IMPULSE:
        input_kernels.apply_impulse(state, motion, disk, ledger, values[0], values[1])
    elif what == FOLLOW_PLATFORM:
        input_kernels.follow_platform(state, motion, ns != 0)
    elif what == CLASSIFY:
        input_kernels.classify_after_input(state, motion, disk)
    elif what == CHANGE_DISK:
        input_kernels.change_disk(state, motion, disk, disks[1], ledger)
    return n, 0, DONE


class Engine:
    """State, motion in force, disk, energy ledger and the open row of the impact log."""

    def __init__(self, disk: Disk, report_speed: float) -> None:
        """Empty records; `place` gives them a state."""
        self.disk = disk_record(disk, report_speed)
        self.state = np.zeros(1, STATE_DTYPE)
        self.base = np.zeros(1, MOTION_DTYPE)  # the sinusoid
        self.segments: Segments = (hold(0, 0.0), hold(0, 0.0))  # of the offset
        self._join_motions()
        self._stands_at, self._events_here = (0, 0.0), 0
        self._ledger = np.zeros((2, len(LEDGER_FIELDS)))
        self._open_row = np.zeros(1, IMPACT_DTYPE)
        self._buffer = np.zeros(_ROOM, IMPACT_DTYPE)
        self._values = np.zeros(len(Observed._fields))

    @property
    def fading(self) -> bool:
        """Whether the motion in force is a cross-fade."""
        return bool(self.motion["kind"][0] == FADE)

    @property
    def clock(self) -> tuple[int, float]:
        """Whole cycles and forcing phase of the state."""
        return int(self.state["cycles"][0]), float(self.state["tau"][0])

    def place(
        self, time_ns: int, initial: InitialState, motion: Motion, segments: Segments
    ) -> None:
        """Start in an initial state at time_ns; cycles and row index go on, the ledger is reset.

        `segments`: the offset's, axial and angular.
        """
        state = self.state
        tau = initial.forcing_phase % TWO_PI
        tau = tau if tau < TWO_PI else 0.0
        cycles, before = self.clock
        cycles += 1 if tau < before else 0  # (cycles, phase) never falls
        rows = int(state["rows"][0])
        self.base = platform.steady(motion, time_ns, cycles, tau)
        self.segments = segments
        self._join_motions()
        state[:] = np.zeros(1, STATE_DTYPE)
        state["ns"], state["cycles"], state["tau"], state["rows"], state["phase"] = (
            time_ns,
            cycles,
            tau,
            rows,
            FLIGHT,
        )
        state["sine"], state["cosine"] = sine_and_cosine(tau)
        turns = round(initial.angle / TWO_PI)
        state["turns"], state["angle"] = turns, initial.angle - turns * TWO_PI
        state["gap"], state["omega"] = initial.height, initial.angular_velocity
        if initial.axial_velocity is not None:
            self._call_kernel(OBSERVE)
            u = initial.axial_velocity - self._observed.s1
            fastest = TWO_PI * motion.frequency * motion.axial_amplitude
            at_rest = initial.height == 0.0 and abs(u) <= INSTANT * fastest
            state["u"] = 0.0 if at_rest else u  # ṡ itself is rounded by that
        self.resume()
        self._ledger[:] = 0.0
        self._call_kernel(OBSERVE)
        state["initial_energy"] = self._observed.energy

    def step(self, target_ns: int, boundary_ns: int, budget: int, rows: Blocks) -> tuple[int, bool]:
        """Resolve the events up to target_ns; the work done and whether the budget ran out.

        Raises SimulationError for a run that cannot go on.
        """
        used = 0
        while True:
            n, events, status = self._call_kernel(ADVANCE, boundary_ns, target_ns, budget - used)
            used += events
            if events:
                self._check_that_time_goes_on(events)
            if n:
                rows.append(self._given_away(n) if status == FULL else self._written(n))
            if status == FAULTY:
                raise SimulationError(self._described("no next event after"))
            if status != FULL:
                return used, status == BEHIND

    def _check_that_time_goes_on(self, events: int) -> None:
        """Raise SimulationError for events without end within the rounding of one instant.

        Finitely many are due at an instant: a chatter has some hundred bounces that short. In a
        cross-fade they are as short as a chatter takes them: by the shortest period.
        """
        ns, sub = int(self.state["ns"][0]), float(self.state["sub"][0])
        passed = (ns - self._stands_at[0]) + (sub - self._stands_at[1])
        if passed * 1e-9 * float(self.motion["omega_max"][0]) > INSTANT * TWO_PI:
            self._begin_instant()
            return
        self._events_here += events
        if self._events_here > _MOST_AT_AN_INSTANT:
            raise SimulationError(self._described("time does not go on: events without end at"))

    def _begin_instant(self) -> None:
        """Count the events at one instant anew: the state's, or an input has acted."""
        self._stands_at = int(self.state["ns"][0]), float(self.state["sub"][0])
        self._events_here = 0

    def _described(self, what: str) -> str:
        state = self.state[0]
        values = ", ".join(
            f"{n} {float(state[n])!r}" for n in ("gap", "u", "omega", "angle", "tau")
        )
        phase = Phase(int(state["phase"])).name.lower()
        return f"{what} simulated time {int(state['ns'])} ns: {phase}, {values}"

    @property
    def in_chatter(self) -> bool:
        """Whether the next event is the end of a chatter in closed form."""
        return bool(self.state["event"][0] == CHATTER_ENDS)

    def invalidate_next_event(self) -> None:
        """Forget the next event: the boundary that bounded its search has changed."""
        self.state["event"] = UNKNOWN

    def cut_bounce(self, time_ns: int, rows: Blocks) -> bool:
        """Resolve one bounce, due at time_ns, of a chatter that ends after it; if there is one."""
        if not self.in_chatter:
            return False
        self.invalidate_next_event()
        resolved = self.step(time_ns, time_ns, 1, rows)[1]
        self.invalidate_next_event()  # what is known of the next event holds up to time_ns only
        return resolved

    def take_due(self, time_ns: int) -> bool:
        """Whether only rounding put the next event after an input at time_ns: it is due now."""
        return bool(self._call_kernel(TAKE_DUE, time_ns)[0])

    def advance_to(self, time_ns: int, rows: Blocks) -> None:
        """Propagate the state to time_ns, where all that is due earlier has been resolved."""
        n = self._call_kernel(ADVANCE_TO, time_ns)[0]
        self._begin_instant()
        if n:
            rows.append(self._written(n))

    def change_motion(self, motion: NDArray[np.void]) -> None:
        """Put another sinusoid in force under the halted disk."""
        self.base = motion
        self._join_motions()
        self._call_kernel(FOLLOW_PLATFORM)

    def change_offset(self, segments: Segments) -> None:
        """Put other segments of the offset in force under the halted disk, at its instant.

        Where the platform's velocity jumps, the disk's own stays.
        """
        now = int(self.state["ns"][0])
        axial, angular = (
            0.0 if after == before else after.velocity_after(now) - before.velocity_before(now)
            for before, after in zip(self.segments, segments, strict=True)
        )
        self.segments = segments
        self._join_motions()
        if axial != 0.0:
            self.state["u"] -= axial
            self._ledger[0, THROUGHPUT] += float(self.disk["mass"][0]) * axial * axial
        self._call_kernel(FOLLOW_PLATFORM, int(angular != 0.0))

    def _join_motions(self) -> None:
        self.motion = with_offset(self.base, *self.segments)

    def apply_impulse(self, axial_impulse: float, angular_impulse: float) -> None:
        """Add impulses to the halted disk."""
        self._values[:2] = axial_impulse, angular_impulse
        self._call_kernel(APPLY_IMPULSE)

    def change_disk(self, disk: Disk, report_speed: float) -> None:
        """Change the parameters of the halted disk."""
        new = disk_record(disk, report_speed)
        self.disk = np.concatenate((self.disk, new))
        self._call_kernel(CHANGE_DISK)
        self.disk = new

    def resume(self) -> None:
        """Decide contact or flight after the inputs of one instant."""
        self._call_kernel(CLASSIFY)

    def sample(self, time_ns: int) -> Sample:
        """State at time_ns, which lies before the next event; changes nothing."""
        state, _ = self._at(time_ns)
        s, o = state[0], self._observed
        return Sample(
            time_ns,
            Phase(int(s["phase"])),
            int(s["cycles"]),
            float(s["tau"]),
            o.s,
            o.s1,
            o.b,
            o.b1,
            float(s["gap"]),
            float(o.s + s["gap"]),
            float(o.s1 + s["u"]),
            int(s["turns"]),
            float(s["angle"]),
            float(s["omega"]),
            o.force,
            o.torque,
        )

    def energy(self, time_ns: int) -> Energy:
        """Energy ledger at time_ns; changes nothing."""
        state, ledger = self._at(time_ns)
        kinetic, energy = self._observed.kinetic, self._observed.energy
        sums = dict(zip(LEDGER_FIELDS, (float(v) for v in ledger[0] + ledger[1]), strict=True))
        throughput = sums.pop("throughput")
        initial = float(state["initial_energy"][0])
        gains = 0.0
        for name, value in sums.items():  # not sum(): from Python 3.12 on it gives other bits
            gains += value if name.startswith("work") else -value
        residual = (energy - initial) - gains
        potential = energy - kinetic
        throughput += kinetic + abs(potential) + abs(initial)
        return Energy(kinetic, potential, initial, **sums, residual=residual, throughput=throughput)

    def _given_away(self, n: int) -> NDArray[np.void]:
        """The first n rows of a full buffer, not copied; the next buffer is twice as long."""
        full = self._buffer
        self._buffer = np.zeros(min(2 * len(full), _MOST_ROOM), IMPACT_DTYPE)
        return full[:n]

    def _written(self, n: int) -> NDArray[np.void]:
        """Copy of the first n rows; as bytes: a structured copy leaves the padding undefined."""
        return self._buffer[:n].view(np.uint8).copy().view(IMPACT_DTYPE)

    def _call_kernel(
        self, what: int, ns: int = 0, until_ns: int = 0, budget: int = 0
    ) -> tuple[int, int, int]:
        """Let `act` do one thing to the records of this run."""
        found: tuple[int, int, int] = act(
            what, self.state, self.motion, self.disk, self._ledger, self._buffer, self._open_row,
            self._values, ns, until_ns, budget,
        )  # fmt: skip
        return found

    @property
    def _observed(self) -> Observed:
        """What was observed last."""
        return Observed(*self._values.tolist())

    def _at(self, time_ns: int) -> tuple[NDArray[np.void], NDArray[np.float64]]:
        """Copies of state and ledger, propagated to time_ns and observed there."""
        state, ledger, row = self.state.copy(), self._ledger.copy(), self._open_row.copy()
        rows = np.zeros(64, IMPACT_DTYPE)
        records = (state, self.motion, self.disk, ledger, rows, row, self._values)
        status = DONE
        if self.in_chatter:  # bounce by bounce, as far as the work may go
            state["event"] = UNKNOWN
            left = SHOWN_BOUNCES
            status = FULL
            while status == FULL:
                _, used, status = act(ADVANCE, *records, time_ns, time_ns, left)
                left -= used
        act(OBSERVE_AT, *records, time_ns, 0, 0)
        if status != DONE:  # the rest of the bounces is below all that can be shown
            state["gap"] = state["u"] = 0.0
            act(OBSERVE, *records, 0, 0, 0)
        return state, ledger

    def snapshot(self) -> dict[str, Any]:
        """All records as JSON-able numbers."""
        return {
            "state": checkpoint.plain(self.state),
            "motion": checkpoint.plain(self.base),
            "disk": checkpoint.plain(self.disk),
            "books": self._ledger.tolist(),
            "open_row": checkpoint.plain(self._open_row),
        }

    @classmethod
    def restore(cls, disk: Disk, report_speed: float, values: Any, segments: Segments) -> Self:
        """Inverse of `snapshot`. What follows from other numbers is computed again."""
        with_names("engine", values, ("state", "motion", "books", "open_row"))
        engine = cls(disk, report_speed)
        engine.state = checkpoint.record("state", _of_old_records(values["state"]), STATE_DTYPE)
        checkpoint.check_state(engine.state[0])
        engine.state["sine"], engine.state["cosine"] = sine_and_cosine(engine.clock[1])
        engine.invalidate_next_event()
        engine.base = checkpoint.record("motion", values["motion"], MOTION_DTYPE)
        checkpoint.check_motion(engine.base[0])
        platform.derive(engine.base)
        engine.segments = segments
        engine._join_motions()
        engine._ledger = checkpoint.table(
            "books", values["books"], ("sums", "rests"), LEDGER_FIELDS
        )
        engine._open_row = checkpoint.record("open_row", values["open_row"], IMPACT_DTYPE)
        return engine


def _of_old_records(values: Any) -> Any:
    """A state's record as this version keeps it, from a record of this version or of 0.2.0.

    Version 0.2.0 had no `rows_entered`, kept the signs as floats, and in sticking kept the sign of
    the last slip.
    """
    if not isinstance(values, Mapping) or "rows_entered" in values:
        return values
    found: dict[str, Any] = {"rows_entered": 0, **values}
    for name in ("slip_sign", "spin_sign"):
        value = found.get(name)
        if isinstance(value, float) and value.is_integer():
            found[name] = int(value)
    if found.get("phase") == STICKING:
        found["slip_sign"] = 0
    return found
