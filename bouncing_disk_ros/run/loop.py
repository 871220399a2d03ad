"""The loop: advance a session to an instant and hand samples, speeds and impacts to a sink.

Knows neither ROS nor a clock of its own; the caller says which instant is due and how long the
work may take.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from fractions import Fraction
from typing import TYPE_CHECKING, Any, Protocol

from numpy.typing import NDArray

from bouncing_disk_ros.core.model import Sample, join_rows
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.parameters import Value
from bouncing_disk_ros.run.time_map import FAR_NS, Grid
from bouncing_disk_ros.topics import MAX_ROWS
from bouncing_disk_ros.units import NS

if TYPE_CHECKING:
    from bouncing_disk_ros.run.session import Session

MAX_SAMPLES = 100
"""Samples (and speeds) handed over on the way to an instant, before the loop goes on without them;
what is due until it has caught up, or its slice ends, is counted."""
BUDGET_NS = 20_000_000
"""Wall time of one slice: between slices services, commands and signals are handled."""


class Sink(Protocol):
    """What becomes of the results."""

    def sample(self, sample: Sample) -> None:
        """A sample on the grid of state_rate."""

    def speed(self, first: Sample, second: Sample) -> None:
        """Two samples one interval of rotor_speed_rate apart."""

    def impacts(self, rows: NDArray[Any]) -> None:
        """Rows of impacts, at least one, in the order of their index."""


class Loop:
    """Drives one session. `skipped` counts the samples that were due and not handed over."""

    def __init__(
        self, session: Session, sink: Sink, clock: Callable[[], int] = time.monotonic_ns
    ) -> None:
        self.session = session
        self.skipped = 0
        self._left = MAX_SAMPLES  # samples that may still be handed over
        self._sink = sink
        self._clock = clock
        # a session that starts hands over its first state too
        after = session.time_ns if session.time_ns > 0 else -1
        self._states, self._speeds = self._grids(after)
        self.restart_speed()
        self._advance_past_samples()

    def set_rates(self) -> None:
        """Take over the rates in the session's parameters."""
        self._states, self._speeds = self._grids(self.session.time_ns)

    def _grids(self, after_ns: int) -> tuple[Grid, Grid]:
        values = self.session.latest_values
        names = ("state_rate", "rotor_speed_rate")
        first, second = (Grid(float(values[name]), after_ns) for name in names)
        return first, second

    def restart_speed(self) -> None:
        """Begin a new interval of the rotor speed here (a reset is not rotation)."""
        self._speed_from = self.session.simulation.sample()

    @property
    def next_sample_ns(self) -> int:
        """When the next sample of joint_states is due, simulated ns."""
        return self._states.next_ns

    @property
    def next_output_ns(self) -> int:
        """When the next sample or speed is due, simulated ns."""
        return min(self._states.next_ns, self._speeds.next_ns)

    def slice(self, until_ns: int, budget_ns: int = BUDGET_NS, *, to_impact: bool = False) -> bool:
        """Advance towards an instant for about a wall time; True when it was reached.

        `to_impact`: no further than just after the first row of impacts.

        Where samples cost more than the motion between them, slices of nothing but samples would
        keep a simulation behind that could catch up. So MAX_SAMPLES of them, over however many
        slices, are followed by half a slice or more without.
        """
        deadline = self._clock() + budget_ns
        self.finish_samples()
        session = self.session
        while session.time_ns < until_ns:
            goal = min(until_ns, self._horizon())
            session.advance(goal, 1 if to_impact else session.events_at_once)
            if to_impact and session.gathered:
                if session.paused:  # inputs act at the instant reached: not before the impact
                    session.advance(session.time_ns + 1)
                break
            if session.gathered >= MAX_ROWS:
                self.flush()
            if self._left > 0 and session.time_ns == goal and self._advance_past_samples():
                self._left -= 1
                if self._left == 0:
                    deadline = max(deadline, self._clock() + budget_ns // 2)
            if session.fault or self._clock() >= deadline:
                break
        self._end_slice(reached=session.time_ns >= until_ns)
        return session.time_ns >= until_ns

    def _end_slice(self, *, reached: bool) -> None:
        """Count the samples passed over, if they were; hand over the impacts."""
        if self._left == 0:
            self.skipped += self._states.skip_to(self.session.time_ns)
            self._speeds.skip_to(self.session.time_ns)
        if self._left == 0 or reached:
            self._left = MAX_SAMPLES
        self.flush()

    def resolve_waiting(self, budget_ns: int = BUDGET_NS) -> bool:
        """Let waiting inputs act, for at most a wall time; True when none waits any more."""
        deadline = self._clock() + budget_ns
        while not self.session.resolve_waiting():
            if self.session.fault or self._clock() >= deadline:
                break
        self.flush()
        return not self.session.waiting

    def _horizon(self) -> int:
        """Where the next call of the core may end: a grid instant, or far on past the limit."""
        if self._left > 0:
            return self.next_output_ns
        return self.session.time_ns + round(MAX_SAMPLES * NS / self._states.rate)

    def _advance_past_samples(self) -> bool:
        """Hand over what is due at the instant reached; whether anything was."""
        now = self.session.time_ns
        due_state, due_speed = self._states.next_ns == now, self._speeds.next_ns == now
        if not (due_state or due_speed):
            return False
        sample = self.session.simulation.sample()
        if due_state:
            self._sink.sample(sample)
            self._states.advance()
        if due_speed:
            if self._speed_from.time_ns < now:
                self._sink.speed(self._speed_from, sample)
            self._speed_from = sample
            self._speeds.advance()
        return True

    def finish_samples(self) -> None:
        """Hand over a sample due at the very instant reached; to be called before each input."""
        self._advance_past_samples()
        now = self.session.time_ns
        self.skipped += self._states.skip_past(now)
        self._speeds.skip_past(now)

    def flush(self) -> None:
        """Hand over the impacts gathered so far."""
        rows = self.session.take_rows()
        if rows:
            self._sink.impacts(join_rows(rows))


class Steps:
    """Where `~/step` ends: step k at round(k T) ns from the first, so that steps do not drift."""

    def __init__(self) -> None:
        self._key: tuple[float, int] | None = None
        self._base = self._last = self._count = 0

    def end(self, session: Session, values: Mapping[str, Value], times: int = 1) -> tuple[int, str]:
        """Where a step of a session ends at the latest, simulated ns, and what it is in words.

        `times` as many as the parameters (`values`) say. InputError while it is not paused.
        """
        if not session.paused:
            raise InputError("~/step", "a call while running", "calls while paused", "Pause first.")
        now = session.time_ns
        if values["step_until"] == "impact":
            return FAR_NS, "to the next impact" if times == 1 else f"over {times} impacts"
        if values["step_until"] == "nanoseconds":
            nanos = int(values["step_nanoseconds"]) * times
            return min(now + nanos, FAR_NS), f"{nanos} ns"
        periods = int(values["step_periods"]) * times
        frequency = session.simulation.motion_in_force.target.frequency
        return min(self.next_end(now, frequency, periods), FAR_NS), f"{periods} period(s)"

    def next_end(self, now_ns: int, frequency: float, periods: int) -> int:
        """End of the next step of `periods` periods from an instant of simulated time."""
        if self._key != (frequency, periods) or now_ns != self._last:
            self._key, self._base, self._count = (frequency, periods), now_ns, 0
        self._count += 1
        period = Fraction(periods * NS) / Fraction(frequency)
        self._last = self._base + round(self._count * period)
        return self._last
