"""Which of the sudden sounds in a recording are hits: those that sound alike.

One ball on one plate makes the same sound at each impact, louder or softer: the same frequencies
rise at the same instant, and fade as fast. A voice, a bump or a hand does not. Compared are the
amplitudes over frequency, and over the first hundredth of a second, that come on top of what was
heard before, in units of the noise. Their cosine is 1 for sounds that differ in loudness alone.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
_WINDOW = 0.004
"""Of a spectrum, s: about as long as a hit."""
_STEP = 0.25
"""Between spectra, in windows."""
_ATTACK, _FADES = 4, ((6, 11), (10, 19))
"""Spectra of the attack, and from where to where the fading of a hit is heard, in steps."""
_BEFORE = 4, 28
"""The spectra before a hit: two periods of a low voice, so that its pulses are no news."""
_EARLIER, _LATER = 10, 2
"""A hit begins so many steps before, or after, its band is loudest: low tones rise slowly."""
_LOWEST = 300.0
"""End of the first band, Hz; the others are thirds of an octave."""
_LOUDNESS = 0.35
"""Exponent of the power: loud parts do not count for all (Stevens's law has 0.3)."""
_ALIKE = 0.9
"""Cosine of sounds that are alike: their differences have less than a fifth of the energy. Where as
many hits are lost as others are taken: on made sounds 2 % of the hits had less, and 1 % of voices
and bumps had more."""
_MOST_NOISE = 1.0 / 3.0
"""Noise is unlike the hits: so much of the energy of a hit may be noise. Chosen, not tried."""
_PLACES, _CALM = 50, 0.5
"""Places where nothing begins, mostly, and the quantile of their energies that tells the noise: the
median, because as many places may have too little noise (a gate, a codec) as too much (a voice). On
made sounds 0.3 missed more weak hits of plates, 0.7 took more of a voice for hits."""
_QUIET, _LOOKS = 0.1, 500
"""Quantile of the spectra that tells the noise, and how many spectra are looked at."""
UNEVEN = 0.1
"""Noise at any frequency, in parts of the median: codecs leave none where they hear none."""
_ROUNDS = 8
_SETS = 3
"""Sets of sounds that are alike: hits, a voice, and bumps. Chosen, not tried."""
_NEAREST, _NEXT = 7, 3
"""Numbers of hits whose median is the shape that a sound is compared with: for a set, and for its
wider set. Chosen: with three for both, parts of voices were taken for hits."""
_SAME = 5e-3
"""One minus the cosine of sounds that noise alone makes different: nearer ones count no more.
Chosen, not tried."""


def alike(
    samples: Array, peaks: NDArray[np.intp], loudest: Array, rate: float, floor: float
) -> list[tuple[NDArray[np.bool_], NDArray[np.bool_]]]:
    """Which of the sounds at `peaks` belong to each set that sounds alike, the clearest set first.

    A set counts by how alike its sounds are, and by how far they rise above the loudest that was
    heard just before, where they are loud. With each set comes a wider one, whose sounds are like
    the next ones in level: the sound of a ball may change with its speed. `loudest`: energy at each
    peak. `floor`: rms of the rounding.
    """
    if not len(peaks):
        return []
    spectra = _Spectra(samples, rate, floor)
    news, rises, begins = spectra.news(peaks)
    loudness = (1.0 + news) ** _LOUDNESS - 1.0
    attacks = loudness[:, : rises.shape[1]] + 1e-300
    rise = np.maximum(np.sum(rises * attacks, axis=1) / np.sum(attacks, axis=1), 0.0)
    energies = np.maximum(np.sum(loudness**2, axis=1), 1e-300)
    least = _ALIKE * np.sqrt(1.0 - np.minimum(spectra.quiet() / energies, _MOST_NOISE))
    shapes = loudness / np.maximum(np.linalg.norm(loudness, axis=1, keepdims=True), 1e-300)
    near = np.log((1.0 - _ALIKE) / np.maximum(1.0 - shapes @ shapes.T, _SAME))
    np.fill_diagonal(near, 0.0)
    counts = rise * (np.maximum(near, 0.0) @ rise + 1e-6)
    attack, heard = (n * _STEP * spectra.size for n in (_ATTACK, _BEFORE[1] + _FADES[-1][1]))

    def grown(kinds: Array, nearest: int) -> NDArray[np.bool_]:
        """The set of sounds like the first ones, like the median of these, and so on."""
        is_hit = np.zeros(len(peaks), bool)
        for _ in range(_ROUNDS):
            found = np.sum(shapes * kinds, axis=1) > least * np.linalg.norm(kinds, axis=1)
            is_louder = np.sum(rises * kinds[:, : rises.shape[1]], axis=1) > 0.0
            found = single(found, begins, loudest, attack)
            found = _clear(found, is_louder, begins, loudest, heard)
            if not found.any() or (found == is_hit).all():
                break
            is_hit, kinds = found, _kinds(shapes, np.log(loudest), found, nearest)
        return is_hit

    sets = list[tuple[NDArray[np.bool_], NDArray[np.bool_]]]()
    is_tried = counts <= 0.0
    for _ in range(_SETS):
        first = int(np.argmax(np.where(is_tried, -1.0, counts)))
        one = grown(np.tile(shapes[first], (len(shapes), 1)), _NEAREST)
        is_tried[first] = True
        if one.any() and not any(np.array_equal(one, other) for other, _ in sets):
            sets.append((one, grown(_kinds(shapes, np.log(loudest), one, _NEXT), _NEXT)))
            is_tried |= one
    return sets


def _kinds(shapes: Array, levels: Array, is_hit: NDArray[np.bool_], nearest: int) -> Array:
    """For each sound the median shape of the hits nearest in level: weak ones sound duller."""
    hits = np.flatnonzero(is_hit)
    away = np.abs(levels[:, None] - levels[hits])
    near = hits[np.argsort(away, axis=1, kind="stable")[:, :nearest]]
    return np.asarray(np.median(shapes[near], axis=1))


def single(
    is_hit: NDArray[np.bool_], begins: Array, levels: Array, attack: float
) -> NDArray[np.bool_]:
    """The hits without the weaker of two that begin in the time of one attack, or out of order."""
    hits = np.flatnonzero(is_hit)
    same = np.flatnonzero(np.diff(begins[hits]) < attack)
    found = is_hit.copy()
    found[hits[np.where(levels[hits[same]] < levels[hits[same + 1]], same, same + 1)]] = False
    return found


def _clear(
    is_hit: NDArray[np.bool_], is_louder: NDArray[np.bool_], begins: Array, levels: Array,
    before: float,
) -> NDArray[np.bool_]:  # fmt: skip
    """The hits that are louder than what was heard before, or weaker than a hit in that time.

    A pulse of a voice may sound like the hits, but the pulses before it are as loud.
    """
    found, last = np.zeros(len(is_hit), bool), -1
    for i in np.flatnonzero(is_hit):
        is_hidden = last >= 0 and begins[i] - begins[last] < before and levels[i] < levels[last]
        if is_louder[i] or is_hidden:
            found[i], last = True, int(i)
    return found


class _Spectra:
    """Powers in bands of short windows, and those of the noise."""

    def __init__(self, samples: Array, rate: float, floor: float) -> None:
        self.size = 2 ** round(np.log2(_WINDOW * rate))
        self.samples = np.pad(samples, (12 * self.size, 8 * self.size))
        self.window = np.hanning(self.size + 1)[:-1]
        self.floor = floor**2 * float(np.sum(self.window**2))
        step = rate / self.size
        thirds = _LOWEST * 2.0 ** (np.arange(-1, 30) / 3.0)
        edges = np.unique(np.ceil(thirds[thirds < 0.5 * rate] / step - 0.5).astype(int))
        self.edges = np.concatenate([[0], edges[edges > 1]])
        count = len(samples) - self.size
        middles = np.linspace(0.5 * self.size, count, min(_LOOKS, count)).astype(int)
        noise = np.quantile(self._powers(middles), _QUIET, axis=0)
        self.noise = np.maximum(noise, UNEVEN * np.median(noise))

    def news(self, peaks: NDArray[np.intp]) -> tuple[Array, Array, Array]:
        """Powers on top of those before, over the noise, rises (log) and begins (samples).

        A sound begins where it rises most.
        """
        first, last = -_EARLIER - _BEFORE[1], _LATER + _FADES[-1][1]
        steps = np.round(np.arange(first, last) * _STEP * self.size).astype(int)
        powers = self._powers(peaks[:, None] + steps)
        rows = np.arange(len(peaks))
        rises, begins = np.full((len(peaks), powers.shape[2]), -np.inf), np.zeros(len(peaks), int)
        gaps = np.diff(peaks, prepend=-self.size * _BEFORE[1]) / (_STEP * self.size)
        earliest = _BEFORE[1] + _EARLIER + _ATTACK - gaps  # a hit begins after the one before
        for begin in range(_BEFORE[1], _BEFORE[1] + _EARLIER + _LATER + 1):
            before = powers[:, begin - _BEFORE[1] : begin - _BEFORE[0] + 1].max(axis=1)
            attack = powers[:, begin : begin + _ATTACK].max(axis=1)
            rise = np.log(attack / before)
            better = (rise.mean(axis=1) > rises.mean(axis=1)) & (
                (begin >= earliest) | (begin == _BEFORE[1] + _EARLIER)
            )
            begins[better], rises[better] = begin, rise[better]

        def mean(part: tuple[int, int]) -> Array:
            places = begins[:, None] + np.arange(*part)
            return np.asarray(powers[rows[:, None], places].mean(axis=1))

        attack = powers[rows[:, None], begins[:, None] + np.arange(_ATTACK)].max(axis=1)
        before = mean((-_BEFORE[1], 1 - _BEFORE[0]))
        parts = [attack, *(mean(part) for part in _FADES)]
        news = np.hstack([np.maximum(part - before, 0.0) / self.noise for part in parts])
        starts = peaks + (begins - _BEFORE[1] - _EARLIER) * _STEP * self.size
        return news, rises, starts

    def quiet(self) -> float:
        """Sum of the squared loudnesses where nothing begins: that of noise."""
        count = len(self.samples) - 20 * self.size
        places = np.linspace(0, count, _PLACES + 2).astype(int)[1:-1]
        loudness = (1.0 + self.news(places)[0]) ** _LOUDNESS - 1.0
        return float(np.quantile(np.sum(loudness**2, axis=1), _CALM))

    def _powers(self, middles: NDArray[np.intp]) -> Array:
        first = np.clip(middles + 12 * self.size - self.size // 2, 0, len(self.samples) - self.size)
        pieces = np.lib.stride_tricks.sliding_window_view(self.samples, self.size)[first]
        power = np.abs(np.fft.rfft(pieces * self.window)) ** 2 + self.floor
        lengths = np.diff(np.append(self.edges, power.shape[-1]))
        return np.asarray(np.add.reduceat(power, self.edges, axis=-1) / lengths)
