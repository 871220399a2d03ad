"""A session: one simulation, its parameters, whether it is paused, and the record of its inputs.

An input acts once all that is due at its instant is resolved. That takes no time worth mentioning,
but where a nanosecond holds more impacts than one slice of work can resolve: there the input waits.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

from numpy.typing import NDArray

import bouncing_disk_ros
from bouncing_disk_ros.core.model import (
    RESIDUAL_LIMIT,
    Disk,
    Energy,
    InitialState,
    Motion,
    SimulationError,
)
from bouncing_disk_ros.core.offset import Offset
from bouncing_disk_ros.core.schedule import Pending
from bouncing_disk_ros.core.simulation import Simulation
from bouncing_disk_ros.parameters import Value
from bouncing_disk_ros.run.input_records import Record
from bouncing_disk_ros.run.time_map import nanoseconds
from bouncing_disk_ros.run.trajectory_validation import Splice, as_record

MAX_INPUTS_BETWEEN_SNAPSHOTS = 500
"""A latched reader of depth 1000 then always holds a snapshot."""

EVENTS_AT_ONCE = 4_000
"""Event budget of one attempt to resolve the instant of an input, and of one call of the core: some
milliseconds."""


class WaitingInput(NamedTuple):
    """An accepted input whose instant is not resolved yet."""

    act: Callable[[], None]
    cuts_chatter: bool  # it changes the state itself: see Simulation.resolve_due
    target: Motion | None  # the newest accepted motion after it; None: as before
    offset: Offset | None = None  # the offsets accepted with it; None: as before
    values: Mapping[str, Value] | None = None  # the parameters that it sets; None: none


def motion_of(values: Mapping[str, Value]) -> Motion:
    """The platform motion of a set of parameters; the phase lag wraps to ±π."""
    motion = Motion.of(values)
    return motion._replace(phase_lag=math.remainder(motion.phase_lag, math.tau))


def initial_of(values: Mapping[str, Value]) -> InitialState:
    """The initial state of a set of parameters."""
    follows = bool(values["initial_with_platform"])
    return InitialState(
        height=float(values["initial_height"]),
        axial_velocity=None if follows else float(values["initial_axial_velocity"]),
        angular_velocity=float(values["initial_angular_velocity"]),
        angle=float(values["initial_angle"]),
        forcing_phase=float(values["initial_forcing_phase"]),
    )


class Session:
    """Applies inputs to a simulation and records each, in the order applied.

    Rows of impacts gather in `rows` until `take_rows` fetches them. Everything given here has been
    validated already (run.command_validation, parameters).
    """

    events_at_once = EVENTS_AT_ONCE

    def __init__(
        self, values: Mapping[str, Value], record: Callable[[Record], None], paused: bool = False
    ) -> None:
        """Start at time 0 from a whole set of parameters; `record` receives each record."""
        self.values: dict[str, Value] = dict(values)
        self.simulation = Simulation(
            motion_of(values),
            Disk.of(values),
            initial_of(values),
            chatter_report_speed=float(values["chatter_report_speed"]),
        )
        self.paused = paused
        self.fault = ""  # why the simulation cannot go on, if it cannot
        self.accepted = 0
        self.gathered = 0
        self._rows: list[NDArray[Any]] = []
        self._record = record
        self._waiting: list[WaitingInput] = []
        self._input_ns: int | None = None  # the instant that the first waiting input acts at
        self._index = 0
        self._since_snapshot = 0
        self.snapshot()

    @property
    def time_ns(self) -> int:
        """Simulated up to and including this instant."""
        return self.simulation.time_ns

    @property
    def input_ns(self) -> int:
        """The instant at which an input without a stamp acts, ns: the next one unless paused."""
        return self.time_ns if self.paused else self.time_ns + 1

    @property
    def waiting(self) -> int:
        """Accepted inputs that have not acted because their instant is not resolved yet."""
        return len(self._waiting)

    @property
    def pending(self) -> Pending:
        """Accepted inputs that have not acted."""
        simulation = self.simulation
        fades, impulse_ns = simulation.pending, simulation.next_impulse_ns
        instants = [fades[0].begin_ns] if fades else []
        if impulse_ns is not None:
            instants.append(impulse_ns)
        takeovers = simulation.offset.takeovers_after(self.time_ns)
        first = min([*instants, *takeovers[:1]], default=None)
        queued = simulation.queued_impulses
        return Pending(len(fades), queued, self.waiting, first, len(takeovers))

    @property
    def latest_target(self) -> Motion:
        """The newest accepted target: of waiting inputs, pending cross-fades or the motion."""
        targets = [item.target for item in self._waiting if item.target is not None]
        return targets[-1] if targets else self.simulation.latest_target

    @property
    def latest_values(self) -> Mapping[str, Value]:
        """The newest accepted parameters: those that waiting inputs set too."""
        found: Mapping[str, Value] = self.values
        for item in self._waiting:
            found = {**found, **(item.values or {})}
        return found

    @property
    def latest_offset(self) -> Offset:
        """The offset with all accepted trajectories, waiting ones too."""
        offsets = [item.offset for item in self._waiting if item.offset is not None]
        return offsets[-1] if offsets else self.simulation.offset

    def advance(self, until_ns: int, max_events: int = 1_000_000) -> bool:
        """Simulate up to an instant; True when the event budget ran out before it.

        After a `fault` it is always True: the simulation stands still.
        """
        if self.fault:
            return True
        try:
            rows, behind = self.simulation.advance(until_ns, max_events)
        except SimulationError as error:
            self.fault = str(error)
            return True
        self._gather(rows)
        return bool(behind)

    def checked_energy(self) -> Energy:
        """The energy ledger now; one that does not close is a `fault`: the run ends."""
        energy = self.simulation.energy()
        if not energy.relative_residual <= RESIDUAL_LIMIT and not self.fault:  # so is nan
            given = f"a residual of {energy.residual:.3g} J, throughput {energy.throughput:.3g} J"
            sample = self.simulation.sample()._asdict()
            state = ", ".join(f"{name} {value}" for name, value in sample.items())
            self.fault = f"the energy ledger does not close: {given}, at {state}"
        return energy

    def resolve_present(self) -> None:
        """Resolve what is due at the instant reached, within one budget of events."""
        self.advance(self.time_ns, EVENTS_AT_ONCE)

    def resolve_waiting(self, max_events: int = EVENTS_AT_ONCE) -> bool:
        """Let the waiting inputs act, in order; False when the budget ran out before the last."""
        while self._waiting:
            first = self._waiting[0]
            if self._input_ns is None:  # samples at the instant reached are out: one ns later
                self._input_ns = self.input_ns
            if self.advance(self._input_ns, max_events) or not self._settle(first, max_events):
                return False
            self._waiting.pop(0)
            self._input_ns = None
            first.act()
        return True

    def _settle(self, first: WaitingInput, max_events: int) -> bool:
        try:
            return self.simulation.resolve_due(max_events, cut_chatter=first.cuts_chatter)
        except SimulationError as error:
            self.fault = str(error)
            return False

    def _submit(
        self,
        act: Callable[[], None],
        cuts_chatter: bool = False,
        target: Motion | None = None,
        offset: Offset | None = None,
        values: Mapping[str, Value] | None = None,
    ) -> None:
        self._waiting.append(WaitingInput(act, cuts_chatter, target, offset, values))
        self.resolve_waiting()

    def _gather(self, rows: NDArray[Any]) -> None:
        if len(rows):
            self._rows.append(rows)
            self.gathered += len(rows)

    def take_rows(self) -> list[NDArray[Any]]:
        """The rows gathered since the last call, in order, one array for each advance."""
        rows, self._rows, self.gathered = self._rows, [], 0
        return rows

    def command(self, points: Sequence[tuple[int, Motion]]) -> None:
        """An accepted programme: replaces every cross-fade that has not begun."""
        crossfade_ns = self._crossfade_ns()
        target = points[-1][1] if points else self.simulation.motion_in_force.target

        def act() -> None:
            now = self.time_ns
            self.simulation.command(points, crossfade_ns)
            shown = [[at, list(motion)] for at, motion in points]
            self._note("motion", now, points=shown, crossfade_ns=crossfade_ns)

        self._submit(act, target=target)

    def trajectory(self, splice: Splice) -> None:
        """An accepted offset trajectory, from an instant not before `input_ns` on."""
        _, *knots = splice
        offset = self.latest_offset.spliced(splice.begin_ns, self.input_ns, *knots)

        def act() -> None:
            now = self.time_ns
            begin = max(splice.begin_ns, now)
            self.simulation.splice(begin, splice.axial, splice.angular)
            self._note("trajectory", now, begin_ns=begin, joints=as_record(splice))

        self._submit(act, offset=offset)

    def apply_impulse(self, at_ns: int, axial_impulse: float, angular_impulse: float) -> None:
        """An accepted impulse at an instant not before `input_ns`."""

        def act() -> None:
            now = self.time_ns
            at = max(at_ns, now)
            self.simulation.apply_impulse(at, axial_impulse, angular_impulse)
            impulses = {"axial_impulse": axial_impulse, "angular_impulse": angular_impulse}
            self._note("impulse", now, at_ns=at, **impulses)

        self._submit(act)

    def set_parameters(self, values: Mapping[str, Value]) -> None:
        """Checked parameters, in force from here on (initial ones from the next reset on)."""

        def act() -> None:
            self.values.update(values)
            disk = Disk.of(self.values)
            self.simulation.set_parameters(values, disk)
            self._note("parameters", self.time_ns, values=dict(values), disk=disk._asdict())

        self._submit(act, not values.keys().isdisjoint(Disk._fields), values=values)

    def set_paused(self, paused: bool) -> None:
        """Pause or resume; the state does not change."""
        if paused == self.paused and not self._waiting:
            return

        def act() -> None:
            if paused != self.paused:
                self.paused = paused
                self._note("pause", self.time_ns, paused=paused)

        self._submit(act)  # while paused, inputs act at this instant: all before it is resolved

    def reset(self) -> None:
        """Back to the initial state and motion of the parameters; time and cycles go on."""
        values = self.latest_values
        initial, motion = initial_of(values), motion_of(values)

        def act() -> None:
            self.simulation.reset(initial, motion)
            self._note("reset", self.time_ns, initial=initial._asdict(), motion=motion._asdict())

        self._submit(act, cuts_chatter=True, target=motion, offset=Offset())

    def snapshot(self) -> None:
        """Put the full state on record."""
        self._since_snapshot = 0
        self._note(
            "snapshot",
            self.time_ns,
            state=self.simulation.snapshot(),
            held=self.paused,  # so named on records
            version=bouncing_disk_ros.__version__,
            parameters=dict(self.values),
        )

    def _crossfade_ns(self) -> int:
        seconds = float(self.latest_values["crossfade_duration"])
        return max(1, nanoseconds(seconds)) if seconds > 0.0 else 0

    def _note(self, kind: str, time_ns: int, **fields: Any) -> None:
        self._record({"index": self._index, "time_ns": time_ns, "kind": kind, **fields})
        self._index += 1
        if kind != "snapshot":
            self.accepted += 1
            self._since_snapshot += 1
            if self._since_snapshot >= MAX_INPUTS_BETWEEN_SNAPSHOTS:
                self.snapshot()
