"""Slow motion by strobe: samples at a slowly moving phase of a motion too fast to be seen."""

from __future__ import annotations

import math
from typing import NamedTuple

from bouncing_disk_ros.units import number_text, with_prefix

ENOUGH = 8
"""Samples in a period from which on a motion is seen as it is."""
SHOWN_SECONDS = 2.0
"""A period is stretched to this long."""


class Shown(NamedTuple):
    """How samples show a periodic motion: their phases advance by `step` periods each, |step| ≤ ½.

    `skipped`: whole periods between two samples; `seconds`: how long one period seems to take on
    the wall clock, inf where every sample has the same phase.
    """

    step: float
    skipped: int
    seconds: float

    @property
    def is_strobed(self) -> bool:
        """Whether periods lie between the samples."""
        return self.skipped > 0


def shown_motion(frequency: float, state_rate: float, real_time_factor: float) -> Shown:
    """What samples at a rate (Hz, simulated) show of a motion of a frequency (Hz)."""
    periods = frequency / state_rate
    skipped = round(periods)
    step = periods - skipped
    if abs(step) < 1e-9 * max(1.0, periods):  # the same phase, but for rounding
        return Shown(0.0, skipped, math.inf)
    factor = real_time_factor or 1.0
    return Shown(step, skipped, 1.0 / abs(step) / (state_rate * factor))


def strobe_rate(frequency: float, wanted_rate: float, real_time_factor: float = 1.0) -> float:
    """A state_rate near a wanted one (Hz) whose samples show one period in SHOWN_SECONDS.

    Samples come every n + 1/m periods, n whole and at least 1, m the samples in those seconds.
    Where the wanted rate has ENOUGH samples in a period, it is left as it is.
    """
    if frequency * ENOUGH <= wanted_rate:
        return wanted_rate
    skipped = max(1, round(frequency / wanted_rate))
    samples = max(ENOUGH, round(frequency / skipped * (real_time_factor or 1.0) * SHOWN_SECONDS))
    return frequency / (skipped + 1.0 / samples)


def text_of(shown: Shown, frequency: float) -> str:
    """What the page says of it."""
    rate = with_prefix(frequency, "Hz", 6)
    if not shown.is_strobed:
        if abs(shown.step) > 0.25:
            return f"about {1 / abs(shown.step):.1f} samples in each period of {rate}"
        return ""
    if math.isinf(shown.seconds):
        return (
            f"strobed: {shown.skipped} periods of {rate} between samples, always at the "
            "same phase: it seems to stand"
        )
    backward = "" if shown.step > 0 else ", backward"
    return (
        f"strobed slow motion: {shown.skipped} periods of {rate} lie between samples whose "
        f"phase moves on by 1/{1 / abs(shown.step):.0f}; one period is seen in "
        f"{number_text(shown.seconds, 3)} s{backward}"
    )
