"""Echoes among the hits of a sound: what follows louder hits at the same delay each time."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.measured.filters import running_maximum

Array = NDArray[np.float64]
# All of these are chosen, and tried on made sounds only: _SHARE from 0.5 to 0.75 made no clear
# difference, _FEWEST = 3 left four times as many echoes. For the others nothing else was tried.
_LONGEST = 0.5
"""Delay of an echo, s: a wall at 85 m."""
_WEAKER = 2.0
"""An echo has so much less energy than its hit."""
_ALIKE = 4.0
"""Energies of the echoes of several hits, relative to these, differ by no more."""
_VISIBLE = 4.0
"""Over the noise: where the echo of a hit can be seen or missed."""
_FEWEST = 2
"""Other hits with the same echo: one could be chance."""
_SHARE = 0.67
"""Of the hits whose echo could be seen have it."""


def without_echoes(
    peaks: NDArray[np.intp], energy: Array, near: int, noise: float, rate: float
) -> NDArray[np.bool_]:
    """Which hits are no echoes.

    A hit that follows a louder one is an echo if the sound is as loud at the same delay (within
    `near` samples) after most other hits whose echo could be seen. Only hits louder than itself
    count there: they are decided before it. Flights change from impact to impact. Where most of the
    hits that stay come at equal intervals, as on an orbit that has settled, nothing tells an echo
    from a weak impact, and all stay.
    """
    around = running_maximum(energy, near, near)
    levels = energy[peaks]
    is_hit = np.ones(len(peaks), bool)
    changed = True
    while changed:
        changed = False
        for j in np.argsort(-levels, kind="stable"):
            delays = peaks[j] - peaks
            louder = is_hit & (delays > 0) & (delays <= _LONGEST * rate)
            sources = np.flatnonzero(louder & (levels >= _WEAKER * levels[j]))
            if is_hit[j] and any(
                _is_echo(peaks, levels, is_hit, int(i), int(j), around, noise) for i in sources
            ):
                is_hit[j], changed = False, True
    intervals = np.diff(peaks[is_hit])
    if len(intervals) and np.mean(np.abs(intervals - np.median(intervals)) <= 2 * near) > 0.5:
        return np.ones(len(peaks), bool)
    return is_hit


def _is_echo(
    peaks: NDArray[np.intp], levels: Array, is_hit: NDArray[np.bool_], i: int, j: int,
    around: Array, noise: float,
) -> bool:  # fmt: skip
    """Whether hit j is an echo of hit i."""
    delay, part = peaks[j] - peaks[i], levels[j] / levels[i]
    others = (
        is_hit
        & (levels > levels[j])
        & (levels * part > _VISIBLE * noise)
        & (peaks + delay < len(around))
    )
    source = around[np.maximum(peaks - delay, 0)]
    others &= levels > _ALIKE * part * source  # else they may be its echoes themselves
    others[i] = False
    seen = around[peaks[others] + delay] > part / _ALIKE * levels[others]
    return bool(seen.sum() >= max(_FEWEST, _SHARE * len(seen)))
