"""What settled flights tell where they do not tell the parameters themselves.

Flights of n₁ and n₂ periods in turn, from phases τ₁ and τ₂ = τ₁ + 2πn₁ of the platform, with
r = (1 - ε)/(1 + ε) and q = (sin τ₂ - sin τ₁)/(2π): the sum and the difference of both impacts are

    r(n₁ + n₂)/Γ + q(1/n₁ - 1/n₂) = cos τ₁ + cos τ₂,
    (n₁ - n₂)/Γ + rq(1/n₁ + 1/n₂) = cos τ₁ - cos τ₂.

With n₁ = n₂ = n whole the first one is rn/Γ = cos τ, and the second one says nothing.
"""

from __future__ import annotations

import math

import numpy as np

from bouncing_disk_ros.distributions import t_probability
from bouncing_disk_ros.measured.profiles import LEVEL, Array, Interval, interval_text

_PHASES = 65
"""At which the extremes of cos τ over an interval of φ are looked for."""


def periods_of(times: Array, frequency: float) -> tuple[Array, float]:
    """Periods a flight, [n] or [n₁, n₂] in turn, and how far (rms) times are from such flights, s.

    Two where the times tell an alternation: by t, at the level of the intervals.
    """
    k = np.arange(len(times))
    columns = np.column_stack([np.ones(len(k)), k, 0.5 * (-1.0) ** k])
    degrees = len(k) - 3
    found = np.linalg.lstsq(columns, times, rcond=None)[0]
    rms = float(np.sqrt(np.mean((times - columns @ found) ** 2)))
    if degrees > 0:
        error = 2.0 * rms / math.sqrt(degrees)
        if t_probability(degrees, abs(found[2]) / max(error, 1e-300)) > 0.5 + 0.5 * LEVEL:
            return frequency * (found[1] + found[2] * np.array([-1.0, 1.0])), rms
    found = np.polyfit(k, times, 1)
    rms = float(np.sqrt(np.mean((times - np.polyval(found, k)) ** 2)))
    return np.array([frequency * found[0]]), rms


def told_by(times: Array, frequency: float, phase: Interval | None) -> str:
    """The relations in words, Hz; with the phase of a reference also the mean of cos τ."""
    periods, rms = periods_of(times, frequency)
    first, last = periods[0], periods[-1]
    steady = f"to {100.0 * rms / np.diff(times).mean():.2g} % of a flight"
    if len(periods) == 1:
        text = f"n(1 − ε)/((1 + ε)Γ) = cos τ, if n = {first:.6g} periods a flight ({steady})"
    else:
        text = (
            "r(n₁ + n₂)/Γ + q(1/n₁ − 1/n₂) = cos τ₁ + cos τ₂ and "
            "(n₁ − n₂)/Γ + rq(1/n₁ + 1/n₂) = cos τ₁ − cos τ₂ "
            "with r = (1 − ε)/(1 + ε), q = (sin τ₂ − sin τ₁)/(2π), τ₂ = τ₁ + 2πn₁, "
            f"if flights of n₁ = {first:.6g} and n₂ = {last:.6g} periods alternate ({steady})"
        )
    if phase is None:
        return text
    angles = math.tau * frequency * times[:, None]
    at = np.concatenate([[phase.value], np.linspace(phase.low, phase.high, _PHASES)])
    sides = np.cos(angles + at).mean(axis=0)
    return f"{text}; mean of cos τ = {interval_text(Interval(sides[0], sides.min(), sides.max()))}"
