"""A run of the model: its time, the inputs to come, and the instants at which they act."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.core import checkpoint, platform
from bouncing_disk_ros.core.engine import Blocks, Engine
from bouncing_disk_ros.core.layout import NEVER
from bouncing_disk_ros.core.model import (
    IMPACT_DTYPE,
    Disk,
    Energy,
    InitialState,
    Motion,
    MotionInForce,
    Sample,
    SimulationError,
    join_rows,
)
from bouncing_disk_ros.core.offset import Knot, Offset, Segment
from bouncing_disk_ros.core.schedule import Fade, Impulse, add_impulse, plan_fades
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.field_checks import mapping, number, plain, whole, with_names

_MANY_EVENTS = 1_000_000
_EVENTS_AT_ONCE = 10_000  # at the instant of an input; the next call of `advance` goes on


class Simulation:
    """The disk on its platform, exact and deterministic; SI units, times in whole nanoseconds.

    The same inputs at the same instants of simulated time give bit-identical impacts for any
    pattern of calls of `advance`, on every x86-64. Numbers that a run cannot have raise InputError;
    within the ranges of `parameters` its accuracy is tested. Not safe for use by two threads at
    once.
    """

    _SNAPSHOT = (
        *("time_ns", "motion_index", "disk", "chatter_report_speed", "initial", "initial_motion"),
        *("start", "target", "pending", "kicks", "held", "engine"),
    )

    def __init__(
        self,
        motion: Motion,
        disk: Disk,
        initial: InitialState,
        *,
        chatter_report_speed: float = 0.0,
    ) -> None:
        """Start at t = 0; impacts slower than chatter_report_speed (m/s) share rows of the log."""
        self._disk = disk = checkpoint.disk("disk", disk)
        self._report_speed = _report_speed(chatter_report_speed)
        self._initial = initial = checkpoint.initial("initial", initial)
        self._initial_motion = motion = checkpoint.motion("motion", motion)
        self._engine = Engine(disk, self._report_speed)
        self._unreported_rows: Blocks = []  # rows of an input's own instant, for the next advance
        self._time_ns = 0
        self._motion_index = 0
        self._pending: list[Fade] = []
        self._impulses: list[Impulse] = []
        self._start = self._target = motion
        self._offset = Offset()
        self._offset_index = 0
        self._offset_boundary_ns = int(NEVER)  # where a segment of the offset begins
        self._engine.place(0, initial, motion, self._offset.segments_at(0))

    def __repr__(self) -> str:
        """When, and which motion is in force."""
        motion = ", ".join(f"{name} {value:g}" for name, value in self._target._asdict().items())
        return f"<simulation at {self._time_ns / 1e9:.9g} s: {motion}>"

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
        """The cross-fade in progress, or the steady motion with the instant it was reached."""
        m = self._engine.motion[0]
        begin, cycles, tau = int(m["begin_ns"]), int(m["cycles"]), float(m["tau"])
        end = int(m["end_ns"]) if self._engine.fading else begin
        return MotionInForce(begin, end, self._start, self._target, cycles, tau)

    @property
    def motion_index(self) -> int:
        """Grows each time the motion in force changes."""
        return self._motion_index

    @property
    def offset(self) -> Offset:
        """The offset trajectories of both joints, accepted ones that lie ahead included."""
        return self._offset

    @property
    def offset_in_force(self) -> tuple[Segment, Segment]:
        """The segments of the axial and the angular offset in force."""
        return self._engine.segments

    @property
    def offset_begin_ns(self) -> int:
        """When the newest segment of the offset in force has begun."""
        return max(segment.begin_ns for segment in self._engine.segments)

    @property
    def offset_end_ns(self) -> int | None:
        """When the next segment of the offset begins; None: what is in force is held."""
        end = self._offset_boundary_ns
        return None if end == int(NEVER) else end

    @property
    def offset_index(self) -> int:
        """Grows each time a segment of the offset begins."""
        return self._offset_index

    @property
    def pending(self) -> tuple[Fade, ...]:
        """Cross-fades that have not begun."""
        return tuple(self._pending)

    @property
    def queued_impulses(self) -> int:
        """Impulses that lie ahead."""
        return len(self._impulses)

    @property
    def next_impulse_ns(self) -> int | None:
        """When the first impulse that lies ahead acts; None: none does."""
        return self._impulses[0].at_ns if self._impulses else None

    @property
    def latest_target(self) -> Motion:
        """The newest accepted target, pending ones included."""
        return self._pending[-1].target if self._pending else self._target

    @property
    def rows_total(self) -> int:
        """Index of the next row."""
        return int(self._engine.state["rows"][0])

    def sample(self) -> Sample:
        """State at time_ns."""
        return self._engine.sample(self._time_ns)

    def energy(self) -> Energy:
        """Energy ledger at time_ns, since the start or the last reset."""
        return self._engine.energy(self._time_ns)

    def advance(
        self, until_ns: int, max_events: int = _MANY_EVENTS
    ) -> tuple[NDArray[np.void], bool]:
        """Simulate up to and including until_ns; an instant that is past does nothing.

        Returns the rows of the impacts (IMPACT_DTYPE) and whether the budget of events ran out
        first: then time_ns lags behind and the call is to be repeated. Raises SimulationError for
        a run that cannot go on, each time.
        """
        if type(until_ns) is not int or type(max_events) is not int:  # a call of `whole` is slow
            until_ns = whole("until_ns", plain(until_ns))
            max_events = whole("max_events", plain(max_events))
        parts, self._unreported_rows = self._unreported_rows, []
        behind = False
        while True:
            boundary = self._boundary_ns()
            target = min(until_ns, boundary)
            if target < self._time_ns:
                break
            try:
                used, behind = self._engine.step(target, boundary, max_events, parts)
            except SimulationError:
                if parts:  # first the impacts before it; the next call raises
                    return join_rows(parts), True
                raise
            max_events -= used
            if behind:
                reached = int(self._engine.state["ns"][0])
                self._time_ns = max(self._time_ns, min(reached, target - 1))
                break
            self._time_ns = target
            if target < boundary:
                break
            self._act(parts)
            max_events -= 1  # it may have brought about a row, at which the caller is to stop
        return join_rows(parts), behind

    def _boundary_ns(self) -> int:
        """When an impulse acts next, or a cross-fade or a segment of an offset begins or ends."""
        instants = [self._offset_boundary_ns]
        if self._impulses:
            instants.append(self._impulses[0].at_ns)
        if self._engine.fading:
            instants.append(int(self._engine.motion["end_ns"][0]))
        elif self._pending:
            instants.append(self._pending[0].begin_ns)
        return min(instants)

    def _act(self, parts: Blocks) -> None:
        """What is due at time_ns: the motion first, then impulses in order of arrival (rule 10)."""
        engine, now = self._engine, self._time_ns
        engine.advance_to(now, parts)
        if engine.fading and int(engine.motion["end_ns"][0]) == now:
            engine.change_motion(platform.steady(self._target, now, *engine.clock))
            self._note_motion(self._target, self._target)
        if not engine.fading and self._pending and self._pending[0].begin_ns == now:
            fade = self._pending.pop(0)
            plan = (self._target, fade.target, now, fade.end_ns)
            engine.change_motion(platform.fade(*plan, *engine.clock))
            self._note_motion(self._target, fade.target)
        if self._offset_boundary_ns <= now:
            self._follow_offset()
        while self._impulses and self._impulses[0].at_ns == now:
            impulse = self._impulses.pop(0)
            engine.apply_impulse(impulse.axial_impulse, impulse.angular_impulse)
        engine.resume()

    def _follow_offset(self) -> None:
        """Put the segments of the offset in force that begin at time_ns."""
        now, offset = self._time_ns, self._offset
        self._engine.change_offset(offset.segments_at(now))
        self._offset = offset.since(now)
        self._offset_boundary_ns = self._offset.boundary_after(now)
        self._offset_index += 1

    def _note_motion(self, start: Motion, target: Motion) -> None:
        self._start, self._target = start, target
        self._motion_index += 1

    def command(self, points: Sequence[tuple[int, Motion]], crossfade_ns: int = 0) -> None:
        """Accept a programme: each motion is reached at its time (ns, strictly increasing).

        It replaces every cross-fade that has not begun; one that has begun runs out.
        `crossfade_ns` 0: one period of the slower motion. No points: cancel what is pending.
        """
        checked = checkpoint.made("points", points, checkpoint.point)
        crossfade_ns = whole("crossfade_ns", plain(crossfade_ns), 0)
        self._resolve_due()
        free = int(self._engine.motion["end_ns"][0]) if self._engine.fading else self._time_ns
        self._pending = plan_fades(checked, self._target, free, crossfade_ns)
        self._engine.invalidate_next_event()
        self._resolve_consequences()

    def apply_impulse(self, at_ns: int, axial_impulse: float, angular_impulse: float) -> None:
        """Queue impulses on the disk (N·s, N·m·s) for at_ns; ValueError if that is past."""
        at_ns = whole("impulse instant", plain(at_ns))
        if at_ns < self._time_ns:
            raise ValueError(f"impulse at {at_ns} ns: allowed from {self._time_ns} ns (simulated)")
        impulse = checkpoint.queued_impulse("impulse", (at_ns, axial_impulse, angular_impulse))
        self._resolve_due()
        add_impulse(self._impulses, impulse)
        self._engine.invalidate_next_event()
        self._resolve_consequences()

    def trajectory(
        self,
        begin_ns: int,
        axial: Sequence[Knot] | None = None,
        angular: Sequence[Knot] | None = None,
    ) -> None:
        """Splice offset trajectories at begin_ns (at once if that is past): rising, later knots.

        What is in force runs on to that instant; everything after it is replaced, for the joints
        given. None: the joint is left alone; no knots: what has not begun is cancelled.
        """
        begin_ns = whole("begin_ns", plain(begin_ns))
        axial, angular = checkpoint.knots("axial", axial), checkpoint.knots("angular", angular)
        self.splice(begin_ns, axial, angular)

    def splice(
        self, begin_ns: int, axial: Sequence[Knot] | None, angular: Sequence[Knot] | None
    ) -> None:
        """Splice offset trajectories whose numbers were checked, as `trajectory` does.

        To check a thousand knots again would take 5 ms of a tick.
        """
        self._resolve_due()
        now = self._time_ns
        self._offset = self._offset.spliced(max(begin_ns, now), now, axial, angular)
        self._find_offset_boundary()
        self._engine.invalidate_next_event()
        self._resolve_consequences()

    def _find_offset_boundary(self) -> None:
        now, offset = self._time_ns, self._offset
        self._offset_boundary_ns = offset.boundary_after(now)
        if self._engine.segments != offset.segments_at(now):
            self._offset_boundary_ns = now

    def set_disk(self, disk: Disk) -> None:
        """Change parameters of disk and contact now; the jump of the energy enters the ledger."""
        disk = checkpoint.disk("disk", disk)
        self._resolve_due(cut_chatter=True)
        self._engine.advance_to(self._time_ns, self._unreported_rows)
        self._engine.change_disk(disk, self._report_speed)
        self._disk = disk
        self._engine.resume()
        self._resolve_consequences()

    def set_parameters(self, values: Mapping[str, Any], disk: Disk) -> None:
        """Change those of some parameters that concern disk, contact and the log of impacts.

        `values`: the changed parameters by name. `disk`: with all its values.
        """
        if not mapping("values", values).keys().isdisjoint(Disk._fields):
            self.set_disk(disk)
        if "chatter_report_speed" in values:
            self.set_chatter_report_speed(values["chatter_report_speed"])

    def set_chatter_report_speed(self, speed: float) -> None:
        """Impacts slower than this (m/s) share a row of the log; nothing else changes."""
        speed = _report_speed(speed)
        self._resolve_due()
        self._report_speed = speed
        self._engine.disk["report_speed"] = speed

    def reset(self, initial: InitialState | None = None, motion: Motion | None = None) -> None:
        """Back to the initial (or a new) state and motion; time, cycles and row index go on."""
        initial = checkpoint.initial("initial", self._initial if initial is None else initial)
        motion = checkpoint.motion("motion", self._initial_motion if motion is None else motion)
        self._resolve_due(cut_chatter=True)
        self._engine.advance_to(self._time_ns, self._unreported_rows)
        self._initial, self._initial_motion = initial, motion
        self._pending, self._impulses = [], []
        now, has_moved = self._time_ns, self._offset_index > 0
        self._offset, self._offset_boundary_ns = Offset.at_rest(now if has_moved else 0), int(NEVER)
        self._offset_index += has_moved
        segments = self._offset.segments_at(now)
        self._engine.place(now, self._initial, self._initial_motion, segments)
        self._note_motion(self._initial_motion, self._initial_motion)
        self._resolve_consequences()

    def resolve_due(self, max_events: int, *, cut_chatter: bool) -> bool:
        """Resolve all that is due at time_ns, to rounding; False when the budget ran out before.

        Then call it again. Rows wait for the next `advance`. `cut_chatter`: a chatter that ends
        later too, bounce by bounce, as `set_disk` and `reset` need it; after each bounce its end
        may be due.
        """
        parts: Blocks = []
        is_due, behind = True, False
        while is_due and not behind:
            rows, behind = self.advance(self._time_ns, max_events)
            parts += [rows] if len(rows) else []
            if not behind:
                is_due = self._engine.take_due(self._time_ns)
                if cut_chatter and not is_due:
                    is_due = self._engine.cut_bounce(self._time_ns, parts)
            max_events -= 1
            behind = behind or (is_due and max_events <= 0)
        self._unreported_rows = parts + self._unreported_rows
        return not behind

    def _resolve_due(self, *, cut_chatter: bool = False) -> None:
        """Resolve all that is due at time_ns, whatever the number of events."""
        while not self.resolve_due(_MANY_EVENTS, cut_chatter=cut_chatter):
            pass

    def _resolve_consequences(self) -> None:
        """Resolve what an input causes at its own instant, within one budget of events."""
        with suppress(SimulationError):  # the next call of `advance` raises it again
            rows, _ = self.advance(self._time_ns, _EVENTS_AT_ONCE)
            if len(rows):
                self._unreported_rows.append(rows)

    def snapshot(self) -> dict[str, Any]:
        """Everything the run depends on, JSON-able; `restore` continues it bit-identically."""
        offset = self._offset.trimmed(self._time_ns)
        moved = self._offset_index or offset != Offset()
        more = {
            "offset": checkpoint.plain_offset(offset, self._engine.segments, self._offset_index)
        }
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
            "kicks": [list(impulse) for impulse in self._impulses],
            "held": [
                checkpoint.plain(r[i : i + 1]) for r in self._unreported_rows for i in range(len(r))
            ],
            "engine": self._engine.snapshot(),
            **(more if moved else {}),
        }

    @classmethod
    def restore(cls, snapshot: Mapping[str, Any]) -> Self:
        """Continue from a snapshot; InputError for one that does not fit."""
        try:
            return cls._restored(snapshot)
        except InputError as error:
            raise error.inside("checkpoint ") from None

    @classmethod
    def _restored(cls, snapshot: Mapping[str, Any]) -> Self:
        if mapping("content", snapshot).get("format") != checkpoint.FORMAT:
            raise InputError("format", snapshot.get("format"), str(checkpoint.FORMAT))
        with_names("", snapshot, cls._SNAPSHOT)
        run = cls(
            checkpoint.motion("initial_motion", snapshot["initial_motion"]),
            checkpoint.disk("disk", snapshot["disk"]),
            checkpoint.initial("initial", snapshot["initial"]),
            chatter_report_speed=snapshot["chatter_report_speed"],
        )
        run._time_ns = checkpoint.instant("time_ns", snapshot["time_ns"])
        run._motion_index = whole("motion_index", snapshot["motion_index"], low=0)
        run._start = checkpoint.motion("start", snapshot["start"])
        run._target = checkpoint.motion("target", snapshot["target"])
        run._pending = checkpoint.made("pending", snapshot["pending"], checkpoint.pending_fade)
        run._impulses = checkpoint.made("kicks", snapshot["kicks"], checkpoint.queued_impulse)
        checkpoint.in_order("pending", [t for f in run._pending for t in f[:2]])
        checkpoint.in_order("kicks", [run._time_ns, *(impulse.at_ns for impulse in run._impulses)])
        run._unreported_rows = checkpoint.made(
            "held", snapshot["held"], lambda name, row: checkpoint.record(name, row, IMPACT_DTYPE)
        )
        run._offset, segments, run._offset_index = checkpoint.offset(snapshot.get("offset"))
        engine = snapshot["engine"]
        run._engine = Engine.restore(run._disk, run._report_speed, engine, segments)
        run._find_offset_boundary()
        whole("time_ns", run._time_ns, low=int(run._engine.state["ns"][0]))
        return run


def _report_speed(value: object) -> float:
    """A speed below which impacts share a row of the log, m/s."""
    return number("chatter_report_speed", plain(value), *checkpoint.POSITIVE)
