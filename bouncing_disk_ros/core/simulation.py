"""A run of the model: state, motion, the inputs to come, and the instants at which they act."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.core import checkpoint, platform, stepper
from bouncing_disk_ros.core.arithmetic import TWO_PI
from bouncing_disk_ros.core.layout import (
    BOOKS,
    CHATTER_ENDS,
    DISK_DTYPE,
    FADE,
    FLIGHT,
    MOTION_DTYPE,
    NEVER,
    STATE_DTYPE,
    STEADY,
    UNKNOWN,
)
from bouncing_disk_ros.core.model import (
    IMPACT_DTYPE,
    Disk,
    Energy,
    InitialState,
    Motion,
    MotionInForce,
    Phase,
    Sample,
)
from bouncing_disk_ros.core.schedule import Fade, Kick, add_kick, plan_fades

_NEVER = int(NEVER)
_ROOM = 4096  # rows of one call of the stepper


def disk_record(disk: Disk, report_speed: float) -> NDArray[np.void]:
    """The disk as the kernels read it, with what follows from it."""
    k = np.zeros(1, DISK_DTYPE)
    inertia = disk.mass * disk.gyration_radius**2
    k["mass"], k["restitution"], k["friction"], k["inertia"] = disk.mass, disk.restitution, disk.friction, inertia
    k["weight"] = disk.mass * disk.gravity + disk.preload
    k["g"] = disk.gravity + disk.preload / disk.mass
    k["grip"] = disk.friction * disk.friction_radius / disk.gyration_radius**2
    k["load_torque"], k["lag"] = disk.load_torque, disk.load_torque / inertia
    k["report_speed"] = report_speed
    return k


class Simulation:
    """The disk on its platform, exact and deterministic.

    The same inputs at the same instants of simulated time give bit-identical impacts for any pattern of calls of
    `advance`, on every x86-64. Arguments are trusted to be in range (see `parameters`). Units are SI, times are
    whole nanoseconds of simulated time. Not safe for use by two threads at once.
    """

    def __init__(
        self, motion: Motion, disk: Disk, initial: InitialState, *, chatter_report_speed: float = 0.0
    ) -> None:
        """Start at t = 0 in the initial state; rows of impacts slower than chatter_report_speed (m/s) are shared."""
        self._disk, self._report_speed = disk, chatter_report_speed
        self._initial, self._initial_motion = initial, motion
        self._k = disk_record(disk, chatter_report_speed)
        self._state = np.zeros(1, STATE_DTYPE)
        self._books = np.zeros((2, len(BOOKS)))
        self._open_row = np.zeros(1, IMPACT_DTYPE)
        self._buffer = np.zeros(_ROOM, IMPACT_DTYPE)
        self._observed = np.zeros(1, stepper.OBSERVED)
        self._held: list[NDArray[np.void]] = []  # rows of an input's own instant, for the next advance
        self._time_ns = 0
        self._motion_index = 0
        self._pending: list[Fade] = []
        self._kicks: list[Kick] = []
        self._start, self._target = motion, motion
        self._m = platform.steady(motion, 0, 0, 0.0)
        self._place(initial, motion)

    # Reading -------------------------------------------------------------------------------------------------

    @property
    def time_ns(self) -> int:
        """Simulated up to and including this instant."""
        return self._time_ns

    @property
    def disk(self) -> Disk:
        """Parameters in force."""
        return self._disk

    @property
    def chatter_report_speed(self) -> float:
        """Impacts slower than this share a row of the log, m/s."""
        return self._report_speed

    @property
    def motion_in_force(self) -> MotionInForce:
        """The cross-fade in progress, or the steady motion with the instant at which it was reached."""
        m = self._m[0]
        begin = int(m["begin_ns"])
        end = int(m["end_ns"]) if m["kind"] == FADE else begin
        return MotionInForce(begin, end, self._start, self._target, int(m["cycles"]), float(m["tau"]))

    @property
    def motion_index(self) -> int:
        """Grows each time the motion in force changes."""
        return self._motion_index

    @property
    def pending(self) -> tuple[Fade, ...]:
        """Cross-fades that have not begun."""
        return tuple(self._pending)

    @property
    def latest_target(self) -> Motion:
        """The newest accepted target, pending ones included."""
        return self._pending[-1].target if self._pending else self._target

    @property
    def rows_total(self) -> int:
        """Index of the next row."""
        return int(self._state["rows"][0])

    def sample(self) -> Sample:
        """State at time_ns."""
        state, _ = self._here()
        stepper.observe(state, self._m, self._k, self._observed)
        s, o = state[0], self._observed[0]
        return Sample(
            self._time_ns,
            Phase(int(s["phase"])),
            int(s["cycles"]),
            float(s["tau"]),
            float(o["s"]),
            float(o["s1"]),
            float(o["b"]),
            float(o["b1"]),
            float(s["gap"]),
            float(o["s"] + s["gap"]),
            float(o["s1"] + s["u"]),
            int(s["turns"]),
            float(s["angle"]),
            float(s["omega"]),
            float(o["force"]),
            float(o["torque"]),
        )

    def energy(self) -> Energy:
        """Energy books at time_ns, since the start or the last reset."""
        state, books = self._here()
        stepper.observe(state, self._m, self._k, self._observed)
        kinetic, energy = float(self._observed["kinetic"][0]), float(self._observed["energy"][0])
        sums = dict(zip(BOOKS, (float(v) for v in books[0] + books[1]), strict=True))
        throughput = sums.pop("throughput")
        initial = float(state["initial_energy"][0])
        gains = [v if name.startswith("work") else -v for name, v in sums.items()]
        residual = float(np.sum([energy, -initial, *(-v for v in gains)]))
        return Energy(kinetic, energy - kinetic, initial, **sums, residual=residual, throughput=throughput)

    # Time ----------------------------------------------------------------------------------------------------

    def advance(self, until_ns: int, max_events: int = 1_000_000) -> tuple[NDArray[np.void], bool]:
        """Simulate up to and including until_ns.

        Returns the rows of the impacts (IMPACT_DTYPE) and whether the budget of events ran out first: then time_ns
        lags behind and the call is to be repeated.
        """
        parts, self._held = self._held, []
        while True:
            boundary = self._boundary_ns()
            target = min(until_ns, boundary)
            if target < self._time_ns:
                behind = False
                break
            used, behind = self._step(target, max_events, parts)
            max_events -= used
            if behind:
                break
            self._time_ns = target
            if target < boundary:
                break
            self._act(parts)
        return (np.concatenate(parts) if parts else np.zeros(0, IMPACT_DTYPE)), behind

    def _step(self, target: int, budget: int, parts: list[NDArray[np.void]]) -> tuple[int, bool]:
        used = 0
        while True:
            n, events, status = stepper.advance(
                self._state,
                self._m,
                self._k,
                self._books,
                self._buffer,
                self._open_row,
                self._boundary_ns(),
                target,
                budget - used,
            )
            used += events
            if n:
                parts.append(self._buffer[:n].copy())
            if status == stepper.DONE:
                return used, False
            if status == stepper.BEHIND:
                self._time_ns = max(self._time_ns, min(int(self._state["ns"][0]), target - 1))
                return used, True

    def _boundary_ns(self) -> int:
        """The next instant at which an input acts or a cross-fade begins or ends."""
        instants = [self._kicks[0].at_ns] if self._kicks else []
        if self._m["kind"][0] == FADE:
            instants.append(int(self._m["end_ns"][0]))
        elif self._pending:
            instants.append(self._pending[0].begin_ns)
        return min(instants, default=_NEVER)

    def _act(self, parts: list[NDArray[np.void]]) -> None:
        """What is due at time_ns: the motion first, then kicks in order of arrival (rule 10)."""
        self._halt(parts)
        now = self._time_ns
        if self._m["kind"][0] == FADE and int(self._m["end_ns"][0]) == now:
            self._set_motion(platform.steady(self._target, now, *self._clock()), self._target, self._target)
        if self._m["kind"][0] == STEADY and self._pending and self._pending[0].begin_ns == now:
            fade = self._pending.pop(0)
            m = platform.fade(self._target, fade.target, now, fade.end_ns, *self._clock())
            self._set_motion(m, self._target, fade.target)
        while self._kicks and self._kicks[0].at_ns == now:
            _, axial, angular = self._kicks.pop(0)
            stepper.kick(self._state, self._m, self._k, self._books, axial, angular)
        stepper.resume(self._state, self._m, self._k)

    def _clock(self) -> tuple[int, float]:
        return int(self._state["cycles"][0]), float(self._state["tau"][0])

    def _set_motion(self, m: NDArray[np.void], start: Motion, target: Motion) -> None:
        self._m, self._start, self._target = m, start, target
        self._motion_index += 1

    def _halt(self, parts: list[NDArray[np.void]]) -> None:
        """Carry the state to time_ns, where all that is due earlier has been resolved."""
        n = stepper.halt(
            self._state, self._m, self._k, self._books, self._buffer, self._open_row, self._time_ns
        )
        if n:
            parts.append(self._buffer[:n].copy())

    def _here(self) -> tuple[NDArray[np.void], NDArray[np.float64]]:
        """Copies of state and books, carried to time_ns."""
        state, books, row = self._state.copy(), self._books.copy(), self._open_row.copy()
        rows = np.zeros(64, IMPACT_DTYPE)
        arguments = (state, self._m, self._k, books, rows, row)
        if state["event"][0] == CHATTER_ENDS:  # in the midst of a chatter: bounce by bounce up to here
            state["event"] = UNKNOWN
            while stepper.advance(*arguments, self._time_ns, self._time_ns, 1_000_000)[2] != stepper.DONE:
                pass
        stepper.halt(*arguments, self._time_ns)
        return state, books

    # Inputs, each at time_ns unless it says when -------------------------------------------------------------

    def command(self, points: Sequence[tuple[int, Motion]], crossfade_ns: int = 0) -> None:
        """Accept a programme: each motion is reached at its time (ns, strictly increasing) by a cross-fade.

        It replaces every cross-fade that has not begun; one that has begun runs out. `crossfade_ns` 0: one period of
        the slower motion. No points: cancel what is pending.
        """
        self._finish()
        m = self._m[0]
        free = int(m["end_ns"]) if m["kind"] == FADE else self._time_ns
        self._pending = plan_fades(points, self._target, free, crossfade_ns)
        self._look_again()
        self._finish()

    def kick(self, at_ns: int, axial_impulse: float, angular_impulse: float) -> None:
        """Queue impulses on the disk (N·s, N·m·s) for at_ns ≥ time_ns; ValueError for an instant that is past."""
        if at_ns < self._time_ns:
            raise ValueError(f"kick at {at_ns} ns: allowed from {self._time_ns} ns (simulated already)")
        self._finish()
        add_kick(self._kicks, Kick(at_ns, axial_impulse, angular_impulse))
        self._look_again()
        self._finish()

    def set_disk(self, disk: Disk) -> None:
        """Change parameters of disk and contact; the jump of the energy is booked."""
        self._finish()
        self._halt(self._held)
        new = disk_record(disk, self._report_speed)
        stepper.change_disk(self._state, self._m, self._k, new, self._books)
        self._disk, self._k = disk, new
        stepper.resume(self._state, self._m, self._k)
        self._finish()

    def set_chatter_report_speed(self, speed: float) -> None:
        """Impacts slower than this (m/s) share a row of the log; nothing else changes."""
        self._finish()
        self._report_speed = speed
        self._k["report_speed"] = speed

    def reset(self, initial: InitialState | None = None, motion: Motion | None = None) -> None:
        """Back to the initial (or a new) state, phase and motion; time, cycles and the index of rows go on."""
        self._finish()
        self._halt(self._held)
        self._initial = initial or self._initial
        self._initial_motion = motion or self._initial_motion
        self._pending, self._kicks = [], []
        self._place(self._initial, self._initial_motion)
        self._finish()

    def _finish(self) -> None:
        """Resolve all that is due at time_ns; rows wait for the next call of `advance`."""
        while True:
            rows, behind = self.advance(self._time_ns)
            if len(rows):
                self._held.append(rows)
            if not behind:
                return

    def _look_again(self) -> None:
        """The boundary has changed: a completion of chatter, or no event at all, may have been found with the old one."""
        self._state["event"] = UNKNOWN

    def _place(self, initial: InitialState, motion: Motion) -> None:
        s = self._state
        tau = initial.forcing_phase % TWO_PI
        tau = tau if tau < TWO_PI else 0.0
        cycles, before = self._clock()
        cycles += 1 if tau < before else 0  # (cycles, phase) never falls
        rows = int(s["rows"][0])
        self._set_motion(platform.steady(motion, self._time_ns, cycles, tau), motion, motion)
        s[:] = np.zeros(1, STATE_DTYPE)
        s["ns"], s["cycles"], s["tau"], s["rows"], s["phase"] = self._time_ns, cycles, tau, rows, FLIGHT
        turns = round(initial.angle / TWO_PI)
        s["turns"], s["angle"] = turns, initial.angle - turns * TWO_PI
        s["gap"], s["omega"] = initial.height, initial.angular_velocity
        if initial.axial_velocity is not None:
            stepper.observe(s, self._m, self._k, self._observed)
            s["u"] = initial.axial_velocity - self._observed["s1"]
        stepper.resume(s, self._m, self._k)
        self._books[:] = 0.0
        stepper.observe(s, self._m, self._k, self._observed)
        s["initial_energy"] = self._observed["energy"]

    # Checkpoints ---------------------------------------------------------------------------------------------

    def snapshot(self) -> dict[str, Any]:
        """Everything the run depends on, as JSON-able numbers; `restore` continues it bit-identically."""
        return {
            "format": checkpoint.FORMAT,
            "time_ns": self._time_ns,
            "motion_index": self._motion_index,
            "disk": list(self._disk),
            "chatter_report_speed": self._report_speed,
            "initial": list(self._initial),
            "initial_motion": list(self._initial_motion),
            "start": list(self._start),
            "target": list(self._target),
            "pending": [[f.begin_ns, f.end_ns, list(f.target)] for f in self._pending],
            "kicks": [list(k) for k in self._kicks],
            "state": checkpoint.plain(self._state),
            "motion": checkpoint.plain(self._m),
            "books": self._books.tolist(),
            "open_row": checkpoint.plain(self._open_row),
            "held": [checkpoint.plain(r[i : i + 1]) for r in self._held for i in range(len(r))],
        }

    @classmethod
    def restore(cls, snapshot: Mapping[str, Any]) -> Self:
        """Continue from a snapshot; ValueError if it is of another format."""
        if snapshot.get("format") != checkpoint.FORMAT:
            raise ValueError(
                f"checkpoint format {snapshot.get('format')!r}: this version reads {checkpoint.FORMAT}"
            )
        run = cls(
            Motion(*snapshot["initial_motion"]),
            Disk(*snapshot["disk"]),
            InitialState(*snapshot["initial"]),
            chatter_report_speed=snapshot["chatter_report_speed"],
        )
        run._time_ns, run._motion_index = snapshot["time_ns"], snapshot["motion_index"]
        run._start, run._target = Motion(*snapshot["start"]), Motion(*snapshot["target"])
        run._pending = [Fade(b, e, Motion(*m)) for b, e, m in snapshot["pending"]]
        run._kicks = [Kick(*k) for k in snapshot["kicks"]]
        run._state = checkpoint.record(snapshot["state"], STATE_DTYPE)
        run._m = checkpoint.record(snapshot["motion"], MOTION_DTYPE)
        run._books = np.array(snapshot["books"])
        run._open_row = checkpoint.record(snapshot["open_row"], IMPACT_DTYPE)
        run._held = [checkpoint.record(r, IMPACT_DTYPE) for r in snapshot["held"]]
        return run
