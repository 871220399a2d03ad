"""How a run is doing: `Health` turns counts and clocks into a report, once a second.

After it the same as named numbers that tools can plot: `run_values`, the content of
disk/run_state.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import NamedTuple

import numpy as np

from bouncing_disk_ros.core.model import RESIDUAL_LIMIT, Energy
from bouncing_disk_ros.core.schedule import NOTHING_PENDING, Pending
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.units import NS

LAG_WARN = 0.1
LAG_ERROR = 1.0
"""Simulated time behind its due time, in seconds of the wall clock: WARN and ERROR."""


class Level(IntEnum):
    """Levels of diagnostic_msgs/DiagnosticStatus."""

    OK = 0
    WARN = 1
    ERROR = 2


class Status(NamedTuple):
    """One row of /diagnostics."""

    task: str
    level: Level
    message: str
    values: Mapping[str, str]


@dataclass(frozen=True)
class Reading:
    """What the node reads off once a second."""

    steady_ns: int
    simulated_ns: int
    lag_ns: int  # simulated time behind its due time, in ns of the wall clock
    rows: int
    skipped: int
    accepted: int
    energy: Energy | None
    state: str  # of the node: running, paused, inactive ...
    factor: float  # asked for
    other_publishers: int  # of platform/motion
    fault: str = ""  # why the run has ended, if it has
    lost: int = 0  # messages of the command topics that did not arrive
    uncertain: Sequence[str] = ()  # command topics of which more may be lost
    pending: Pending = NOTHING_PENDING
    motion_index: int = 0
    waiting: str = ""  # what a lockstep waits for
    overdue: bool = False  # it has waited for longer than is left unreported
    other_clock: bool = False  # with publish_clock: another node publishes /clock


class Ticks:
    """Lateness of the ticks of the loop, against the instants at which they should begin."""

    def __init__(self) -> None:
        self._late: list[int] = []

    def note(self, late_ns: int) -> None:
        """A tick has begun, so late."""
        self._late.append(late_ns)

    def take(self) -> dict[str, float]:
        """Lateness p50, p99 and max in seconds since the last call, and the number of ticks."""
        late, self._late = self._late, []
        if not late:
            return {"ticks": 0.0}
        p50, p99 = np.percentile(late, [50, 99]) / NS
        return {"ticks": float(len(late)), "p50": p50, "p99": p99, "max": max(late) / NS}


class Health:
    """Keeps the last reading and the refusals, and turns a new reading into a report."""

    def __init__(self) -> None:
        self.refused = 0
        self._last_refusal: InputError | None = None
        self._last: Reading | None = None

    def count_refusal(self, error: InputError) -> None:
        """Count a refused input and remember why."""
        self.refused += 1
        self._last_refusal = error

    def report(self, now: Reading, ticks: Mapping[str, float]) -> list[Status]:
        """The rows of /diagnostics for this reading."""
        last, self._last = self._last, now
        return [
            self._real_time(now, last, ticks),
            self._impacts(now, last),
            self._energy(now),
            self._inputs(now, last),
        ]

    @staticmethod
    def _real_time(now: Reading, last: Reading | None, ticks: Mapping[str, float]) -> Status:
        lag = now.lag_ns / NS
        level = Level.OK if lag < LAG_WARN else Level.WARN if lag < LAG_ERROR else Level.ERROR
        message = now.state
        skipped = max(0, now.skipped - (0 if last is None else last.skipped))
        if skipped and now.factor > 0.0 and now.state == "running":  # a free run skips most of them
            level = max(level, Level.WARN)
            message = f"{now.state}, {skipped} samples of joint_states skipped: lower state_rate"
        if lag >= LAG_WARN:
            message = (
                f"{now.state}, {lag:.3g} s behind: lower real_time_factor, state_rate or the load"
            )
        if now.other_clock:
            level = max(level, Level.WARN)
            message += "; another node publishes /clock: end it, or start without publish_clock"
        if now.overdue:
            level, message = Level.ERROR, f"lockstep: {now.waiting}"
        if now.fault:
            level, message = Level.ERROR, f"the run has ended: {now.fault}"
        reached = 0.0
        is_same_run = last is not None and now.simulated_ns >= last.simulated_ns
        if last is not None and is_same_run and now.steady_ns > last.steady_ns:
            reached = (now.simulated_ns - last.simulated_ns) / (now.steady_ns - last.steady_ns)
        values = {
            "real_time_factor asked": "free running" if now.factor == 0.0 else f"{now.factor:g}",
            "real_time_factor reached": f"{reached:.6g}",
            "simulated time (s)": f"{now.simulated_ns / NS:.9f}",
            "behind (s)": f"{lag:.6f}",
            "ticks": f"{ticks['ticks']:.0f}",
            **{
                f"lateness {key} (s)": f"{ticks.get(key, 0.0):.6f}" for key in ("p50", "p99", "max")
            },
            "samples skipped": str(now.skipped),
            "lockstep waits for": now.waiting or "nothing",
        }
        return Status("real time", level, message, values)

    @staticmethod
    def _impacts(now: Reading, last: Reading | None) -> Status:
        rate = 0.0
        if last is not None and now.steady_ns > last.steady_ns and now.rows >= last.rows:
            rate = (now.rows - last.rows) * NS / (now.steady_ns - last.steady_ns)
        values = {"rows/s": f"{rate:.6g}", "rows": str(now.rows)}
        return Status("impacts", Level.OK, f"{rate:.6g} rows/s", values)

    @staticmethod
    def _energy(now: Reading) -> Status:
        if now.energy is None:
            return Status("energy", Level.OK, "no run", {})
        ledger = now.energy
        relative = ledger.relative_residual
        level = Level.OK if relative <= RESIDUAL_LIMIT else Level.ERROR
        values = {f"{name} (J)": f"{value:.9g}" for name, value in ledger._asdict().items()}
        values["residual / throughput"] = f"{relative:.3g}"
        return Status("energy", level, f"residual {relative:.2g} of throughput", values)

    def _inputs(self, now: Reading, last: Reading | None) -> Status:
        level, message = Level.OK, f"{now.accepted} accepted, {self.refused} refused"
        newly_lost = now.lost - (0 if last is None else last.lost)
        if newly_lost > 0:
            level = Level.WARN
            message += f"; {newly_lost} commands were lost on the way: send them more slowly"
        if now.other_publishers:
            level = Level.WARN
            message += "; another node publishes platform/motion here: give each its own namespace"
        lost = str(now.lost)
        if now.uncertain:
            lost = f"at least {lost}: several publishers on {', '.join(now.uncertain)}"
        values = {
            "accepted": str(now.accepted),
            "refused": str(self.refused),
            "last refusal": "none" if self._last_refusal is None else self._last_refusal.line,
            "commands lost on the way": lost,
            "pending": str(now.pending),
        }
        return Status("inputs", level, message, values)


# ------------------------------------------------------------------------------------------------
# How a run stands, as named numbers that tools can plot: the content of disk/run_state.


STATES = ("unconfigured", "inactive", "paused", "running", "stepping", "ended by a fault")
"""The states of a run; `state` in disk/run_state is the index in this table."""
_NO_ENERGY = Energy._make([math.nan] * len(Energy._fields))


def run_values(now: Reading, refused: int) -> dict[str, float]:
    """The fields of disk/run_state in their order; nan where there is none."""
    pending = now.pending
    values = {
        "state": STATES.index(now.state),
        "simulated_time": now.simulated_ns / NS,
        "behind": now.lag_ns / NS,
        "motion_index": now.motion_index,
        "pending_motions": pending.motions,
        "pending_impulses": pending.impulses,
        "waiting_inputs": pending.waiting,
        "next_input_time": math.nan if pending.next_ns is None else pending.next_ns / NS,
        "accepted_inputs": now.accepted,
        "refused_inputs": refused,
        "lost_commands": now.lost,
        "impact_rows": now.rows,
        "skipped_samples": now.skipped,
    }
    energy = _NO_ENERGY if now.energy is None else now.energy
    values |= {f"energy_{name}": value for name, value in energy._asdict().items()}
    values["pending_trajectories"] = pending.trajectories
    return {name: float(value) for name, value in values.items()}
