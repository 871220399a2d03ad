"""Filters and spectra of sounds. NumPy alone: SciPy's module of signals takes a second to load."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
_TAPER = 0.125
"""Of a piece, at both ends: where its window rises and falls."""
_RING = 0.25
"""After the end of a sound, s: there the ringing of a filter fades, it must not reach the begin."""


def spectra(samples: Array, rate: float, pieces: float) -> tuple[Array, Array]:
    """Frequencies, Hz, and powers per Hz (frequencies, times) of pieces that overlap by half.

    About `pieces` of them are one second long; a piece has 32 samples at least.
    """
    size = min(2 ** max(5, round(np.log2(rate / pieces))), len(samples) // 8 * 2)
    cut = np.lib.stride_tricks.sliding_window_view(samples, size)[:: size // 2]
    edge = np.minimum(np.arange(size), size - np.arange(size)) / (_TAPER * size)
    window = 0.5 - 0.5 * np.cos(np.pi * np.minimum(edge, 1.0))
    power = np.abs(np.fft.rfft((cut - cut.mean(axis=1, keepdims=True)) * window)) ** 2
    at = rate / size * np.arange(size // 2 + 1)
    return at, 2.0 * power.T / (rate * float(np.sum(window**2)))


def filtered(samples: Array, rate: float, low: float, high: float, order: int) -> Array:
    """The samples in the band from low to high, Hz: Butterworth's filter.

    It is causal: nothing comes before a hit. Up to the highest frequencies it is a high pass.
    """
    size = 1 << (len(samples) + int(_RING * rate)).bit_length()
    turn = np.maximum(np.tan(np.pi / size * np.arange(size // 2 + 1)), 1e-9)
    first, last = np.tan(np.pi * low / rate), np.tan(np.pi * min(high / rate, 0.49))
    if high > 0.45 * rate:
        order, place = 2 * order, -first / turn
    else:
        place = (turn**2 - first * last) / (turn * (last - first))
    poles = np.exp(1j * np.pi * (0.5 + (np.arange(order) + 0.5) / order))
    response = 1.0 / np.polyval(np.poly(poles).real, 1j * place)
    return np.fft.irfft(np.fft.rfft(samples, size) * response, size)[: len(samples)]


def running_maximum(values: Array, before: int, after: int) -> Array:
    """The largest of each value, so many before it and so many after it, as far as there are any.

    From maxima of 1, 2, 4 ... values.
    """
    size, length = 1, before + after + 1
    found = np.pad(values, (before, after), constant_values=-np.inf)
    while 2 * size <= length:
        found = np.maximum(found[:-size], found[size:])
        size *= 2
    return np.maximum(found[: len(values)], found[length - size :][: len(values)])


def highest(values: Array, least: float, distance: int) -> NDArray[np.intp]:
    """Places of maxima that are at least so high, and the highest within the distance.

    The place of a maximum of several equal values is their middle.
    """
    first = np.append(0, np.flatnonzero(np.diff(values)) + 1)
    middle = (first + np.append(first[1:], len(values)) - 1) // 2
    steps = values[first]
    inner = np.flatnonzero((steps[1:-1] > steps[:-2]) & (steps[1:-1] > steps[2:])) + 1
    inner = inner[steps[inner] >= least]
    at = middle[inner]
    stays = np.ones(len(at), bool)
    starts, ends = np.searchsorted(at, at - distance, "right"), np.searchsorted(at, at + distance)
    for i in np.argsort(-steps[inner], kind="stable"):
        if stays[i]:
            stays[starts[i] : ends[i]] = False
            stays[i] = True
    return at[stays]
