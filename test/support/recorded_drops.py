"""Sounds as a phone records them: balls of several kinds dropped on tables, with what goes with it.

A voice before the drop, bumps of handling, a room, an automatic gain, a ball that rolls at the end
or is caught. A third model of hits, apart from `impact_sounds` and `struck_plates`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from support.impact_sounds import Sound

Array = NDArray[np.float64]
Generator = np.random.Generator
_FINER = 8
"""Points of one hit in a sample."""


@dataclass(frozen=True)
class Ball:
    """Restitution from, to; contact at 1 m/s (s) from, to; own tone (Hz) from, to (0: none)."""

    restitution: tuple[float, float]
    contact: tuple[float, float]
    tone: tuple[float, float]


BALLS = {
    "steel": Ball((0.55, 0.9), (8e-5, 2.5e-4), (0.0, 0.0)),
    "glass": Ball((0.6, 0.92), (8e-5, 2e-4), (0.0, 0.0)),
    "table tennis": Ball((0.82, 0.92), (6e-4, 1e-3), (5000.0, 9000.0)),
    "golf": Ball((0.65, 0.85), (3e-4, 6e-4), (2500.0, 4000.0)),
    "rubber": Ball((0.7, 0.9), (1.5e-3, 4e-3), (0.0, 0.0)),
}


def random_recording(rng: Generator) -> tuple[Sound, float]:
    """A random drop, recorded by a random phone in a random room; its table's lowest tone, Hz."""
    rate = float(rng.choice([44100, 48000, 48000, 16000, 96000], p=[0.4, 0.25, 0.25, 0.05, 0.05]))
    ball = BALLS[str(rng.choice(list(BALLS)))]
    restitution = float(rng.uniform(*ball.restitution))
    scatter = float(rng.choice([0.0, 0.002, 0.005]))
    start = rng.uniform(0.5, 2.5)
    times, speeds = _impacts(rng, restitution, scatter, start)
    count = round((times[-1] + rng.uniform(0.3, 1.5)) * rate)
    clean, heard = _hits(rng, ball, times, speeds, rate, count)
    room = _room(rng, rate) if rng.random() < 0.8 else np.ones(1)
    loudest = float(np.abs(clean).max())
    clean = scipy.signal.fftconvolve(clean / loudest, room)[:count]
    other = 10.0 ** rng.uniform(-3.7, -2.0) * _coloured(rng, count)
    other += rng.choice([0.0, 3e-3, 0.02]) * _hum(rng, count, rate)
    other += _beside(rng, times, count, rate, room)
    decibels = _decibels(clean, other, heard, rate)
    samples = clean + other
    if rng.random() < 0.5:
        samples = _gained(samples, rate, rng)
    samples = samples / np.abs(samples).max()
    if rng.random() < 0.25:
        limit = rng.uniform(0.3, 0.9)
        samples = np.clip(samples, -limit, limit)
    return Sound(samples, rate, times, decibels), 300.0


HARD = "steel", "glass", "golf", "table tennis"


def noiseless_drop(rng: Generator, kinds: tuple[str, ...] = HARD) -> Sound:
    """A drop of a ball in a room without noise."""
    rate, restitution, start = 48000.0, rng.uniform(0.6, 0.9), rng.uniform(0.5, 1.5)
    speed = math.sqrt(2.0 * 9.81 * rng.uniform(0.2, 0.5))
    count = math.ceil(math.log(0.03 * 9.81 / (2.0 * speed)) / math.log(restitution))
    speeds = speed * restitution ** np.arange(count, dtype=np.float64)
    times = start + np.concatenate([[0.0], np.cumsum(2.0 * speeds[1:] / 9.81)])
    ball = BALLS[str(rng.choice(kinds))]
    size = round((times[-1] + 0.6) * rate)
    clean, _ = _hits(rng, ball, times, speeds, rate, size)
    samples = scipy.signal.fftconvolve(clean, _room(rng, rate))[:size]
    return Sound(samples / np.abs(samples).max(), rate, times, np.full(count, math.inf))


def _impacts(
    rng: Generator, restitution: float, scatter: float, start: float
) -> tuple[Array, Array]:
    """Times and speeds until flights are shorter than 15 to 60 ms, or the ball is caught."""
    speed, least = math.sqrt(2.0 * 9.81 * rng.uniform(0.1, 0.6)), rng.uniform(0.015, 0.06)
    most = int(rng.integers(6, 15)) if rng.random() < 0.3 else 60
    times, speeds = [start], [speed]
    while len(times) < most:
        speed *= restitution + scatter * rng.standard_normal()
        flight = 2.0 * speed / 9.81
        if flight < least:
            break
        times.append(times[-1] + flight)
        speeds.append(speed)
    return np.array(times), np.array(speeds)


def _hits(
    rng: Generator, ball: Ball, times: Array, speeds: Array, rate: float, count: int
) -> tuple[Array, list[int]]:
    """Hits on a table of many modes; where it is hit differs a little from time to time."""
    lowest = float(np.exp(rng.uniform(math.log(100.0), math.log(500.0))))
    modes = lowest * np.concatenate([[1.0], 1.0 + np.cumsum(rng.exponential(0.9, 40))])
    modes = modes[modes < 0.45 * rate]
    quality = float(np.exp(rng.uniform(math.log(8.0), math.log(40.0))))
    shapes = rng.standard_normal(len(modes))
    if ball.tone[1]:
        modes, shapes = np.append(modes, rng.uniform(*ball.tone)), np.append(shapes, 3.0)
    thud = rng.choice([0.0, 1.0, 3.0])
    modes, shapes = np.append(modes, rng.uniform(60.0, 150.0)), np.append(shapes, thud)
    decays = np.minimum(quality / (math.pi * modes), 0.025) + 1e-4
    contact, power = float(rng.uniform(*ball.contact)), rng.uniform(0.9, 1.2)
    wander = rng.uniform(0.05, 0.4)
    clean, firsts = np.zeros(count), []
    low = scipy.signal.butter(3, 0.45 * rate, fs=rate * _FINER, output="sos")
    tail = 10.0 * float(decays.max())
    at = np.arange(0.0, tail + 0.01, 1.0 / (rate * _FINER))
    rings = np.exp(-at[:, None] / decays) * np.sin(math.tau * modes * at[:, None])
    for time, speed in zip(times, speeds, strict=True):
        own = shapes * (1.0 + wander * rng.standard_normal(len(modes)))
        first = math.ceil(time * rate)
        begin = first / rate - time
        width = contact * speed**-0.2
        force = np.sin(math.pi * at[at < width] / width) ** 1.5
        one = scipy.signal.oaconvolve(force, rings @ own)[: len(at)] / force.sum()
        one = scipy.signal.sosfilt(low, one)
        places = np.arange(min(round((tail + 0.005) * rate), count - first))
        shown = np.interp((places / rate + begin) * rate * _FINER, np.arange(len(one)), one)
        clean[first : first + len(shown)] += speed**power * shown
        firsts.append(first)
    return clean, firsts


def _room(rng: Generator, rate: float) -> Array:
    """Direct sound, the first walls, and a dense tail from 3 to 15 ms on."""
    time = rng.uniform(0.15, 0.7)
    at = np.arange(round(time * rate)) / rate
    tail = scipy.signal.lfilter([0.5], [1.0, -0.5], rng.standard_normal(len(at)))
    tail = tail * np.exp(-6.9 * at / time) * (at > rng.uniform(0.003, 0.015))
    response = 10.0 ** rng.uniform(-1.2, -0.3) * tail / math.sqrt(float(np.sum(tail**2)))
    for _ in range(int(rng.integers(0, 7))):
        place = rng.uniform(0.001, 0.03)
        response[int(place * rate)] += rng.choice([-1.0, 1.0]) * rng.uniform(0.05, 0.4)
    response[0] = 1.0
    return np.asarray(response)


def _coloured(rng: Generator, count: int) -> Array:
    """Noise with a power that falls with the frequency, rms 1."""
    spectrum = rng.standard_normal(count // 2 + 1) + 1j * rng.standard_normal(count // 2 + 1)
    spectrum[1:] *= np.arange(1, len(spectrum)) ** -rng.uniform(0.0, 0.7)
    spectrum[0] = 0.0
    noise = np.fft.irfft(spectrum, count)
    return np.asarray(noise / np.std(noise))


def _hum(rng: Generator, count: int, rate: float) -> Array:
    at = np.arange(count) / rate
    first = rng.choice([50.0, 60.0])
    return np.asarray(
        sum(np.sin(math.tau * first * n * at + rng.uniform(0.0, 6.3)) / n for n in (1, 2, 3, 5))
    )


def _beside(rng: Generator, times: Array, count: int, rate: float, room: Array) -> Array:
    """A voice before the drop, bumps before it and after its end, and what the ball does then."""
    found = np.zeros(count)
    if rng.random() < 0.6:
        end = times[0] - rng.uniform(0.1, 0.5)
        _put(found, 10.0 ** rng.uniform(-1.3, 0.0) * voice(rng, round(end * rate), rate), 0)
    for _ in range(int(rng.integers(0, 4))):
        bump = 10.0 ** rng.uniform(-1.5, 0.3) * _bump(rng, rate)
        early = rng.random() < 0.6
        place = rng.uniform(0.0, times[0] - 0.1) if early else rng.uniform(times[-1], count / rate)
        _put(found, bump, round(place * rate))
    after = rng.choice(["quiet", "rolling", "caught", "speaks"])
    first = round((times[-1] + 0.03) * rate)
    if after == "rolling":
        length = count - first
        noise = scipy.signal.lfilter([0.1], [1.0, -0.9], rng.standard_normal(length))
        noise *= 1.0 + 0.5 * np.sin(math.tau * rng.uniform(5.0, 15.0) * np.arange(length) / rate)
        _put(found, 10.0 ** rng.uniform(-3.0, -1.7) * noise / np.std(noise), first)
    if after == "caught":
        at = np.arange(round(0.1 * rate)) / rate
        noise = scipy.signal.lfilter([0.3], [1.0, -0.7], rng.standard_normal(len(at)))
        shape = (1.0 - np.exp(-at / 3e-3)) * np.exp(-at / rng.uniform(0.01, 0.03))
        _put(found, 10.0 ** rng.uniform(-2.0, -0.5) * noise / np.std(noise) * shape, first)
    if after == "speaks":
        _put(found, 10.0 ** rng.uniform(-1.3, 0.0) * voice(rng, count - first, rate), first)
    return np.asarray(scipy.signal.fftconvolve(found, room)[:count])


def _put(found: Array, part: Array, place: int) -> None:
    end = min(place + len(part), len(found))
    found[place:end] += part[: max(end - place, 0)]


def _bump(rng: Generator, rate: float) -> Array:
    """A phone that is put down: a thud, and some clicks in it."""
    at = np.arange(round(0.3 * rate)) / rate
    found = np.exp(-at / rng.uniform(0.01, 0.05)) * np.sin(math.tau * rng.uniform(50.0, 250.0) * at)
    for _ in range(int(rng.integers(0, 5))):
        since = at - rng.uniform(0.0, 0.08)
        click = np.exp(-np.maximum(since, 0.0) / rng.uniform(5e-4, 4e-3)) * (since > 0.0)
        found += rng.uniform(0.05, 0.5) * click * rng.standard_normal(len(at))
    return np.asarray(found / np.abs(found).max())


def voice(rng: Generator, count: int, rate: float) -> Array:
    """Syllables: a pulsed voice through three resonances, some after a burst or a hiss. Peak 1."""
    found, place = np.zeros(max(count, 1)), rng.uniform(0.0, 0.3)
    while place < count / rate:
        length = rng.uniform(0.08, 0.3)
        at = np.arange(round(length * rate)) / rate
        pitch = rng.uniform(90.0, 240.0) * (1.0 + rng.uniform(-0.2, 0.2) * at / length)
        phase = np.cumsum(pitch) / rate
        pulses = np.diff(np.floor(phase), prepend=0.0) + 0.01 * rng.standard_normal(len(at))
        shape = np.minimum(at / rng.uniform(0.01, 0.05), 1.0) * np.minimum(
            (length - at) / 0.05, 1.0
        )
        part = scipy.signal.lfilter([1.0], [1.0, -0.95], pulses)
        for middle in (rng.uniform(300, 800), rng.uniform(900, 2200), rng.uniform(2300, 3200)):
            radius = math.exp(-math.pi * rng.uniform(60.0, 150.0) / rate)
            turn = 2.0 * radius * math.cos(math.tau * middle / rate)
            part = scipy.signal.lfilter([1.0 - radius], [1.0, -turn, radius**2], part)
        part = np.diff(part, prepend=0.0) * shape
        part *= rng.uniform(0.3, 1.0) / max(float(np.abs(part).max()), 1e-12)
        before = rng.choice(["", "burst", "hiss"])
        if before == "burst":
            since = np.arange(round(0.04 * rate)) / rate
            noise = rng.standard_normal(len(since)) * np.exp(-since / rng.uniform(3e-3, 0.015))
            _put(found, rng.uniform(0.03, 0.2) * noise, round(place * rate))
            place += rng.uniform(0.02, 0.06)
        if before == "hiss":
            since = np.arange(round(0.1 * rate)) / rate
            noise = np.diff(rng.standard_normal(len(since)), prepend=0.0)
            swell = np.sin(math.pi * since / 0.1) ** 0.7
            _put(found, rng.uniform(0.02, 0.1) * noise * swell, round(place * rate))
            place += 0.08
        _put(found, part, round(place * rate))
        place += length + rng.uniform(0.0, 0.15) + (rng.random() < 0.2) * 0.3
    return found / max(float(np.abs(found).max()), 1e-12)


def _decibels(clean: Array, other: Array, firsts: list[int], rate: float) -> Array:
    """Peak of each hit over what is heard 10 ms before it, above 300 Hz."""
    high = scipy.signal.butter(2, 300.0, "highpass", fs=rate, output="sos")
    heard, whole = scipy.signal.sosfilt(high, clean), scipy.signal.sosfilt(high, clean + other)
    found = []
    for first, following in zip(firsts, [*firsts[1:], len(clean)], strict=True):
        before = whole[max(first - round(0.01 * rate), 0) : first]
        end = min(first + round(0.01 * rate), following)
        rms = math.sqrt(float(np.mean(before**2)) + 1e-30)
        found.append(20.0 * math.log10(float(np.abs(heard[first:end]).max()) / rms))
    return np.array(found)


def _gained(samples: Array, rate: float, rng: Generator) -> Array:
    """What an automatic gain makes of it: loud parts are lowered at once, and recover slowly."""
    step = round(1e-3 * rate)
    blocks = np.abs(np.pad(samples, (0, -len(samples) % step))).reshape(-1, step).max(axis=1)
    attack, release = (
        math.exp(-1.0 / rng.uniform(2.0, 20.0)),
        math.exp(-1.0 / rng.uniform(100, 800)),
    )
    level, levels = 0.0, []
    for block in blocks:
        part = attack if block > level else release
        level = part * level + (1.0 - part) * block
        levels.append(level)
    target = rng.uniform(0.05, 0.3)
    gain = target / (np.array(levels) + 0.1 * target)
    return np.asarray(
        samples * np.interp(np.arange(len(samples)), step * np.arange(len(gain)), gain)
    )
