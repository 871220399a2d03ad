"""Peers for many trajectories: the same map by numpy, JAX, heyoka's batches and SciPy.

numpy and JAX run the algorithm of the lanes: a certified first root by parabolas below the gap,
then steps of fifth order. heyoka and SciPy integrate the gap y'' = Γ sin t − 1/π and watch for
y = 0, from a hair above zero. All do rounds of one flight for all trajectories.
"""

from __future__ import annotations

import importlib.util
import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.axial import GRAVITY, RESTITUTION
from bench.heyoka_reference import HAIR

Floats = NDArray[np.float64]
_SHORT = 1e-4


def missing(module: str) -> str:
    """Why a peer cannot be had, or ''."""
    return "" if importlib.util.find_spec(module) else f"{module} is not installed"


def _first_delay(xp: Any, axial_forcing: float, s: Any, c: Any, u: Any) -> Any:
    """A safe delay after the launch: above the crest until then, or a parabola below the gap."""
    v, k = axial_forcing * c + u, GRAVITY + axial_forcing
    q = v * v + 2.0 * GRAVITY * axial_forcing * (s - 1.0)
    r = xp.sqrt(xp.maximum(q, 0.0))
    step, begin, end = 2.0 * u / k, (v - r) / GRAVITY, (v + r) / GRAVITY
    return xp.where((q > 0.0) & (begin <= step) & (step < end), end, step)


def _looked(xp: Any, axial_forcing: float, tau: Any, s: Any, c: Any, u: Any, d: Any) -> Any:
    """The delay after one look at the gap, the slope there and whether it is a root."""
    k = GRAVITY + axial_forcing
    sine, cosine = xp.sin(tau + d), xp.cos(tau + d)
    h = (u - 0.5 * GRAVITY * d) * d - axial_forcing * (sine - s - c * d)
    h1 = u - GRAVITY * d - axial_forcing * (cosine - c)
    h2, h3, h4 = axial_forcing * sine - GRAVITY, axial_forcing * cosine, -axial_forcing * sine
    above = xp.maximum(h, 0.0)
    ahead = (h1 < 0.0) & (4.0 * k * above <= h1 * h1)
    root = xp.sqrt(h1 * h1 + 2.0 * k * above)
    falls = h1 < 0.0
    over, under = xp.where(falls, 2.0 * above, h1 + root), xp.where(falls, root - h1, k)
    r = 1.0 / xp.where(ahead, h1, 1.0)
    v, a2, a3, a4 = -h * r, 0.5 * h2 * r, h3 * r / 6.0, h4 * r / 24.0
    x = v - v * v * (a2 - v * ((2.0 * a2 * a2 - a3) + v * (5.0 * a2 * (a3 - a2 * a2) - a4)))
    slope = h1 + x * (h2 + x * (0.5 * h3 + x * h4 / 6.0))
    step = xp.where(ahead, x, xp.maximum(over / under, 4e-16 * d))
    return d + step, slope, ahead & (xp.abs(x) < _SHORT)


def by_numpy(tau: Floats, w: Floats, axial_forcing: float, impacts: int) -> None:
    """Carry trajectories on, in place."""
    for _ in range(impacts):
        s, c, u = np.sin(tau), np.cos(tau), -RESTITUTION * w
        d = _first_delay(np, axial_forcing, s, c, u)
        left = np.arange(len(tau))
        while len(left):
            part = (tau[left], s[left], c[left], u[left], d[left])
            d[left], w[left], done = _looked(np, axial_forcing, *part)
            left = left[~done]
        tau += d
        tau %= math.tau


class ByJax:
    """The same, compiled; all trajectories look until the last has landed."""

    def __init__(self, axial_forcing: float) -> None:
        import jax
        from jax import numpy as jnp

        jax.config.update("jax_enable_x64", True)

        def flight(_: Any, state: Any) -> Any:
            tau, w = state
            s, c, u = jnp.sin(tau), jnp.cos(tau), -RESTITUTION * w

            def step(carried: Any) -> Any:
                d, w, done = carried
                new, slope, landed = _looked(jnp, axial_forcing, tau, s, c, u, d)
                return jnp.where(done, d, new), jnp.where(done, w, slope), done | landed

            start = (_first_delay(jnp, axial_forcing, s, c, u), w, jnp.zeros(w.shape, bool))
            d, w, _ = jax.lax.while_loop(lambda carried: ~carried[2].all(), step, start)
            return jnp.mod(tau + d, math.tau), w

        def run(tau: Any, w: Any, impacts: Any) -> Any:
            return jax.lax.fori_loop(0, impacts, flight, (tau, w))

        self._run = jax.jit(run)

    def iterate(self, tau: Floats, w: Floats, impacts: int) -> None:
        """Carry trajectories on, in place."""
        found = self._run(tau, w, impacts)
        tau[:], w[:] = np.asarray(found[0]), np.asarray(found[1])


def by_scipy(tau: float, w: float, axial_forcing: float, impacts: int) -> tuple[float, float]:
    """One trajectory by SciPy."""
    for _ in range(impacts):
        tau, w = flight(tau, (HAIR, -RESTITUTION * w), axial_forcing)
    return tau, w


def flight(tau: float, start: tuple[float, float], axial_forcing: float) -> tuple[float, float]:
    """One flight by DOP853 with an event, at rtol 1e-9: far less exact, and far slower."""
    from scipy.integrate import solve_ivp

    def fall(t: float, y: Floats) -> tuple[float, float]:
        return y[1], axial_forcing * math.sin(t) - GRAVITY

    def gap(_: float, y: Floats) -> float:
        return float(y[0])

    gap.terminal, gap.direction = True, -1.0  # type: ignore[attr-defined]
    found = solve_ivp(fall, (tau, tau + 50.0), start, "DOP853", events=gap, rtol=1e-9, atol=1e-12)
    return float(found.t[-1] % math.tau), float(found.y[1, -1])
