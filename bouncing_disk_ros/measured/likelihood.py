"""Likelihood of measured impact times: kernels that integrate the true times out.

The platform is s = A sin(ωt + φ); A = 0 is a platform at rest. From the true times θ follow the
take-off and landing of each flight, so each inner impact k has a coefficient of restitution

    e_k(θ_(k-1), θ_k, θ_(k+1)) = -(u_k - ṡ_k)/(v_k - ṡ_k) = ε + scatter.

The measured times are t = θ + errors. Linearised at the mode of θ, the equations have the
covariance S = BΣBᵀ + ρ²I with B = ∂e/∂θ, which has five diagonals. All errors are multiples of c,
and ρ = σ_ε/c.
"""

from __future__ import annotations

from math import asin, cos, floor, inf, log, pi, sin, sqrt, tau

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.core.arithmetic import entry, rare_kernel

RESTITUTION, AMPLITUDE, PHASE, FREQUENCY = range(4)
"""Parameters of the model: ε, A (m), φ (rad at t = 0), ω (rad/s)."""
_ROUNDS, _STEPS, _HALVINGS = 60, 40, 12
_LEAST_FALL = 1e-11
"""Of the sum of squares: a step that promises less is not taken."""
_IMPOSSIBLE = 1e300
_ARRAY, _FLAGS = "float64[::1]", "boolean[::1]"
_TIMES = f"{_ARRAY}, {_ARRAY}, {_FLAGS}, {_ARRAY}"


@rare_kernel
def _separation(t: float, p: NDArray[np.float64], g: float) -> float:
    """Last instant up to t at which a disk in contact leaves the platform; -inf: it never does."""
    peak = p[AMPLITUDE] * p[FREQUENCY] ** 2
    if abs(peak) <= g:
        return -inf
    at = asin(g / peak) if peak > 0.0 else pi - asin(g / peak)
    turns = floor((p[FREQUENCY] * t + p[PHASE] - at) / tau)
    return (at + tau * turns - p[PHASE]) / p[FREQUENCY]


@entry(f"boolean({_ARRAY}, {_FLAGS}, {_ARRAY}, float64, {_ARRAY}, float64[:, ::1], {_ARRAY})")
def equations(
    th: NDArray[np.float64],
    contact: NDArray[np.bool_],
    p: NDArray[np.float64],
    g: float,
    e: NDArray[np.float64],
    b: NDArray[np.float64],
    scatters: NDArray[np.float64],
) -> bool:
    """Fill e (n), b (n, 3: the derivatives by three times) and scatters (n); whether they exist.

    Gap k is that after time k. After a gap in contact the landing follows from the separation. The
    impact before such a gap says nothing; in its place stands the instant of the landing.
    """
    w, a = p[FREQUENCY], p[AMPLITUDE]
    for j in range(e.size):
        k = j + 1
        before, here, after = th[k - 1], th[k], th[k + 1]
        tm, tp = here - before, after - here
        if not (tm > 0.0 and tp > 0.0):
            return False
        s0, s1, s2 = a * sin(w * before + p[PHASE]), a * sin(w * here + p[PHASE]), 0.0
        s2 = a * sin(w * after + p[PHASE])
        d0, d1 = a * w * cos(w * before + p[PHASE]), a * w * cos(w * here + p[PHASE])
        d2 = a * w * cos(w * after + p[PHASE])
        scatters[j] = 0.0 if contact[k] else 1.0
        if contact[k]:
            leave = _separation(after, p, g)
            if leave < here:
                return False
            d = after - leave
            up = a * w * cos(w * leave + p[PHASE])
            e[j] = s2 - a * sin(w * leave + p[PHASE]) - up * d + 0.5 * g * d * d
            b[j, 0], b[j, 1], b[j, 2] = 0.0, 0.0, d2 - up + g * d
            continue
        u = (s2 - s1) / tp + 0.5 * g * tp - d1
        du1 = (s2 - s1 - d1 * tp) / (tp * tp) - 0.5 * g + w * w * s1
        du2 = (d2 * tp - s2 + s1) / (tp * tp) + 0.5 * g
        if contact[k - 1]:
            leave = _separation(here, p, g)
            if leave < before:
                return False
            v = a * w * cos(w * leave + p[PHASE]) - g * (here - leave) - d1
            dv0, dv1 = 0.0, -g + w * w * s1
        else:
            v = (s1 - s0) / tm - 0.5 * g * tm - d1
            dv0 = (s1 - s0 - d0 * tm) / (tm * tm) + 0.5 * g
            dv1 = (d1 * tm - s1 + s0) / (tm * tm) - 0.5 * g + w * w * s1
        if v == 0.0:
            return False
        e[j] = -u / v - p[RESTITUTION]
        b[j, 0] = u / (v * v) * dv0
        b[j, 1] = -du1 / v + u / (v * v) * dv1
        b[j, 2] = -du2 / v
    return True


@rare_kernel
def _factor(
    b: NDArray[np.float64],
    sig: NDArray[np.float64],
    scatters: NDArray[np.float64],
    rho: float,
    low: NDArray[np.float64],
) -> float:
    """Cholesky factor of S in low (n, 3: L[j, j], L[j, j-1], L[j, j-2]); log det S, nan: none."""
    total = 0.0
    for j in range(b.shape[0]):
        a0, a1, a2 = scatters[j] * rho * rho, 0.0, 0.0
        for m in range(3):
            a0 += (b[j, m] * sig[j + m]) ** 2
        if j >= 1:
            a1 = b[j - 1, 1] * b[j, 0] * sig[j] ** 2 + b[j - 1, 2] * b[j, 1] * sig[j + 1] ** 2
        if j >= 2:
            a2 = b[j - 2, 2] * b[j, 0] * sig[j] ** 2
        l2 = a2 / low[j - 2, 0] if j >= 2 else 0.0
        l1 = (a1 - (l2 * low[j - 1, 1] if j >= 2 else 0.0)) / low[j - 1, 0] if j >= 1 else 0.0
        rest = a0 - l1 * l1 - l2 * l2
        if not rest > 0.0:
            return np.nan
        low[j, 0], low[j, 1], low[j, 2] = sqrt(rest), l1, l2
        total += log(rest)
    return total


@rare_kernel
def _whiten(low: NDArray[np.float64], r: NDArray[np.float64]) -> None:
    """Replace r by L⁻¹r."""
    for j in range(r.size):
        x = r[j]
        if j >= 1:
            x -= low[j, 1] * r[j - 1]
        if j >= 2:
            x -= low[j, 2] * r[j - 2]
        r[j] = x / low[j, 0]


@rare_kernel
def _unwhiten(low: NDArray[np.float64], r: NDArray[np.float64]) -> None:
    """Replace r by L⁻ᵀr."""
    n = r.size
    for j in range(n - 1, -1, -1):
        x = r[j]
        if j + 1 < n:
            x -= low[j + 1, 1] * r[j + 1]
        if j + 2 < n:
            x -= low[j + 2, 2] * r[j + 2]
        r[j] = x / low[j, 0]


@rare_kernel
def _residuals(
    t: NDArray[np.float64],
    th: NDArray[np.float64],
    e: NDArray[np.float64],
    b: NDArray[np.float64],
    r: NDArray[np.float64],
) -> None:
    """Fill r with the equations as the measured times would have them, linearised at th."""
    for j in range(r.size):
        r[j] = e[j]
        for m in range(3):
            r[j] += b[j, m] * (t[j + m] - th[j + m])


@rare_kernel
def _move(
    t: NDArray[np.float64],
    sig: NDArray[np.float64],
    b: NDArray[np.float64],
    q: NDArray[np.float64],
    part: float,
    th: NDArray[np.float64],
) -> float:
    """Move th a part of the way to t - ΣBᵀq; the longest way, in errors."""
    longest, n = 0.0, q.size
    for k in range(t.size):
        x = t[k]
        for m in range(3):
            if 0 <= k - m < n:
                x -= sig[k] ** 2 * b[k - m, m] * q[k - m]
        longest = max(longest, abs(x - th[k]) / sig[k])
        th[k] += part * (x - th[k])
    return longest


@entry(f"UniTuple(float64, 2)({_TIMES}, float64, float64, {_ARRAY}, float64[:, ::1], {_ARRAY})")
def true_times(
    t: NDArray[np.float64],
    sig: NDArray[np.float64],
    contact: NDArray[np.bool_],
    p: NDArray[np.float64],
    g: float,
    rho: float,
    th: NDArray[np.float64],
    low: NDArray[np.float64],
    white: NDArray[np.float64],
) -> tuple[float, float]:
    """Move th to the mode of the true times; rᵀS⁻¹r and log det S/det BΣBᵀ; 1e300: none.

    low: Cholesky factor of S there, white: L⁻¹r. The first two times are profiled, not integrated
    over a flat measure: that would favour parameters by how fast orbits part.
    """
    n = t.size - 2
    e, b, scatters = np.empty(n), np.empty((n, 3)), np.empty(n)
    q = np.empty(n)
    total, last, part = 0.0, inf, 1.0
    for i in range(_ROUNDS + 1):
        if i == _ROUNDS:
            return _IMPOSSIBLE, 0.0
        if not equations(th, contact, p, g, e, b, scatters):
            return _IMPOSSIBLE, 0.0
        total = _factor(b, sig, scatters, rho, low)
        if not total < inf:
            return _IMPOSSIBLE, 0.0
        _residuals(t, th, e, b, white)
        _whiten(low, white)
        q[:] = white
        _unwhiten(low, q)
        moved = _move(t, sig, b, q, part, th)
        if moved < 1e-7 or (moved < 1e-3 and moved >= last):
            break
        part = max(0.5 * part, 0.1) if moved > 0.9 * last else min(1.5 * part, 1.0)
        last = moved
    rss = 0.0
    for j in range(n):
        rss += white[j] ** 2
    total -= _factor(b, sig, scatters, 0.0, np.empty((n, 3)))
    return (rss, total) if rss + abs(total) < _IMPOSSIBLE else (_IMPOSSIBLE, 0.0)


@rare_kernel
def _derivatives(
    th: NDArray[np.float64],
    contact: NDArray[np.bool_],
    p: NDArray[np.float64],
    g: float,
    low: NDArray[np.float64],
    free: NDArray[np.int64],
    steps: NDArray[np.float64],
    d: NDArray[np.float64],
) -> bool:
    """Fill d (free, n) with L⁻¹ ∂r/∂p at fixed times, by central differences."""
    n = th.size - 2
    e, b, scatters, q = np.empty(n), np.empty((n, 3)), np.empty(n), p.copy()
    for i in range(free.size):
        h = steps[free[i]]
        q[free[i]] = p[free[i]] + h
        if not equations(th, contact, q, g, e, b, scatters):
            return False
        d[i] = e
        q[free[i]] = p[free[i]] - h
        if not equations(th, contact, q, g, e, b, scatters):
            return False
        q[free[i]] = p[free[i]]
        for j in range(n):
            d[i, j] = (d[i, j] - e[j]) / (2.0 * h)
        _whiten(low, d[i])
    return True


@rare_kernel
def _solve(h: NDArray[np.float64], x: NDArray[np.float64], damping: float) -> bool:
    """Replace x by (h + damping diag h)⁻¹ x; whether that exists."""
    n = x.size
    low = np.zeros((n, n))
    for i in range(n):
        for j in range(i + 1):
            y = h[i, j] * (1.0 + damping if i == j else 1.0)
            for m in range(j):
                y -= low[i, m] * low[j, m]
            if i == j:
                if not y > 0.0:
                    return False
                low[i, i] = sqrt(y)
            else:
                low[i, j] = y / low[j, j]
    for i in range(n):
        for m in range(i):
            x[i] -= low[i, m] * x[m]
        x[i] /= low[i, i]
    for i in range(n - 1, -1, -1):
        for m in range(i + 1, n):
            x[i] -= low[m, i] * x[m]
        x[i] /= low[i, i]
    return True


@rare_kernel
def _product(x: NDArray[np.float64], y: NDArray[np.float64]) -> float:
    """Scalar product."""
    total = 0.0
    for j in range(x.size):
        total += x[j] * y[j]
    return total


@rare_kernel
def _information(
    d: NDArray[np.float64],
    white: NDArray[np.float64],
    h: NDArray[np.float64],
    gradient: NDArray[np.float64],
) -> None:
    """Fill h with d dᵀ and gradient with d white."""
    for i in range(d.shape[0]):
        gradient[i] = _product(d[i], white)
        for m in range(d.shape[0]):
            h[i, m] = _product(d[i], d[m])


@entry(
    f"UniTuple(float64, 2)({_TIMES}, int64[::1], {_ARRAY}, float64, float64, {_ARRAY}, "
    "float64[:, ::1])"
)
def fit_parameters(
    t: NDArray[np.float64],
    sig: NDArray[np.float64],
    contact: NDArray[np.bool_],
    p: NDArray[np.float64],
    free: NDArray[np.int64],
    steps: NDArray[np.float64],
    g: float,
    rho: float,
    th: NDArray[np.float64],
    h: NDArray[np.float64],
) -> tuple[float, float]:
    """Move the free parameters and th to the least rᵀS⁻¹r (Levenberg and Marquardt).

    Returns what `true_times` returns. h (free, free): the information, in units of c⁻².
    """
    n = t.size - 2
    low, white, d = np.empty((n, 3)), np.empty(n), np.empty((free.size, n))
    rss, total = true_times(t, sig, contact, p, g, rho, th, low, white)
    if rss >= _IMPOSSIBLE:
        return rss, total
    gradient = np.empty(free.size)
    damping = 0.0
    for _ in range(_STEPS):
        if not _derivatives(th, contact, p, g, low, free, steps, d):
            break
        _information(d, white, h, gradient)
        moved = False
        for _ in range(_HALVINGS):
            step = -gradient
            if not _solve(h, step, damping):
                damping = max(10.0 * damping, 1e-9)
                continue
            new, places, promised = p.copy(), th.copy(), 0.0
            for i in range(free.size):
                new[free[i]] += step[i]
                promised -= step[i] * gradient[i]
            if promised < _LEAST_FALL * rss:
                break
            low2, white2 = np.empty((n, 3)), np.empty(n)
            rss2, total2 = true_times(t, sig, contact, new, g, rho, places, low2, white2)
            if rss2 < rss:
                p[:], th[:], low[:], white[:] = new, places, low2, white2
                rss, total, moved = rss2, total2, True
                damping = 0.0 if damping < 1e-8 else 0.1 * damping
                break
            damping = max(10.0 * damping, 1e-6)
        if not moved:
            break
    return rss, total
