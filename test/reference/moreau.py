"""Moreau time-stepping of the whole model: an independent method, for tests alone.

Written from the model's equations only; it shares nothing with the core. One step of length h of
the Moreau-Jean scheme (M. Jean, Comput. Methods Appl. Mech. Eng. 177, 1999): forces act over the
step, the contact is active if the midpoint of the step penetrates, and an active contact obeys 0
≤ P ⊥ w⁺ + ε w⁻ ≥ 0 for the relative velocities at the two ends of the step, with Coulomb's limit
μ a_e P for the angular impulse. Impacts are resolved to one step: the error is of first order in
h and depends on where each event falls within its step. Steps of random length (uniform in h/2 …
3h/2) make these places independent, so that the errors of many runs are a sample with a mean and
a variance.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from bouncing_disk_ros.core.model import Disk, Motion
from reference.offset_path import Piece


class State(NamedTuple):
    """Absolute state of the disk (m, m/s, rad, rad/s)."""

    position: float
    velocity: float
    angle: float
    angular_velocity: float


class Crossfade(NamedTuple):
    """A cross-fade to `target` from `begin` to `end`, s."""

    begin: float
    end: float
    target: Motion


class Kick(NamedTuple):
    """Impulses on the disk (N s, N m s) at `time`, s."""

    time: float
    axial: float
    angular: float


def segments(start: Motion, phase: float, fades: Sequence[Crossfade]) -> NDArray[np.float64]:
    """Rows (begin, duration or 0, τ, A, ΔA, Φ, ΔΦ, ω, Δω, θ, Δθ) of the platform's motion, first
    at t = 0."""
    rows = []
    now, tau, motion = 0.0, phase, start
    for fade in fades:
        omega, change = motion.frequency * math.tau, fade.target.frequency * math.tau
        rows.append([now, 0.0, tau, *_columns(motion, motion)])
        tau += omega * (fade.begin - now)
        rows.append([fade.begin, fade.end - fade.begin, tau, *_columns(motion, fade.target)])
        tau += 0.5 * (omega + change) * (fade.end - fade.begin)
        now, motion = fade.end, fade.target
    rows.append([now, 0.0, tau, *_columns(motion, motion)])
    return np.array(rows)


def _columns(a: Motion, b: Motion) -> list[float]:
    short = (b.phase_lag - a.phase_lag + math.pi) % math.tau - math.pi  # θ goes the short way
    omega = a.frequency * math.tau
    return [
        *(a.axial_amplitude, b.axial_amplitude - a.axial_amplitude),
        *(a.angular_amplitude, b.angular_amplitude - a.angular_amplitude),
        *(omega, b.frequency * math.tau - omega),
        *(a.phase_lag, short),
    ]


@njit(cache=True)
def _forcing(rows, t):  # type: ignore[no-untyped-def]
    """Return the segment in force, b, ḃ, τ, ω at time t."""
    i = len(rows) - 1
    while i > 0 and rows[i, 0] > t:
        i -= 1
    begin, duration, tau, w, dw = rows[i, 0], rows[i, 1], rows[i, 2], rows[i, 7], rows[i, 8]
    elapsed = t - begin
    b = b1 = blend_integral = 0.0
    if duration > 0.0:
        x = elapsed / duration
        b = x * x * x * (10.0 + x * (-15.0 + x * 6.0))
        b1 = 30.0 * x * x * (1.0 - x) * (1.0 - x) / duration
        blend_integral = duration * x**4 * (2.5 + x * (-3.0 + x))
    return i, b, b1, tau + w * elapsed + dw * blend_integral, w + dw * b


def no_offset() -> NDArray[np.float64]:
    """Rows of an offset that is 0 for good."""
    return np.array([[0.0] * 7])


def offset_rows(found: Sequence[Piece]) -> NDArray[np.float64]:
    """Rows (begin, six coefficients of the time since then) of the pieces of an offset."""
    rows = []
    for piece in found:
        orders = range(3) if piece.kind else range(1)
        taylor = [float(piece.at(piece.begin, k)) / math.factorial(k) for k in orders]
        taylor += [0.0] * (6 - len(taylor))
        if piece.kind > 1:  # the rest from the end: p, ṗ and p̈ there
            taylor[3:] = _upper(piece, taylor)
        rows.append([float(piece.begin), *taylor])
    return np.array(rows)


def _upper(piece: Piece, lower: Sequence[float]) -> list[float]:
    """Third to fifth coefficients of a piece, from its first three and the state at its end."""
    d = float(piece.end - piece.begin)
    powers = np.array(
        [[d**k * math.perm(k, order) / d**order for k in (3, 4, 5)] for order in range(3)]
    )
    known = [
        sum(math.perm(k, order) * lower[k] * d ** (k - order) for k in range(order, 3))
        for order in range(3)
    ]
    wanted = [float(piece.at(piece.end, order)) - known[order] for order in range(3)]
    return [float(value) for value in np.linalg.solve(powers, wanted)]


@njit(cache=True)
def _offset(rows, t):  # type: ignore[no-untyped-def]
    """Return an offset and its velocity at time t."""
    i = len(rows) - 1
    while i > 0 and rows[i, 0] > t:
        i -= 1
    x, p, v = t - rows[i, 0], 0.0, 0.0
    for k in range(5, -1, -1):
        v = v * x + p
        p = p * x + rows[i, 1 + k]
    return p, v


@njit(cache=True)
def axial(rows, offset, t):  # type: ignore[no-untyped-def]
    """Return s, ṡ at time t."""
    i, b, b1, tau, rate = _forcing(rows, t)
    a, change = rows[i, 3] + rows[i, 4] * b, rows[i, 4] * b1
    p, v = _offset(offset, t)
    return a * math.sin(tau) + p, change * math.sin(tau) + a * rate * math.cos(tau) + v


@njit(cache=True)
def angular(rows, offset, t):  # type: ignore[no-untyped-def]
    """Return β, β̇ at time t."""
    i, b, b1, tau, rate = _forcing(rows, t)
    phi, change = rows[i, 5] + rows[i, 6] * b, rows[i, 6] * b1
    turn, turn_rate = tau + rows[i, 9] + rows[i, 10] * b, rate + rows[i, 10] * b1
    q, v = _offset(offset, t)
    return phi * math.sin(turn) + q, change * math.sin(turn) + phi * turn_rate * math.cos(turn) + v


@njit(cache=True)
def _after(free, platform, rub, hold):  # type: ignore[no-untyped-def]
    """Return α̇ after a step, with impulses of friction and brake of at most rub and hold over I.

    The least of ½(x − free)² + rub|x − platform| + hold|x|: at a kink, or where a slope vanishes.
    """
    best, least = 0.0, math.inf
    for k in range(6):
        x = 0.0 if k == 0 else platform
        if k >= 2:
            x = free + (rub if k % 2 else -rub) + (hold if k < 4 else -hold)
        size = 0.5 * (x - free) ** 2 + rub * abs(x - platform) + hold * abs(x)
        if size < least:
            best, least = x, size
    return best


@njit(cache=True)
def _integrate(rows, offsets, impulses, constants, state, end, h, seed):  # type: ignore[no-untyped-def]
    restitution, limit, gravity, load, brake = constants
    p_rows, q_rows = offsets
    x, v, angle, spin = state
    np.random.seed(seed)  # noqa: NPY002 (numba has this one)
    t, k = 0.0, 0
    s, s1 = axial(rows, p_rows, t)
    if x <= s and v < s1:  # an impact at once, before a kick of the same instant
        p, slip = (1.0 + restitution) * (s1 - v), spin - angular(rows, q_rows, t)[1]
        v += p
        spin -= min(max(slip, -limit * p), limit * p)
    while True:
        while k < len(impulses) and impulses[k, 0] <= t:
            v += impulses[k, 1]
            spin += impulses[k, 2]
            k += 1
        if t >= end:
            return x, v, angle, spin
        stop = min(end, impulses[k, 0]) if k < len(impulses) else end
        after = min(t + h * (0.5 + np.random.random()), stop)  # noqa: NPY002
        dt = after - t
        v_free, spin_free = v - gravity * dt, spin - load * dt
        rub = 0.0
        if (
            x + 0.5 * dt * v <= axial(rows, p_rows, t + 0.5 * dt)[0]
        ):  # P/m, angular impulse/(m a_g²)
            before, then = v - axial(rows, p_rows, t)[1], v_free - axial(rows, p_rows, after)[1]
            p = max(0.0, -restitution * before - then)
            v_free += p
            rub = limit * p
        if rub > 0.0 or brake > 0.0:
            spin_free = _after(spin_free, angular(rows, q_rows, after)[1], rub, brake * dt)
        x += 0.5 * dt * (v + v_free)
        angle += 0.5 * dt * (spin + spin_free)
        t, v, spin = after, v_free, spin_free


def integrate(
    rows: NDArray[np.float64],
    impulses: Sequence[Kick],
    disk: Disk,
    state: State,
    end: float,
    h: float,
    seed: int,
    offsets: tuple[NDArray[np.float64], NDArray[np.float64]] | None = None,
) -> State:
    """State at time `end` (s) by steps of random length around h (s); the same seed, the same
    steps.

    `rows` come from `segments`; kicks are in order of time and act between two steps; `offsets`,
    of both joints, from `offset_rows`.
    """
    inertia = disk.mass * disk.gyration_radius**2 + disk.load_inertia
    scaled = [
        (impulse.time, impulse.axial / disk.mass, impulse.angular / inertia) for impulse in impulses
    ]
    constants = (
        disk.restitution,
        disk.friction * disk.friction_radius * disk.mass / inertia,
        disk.gravity + disk.preload / disk.mass,
        disk.load_torque / inertia,
        disk.brake_torque / inertia,
    )
    table = np.array(scaled, dtype=np.float64).reshape(-1, 3)
    offsets = offsets or (no_offset(), no_offset())
    return State(*_integrate(rows, offsets, table, constants, tuple(state), end, h, seed))
