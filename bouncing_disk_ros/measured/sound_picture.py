"""The hits of a sound as a picture, as lines of a terminal, and as a table."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from bouncing_disk_ros.errors import counted
from bouncing_disk_ros.measured.sound import ImpactSound
from bouncing_disk_ros.report.panel import Panel, Series, SeriesStyle, series
from bouncing_disk_ros.report.report_files import TABLE_MARK


def sound_panel(sound: ImpactSound, rejected: ArrayLike = ()) -> Panel:
    """Level of the sound over time with its hits; `rejected`: the times of those no flight has."""
    out = np.isin(sound.times, rejected)
    parts = [series("sound", sound.curve[0], sound.curve[1], SeriesStyle.LINE, 4)]
    for name, times, colour in (
        ("hits", sound.times[~out], 0),
        ("echoes", sound.rejected, 1),
        ("unlike the hits", sound.unlike, 3),
        ("hits that no flight reaches", sound.times[out], 5),
    ):
        if len(times):
            parts.append(_marks(sound, name, times, colour))
    title = f"Sound from {sound.band[0]:.0f} to {sound.band[1]:.0f} Hz"
    return Panel(title, "time, s", "level, dB of the loudest", parts)


def _marks(sound: ImpactSound, name: str, times: ArrayLike, colour: int) -> Series:
    """Marks on the curve, at the loudest of the parts that a hit rises in."""
    at, level = sound.curve
    place = np.minimum(np.searchsorted(at, times), len(at) - 1)
    heights = np.maximum.reduce([level[np.maximum(place - 1, 0)], level[place]])
    return series(name, times, heights, SeriesStyle.POINTS, colour)


def sound_lines(sound: ImpactSound) -> list[str]:
    """What was heard, in words."""
    low, high = 1e6 * sound.errors.min(), 1e6 * sound.errors.max()
    lines = [f"{counted(len(sound.times), 'hit')}, errors {low:.0f} to {high:.0f} µs"]
    for times, why in ((sound.rejected, "as echoes"), (sound.unlike, "because unlike the hits")):
        if len(times):
            shown = ", ".join(f"{t:.4f}" for t in times[:5])
            more = " ..." if len(times) > 5 else ""
            lines.append(f"{len(times)} rejected {why}, at {shown}{more} s")
    return lines


def sound_text(sound: ImpactSound) -> str:
    """A table with a line for each hit: time and error in s, level in dB."""
    rows = zip(sound.times, sound.errors, sound.levels, strict=True)
    lines = [f"{time:.7f},{error:.2e},{level:.1f}" for time, error, level in rows]
    return TABLE_MARK + "\n".join([*lines, ""])
