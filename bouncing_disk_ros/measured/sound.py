"""`impact_times`: the hits in a sound of impacts, with the error of each.

A hit rises above the sound before it: the energy of a short window over the mean energy of a long
one before, in the band where hits are louder than the noise. Those that sound alike are hits
(`similar_sounds`), the others are not. Its onset is where the variance changes, by Akaike's
criterion (Maeda, "A method for reading and checking phase times in autoprocessing system of seismic
wave data", Zisin 1985), and is told better by the shape that all hits have (`alignment`).
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.distributions import chi_square_quantile, normal_quantile
from bouncing_disk_ros.errors import InputError, MissingLibraryError
from bouncing_disk_ros.folders import user_path
from bouncing_disk_ros.measured.alignment import aligned
from bouncing_disk_ros.measured.echoes import without_echoes
from bouncing_disk_ros.measured.filters import filtered, highest, running_maximum, spectra
from bouncing_disk_ros.measured.similar_sounds import UNEVEN, alike, single
from bouncing_disk_ros.parameters import DEFAULTS

Array = NDArray[np.float64]
SUFFIXES = {
    ".wav", ".wave", ".flac", ".ogg", ".oga", ".opus", ".mp3", ".aif", ".aiff", ".au", ".caf",
    ".m4a", ".mp4", ".aac", ".3gp", ".mov", ".wma", ".webm", ".mkv", ".amr",
}  # fmt: skip
"""Names of sound files end so; the second line is refused with the way to convert them."""
MOST_SAMPLES = 1 << 24
"""Of all channels: six minutes at 48 kHz."""
_BITS = {"PCM_U8": 8, "PCM_S8": 8, "ULAW": 8, "ALAW": 8, "PCM_24": 24, "PCM_32": 24}
"""Of formats that are not 16 bits deep; floats are as deep as 24."""
_DEEPEST = 1e-5
"""Noise of a file that has none, part of its peak: no microphone has 100 dB."""
_FALSE = 0.01
"""False hits in a recording of Gaussian noise alone."""
_RATIO = 50.0
"""Windows are so long that noise reaches no more. Hits of 20 dB must be found: a tone whose peak is
ten times the rms of the noise has 50 times its energy."""
_SHORTEST = 0.005
"""Of the long window, s: the tail of a hit is no noise, it beats and is reflected."""
_LOW = 0.25
"""Quantile of the energy that tells the noise: hits and their tails are above it."""
_QUIET, _HUM = 0.1, 0.02
"""So much of the time has no hit within a period of the mains, s: its mean energy is noise too."""
_FRAMES = 128.0
"""Of a spectrum, 1/s: hits are about as long."""
_SKIRT = 0.01
"""Of the signal over the noise at its best frequency: what is below is out of the band. Chosen, and
tried on made sounds."""
_ONSET = 0.01
"""Part of its peak where a hit begins, if the noise is lower: the same part for all loud hits."""
_RISE = 2
"""Times in which a hit rises: its onset is so close before its peak. Tried: 1 loses onsets, 2 to 5
differ little; far from the peak a change of the noise can be taken for the onset."""
_EARLIER = 0.75
"""Part of the sound before an onset that tells the noise: nothing of the hit is in it."""
_LIKELY = float(-np.log(0.01))
"""Evidence of flights that hits of no law have once in a hundred recordings, at most."""
_SHRINKS = 0.98
"""Restitution of flights, at most: beyond it they are equal, as the ticks of a clock. Chosen."""
_APART = 0.02
"""So close, s, two sounds are parts of one impact: a codec spreads it. Chosen, not tried."""
_CUT = 4
"""Samples at the largest value of a file that is clipped: one crest of a tone has fewer, unless it
is rounded to a few bits. Chosen, not tried."""
_HIT = 3e-3
"""From an onset on, s: where a clipped sample changes the shape of a hit."""
_ORDER = 32
"""Samples that a prediction of the noise looks back."""
_CURVE = 4000
"""Points of the curve for pictures."""


@dataclass(frozen=True)
class ImpactSound:
    """Hits of a sound. Times in s from the begin of the file.

    `times` and `errors` (one standard deviation) of the hits, `levels`: peak over the sound before,
    dB. All times have one common delay. `rejected`: times of what came after louder hits at the
    same delay each time (echoes). `unlike`: times of sudden sounds that do not sound like the hits.
    `band`: where the hits are louder than the noise, Hz. `rate`: samples per s. `curve`: times and
    levels (dB of the loudest) of the sound in its band, two rows.
    """

    name: str
    times: Array
    errors: Array
    levels: Array
    rejected: Array
    unlike: Array
    band: tuple[float, float]
    rate: float
    curve: Array


def impact_times(file: str | Path) -> ImpactSound:
    """The hits in a sound file: WAV, FLAC, OGG or MP3; of several channels the clearest.

    Raises InputError for a file that is no sound, or has no hits.

    >>> fit_impacts(impact_times("drop.wav").times)
    """
    path = user_path(file)
    samples, rate, least = _samples(path)
    found = [_heard(path.name, one, rate, least) for one in samples.T]
    best = max(found, key=lambda one: float(one.levels.sum()) if one else 0.0)
    if best is None or not len(best.times):
        raise InputError("recording", path.name, "a sound of impacts", "No hits stand out in it.")
    return best


def _samples(path: Path) -> tuple[Array, float, float]:
    """Samples (N, channels), their rate, and the noise of their rounding."""
    try:
        import soundfile
    except ModuleNotFoundError as error:
        raise MissingLibraryError("recording", str(error.name)) from None
    if not path.is_file():
        raise InputError("recording", str(path), "a file", "There is no file of that name.")
    try:
        with soundfile.SoundFile(path) as sound:
            if sound.frames * sound.channels > MOST_SAMPLES:
                hint = f"Cut it: ffmpeg -i {path.name} -t 60 part.wav"
                allowed = f"up to {MOST_SAMPLES} samples"
                raise InputError("recording", f"{sound.frames} x {sound.channels}", allowed, hint)
            rate, kind = float(sound.samplerate), str(sound.subtype)
            samples: Any = sound.read(dtype="float64", always_2d=True)
    except (soundfile.LibsndfileError, OSError) as error:
        name = "converted.wav" if path.suffix == ".wav" else f"{path.stem}.wav"
        hint = f"Convert it: ffmpeg -i {path.name} {name} ({error})"
        raise InputError("recording", path.name, "a WAV, FLAC, OGG or MP3 file", hint) from None
    if not np.isfinite(samples).all():
        raise InputError("recording", path.name, "samples that are finite numbers")
    if len(samples) < rate * _SHORTEST * 10.0:
        given = f"{path.name} of {len(samples)} samples"
        raise InputError("recording", given, "a sound of impacts", "It is too short, or cut.")
    bits = 24 if kind in ("FLOAT", "DOUBLE") else _BITS.get(kind, 16)
    return samples, rate, float(2.0 ** (1 - bits) / np.sqrt(12.0))


def _heard(name: str, samples: Array, rate: float, least: float) -> ImpactSound | None:
    """The hits of one channel; None where nothing stands out."""
    clipped = _clipped(samples)
    samples = samples - samples.mean()
    samples = _whitened(samples, rate, max(least, _DEEPEST * float(np.abs(samples).max())))
    floor = max(least, _DEEPEST * float(np.abs(samples).max()))
    found = _band(samples, rate, floor)
    for _ in range(2):  # in the band of all that is loud, then in the band of the hits
        if found is None:
            return None
        low, high, loudest = found
        inside = filtered(samples, rate, low, high, 3)
        energies = _Energies(inside, rate, min(high, 0.5 * rate) - low, loudest, floor)
        peaks, ratios = energies.hits()
        sets = alike(samples, peaks, energies.short[peaks], rate, floor)
        if not sets:
            return None
        is_kind = _of_flights(sets, peaks / rate)
        found = _band(samples, rate, floor, peaks[is_kind])
    unlike, peaks, ratios = peaks[~is_kind] / rate, peaks[is_kind], ratios[is_kind]
    is_hit = without_echoes(peaks, energies.short, energies.near, energies.noise, rate)
    # in its own band a hit rises slowly, and a loud one leaves the noise earlier than a weak one
    wide = filtered(samples, rate, 0.5 * low, 2.0 * high, 2)
    # as many samples are independent as the wider band has degrees of freedom
    part = min(1.0, 2.0 * (2.0 * high - 0.5 * low) / rate)
    previous = np.concatenate([[0], peaks[:-1]])[is_hit]
    hits = [
        _onset(wide, earlier, peak, energies, part)
        for earlier, peak in zip(previous, peaks[is_hit], strict=True)
    ]
    onsets, errors, noises = np.array(hits).reshape(-1, 3).T
    ends = np.searchsorted(clipped, onsets + _HIT * rate)
    is_clipped = ends > np.searchsorted(clipped, onsets)
    onsets, errors = aligned(
        wide**2, onsets, errors, noises + floor**2, is_clipped, rate, energies.window
    )
    levels = energies.short[peaks[is_hit]]
    is_own = single(np.ones(len(onsets), bool), onsets, levels, energies.near)
    return ImpactSound(
        name, onsets[is_own] / rate, errors[is_own] / rate, 10.0 * np.log10(ratios[is_hit][is_own]),
        peaks[~is_hit] / rate, unlike, (low, high), rate, _curve(energies.short, rate),
    )  # fmt: skip


def _of_flights(
    sets: list[tuple[NDArray[np.bool_], NDArray[np.bool_]]], times: Array
) -> NDArray[np.bool_]:
    """The set with the likeliest flights on a platform at rest; where none has any, the first.

    Sounds of its wider set are added where the same flights land: a ball can sound different at low
    speed.
    """
    if len(sets) == 1 and not (sets[0][1] & ~sets[0][0]).any():
        return sets[0][0]
    from bouncing_disk_ros.measured.kernels.rest_laws import RESTITUTION, SLOPE
    from bouncing_disk_ros.measured.sequence import at_rest  # kernels, which take time to load

    gravity = float(DEFAULTS["gravity"])

    def evidence(one: NDArray[np.bool_]) -> float:
        if one.sum() < 3:
            return 0.0
        chain = at_rest(times[one], gravity, least=_LIKELY)
        flights, p = np.diff(times[one][chain.kept]), chain.parameters
        shrinks = len(flights) and p[RESTITUTION] - p[SLOPE] * 0.5 * gravity * flights[0] < _SHRINKS
        return chain.evidence if shrinks else 0.0

    evidences = [evidence(one) for one, _ in sets]
    best = int(np.argmax(np.maximum(evidences, _LIKELY)))
    found, wider = sets[best]
    if not evidences[best] > _LIKELY:
        return found
    is_apart = np.abs(times[:, None] - times[found]).min(axis=1) > _APART
    both = np.flatnonzero(found | (wider & is_apart))
    chain = at_rest(times[both], gravity, least=evidences[best] + _LIKELY)
    found[both[chain.kept]] = True  # none, if it is not likelier
    return found


def _clipped(samples: Array) -> NDArray[np.intp]:
    """The samples that are cut at a limit: as many as this have the same extreme value."""
    is_cut = np.zeros(len(samples), bool)
    for limit in (samples.min(), samples.max()):
        at_limit = samples == limit
        if at_limit.sum() >= _CUT:
            is_cut |= at_limit
    return np.flatnonzero(is_cut)


def _whitened(samples: Array, rate: float, floor: float) -> Array:
    """The samples after a filter that makes their noise white: that of its linear prediction.

    Nothing comes before a hit, because the filter looks back only.
    """
    _, power = spectra(samples, rate, _FRAMES)
    noise = np.quantile(power, _LOW, axis=1) + 2.0 * floor**2 / rate
    noise = np.maximum(noise, UNEVEN * np.median(noise))
    lags = np.fft.irfft(noise)[: _ORDER + 1]
    places = np.arange(_ORDER)
    weights = np.linalg.solve(lags[np.abs(places[:, None] - places)], lags[1:])
    return np.convolve(samples, np.append(1.0, -weights))[: len(samples)]


def _band(
    samples: Array, rate: float, floor: float, hits: NDArray[np.intp] | None = None
) -> tuple[float, float, float] | None:
    """Ends of the band of the hits, and the frequency where they are clearest, Hz.

    The noise of each frequency is estimated from a low quantile over the frames. It was made white:
    where a quantile is below their median, a codec may leave no noise, or none in a part of the
    frames, and the median counts. But where a high quantile is below it too, the filter lowered the
    noise together with hum, and the high one counts. The hits are estimated from the mean logarithm
    over the frames that are louder than noise gets. A frequency belongs to the band where that mean
    is higher than the mean of noise gets.
    """
    at, power = spectra(samples, rate, _FRAMES)
    size = 2 * len(power) - 2  # of a frame; they overlap by half
    at, power = at[1:], power[1:] + 2.0 * floor**2 / rate
    noise = np.quantile(power, _LOW, axis=1) / -np.log1p(-_LOW)
    middle = np.median(noise)
    most = np.quantile(power, 1.0 - _LOW, axis=1) / -np.log(_LOW)
    noise = np.maximum(noise, np.clip(most, UNEVEN * middle, middle))
    over = power / noise[:, None]
    count, frames = over.shape
    loud = over.mean(axis=0) > chi_square_quantile(count, _FALSE / frames) / count
    if hits is not None:  # the frames in whose middle half they begin
        loud = np.zeros(frames, bool)
        places = np.round((hits - 0.5 * size) / (size // 2) + 0.25).astype(int)
        loud[np.clip(places, 0, frames - 1)] = True
    if not loud.any():
        return None
    clear = np.log(over[:, loud]).mean(axis=1)
    spread = np.pi / np.sqrt(6.0 * loud.sum())  # of a mean log of exponential variables
    least = -normal_quantile(_FALSE / count) * spread - np.euler_gamma
    best = int(np.argmax(clear))
    inside = clear > max(least, clear[best] + np.log(_SKIRT))
    inside[best] = True
    first = best - int(np.argmin(np.append(inside[best::-1], False))) + 1
    last = best + int(np.argmin(np.append(inside[best:], False))) - 1
    step = float(at[1] - at[0])
    return max(float(at[first]) - step, 0.5 * step), float(at[last]) + step, float(at[best])


class _Energies:
    """Energy of the filtered sound in short and long windows.

    `short[i]`: mean over a window of two degrees of freedom from sample i on. `near`: samples in
    which a hit rises. `noise`: its energy, without hits.
    """

    def __init__(
        self, filtered: Array, rate: float, width: float, loudest: float, floor: float
    ) -> None:
        count = len(filtered)
        rounding = floor**2 * min(2.0 * width / rate, 1.0)  # its part in the band
        self.total = np.concatenate([[0.0], np.cumsum(filtered**2 + rounding)])
        self.window = window = min(max(round(rate / width), 1), count // 4)
        self.short = (self.total[window:] - self.total[:-window]) / window
        chance = _FALSE * rate / (width * count)
        degrees = next(n for n in range(8, 4000) if _least_ratio(chance, n) < _RATIO)
        longest = max(0.5 * degrees / width, _SHORTEST, 2.0 / loudest)
        self.long = min(int(longest * rate) + 1, count // 4)
        self.least = _least_ratio(chance, 2.0 * width * self.long / rate)
        self.least_over_noise = -float(np.log(chance))
        hum = min(max(round(_HUM * rate), 1), count // 4)
        means = (self.total[hum:] - self.total[:-hum]) / hum
        quiet = float(np.quantile(self.short, _LOW)) / -float(np.log1p(-_LOW))
        self.noise = max(quiet, float(np.quantile(means, _QUIET)))
        self.near = max(window, round(rate / loudest))

    def hits(self) -> tuple[NDArray[np.intp], Array]:
        """Where the short energy of each hit is largest, and its ratio to the long one before."""
        before = np.full(len(self.short), np.inf)
        half = self.long // 2
        ends = np.arange(half, len(before))
        starts = np.maximum(ends - self.long, 0)
        before[half:] = (self.total[ends] - self.total[starts]) / (ends - starts)
        ahead = running_maximum(self.short, 0, half - 1)
        # a hit exceeds both, whose means have few and many degrees of freedom
        sure = np.maximum(self.least * before, self.least_over_noise * self.noise)
        ratio = ahead / np.maximum(before, self.noise)
        at = highest(ahead / sure, 1.0, half)
        peaks: list[tuple[int, float]] = []
        for i in at:
            peak = int(i + np.argmax(self.short[i : i + half + 1]))
            if not peaks or peak - peaks[-1][0] > half:
                peaks.append((peak, ratio[i]))
            elif self.short[peak] > self.short[peaks[-1][0]]:
                peaks[-1] = (peak, ratio[i])
        rows = np.array(peaks).reshape(-1, 2)
        return rows[:, 0].astype(np.intp), rows[:, 1]


def _least_ratio(chance: float, degrees: float) -> float:
    """Ratio of two variances that chance exceeds so often: the first has two degrees of freedom."""
    return 0.5 * degrees * float(chance ** (-2.0 / degrees) - 1.0)


def _onset(
    filtered: Array, previous: int, peak: int, energies: _Energies, part: float
) -> tuple[float, float, float]:
    """Onset of a hit and its error, in samples, and the mean energy before it.

    Two Gaussian variances, one before and one after; the mean and the spread of the onset under
    the weights of Akaike's criterion. `previous`: peak before it, which is no noise. `part`: of
    the samples are independent.
    """
    begin = max(peak - energies.long // 2, previous)  # the energy of a clipped hit peaks late
    loud = begin + int(np.argmax(energies.short[begin : peak + 1] >= 0.5 * energies.short[peak]))
    first = max(loud - energies.long - _RISE * energies.near, previous)
    end = peak + len(filtered) - len(energies.short) + 1
    sums = np.cumsum(filtered[first:end] ** 2)
    before = np.arange(1, len(sums))
    floor = _ONSET**2 * energies.short[peak]
    one = sums[:-1] / before + floor
    two = (sums[-1] - sums[:-1]) / (len(sums) - before) + floor
    cost = part * (before * np.log(one) + (len(sums) - before) * np.log(two))
    cost[: max(loud - first - _RISE * energies.near, 0)] = np.inf
    weights = np.exp(-0.5 * (cost - cost.min()))
    weights /= weights.sum()
    mean = float(weights @ before)
    error = float(np.sqrt(weights @ (before - mean) ** 2 + 1.0 / 12.0))
    earlier = max(int(_EARLIER * mean), 1)
    return first + mean, error, float(sums[earlier - 1]) / earlier


def _curve(short: Array, rate: float) -> Array:
    """Largest energies of equal parts, in dB of the largest of all."""
    size = -(-len(short) // _CURVE)
    whole = np.pad(short, (0, -len(short) % size), constant_values=short.min())
    largest = whole.reshape(-1, size).max(axis=1)
    times = (np.arange(len(largest)) + 0.5) * size / rate
    return np.array([times, 10.0 * np.log10(largest / short.max())])
