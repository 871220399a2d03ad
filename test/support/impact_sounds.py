"""Sounds of impacts that tests make, with true times: hits, echoes, noise, hum and clipping."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Sound:
    """Samples at a rate (Hz), true onsets (s), and how far each hit is above its background (dB).

    The background of a hit is the rms, over 10 ms before it, of noise and tails of earlier hits.
    """

    samples: Array
    rate: float
    times: Array
    decibels: Array


def drop_times(
    rng: np.random.Generator, restitution: float, first: float, least: float, most: int = 60
) -> Array:
    """Times of the impacts of a drop until a flight is shorter than `least`, s."""
    flights = first * restitution ** np.arange(most)
    flights = flights[flights >= least]
    return rng.uniform(0.2, 0.4) + np.concatenate([[0.0], np.cumsum(flights)])


def tone(since: Array, frequency: float, decay: float) -> Array:
    """A decaying tone that begins at 0."""
    s = np.maximum(since, 0.0)
    return np.exp(-s / decay) * np.sin(math.tau * frequency * s)


def sound_of(
    rng: np.random.Generator, times: Array, levels: Array, *, rate: float, frequency: float,
    decay: float, noise: float, reverberation: float = 0.0, echoes: int = 0, hum: float = 0.0,
    clip: float = math.inf, after: float = 0.3,
) -> Sound:  # fmt: skip
    """Hits at `times` (s) with peaks `levels` (parts of the loudest).

    `frequency` (Hz) and `decay` (s) of the tone; `noise`: rms, part of the loudest peak;
    `reverberation`: time in which the room falls by 60 dB, s, with that many single `echoes`;
    `hum`: amplitude at 50 Hz and its harmonics; `clip`: where the samples are cut.
    """
    count = round((times[-1] + after) * rate)
    at = np.arange(count) / rate
    peak = float(np.abs(tone(np.arange(0, 5 * decay, 1e-6), frequency, decay)).max())
    response = _room(rng, rate, reverberation, echoes)
    clean, backs = np.zeros(count), []
    width = round(0.01 * rate)
    tail = round((12.0 * decay) * rate)
    noises = noise * rng.standard_normal(count)
    for time, level in zip(times, levels, strict=True):
        i = math.ceil(time * rate)
        backs.append((clean + noises)[max(i - width, 0) : i].copy())
        end = min(i + tail, count)
        dry = level / peak * tone(at[i:end] - time, frequency, decay)
        if len(response) > 1:
            wet = np.zeros(count - i)
            wet[: end - i] = dry
            wet = _convolved(wet, response)
            clean[i:] += wet
        else:
            clean[i:end] += dry
    rms = np.array([math.sqrt(float(np.mean(back**2)) + 1e-30) for back in backs])
    buzz = sum(
        hum / k * np.sin(math.tau * 50.0 * k * at + rng.uniform(0.0, math.tau))
        for k in (1, 2, 3, 5)
    )
    samples = np.clip(clean + noises + buzz, -clip, clip)
    return Sound(samples, rate, times, 20.0 * np.log10(levels / rms))


def _room(rng: np.random.Generator, rate: float, time: float, echoes: int) -> Array:
    """Impulse response: direct sound, single echoes, and a diffuse tail that falls by 60 dB."""
    if time == 0.0:
        return np.ones(1)
    response = np.zeros(round(time * rate))
    at = np.arange(len(response)) / rate
    fall = 10.0 ** (-3.0 * at / time)
    diffuse = rng.standard_normal(len(response)) * fall
    diffuse[: round(0.02 * rate)] = 0.0
    response += 0.1 * diffuse / math.sqrt(float(np.sum(diffuse**2)) + 1e-30)
    for delay in rng.uniform(0.002, 0.5 * time, echoes):
        response[round(delay * rate)] += rng.uniform(0.1, 0.5) * 10.0 ** (-3.0 * delay / time)
    response[0] = 1.0
    return response


def _convolved(signal: Array, response: Array) -> Array:
    size = 1 << (len(signal) + len(response) - 1).bit_length()
    spectrum = np.fft.rfft(signal, size) * np.fft.rfft(response, size)
    return np.asarray(np.fft.irfft(spectrum, size)[: len(signal)])


def random_drop(rng: np.random.Generator) -> tuple[Sound, float]:
    """A drop in a random room with a random microphone, and the frequency of its tone, Hz."""
    rate = float(rng.choice([8000, 16000, 22050, 44100, 48000, 96000]))
    highest = min(0.4 * rate, 12000.0)
    frequency = float(np.exp(rng.uniform(math.log(300.0), math.log(highest))))
    decay = max(float(np.exp(rng.uniform(math.log(5e-4), math.log(8e-3)))), 1.0 / frequency)
    restitution = rng.uniform(0.55, 0.93)
    times = drop_times(rng, restitution, 0.45, max(0.02, 8.0 * decay))
    levels = np.maximum(restitution ** (rng.uniform(1.0, 1.5) * np.arange(len(times))), 1e-3)
    noise = float(10.0 ** rng.uniform(-3.0, -1.0))
    room = rng.random() < 0.5
    sound = sound_of(
        rng, times, levels, rate=rate, frequency=frequency, decay=decay, noise=noise,
        reverberation=rng.uniform(0.1, 0.5) if room else 0.0,
        echoes=int(rng.integers(0, 4)) if room else 0,
        hum=rng.choice([0.0, 0.3 * noise, 0.1 if frequency > 2000.0 else 0.0]),  # out of its band
        clip=rng.uniform(0.3, 0.9) if rng.random() < 0.3 else math.inf,
    )  # fmt: skip
    return sound, frequency
