"""Sounds of struck plates: a second model of hits, rooms and noises, apart from `impact_sounds`.

A contact force of a half sine excites several modes at once. The room is a dense tail with a pause
before it, and walls that take the high notes. Noise is pink, or a voice that speaks in syllables.
"""

from __future__ import annotations

import math

import numpy as np
import scipy
from numpy.typing import NDArray

from support.impact_sounds import Sound, drop_times

Array = NDArray[np.float64]
_FINER = 16
"""Points of the struck plate's sound in a sample."""


def random_plate(rng: np.random.Generator) -> tuple[Sound, float]:
    """A drop on a plate in a random room, and the frequency of its loudest mode, Hz."""
    rate = float(rng.choice([16000, 44100, 48000, 96000]))
    lowest = float(np.exp(rng.uniform(math.log(400.0), math.log(0.15 * rate))))
    ratios = np.concatenate([[1.0], 1.0 + np.sort(rng.uniform(0.3, 3.0, int(rng.integers(1, 4))))])
    modes = lowest * ratios[lowest * ratios < 0.4 * rate]
    decay = float(np.exp(rng.uniform(math.log(1e-3), math.log(6e-3))))
    contact = float(rng.uniform(0.2, 0.7)) / modes[0]
    restitution = float(rng.uniform(0.6, 0.9))
    times = drop_times(rng, restitution, 0.4, max(0.025, 8.0 * decay))
    levels = restitution ** np.arange(len(times)) * 10.0 ** rng.uniform(-0.1, 0.1, len(times))
    one = _struck(rng, rate, modes, decay, contact)
    count = round((times[-1] + 0.4) * rate)
    clean = np.zeros(count)
    dry = _room(rng, rate) if rng.random() < 0.6 else np.ones(1)
    band = scipy.signal.butter(2, [0.6 * modes[0], min(1.6 * modes[-1], 0.49 * rate)], "bandpass",
                         fs=rate, output="sos")  # fmt: skip
    quiet = 10.0 ** rng.uniform(-3.0, -1.2)
    noises = quiet * (_pink(rng, count) if rng.random() < 0.6 else _voice(rng, count, rate))
    noises += rng.choice([0.0, 0.02]) * _hum(rng, count, rate)
    heard: list[tuple[int, Array]] = []
    for time, level in zip(times, levels, strict=True):
        first = math.ceil(time * rate)
        places = (np.arange(first, count) / rate - time) * rate * _FINER
        own = level * np.interp(places, np.arange(len(one)), one, right=0.0)
        own = scipy.signal.fftconvolve(own, dry)[: len(own)] if len(dry) > 1 else own
        heard.append((first, own))
    decibels = []
    for first, own in heard:
        before = scipy.signal.sosfiltfilt(band, clean + noises)[
            max(first - round(0.01 * rate), 0) : first
        ]
        hit = scipy.signal.sosfiltfilt(band, own[: round(0.05 * rate)])
        rms = math.sqrt(float(np.mean(before**2)) + 1e-30)
        decibels.append(20.0 * math.log10(float(np.abs(hit).max()) / rms))
        clean[first:] += own
    samples = clean + noises
    loudest = float(np.abs(samples).max())
    return Sound(samples / loudest, rate, times, np.array(decibels)), float(modes[0])


def _struck(
    rng: np.random.Generator, rate: float, modes: Array, decay: float, contact: float
) -> Array:
    """One hit on a grid finer than the samples, after the microphone's low pass; peak 1."""
    at = np.arange(0.0, 10.0 * decay + contact, 1.0 / (rate * _FINER))
    force = np.where(at < contact, np.sin(math.pi * at / contact), 0.0)
    rings = np.zeros(len(at))
    for i, mode in enumerate(modes):
        ring = np.exp(-at / (decay / (1.0 + i))) * np.sin(math.tau * mode * at)
        rings += rng.uniform(0.3, 1.0) / (1.0 + i) * ring
    low = scipy.signal.butter(3, 0.45 * rate, fs=rate * _FINER, output="sos")
    sound = scipy.signal.sosfilt(low, scipy.signal.fftconvolve(force, rings)[: len(at)])
    return np.asarray(sound / np.abs(sound).max())


def _room(rng: np.random.Generator, rate: float) -> Array:
    """Direct sound, a few walls, and from 15 ms on a tail whose high notes fall first."""
    time = rng.uniform(0.15, 0.6)
    at = np.arange(round(time * rate)) / rate
    tail = scipy.signal.lfilter([0.5], [1.0, -0.5], rng.laplace(size=len(at)))
    tail *= np.exp(-6.9 * at / time)
    tail[at < 0.015] = 0.0
    response = rng.uniform(0.02, 0.15) * tail / math.sqrt(float(np.sum(tail**2)))
    for _ in range(int(rng.integers(1, 6))):
        i = int(rng.uniform(0.003, 0.4 * time) * rate)
        response[i] += (
            rng.choice([-1.0, 1.0]) * rng.uniform(0.05, 0.4) * math.exp(-6.9 * at[i] / time)
        )
    response[0] = 1.0
    return np.asarray(response)


def _pink(rng: np.random.Generator, count: int) -> Array:
    """Noise of the same power in each octave, rms 1."""
    spectrum = rng.standard_normal(count // 2 + 1) + 1j * rng.standard_normal(count // 2 + 1)
    spectrum[1:] /= np.sqrt(np.arange(1, len(spectrum)))
    spectrum[0] = 0.0
    noise = np.fft.irfft(spectrum, count)
    return np.asarray(noise / np.std(noise))


def _voice(rng: np.random.Generator, count: int, rate: float) -> Array:
    """A hoarse voice: harmonics and breath below 3.5 kHz that swell and fade, rms 1."""
    at = np.arange(count) / rate
    pitch = 120.0 * (1.0 + 0.1 * np.sin(math.tau * 0.7 * at))
    phase = math.tau * np.cumsum(pitch) / rate
    buzz = sum(np.sin(n * phase + rng.uniform(0.0, 6.3)) / n for n in range(1, 25))
    mouth = scipy.signal.butter(2, [150.0, 3500.0], "bandpass", fs=rate, output="sos")
    sound = scipy.signal.sosfilt(mouth, buzz + 0.3 * rng.standard_normal(count))
    syllables = 0.05 + np.maximum(np.sin(math.tau * 4.0 * at + rng.uniform(0.0, 6.3)), 0.0) ** 2
    sound = sound * syllables
    return np.asarray(sound / np.std(sound))


def _hum(rng: np.random.Generator, count: int, rate: float) -> Array:
    """The mains at 60 Hz with odd harmonics, rms about 1."""
    at = np.arange(count) / rate
    parts = [
        np.sin(math.tau * 60.0 * n * at + rng.uniform(0.0, 6.3)) / n**1.5 for n in (1, 3, 5, 7)
    ]
    return np.asarray(sum(parts))
