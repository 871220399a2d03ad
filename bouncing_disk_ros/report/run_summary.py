"""The summary of a run: figures beside those of theory, and as text."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from bouncing_disk_ros.maps.period_one import period_one
from bouncing_disk_ros.maps.scales import axial_forcing_of
from bouncing_disk_ros.report.orbit import Orbit, orbit_of
from bouncing_disk_ros.report.run_record import SETTLED_SECONDS, HealthReport, RunRecord
from bouncing_disk_ros.units import NS


def last_orbit(record: RunRecord) -> Orbit:
    """The orbit found since the platform's motion last changed."""
    rows = record.rows
    steady_since = record.motions[-1].end_ns / NS if record.motions else math.inf
    return orbit_of(rows[rows["time"] >= steady_since])


class Summary(NamedTuple):
    """Summary of a run; nan or None where nothing was received."""

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
    """Summary of a run: orbit, rotor speed, theory, energy, lateness.

    >>> summary_of(read_run("run_1")).orbit.name
    """
    motion = record.motion
    expected = period_one(motion, record.disk) if motion else None
    end = record.speeds[-1][0] if record.speeds else 0.0
    last = [speed for time, speed in record.speeds if time > end - SETTLED_SECONDS]
    health = record.health
    return Summary(
        impacts=int(record.rows["count"].sum()),
        lost=record.lost,
        orbit=last_orbit(record),
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


def _factor(health: list[HealthReport]) -> float:
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
