"""Laws of impacts and flights on a platform at rest: kernels.

The restitution is ε - ε₁v at an impact of speed v; the drag is quadratic, κv². A disk that takes
off with u = a √(g/κ) flies for T = (arctan a + arsinh a)/√(gκ) and lands with u/√(1 + a²); one
released at rest has √(g/κ) tanh(√(gκ) t) after t. A κ below 0, which only intervals need,
continues these.
"""

from __future__ import annotations

from math import asin, asinh, atan, atanh, pi, sqrt, tan, tanh

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.core.compilation import rare_kernel

RESTITUTION, AMPLITUDE, PHASE, FREQUENCY, SLOPE, DRAG = range(6)
"""Parameters of a model: ε, A (m), φ (rad at t = 0), ω (rad/s); at rest ε₁ (s/m), κ (1/m)."""
PARAMETERS = 6
USUAL, RELEASED, VOID = range(3)
"""Kinds of equations: of two flights, of a release at rest and a flight, of nothing."""
_ROUNDS = 100
_SMALL, _TINY = 1e-4, 1e-8
"""gκT²: below it series of derivatives and of values have no larger errors than rounding makes."""


@rare_kernel
def takeoff(duration: float, drag: float, g: float) -> tuple[float, float, float]:
    """Take-off speed of a flight, and its derivatives by the duration and by κ."""
    q = g * drag * duration * duration
    x, scale = sqrt(abs(q)), sqrt(abs(g / drag)) if drag != 0.0 else 0.0
    by_drag = g * g * duration * duration * duration / 32.0
    if abs(q) < _TINY:
        return 0.5 * g * duration * (1.0 + q / 16.0), 0.5 * g * (1.0 + 3.0 * q / 16.0), by_drag
    a = 0.5 * x if q > 0.0 else tanh(x)
    for _ in range(_ROUNDS):
        if q > 0.0:
            beyond, slope = atan(a) + asinh(a) - x, 1.0 / (1.0 + a * a) + 1.0 / sqrt(1.0 + a * a)
        else:
            beyond, slope = atanh(a) + asin(a) - x, 1.0 / (1.0 - a * a) + 1.0 / sqrt(1.0 - a * a)
        a -= beyond / slope
        if not abs(beyond) > 1e-8 * x:  # the next error is its square
            break
    if abs(q) > _SMALL:
        by_drag = 0.5 * scale / drag * (x / slope - a)
    return scale * a, g / slope, by_drag


@rare_kernel
def landing(
    flight: tuple[float, float, float], drag: float, g: float
) -> tuple[float, float, float]:
    """Landing speed after a take-off, and its derivatives by the duration and by κ."""
    u, by_time, by_drag = flight
    part = 1.0 + drag * u * u / g
    slope = 1.0 / (part * sqrt(part))
    return u / sqrt(part), slope * by_time, slope * (by_drag - 0.5 * u * u * u / g)


@rare_kernel
def fall(duration: float, drag: float, g: float) -> tuple[float, float, float]:
    """Landing speed after a release at rest, and its derivatives by the duration and by κ.

    nan where there is none.
    """
    q = g * drag * duration * duration
    by_drag = -(g * g) * duration * duration * duration / 3.0
    if abs(q) < _TINY:
        return g * duration * (1.0 - q / 3.0), g * (1.0 - q), by_drag
    x, scale = sqrt(abs(q)), sqrt(abs(g / drag))
    if q < 0.0 and x > 0.5 * pi:
        return np.nan, np.nan, np.nan
    part = tanh(x) if q > 0.0 else tan(x)
    slope = 1.0 - part * part if q > 0.0 else 1.0 + part * part
    if abs(q) > _SMALL:
        by_drag = 0.5 * scale / drag * (x * slope - part)
    return scale * part, g * slope, by_drag


@rare_kernel
def rest_equations(
    th: NDArray[np.float64],
    p: NDArray[np.float64],
    kinds: NDArray[np.int64],
    g: float,
    e: NDArray[np.float64],
    b: NDArray[np.float64],
    d: NDArray[np.float64],
) -> bool:
    """Fill e (n), b (n, 3: derivatives by three times) and d (6, n: by the parameters).

    kinds (n): USUAL ... False: there is no such motion.
    """
    d[:] = 0.0
    flight = takeoff(th[1] - th[0], p[DRAG], g)
    for j in range(e.size):
        before, after = th[j + 1] - th[j], th[j + 2] - th[j + 1]
        if not (before > 0.0 and after > 0.0):
            return False
        v, vt, vk = landing(flight, p[DRAG], g)
        flight = takeoff(after, p[DRAG], g)
        if kinds[j] == VOID:
            e[j], b[j], d[:, j] = 0.0, 0.0, 0.0
            continue
        u, ut, uk = flight
        if kinds[j] == RELEASED:
            v, vt, vk = fall(before, p[DRAG], g)
        if not v > 0.0:
            return False
        e[j] = u / v - p[RESTITUTION] + p[SLOPE] * v
        by_v = p[SLOPE] - u / (v * v)
        b[j, 0], b[j, 1], b[j, 2] = -by_v * vt, by_v * vt - ut / v, ut / v
        d[RESTITUTION, j], d[SLOPE, j], d[DRAG, j] = -1.0, v, uk / v + by_v * vk
    return True
