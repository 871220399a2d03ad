"""What was seen of a run from outside, and what it amounts to."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.analysis.period_one import period_one
from bouncing_disk_ros.analysis.recorded.orbit import Orbit, orbit_of
from bouncing_disk_ros.analysis.scales import axial_forcing_of
from bouncing_disk_ros.core.model import Disk, Energy, Motion, MotionInForce, join_rows
from bouncing_disk_ros.units import NS

SETTLED_SECONDS = 2.0
"""The rotor speed of the summary is the mean over this long at the end."""
UNKNOWN_DISK = Disk(*[math.nan] * len(Disk._fields))
"""Stands for a disk whose parameters are unknown: what follows from them is nan."""


class State(NamedTuple):
    """One sample of joint_states."""

    time: float  # simulated, s
    disk_position: float  # m
    platform_position: float  # m
    angular_velocity: float  # of the disk, rad/s


class Health(NamedTuple):
    """One report of /diagnostics."""

    stamp: float  # s of the wall clock
    simulated: float  # s
    lateness_p50: float  # of the ticks, s
    lateness_p99: float
    lateness_max: float
    residual: float  # of the energy balance, per throughput
    running: bool = True  # not paused or inactive
    behind: float = math.nan  # of simulated time behind its due time, s of the wall clock
    skipped: int = 0  # samples of joint_states left out, since the start
    refused: int = 0  # inputs, since the start
    asked: str = ""  # real-time factor, in words
    energy: Energy | None = None  # ledger since the start or the last reset, J


class Change(NamedTuple):
    """An input that drives the disk on otherwise than before; motions are kept by themselves."""

    time: float  # simulated, s
    what: str  # "impulse", "reset" or "parameters"
    detail: str = ""  # in words


@dataclass
class RunRecord:
    """Everything that arrived, in order; times are simulated seconds."""

    disk: Disk
    states: list[State] = field(default_factory=list)
    speeds: list[tuple[float, float]] = field(default_factory=list)  # time, mean rad/s before it
    motions: list[MotionInForce] = field(default_factory=list)
    health: list[Health] = field(default_factory=list)
    chunks: list[NDArray[np.void]] = field(default_factory=list)
    lost: int = 0  # rows of impacts
    inputs: int = 0  # motions, impulses, parameter changes and resets that the simulator accepted
    changes: list[Change] = field(default_factory=list)
    disks: list[tuple[float, Disk]] = field(default_factory=list)  # time from which it is known

    @property
    def rows(self) -> NDArray[np.void]:
        """All impacts, IMPACT_DTYPE."""
        return join_rows(self.chunks)

    @property
    def motion(self) -> Motion | None:
        """The steady motion at the end; None while it changes."""
        if not self.motions or self.motions[-1].begin_ns != self.motions[-1].end_ns:
            return None
        return self.motions[-1].target

    @property
    def orbit(self) -> Orbit:
        """The orbit found since the platform's motion last changed."""
        rows = self.rows
        steady_since = self.motions[-1].end_ns / NS if self.motions else math.inf
        return orbit_of(rows[rows["time"] >= steady_since])


class Summary(NamedTuple):
    """What a run amounts to; nan or None where nothing arrived."""

    impacts: int  # single impacts, those counted in a row included
    lost: int
    orbit: Orbit
    axial_forcing: float  # Γ of the last motion
    rotor_speed: float  # rad/s, mean over the last SETTLED_SECONDS
    predicted_speed: float  # of the period-1 orbit by eq. 4, rad/s
    predicted_phase: float  # τ_imp of it, rad
    predicted_velocity: float  # w_A of it, m/s
    real_time_factor: float
    lateness: tuple[float, float, float]  # median of p50, largest p99, largest of all, s
    residual: float  # largest
    inputs: int  # that drove the run


def summary_of(record: RunRecord) -> Summary:
    """The figures of a run."""
    motion = record.motion
    expected = period_one(motion, record.disk) if motion else None
    end = record.speeds[-1][0] if record.speeds else 0.0
    last = [speed for time, speed in record.speeds if time > end - SETTLED_SECONDS]
    health = record.health
    return Summary(
        impacts=int(sum(int(chunk["count"].sum()) for chunk in record.chunks)),
        lost=record.lost,
        orbit=record.orbit,
        axial_forcing=axial_forcing_of(motion, record.disk) if motion else math.nan,
        rotor_speed=float(np.mean(last)) if last else math.nan,
        predicted_speed=expected.angular_velocity if expected else math.nan,
        predicted_phase=expected.forcing_phase if expected else math.nan,
        predicted_velocity=expected.axial_impact_velocity if expected else math.nan,
        real_time_factor=_factor(health),
        lateness=(
            float(np.median([report.lateness_p50 for report in health])) if health else math.nan,
            max((report.lateness_p99 for report in health), default=math.nan),
            max((report.lateness_max for report in health), default=math.nan),
        ),
        residual=max((report.residual for report in health), default=math.nan),
        inputs=record.inputs,
    )


def _factor(health: list[Health]) -> float:
    if len(health) < 2 or health[-1].stamp <= health[0].stamp:
        return math.nan
    simulated = health[-1].simulated - health[0].simulated
    return simulated / (health[-1].stamp - health[0].stamp)


def lines(summary: Summary) -> list[str]:
    """The summary for people, one line each."""
    orbit, found = summary.orbit, ""
    if orbit.is_period_one:
        found = (
            f": τ_imp {orbit.forcing_phases[0]:.6f} rad (theory {summary.predicted_phase:.6f}), "
            f"w_A {orbit.axial_impact_velocities[0]:.6f} m/s "
            f"(theory {summary.predicted_velocity:.6f})"
        )
    predicted = summary.predicted_speed
    difference = summary.rotor_speed - predicted
    equation = f"{predicted:.6f} rad/s, difference {difference:+.1e} rad/s"
    p50, p99, largest = (1e3 * value for value in summary.lateness)
    rows = [
        ("impacts", f"{summary.impacts}, {summary.lost} rows lost on the way"),
        ("axial forcing Γ", _known(summary.axial_forcing, f"{summary.axial_forcing:.4f}")),
        ("orbit found", orbit.name + found),
        ("rotor speed", f"{summary.rotor_speed:.6f} rad/s, mean of {SETTLED_SECONDS:g} s"),
        ("eq. 4, ωΦ cos(τ_imp + θ)", _known(predicted, equation)),
        ("real-time factor", f"{summary.real_time_factor:.4f}"),
        ("lateness of the ticks", f"p50 {p50:.2f} ms, p99 {p99:.2f} ms, largest {largest:.2f} ms"),
        ("energy balance residual", f"{summary.residual:.1e} of the throughput"),
    ]  # fmt: skip
    width = max(len(name) for name, _ in rows)
    return [f"  {name:{width}}  {text}" for name, text in rows]


def _known(value: float, text: str) -> str:
    return "not known" if math.isnan(value) else text
