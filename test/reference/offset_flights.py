"""Impacts of runs with offset trajectories, checked flight by flight against 40 digits.

A flight between two reported impacts begins on the platform with u = ε|w_A|. That its end is a root
is seen in 40 digits; that no root lies before it, by steps that a bound of the acceleration allows.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from typing import NamedTuple

import mpmath
import numpy as np
from mpmath import mpf
from numpy.typing import NDArray

from reference.offset_path import Piece, Platform, Point, Trajectory, piece_at, pieces
from support.offset_runs import OffsetRun

_ROUNDED = 1e-12  # s: the time of an impact that a knot brings about may round to before it
_SURE = 1.05  # of an acceleration sampled at 64 places of a polynomial of degree 3


class Flight(NamedTuple):
    """A flight from one impact to the next: instants (s), velocity at its begin, w_A at its end."""

    begin: float
    end: float
    height: float  # of the disk above the platform at its begin, m
    speed: float  # relative to the platform
    impact_velocity: float


def flights(run: OffsetRun, rows: NDArray[np.void]) -> Iterator[Flight]:
    """The flights between rows that stand for one impact each."""
    for before, after in itertools.pairwise(rows):
        u = -run.disk.restitution * float(before["axial_impact_velocity"])
        if before["kind"] == 0 and after["kind"] == 0 and u > 0.0:
            begin, end = float(before["time"]), float(after["time"])
            yield Flight(begin, end, 0.0, u, float(after["axial_impact_velocity"]))


def axial_pieces(run: OffsetRun, kind: type) -> list[Piece]:
    """The axial offset of a run."""
    messages = [
        Trajectory(one.begin_ns, tuple(Point(int(p[0]), p[1:]) for p in one.axial))
        for one in run.trajectories
        if one.axial
    ]
    return pieces(messages, kind)


class Checked:
    """The platform of a run, in 40 digits and in floats."""

    def __init__(self, run: OffsetRun) -> None:
        motion, phase = run.motion, run.initial.forcing_phase
        self.gravity = run.disk.gravity
        self.exact = Platform(
            motion.axial_amplitude, motion.frequency, phase, axial_pieces(run, mpf)
        )
        self.found = axial_pieces(run, float)
        self.motion, self.phase = motion, phase
        self.omega = math.tau * motion.frequency
        self.bounds = [self._bound(piece) for piece in self.found]
        self.unit = math.pi * self.gravity / self.omega**2  # the length of the model

    def _bound(self, piece: Piece) -> float:
        most = self.gravity + self.motion.axial_amplitude * self.omega**2
        if piece.kind:
            places = np.linspace(piece.begin, piece.end, 64)
            most += _SURE * max(abs(float(piece.at(float(t), 2))) for t in places)
        return most

    def distance(self, flight: Flight) -> float:
        """How far from the platform the disk is at the end of its flight, m, by 40 digits."""
        with mpmath.workdps(40):
            t0, t1 = mpf(flight.begin), mpf(flight.end)
            d = t1 - t0
            after = piece_at(self.exact.found, t0 + mpf(_ROUNDED))
            v = self.exact.at(t0, 1, after) + mpf(flight.speed)
            x = self.exact.at(t0) + mpf(flight.height) + v * d - mpf(self.gravity) * d * d / 2
            return float(x - self.exact.at(t1))

    def _platform(self, t: float, piece: Piece) -> tuple[float, float]:
        turn = self.omega * t + self.phase
        a = self.motion.axial_amplitude
        s = a * math.sin(turn) + float(piece.at(t))
        return s, a * self.omega * math.cos(turn) + float(piece.at(t, 1))

    def missed(self, flight: Flight) -> float | None:
        """Seconds after its begin at which the disk was already below the platform; else None."""
        t0 = flight.begin
        i = max(k for k, piece in enumerate(self.found) if piece.begin <= t0 + _ROUNDED)
        s0, v0 = self._platform(t0, self.found[i])
        x0, v0 = s0 + flight.height, v0 + flight.speed
        length = flight.end - t0
        rounding = 1e-13 * (self.unit + abs(x0))
        d = 0.0
        while d < length:
            s, s1 = self._platform(t0 + d, self.found[i])
            h = x0 + v0 * d - 0.5 * self.gravity * d * d - s
            h1 = v0 - self.gravity * d - s1
            if d == 0.0:
                h, h1 = flight.height, flight.speed
            if h < -rounding:
                return d
            root = math.sqrt(h1 * h1 + 2.0 * self.bounds[i] * max(h, 0.0))
            step = (h1 + root) / self.bounds[i] if h1 > 0.0 else 2.0 * max(h, 0.0) / (root - h1)
            least = 1e-7 / self.omega
            if d + max(step, least) >= length - least:
                return None  # its end is the root, or it comes too close to be told apart
            d += max(step, least)
            if i + 1 < len(self.found) and d >= self.found[i + 1].begin - t0:
                i += 1
                d = max(self.found[i].begin - t0, 0.0)
        return None
