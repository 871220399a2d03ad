"""The control of one run: its clock, pause, step, reset, set, and its work in slices. Without ROS.

The simulator's node and the page without ROS drive it, and say by a `RunOutlet` where results go.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Protocol

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.parameters import Value
from bouncing_disk_ros.run.command_validation import Instant
from bouncing_disk_ros.run.gates import Gates, HeldInput, Lockstep
from bouncing_disk_ros.run.health import LAG_WARN, Reading
from bouncing_disk_ros.run.input_records import Record
from bouncing_disk_ros.run.loop import Loop, Sink, Steps
from bouncing_disk_ros.run.session import Session
from bouncing_disk_ros.run.time_map import (
    FAR_NS,
    TickPlan,
    TimeMap,
    nanoseconds,
    scaled,
    tick_period,
)
from bouncing_disk_ros.run.work_turns import TURN_NS
from bouncing_disk_ros.units import NS

STEP_NS = 100_000_000
"""Wall time after which the answer to a long `~/step` does not wait for its end."""


def ended(name: str, field: str) -> InputError:
    """The refusal of an input by a run that a fault has ended; `name` of its node."""
    hint = f"Start a new run: ros2 lifecycle set {name} deactivate, cleanup, configure, activate."
    return InputError(field, "an input after the run has ended", "inputs while a run goes on", hint)


def inactive(name: str, field: str, state: str) -> InputError:
    """The refusal of an input by a node that is not active."""
    hint = f"Activate it first: ros2 lifecycle set {name} activate."
    if state == "unconfigured":
        hint = f"First: ros2 lifecycle set {name} configure, then activate."
    return InputError(field, f"an input while {state}", "inputs while the node is active", hint)


class RunOutlet(Sink, Protocol):
    """Where the results of a run go."""

    times: TimeMap  # the line in force, set by the run

    def record(self, record: Record) -> None:
        """One record of the inputs."""

    def state(self, session: Session, running: bool) -> None:
        """Work has been done: motion, phase and clock may be others."""

    def ended(self, fault: str) -> None:
        """The run cannot go on; told once."""


class RunControl:
    """From configure to cleanup. It moves while it is active and not paused.

    `name` of the node, for refusals; `values` is the living set of its parameters; `ros_now` reads
    the clock of stamps, ns; a long step ends early when `stopping`. With `gates` time stands where
    `lockstep` says so, and what is dropped of their inputs is given to `refuse`.
    """

    def __init__(
        self,
        name: str,
        values: Mapping[str, Value],
        outlet: RunOutlet,
        *,
        gates: Gates | None = None,
        refuse: Callable[[InputError], None] = lambda _: None,
        stopping: Callable[[], bool] = lambda: False,
        ros_now: Callable[[], int] = time.time_ns,
    ) -> None:
        self._name, self._values, self._outlet = name, values, outlet
        self._stopping, self._refuse, self._ros_now = stopping, refuse, ros_now
        self.times = outlet.times = self._line_through(0, ros_now())
        """The line between steady clock, simulated time and ROS time in force."""
        self.session = Session(values, outlet.record, paused=True)
        self.loop = Loop(self.session, outlet)
        self.answers: Callable[[Session], None] | None = None
        """A controller in this process: asked at each impact, before time goes on."""
        self._steps = Steps()
        self.step_until: int | None = None  # in simulated time: end of a step under way
        self._impacts_left = 0  # of that step; 0: it goes by time
        self._fault_told = False
        self.active = False  # whether inputs are accepted, unless a fault has ended the run
        self._waited_ns = 0  # at gates, since the line was set
        self._paused = bool(values["start_paused"])
        self._next_snapshot = 0
        self._lockstep = Lockstep(str(values["lockstep"]))
        self.gates = gates
        self._released: deque[HeldInput] = deque()  # inputs of an open gate, not applied
        if gates is not None:
            self._close_gate(gates)

    # --- time -------------------------------------------------------------------------------------
    def _line_through(self, simulated_ns: int, ros_ns: int) -> TimeMap:
        factor, clock = float(self._values["real_time_factor"]), bool(self._values["publish_clock"])
        return TimeMap(simulated_ns, time.monotonic_ns(), ros_ns, factor, clock)

    def tick_plan(self, fastest_ns: int, slowest_ns: int) -> TickPlan:
        """When ticks should begin, for a period within bounds; in a free run at any instant."""
        sample_ns = NS / (float(self._values["state_rate"]) * (self.times.factor or 1.0))
        period_ns = tick_period(sample_ns, fastest_ns, slowest_ns)
        if self.times.factor == 0.0:
            return TickPlan(period_ns)
        due_ns = self.times.to_steady(self.loop.next_sample_ns)
        return TickPlan(period_ns, min(float(period_ns), sample_ns), due_ns)

    def anchor(self) -> None:
        """Fix the line between steady clock, simulated time and ROS time here and now."""
        simulated = self.session.time_ns
        published = self.times.clock_is_simulated
        ros = self.times.to_ros(simulated) if published else self._ros_now()
        self.times = self._outlet.times = self._line_through(simulated, ros)
        self._waited_ns = 0

    def _update_paused(self) -> None:
        session, paused = self.session, self._paused or not self.active
        if session.paused and not paused:
            self.anchor()
            self._next_snapshot = self._snapshot_clock + self._snapshot_ns
        self.step_until = None
        session.set_paused(paused)
        self.publish_consequences()

    @property
    def _snapshot_clock(self) -> int:
        """Of snapshots: with gates simulated time, for a record must not depend on the machine."""
        return time.monotonic_ns() if self.gates is None else self.session.time_ns

    @property
    def _snapshot_ns(self) -> int:
        return nanoseconds(float(self._values["snapshot_period"]))

    def set_active(self, active: bool) -> None:
        """The node has been activated or deactivated (which holds the state)."""
        self.active = active
        self._update_paused()

    def tick(self, now_ns: int) -> bool:
        """Simulate what is due at a reading of the steady clock, at most one slice of work.

        True when all of it has been done.
        """
        done = False
        if self.loop.resolve_waiting() and not self.session.paused:
            free = self.times.factor == 0.0
            done = self._slice_to_gate(FAR_NS if free else self.times.due(now_ns))
            # with gates by simulated time: a record must not depend on the machine
            clock = now_ns if self.gates is None else self.session.time_ns
            halted = self.gates is None or self.gates.is_closed
            if clock >= self._next_snapshot and halted and not self.session.fault:
                self._next_snapshot = clock + self._snapshot_ns
                self.session.snapshot()
        elif self.step_until is None:
            done = True
        elif self._slice_step(self.step_until):
            self.step_until, done = None, True
        if self.gates is not None:
            self.gates.watch(time.monotonic_ns())
        self._publish_work()
        return done or bool(self.session.fault)

    def advance_to(self, until_ns: int) -> None:
        """Simulate up to an instant at once, whatever the clock says (for tests)."""
        while not self.loop.resolve_waiting() or not self.loop.slice(until_ns):
            if self._stopping() or self.session.fault:
                break
        self._publish_work()

    def advance_to_impact(self, until_ns: int) -> bool:
        """Simulate until a row of impacts is published; False where there is none before."""
        simulation = self.session.simulation
        before = simulation.rows_total
        while not self.loop.resolve_waiting() or not self.loop.slice(until_ns, to_impact=True):
            if simulation.rows_total > before or self._stopping() or self.session.fault:
                break
        self._publish_work()
        return simulation.rows_total > before

    # --- slices of work ---------------------------------------------------------------------------
    def _slice_step(self, until_ns: int) -> bool:
        """One slice of a step; True when it has ended."""
        if not self.loop.resolve_waiting():
            return False
        before = self.session.simulation.rows_total
        to_impact = self._impacts_left > 0
        reached = self._slice_to_gate(until_ns, to_impact=to_impact)
        if to_impact and self.session.simulation.rows_total > before:
            self._impacts_left -= 1
            return self._impacts_left == 0
        return reached

    def _slice_to_gate(self, until_ns: int, *, to_impact: bool = False) -> bool:
        """One slice of work, up to the next gate of a lockstep; True when `until_ns` was reached.

        Up to an impact where a controller of this process answers it.
        """
        gates = self.gates
        if gates is None:
            reached = self.loop.slice(until_ns, to_impact=to_impact or self.answers is not None)
            if self.answers is not None:
                self.answers(self.session)
            return reached
        self._renew_gate()
        if gates.is_closed:
            if not gates.is_complete:
                return False
            self._forgive(gates)
            self._released.extend(gates.open())
        if not self._apply_inputs(gates):
            return False
        before = self.session.simulation.rows_total
        if self._lockstep is Lockstep.IMPACT:
            self.loop.slice(until_ns, to_impact=True)
            if self.session.simulation.rows_total > before:
                self._close_gate(gates)
        else:
            sample_ns = self.loop.next_sample_ns
            self.loop.slice(min(until_ns, sample_ns), to_impact=to_impact)
            if self.session.time_ns >= sample_ns:
                self._close_gate(gates)
        return self.session.time_ns >= until_ns

    def _apply_inputs(self, gates: Gates) -> bool:
        """Apply the inputs of the gate that was opened, for one slice; whether time may move on."""
        end_ns = time.thread_time_ns() + TURN_NS
        while self._released:
            if time.thread_time_ns() >= end_ns:
                return False
            self._released.popleft().act()
        self._renew_gate()
        return not gates.is_closed

    def _close_gate(self, gates: Gates) -> None:
        """Close the next gate, once all that is due at its instant has been published.

        What came out later would be heard at a gate that does not count it, or not before time goes
        on, though the gate counts it.
        """
        self.session.resolve_present()
        self.loop.finish_samples()
        self.loop.flush()
        self._publish_work()
        rows = self.session.simulation.rows_total
        gates.close(time.monotonic_ns(), rows, self.session.time_ns)

    def go_on(self) -> None:
        """Go on where the gate is complete: an input has come, or an answer."""
        if self.gates is None:
            return
        for one in self.gates.drop_predecessors():
            given = "an input of a controller that ended before its answer"
            self._refuse(InputError(one.topic, given, "those of the one started since"))
        if self.gates.is_complete:
            self.tick(time.monotonic_ns())

    def _renew_gate(self) -> None:
        """Close a gate for rows that none counts: inputs or a service have brought them about."""
        gates = self.gates
        if gates is None or self._released:
            return
        is_due = gates.is_closed or self._lockstep is Lockstep.IMPACT
        if is_due and self.session.simulation.rows_total > gates.rows:
            self._close_gate(gates)

    @property
    def _waits_at_gate(self) -> bool:
        """Whether a gate of a lockstep is closed, or its inputs are not all applied."""
        return self.gates is not None and (self.gates.is_closed or bool(self._released))

    def _forgive(self, gates: Gates) -> None:
        """Leave a wait that put simulated time behind out of the line: it is nobody's load.

        Stamps go on along the same line, so that what is counted from them means the same.
        """
        now = time.monotonic_ns()
        lag_ns = self._lag_ns(now)
        self._waited_ns = min(self._waited_ns + gates.waited_ns(now), lag_ns)
        if lag_ns >= LAG_WARN * NS:
            steady_ns = self.times.steady_ns + self._waited_ns
            self.times, self._waited_ns = replace(self.times, steady_ns=steady_ns), 0

    def _lag_ns(self, now_ns: int) -> int:
        """How far simulated time is behind its due time, ns of the wall clock."""
        factor = self.times.factor
        if self.session.paused or factor == 0.0:
            return 0
        return max(0, scaled(self.times.due(now_ns) - self.session.time_ns, 1.0 / factor))

    def publish_state(self) -> None:
        """Publish motion, phase and clock as they are now."""
        self._outlet.state(self.session, not self.session.paused)

    def _publish_work(self) -> None:
        """Publish what work brought about; say once why a run has ended, if it has."""
        self.publish_state()
        if self.session.fault and not self._fault_told:
            self._fault_told = True
            self._outlet.ended(self.session.fault)

    # --- inputs -----------------------------------------------------------------------------------
    def arrival(self, field: str) -> tuple[Session, Instant]:
        """The session and the instant at which an input arrives; InputError unless active."""
        if not self.active:
            raise inactive(self._name, field, "inactive")
        if self.session.fault:
            raise ended(self._name, field)
        self.loop.finish_samples()
        session, times = self.session, self.times
        if session.paused and not times.clock_is_simulated and self.gates is None:
            # real time passes, simulated time stands
            times = replace(times, simulated_ns=session.time_ns, ros_ns=self._ros_now())
        tolerance = nanoseconds(float(self._values["command_tolerance"]))
        return session, Instant(session.input_ns, times, tolerance)

    def publish_consequences(self) -> None:
        """Publish what an input has brought about."""
        self.loop.flush()
        self._publish_work()
        self._renew_gate()

    def set_parameters(self, values: Mapping[str, Value]) -> None:
        """Checked parameters, in force from here on."""
        self.loop.finish_samples()
        self.session.set_parameters(values)
        if "real_time_factor" in values:
            self.anchor()
        if self.gates is not None:
            self.gates.set_timeout(self._values)
        if {"state_rate", "rotor_speed_rate"} & values.keys():
            self.loop.set_rates()
        if "snapshot_period" in values:
            soon = self._snapshot_clock + self._snapshot_ns
            self._next_snapshot = min(self._next_snapshot, soon)
        self.publish_consequences()

    def pause(self, paused: bool) -> str:
        """Hold or resume; what was done, in words."""
        self.arrival("~/pause")
        self._paused = paused
        self._update_paused()
        return ("paused" if paused else "running") + self._at

    @property
    def stepping(self) -> bool:
        """Whether a step is under way."""
        return self.step_until is not None and not self.session.fault

    @property
    def stamp_ns(self) -> int:
        """ROS time of the state reached: the present where time is not simulated."""
        simulated = self.simulated_stamp_ns
        return self._ros_now() if simulated is None else simulated

    def step(self, times: int = 1) -> str:
        """Simulate `times` as far as `step_until` says; only while paused.

        A long step goes on in the ticks, as far as it said when it began; another one ends it.
        """
        session, _ = self.arrival("~/step")
        end, what = self._steps.end(session, self._values, times)
        self.step_until = None
        self._impacts_left = times if self._values["step_until"] == "impact" else 0
        deadline = time.monotonic_ns() + STEP_NS
        while not self._slice_step(end) and not session.fault:
            if time.monotonic_ns() >= deadline or self._waits_at_gate:
                self.step_until = end
                break
        self._publish_work()
        if session.fault:
            raise ended(self._name, "~/step")
        if self.step_until is None:
            return f"{what}, now{self._at}"
        until = "" if end == FAR_NS else f", until {end / NS:.9f} s"
        return f"{what} under way, now{self._at}{until}; pause again to end it here"

    def reset(self) -> str:
        """Back to the initial state and motion; paused stays paused."""
        session, _ = self.arrival("~/reset")
        self.step_until = None
        session.reset()
        self.loop.restart_speed()
        if not session.paused:
            self.anchor()
        self.loop.flush()
        self._publish_work()
        if self.gates is not None:
            dropped = [*self._released, *self.gates.refuse_all()]
            self._released.clear()
            for held in dropped:
                refused = InputError(held.topic, "an input before the reset", "inputs after it")
                self._refuse(refused)
            self._close_gate(self.gates)
        return "reset" + self._at

    @property
    def _at(self) -> str:
        return f" at {self.session.time_ns / NS:.9f} s of simulated time"

    @property
    def _state(self) -> str:
        if self.session.fault:
            return "ended by a fault"
        if self.step_until is not None:
            return "stepping"
        return "inactive" if not self.active else "paused" if self.session.paused else "running"

    @property
    def summary(self) -> str:
        """What it is doing, for the log."""
        motion = self.session.latest_target
        shown = ", ".join(f"{name} {value:g}" for name, value in motion._asdict().items())
        return f"{self._state}{self._at}: {shown}"

    @property
    def simulated_stamp_ns(self) -> int | None:
        """The time of /clock now; None where time is not simulated."""
        times = self.times
        return times.to_ros(self.session.time_ns) if times.clock_is_simulated else None

    def read(self) -> Reading:
        """How the run stands, for a report of its health."""
        session, gates, now = self.session, self.gates, time.monotonic_ns()
        waiting = "" if gates is None else gates.waiting
        return Reading(
            steady_ns=now,
            simulated_ns=session.time_ns,
            lag_ns=0 if waiting else self._lag_ns(now),
            rows=session.simulation.rows_total,
            skipped=self.loop.skipped,
            accepted=session.accepted,
            energy=None if session.fault else session.checked_energy(),
            state=self._state,
            factor=self.times.factor,
            other_publishers=0,
            fault=session.fault,
            pending=session.pending,
            motion_index=session.simulation.motion_index,
            waiting=waiting,
            overdue=gates is not None and gates.is_overdue(now),
        )
