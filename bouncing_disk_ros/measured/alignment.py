"""Times of hits from their common shape: weak hits are not told later than loud ones.

An onset is seen where a hit leaves the noise, and a weak hit leaves it late. So the logarithm of
the energy is compared with that of all hits together: the same shape, as loud as the hit, over the
noise before it. The shift with the least squares is the time. Its error follows from the squares,
because what hits differ in is in them.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
_BEFORE, _AFTER, _SHIFT = 1e-3, 2e-3, 1e-3
"""Of the shape, before and after an onset, and how far it is shifted, s."""
_FINER = 2
"""Shifts in a sample."""
FEWEST = 3
"""Hits whose median is a shape."""
_ROUNDS = 2


def aligned(
    energy: Array, onsets: Array, noises: Array, rate: float, window: int
) -> tuple[Array, Array]:
    """Times of hits and their errors, in samples.

    `energy` of all samples; `onsets`, and `noises`: mean energy before each. `window`: samples in
    which the energy is smoothed.
    """
    before, after, shift = (max(round(x * rate), 2) for x in (_BEFORE, _AFTER, _SHIFT))
    smooth = np.convolve(np.pad(energy, (0, window - 1)), np.full(window, 1.0 / window), "valid")
    places = np.arange(-before, after)
    shifts = np.arange(-shift * _FINER, shift * _FINER + 1) / _FINER
    long = np.arange(-before - shift - 1, after + shift + 1)
    times, errors = onsets.copy(), np.full(len(onsets), np.inf)
    for _ in range(_ROUNDS):
        whole = _sampled(smooth, times[:, None] + long)
        peaks = np.maximum(whole[:, (long >= 0) & (long < after)].mean(axis=1) - noises, 0.0)
        strong = peaks / noises >= np.median(peaks / noises)
        parts = (whole - noises[:, None])[strong] / peaks[strong, None]
        shape = np.maximum(np.median(parts, axis=0), 0.0)
        shown = np.interp(places - shifts[:, None], long, shape)
        own = np.log(_sampled(smooth, times[:, None] + places) + 1e-300)
        models = [np.log(peak * shown + noise) for peak, noise in zip(peaks, noises, strict=True)]
        squares = np.array(
            [np.mean((x - y) ** 2, axis=1) for x, y in zip(own, models, strict=True)]
        )
        best = squares.argmin(axis=1)
        rest = own - np.array([one[at] for one, at in zip(models, best, strict=True)])
        free = len(places) * _independent(rest)
        costs = 0.5 * free * np.log(squares / squares.min(axis=1, keepdims=True))
        weights = np.exp(-costs)
        weights /= weights.sum(axis=1, keepdims=True)
        times += shifts[best]
        spread = np.sum(weights * (shifts - shifts[best, None]) ** 2, axis=1)
        errors = np.sqrt(spread + 1.0 / (12.0 * _FINER**2))
    return times, errors


def _independent(rest: Array) -> float:
    """Part of the samples that are independent, from the likeness of neighbours in rows."""
    likeness = float(np.sum(rest[:, 1:] * rest[:, :-1]) / np.sum(rest**2))
    return (1.0 - likeness) / (1.0 + likeness)


def _sampled(values: Array, at: Array) -> Array:
    return np.interp(at, np.arange(len(values)), values)
