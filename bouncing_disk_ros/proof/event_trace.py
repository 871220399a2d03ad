"""Run a simulation event by event and keep each event with the states around it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from bouncing_disk_ros.core.engine import Blocks, Engine
from bouncing_disk_ros.core.layout import (
    CHATTER_ENDS,
    FADE,
    IMPACT,
    NEVER,
    SEPARATION,
    SLIP,
    SLIP_ENDS,
    STILLED,
)
from bouncing_disk_ros.core.model import Phase
from bouncing_disk_ros.core.offset import Segment
from bouncing_disk_ros.core.simulation import Simulation
from bouncing_disk_ros.proof.exact_records import (
    DiskRecord,
    Event,
    Kind,
    MotionRecord,
    OffsetPiece,
    State,
)

_KINDS = {
    IMPACT: Kind.IMPACT,
    SEPARATION: Kind.SEPARATION,
    SLIP: Kind.SLIP,
    SLIP_ENDS: Kind.SLIP_ENDS,
    CHATTER_ENDS: Kind.CHATTER,
}


def state_of(record: Any) -> State:
    """The numbers of a state record (layout.STATE_DTYPE)."""
    record = record[0]
    return State(
        int(record["ns"]),
        float(record["sub"]),
        int(record["cycles"]),
        float(record["tau"]),
        Phase(int(record["phase"])),
        float(record["slip_sign"]),
        float(record["gap"]),
        float(record["u"]),
        float(record["omega"]),
    )


def motion_of(engine: Engine) -> MotionRecord:
    """The numbers of the motion in force (layout.MOTION_DTYPE), and what states its offsets."""
    record = engine.base
    m = record[0]
    begin, end, cycles = (int(m[name]) for name in ("begin_ns", "end_ns", "cycles"))
    names = ("tau", "a", "da", "p", "dp", "f", "df", "lag", "dlag")
    numbers = (float(m[name]) for name in names)
    offsets = map(_offset_of, engine.segments)
    return MotionRecord._make((bool(m["kind"] == FADE), begin, end, cycles, *numbers, *offsets))


def _offset_of(segment: Segment) -> OffsetPiece | None:
    if segment.degree == 0 and segment.start.position == 0.0:
        return None
    return OffsetPiece(
        segment.begin_ns, segment.end_ns, tuple(segment.start), tuple(segment.end), segment.degree
    )


def disk_of(record: Any) -> DiskRecord:
    """The numbers of a disk record (layout.DISK_DTYPE)."""
    record = record[0]
    return DiskRecord(*(float(record[name]) for name in DiskRecord._fields))


class TracedEngine(Engine):
    """An engine that resolves one event at a time and keeps each in `events`."""

    events: list[Event]
    last: Event | None

    @classmethod
    def of(cls, simulation: Simulation) -> TracedEngine:
        """The traced engine of a simulation, put into it if need be; its results do not change."""
        if isinstance(simulation._engine, TracedEngine):
            return simulation._engine
        values, speed = simulation.snapshot()["engine"], simulation.chatter_report_speed
        segments = simulation.offset_in_force
        engine = cls.restore(simulation.disk, speed, values, segments)
        engine.events, engine.last = [], None
        simulation._engine = engine
        return engine

    def taken(self) -> list[Event]:
        """The events since this was last asked."""
        events, self.events = self.events, []
        return events

    def step(self, target_ns: int, boundary_ns: int, budget: int, rows: Blocks) -> tuple[int, bool]:
        """Resolve the events up to target_ns one by one."""
        used = 0
        while used < budget:
            before = state_of(self.state)
            used += super().step(before.ns - 1, boundary_ns, 1, rows)[0]  # finds the next event
            pending = self.state[0]
            kind, delay, value = (pending[n] for n in ("event", "event_delay", "event_value"))
            work, is_resolved = super().step(target_ns, boundary_ns, 1, rows)
            used += work
            if not is_resolved:
                return used, False
            boundary = None if boundary_ns == NEVER else boundary_ns
            self._keep(before, int(kind), float(delay), float(value), boundary)
        return used, True

    def advance_to(self, time_ns: int, rows: Blocks) -> None:
        """Propagate the state to time_ns."""
        before = state_of(self.state)
        super().advance_to(time_ns, rows)
        reached = self.last.after if self.last is not None else None
        if reached is not None and (reached.ns, reached.sub) > (before.ns, before.sub):
            before = reached  # a chatter cut short has been bounced through on the way
        delay = ((time_ns - before.ns) - before.sub) * 1e-9
        if delay > 0.0:
            self._keep(before, -1, delay, 0.0, time_ns)

    def _keep(
        self, before: State, kind: int, delay: float, value: float, boundary_ns: int | None
    ) -> None:
        name = _KINDS.get(kind, Kind.PROPAGATED)
        if name is Kind.CHATTER and value == STILLED:
            name = Kind.STILL
        motion, disk, after = motion_of(self), disk_of(self.disk), state_of(self.state)
        event = Event(
            name, before, motion, disk, delay, value, after, boundary_ns, self.inherited(before)
        )
        self.events.append(event)
        self.last = event

    def inherited(self, state: State) -> float:
        """The α̇ from which that of a state has come by sliding."""
        last = self.last
        if last is None or last.after != state or last.before.phase is not Phase.SLIDING:
            return 0.0
        return abs(last.before.omega)


def trace(
    simulation: Simulation, until_ns: int, slice_events: int = 1, *, is_end: bool = True
) -> Iterator[Event]:
    """Run a simulation up to until_ns and yield its events.

    Inputs may be given to the simulation in between. `slice_events`: how many events are resolved
    before they are yielded. `is_end`: the last one says that no event follows until then (it is
    left out in the midst of a chatter that is to complete); without it the next trace of the same
    simulation goes on where this one ends.
    """
    engine = TracedEngine.of(simulation)
    behind = True
    while behind:
        _, behind = simulation.advance(until_ns, slice_events)
        yield from engine.taken()
    before = state_of(engine.state)
    delay = ((until_ns - before.ns) - before.sub) * 1e-9
    if is_end and delay > 0.0 and not engine.in_chatter:
        motion, disk = motion_of(engine), disk_of(engine.disk)
        inherited = engine.inherited(before)
        yield Event(Kind.PROPAGATED, before, motion, disk, delay, 0.0, None, until_ns, inherited)
