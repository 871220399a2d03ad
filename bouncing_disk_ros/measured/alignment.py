"""Times of hits from their common shape: weak hits are not told later than loud ones.

An onset is seen where a hit leaves the noise, and a weak hit leaves it late. So the logarithm of
the energy is compared with that of all hits together: the same shape, as loud as the hit, over the
noise before it. The likeliest shift is the time, and the width of the likelihood its error. Before
the hit the logarithm scatters as that of the energy of noise, in the hit as hits differ there.
A weak hit of a soft ball is late, because its contact lasts longer: its error holds that.
A clipped hit has another shape. What comes before is not clipped, so its onset tells its time.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
_BEFORE, _AFTER, _SHIFT = 1e-3, 2e-3, 1e-3
"""Of the shape, before and after an onset, and how far it is shifted, s."""
_FINER = 2
"""Shifts in a sample."""
_FEWEST = 3
"""Hits whose median is a shape."""
_ROUNDS = 2
_NOTHING = 1e-300
"""An energy that keeps a logarithm finite."""
_RISE = 0.01, 0.5
"""Parts of its largest energy between which the shape rises."""
_CONTACT = -0.1
"""Exponent of the energy in the length of a contact: that of the speed is -1/5 (Hertz)."""
_LEAST = 1e-3
"""Variance of what hits differ in: 0.14 dB, rounding to 8 bits makes more."""


def aligned(
    energy: Array, onsets: Array, errors: Array, noises: Array, is_clipped: NDArray[np.bool_],
    rate: float, window: int,
) -> tuple[Array, Array]:  # fmt: skip
    """Times of hits and their errors, in samples.

    `energy` of all samples; `onsets` with `errors`, and `noises`: mean energy before each. Where
    fewer than three hits are not clipped, onsets are the times. `window`: samples in which the
    energy is smoothed.
    """
    own = ~is_clipped
    if own.sum() < _FEWEST:
        return onsets, errors
    found, spreads = _shifted(energy, onsets[own], noises[own], rate, window)
    later = (found - onsets[own])[errors[own] <= np.median(errors[own])]
    times, errors = onsets + np.median(later), np.hypot(errors, np.std(later))
    times[own], errors[own] = found, spreads
    return times, errors


def _shifted(
    energy: Array, onsets: Array, noises: Array, rate: float, window: int
) -> tuple[Array, Array]:
    """Times of hits by the shape that they have, and their errors, in samples."""
    before, after, shift = (max(round(x * rate), 2) for x in (_BEFORE, _AFTER, _SHIFT))
    smooth = np.convolve(np.pad(energy, (0, window - 1)), np.full(window, 1.0 / window), "valid")
    places = np.arange(-before, after)
    shifts = np.arange(-shift * _FINER, shift * _FINER + 1) / _FINER
    long = np.arange(-before - shift - 1, after + shift + 1)
    times, errors = onsets.copy(), np.full(len(onsets), np.inf)
    for _ in range(_ROUNDS):
        whole = _sampled(smooth, times[:, None] + long)
        peaks = np.maximum(whole[:, (long >= 0) & (long < after)].mean(axis=1) - noises, _NOTHING)
        strong = peaks / noises >= np.median(peaks / noises)
        parts = (whole - noises[:, None])[strong] / peaks[strong, None]
        shape = np.maximum(np.median(parts, axis=0), 0.0)
        own = np.log(_sampled(smooth, times[:, None] + places) + _NOTHING)
        models = peaks[:, None] * np.interp(places, long, shape) + noises[:, None]
        rest, quiet = own - np.log(models), noises[:, None] / models
        differ = _differences(rest, quiet, window)
        free = _independent(rest / np.sqrt(_variance(quiet, differ)))
        shown = np.interp(places - shifts[:, None], long, shape)
        for i, (peak, noise) in enumerate(zip(peaks, noises, strict=True)):
            model = peak * shown + noise
            variance = _variance(noise / model, differ)
            squares = np.mean((own[i] - np.log(model)) ** 2 / variance, axis=1)
            sizes = np.mean(np.log(variance), axis=1)
            # a hit that is unlike the others has larger errors
            misfit = max(float(squares[np.argmin(squares + sizes)]), 1.0)
            costs = 0.5 * free * len(places) * (squares + sizes) / misfit
            best = shifts[np.argmin(costs)]
            weights = np.exp(costs.min() - costs)
            spread = float(weights @ (shifts - best) ** 2 / weights.sum())
            times[i] += best
            errors[i] = np.sqrt(spread + 1.0 / (12.0 * _FINER**2))
    return times, np.hypot(errors, _lateness(shape, np.maximum(peaks, noises)))


def _lateness(shape: Array, peaks: Array) -> Array:
    """Error of each hit because its contact lasts longer than that of the loudest one, in samples.

    The contact begins unheard. So the hit is late by some part of what its rise becomes longer, if
    the contact makes the rise: the root mean square of a part from none to all is 1/√3.
    """
    heard, risen = (int(np.argmax(shape >= part * shape.max())) for part in _RISE)
    longer = (peaks / peaks.max()) ** _CONTACT - 1.0
    return np.asarray((risen - heard) * longer / np.sqrt(3.0))


def _variance(quiet: Array, differ: Array) -> Array:
    """Of the logarithm of an energy; `quiet`: part of it that is noise.

    Of two degrees of freedom: π²/6 for noise alone, twice its part where it is small.
    """
    return np.asarray(quiet * (2.0 - (2.0 - np.pi**2 / 6.0) * quiet) + differ * (1.0 - quiet) ** 2)


def _differences(rest: Array, quiet: Array, window: int) -> Array:
    """Variance of the logarithm of what hits differ in, at each place of the shape."""
    loud = (1.0 - quiet) ** 2
    found = np.sum((rest**2 - _variance(quiet, np.zeros(1))) * loud, axis=0)
    found /= np.maximum(np.sum(loud**2, axis=0), _LEAST)
    smooth = np.pad(np.maximum(found, 0.0), window, "edge")
    mean = np.convolve(smooth, np.full(2 * window + 1, 1.0 / (2 * window + 1)), "valid")
    return np.asarray(np.maximum(mean, _LEAST))


def _independent(rest: Array) -> float:
    """Part of the samples that are independent, from the likeness of neighbours in rows."""
    likeness = float(np.sum(rest[:, 1:] * rest[:, :-1]) / np.sum(rest**2))
    return (1.0 - likeness) / (1.0 + likeness)


def _sampled(values: Array, at: Array) -> Array:
    return np.interp(at, np.arange(len(values)), values)
