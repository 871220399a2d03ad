"""Likelihood of measured impact times: kernels that integrate the true times out.

The platform is s = A sin(ωt + φ); ω = 0 is a platform at rest, with laws of its own (`rest_laws`).
From the true times θ follow the take-off and landing of each flight, so each inner impact k has a
coefficient of restitution

    e_k(θ_(k-1), θ_k, θ_(k+1)) = -(u_k - ṡ_k)/(v_k - ṡ_k) = ε + scatter.

The measured times are t = θ + errors. Linearised at the mode of θ, the equations have the
covariance S = BΣBᵀ + ρ²I with B = ∂e/∂θ, which has five diagonals. All errors are multiples of c,
and ρ = σ_ε/c.
"""

from __future__ import annotations

from math import cos, inf, log, sin, sqrt

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.core.compilation import entry, kernel, rare_kernel
from bouncing_disk_ros.measured.kernels.rest_laws import (
    AMPLITUDE,
    FREQUENCY,
    PARAMETERS,
    PHASE,
    RESTITUTION,
    VOID,
    rest_equations,
)

_LEAST_PART = 1e-3
"""Of a step."""
_MOST_STEPS = 3.0
"""That are made as one."""
_WAIT = 10
"""Rounds in which the squared step has to be halved: so many double the least part to a whole."""
_CLOSE = 1e-12
"""Squared steps in errors, per time: below it the mode is found."""
_NEAR = 1e-6
"""The same where rounding ends the steps."""
_RIDGE = 1e-11
_EXACT = 1e-12
"""Of an eigenvalue."""
_IMPOSSIBLE = 1e300
_ARRAY = "float64[::1]"


@rare_kernel
def _equations(
    th: NDArray[np.float64],
    p: NDArray[np.float64],
    kinds: NDArray[np.int64],
    g: float,
    e: NDArray[np.float64],
    b: NDArray[np.float64],
    d: NDArray[np.float64],
) -> bool:
    """Fill e (n), b (n, 3: derivatives by three times) and d (6, n: by the parameters).

    False: there is no such motion.
    """
    w, a = p[FREQUENCY], p[AMPLITUDE]
    if w == 0.0:
        return rest_equations(th, p, kinds, g, e, b, d)
    o1, c1 = sin(w * th[0] + p[PHASE]), cos(w * th[0] + p[PHASE])
    o2, c2 = sin(w * th[1] + p[PHASE]), cos(w * th[1] + p[PHASE])
    for j in range(e.size):
        x0, x1, x2 = th[j], th[j + 1], th[j + 2]
        tm, tp = x1 - x0, x2 - x1
        if not (tm > 0.0 and tp > 0.0):
            return False
        o0, c0, o1, c1 = o1, c1, o2, c2
        o2, c2 = sin(w * x2 + p[PHASE]), cos(w * x2 + p[PHASE])
        if kinds[j] == VOID:
            e[j], b[j], d[:, j] = 0.0, 0.0, 0.0
            continue
        mean, turn, bend = a * (o2 - o1) / tp, a * w * w * o1, w * x1 * o1 - c1
        u = mean + 0.5 * g * tp - a * w * c1
        u1, u2 = (mean - a * w * c1) / tp - 0.5 * g + turn, (a * w * c2 - mean) / tp + 0.5 * g
        ua, uf = (o2 - o1) / tp - w * c1, a * ((c2 - c1) / tp + w * o1)
        uw = a * ((x2 * c2 - x1 * c1) / tp + bend)
        mean = a * (o1 - o0) / tm
        v = mean - 0.5 * g * tm - a * w * c1
        v0, v1 = (mean - a * w * c0) / tm + 0.5 * g, (a * w * c1 - mean) / tm - 0.5 * g + turn
        va, vf = (o1 - o0) / tm - w * c1, a * ((c1 - c0) / tm + w * o1)
        vw = a * ((x1 * c1 - x0 * c0) / tm + bend)
        if v == 0.0:
            return False
        ratio = -u / v
        e[j] = ratio - p[RESTITUTION]
        b[j, 0], b[j, 1], b[j, 2] = -ratio * v0 / v, -(u1 + ratio * v1) / v, -u2 / v
        d[RESTITUTION, j], d[AMPLITUDE, j] = -1.0, -(ua + ratio * va) / v
        d[PHASE, j], d[FREQUENCY, j] = -(uf + ratio * vf) / v, -(uw + ratio * vw) / v
    return True


@kernel
def _covariances(
    b: NDArray[np.float64], sig: NDArray[np.float64], j: int, start: float
) -> tuple[float, float, float]:
    """Of equation j with itself, from `start` on, and with the two before: of BΣBᵀ."""
    a0, a1, a2 = start, 0.0, 0.0
    for m in range(3):
        a0 += (b[j, m] * sig[j + m]) ** 2
    if j >= 1:
        a1 = b[j - 1, 1] * b[j, 0] * sig[j] ** 2 + b[j - 1, 2] * b[j, 1] * sig[j + 1] ** 2
    if j >= 2:
        a2 = b[j - 2, 2] * b[j, 0] * sig[j] ** 2
    return a0, a1, a2


@rare_kernel
def _factor(
    b: NDArray[np.float64],
    sig: NDArray[np.float64],
    rho: float,
    low: NDArray[np.float64],
) -> float:
    """Cholesky factor of S in low (n, 3: L[j, j], L[j, j-1], L[j, j-2]); log det S, nan: none.

    An equation of nothing has the variance 1.
    """
    total = 0.0
    for j in range(b.shape[0]):
        a0, a1, a2 = _covariances(b, sig, j, rho * rho if b[j, 2] != 0.0 else 1.0)
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
def solve(h: NDArray[np.float64], x: NDArray[np.float64]) -> bool:
    """Replace x by h⁻¹x; whether that exists."""
    n = x.size
    low = np.zeros((n, n))
    for i in range(n):
        for j in range(i + 1):
            y = h[i, j] * (1.0 + _RIDGE if i == j else 1.0)
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


@kernel
def _moved(
    b: NDArray[np.float64], t: NDArray[np.float64], th: NDArray[np.float64], j: int
) -> float:
    """How much equation j differs at times t from times th."""
    total = 0.0
    for m in range(3):
        total += b[j, m] * (t[j + m] - th[j + m])
    return total


@rare_kernel
def _joint_product(
    sig: NDArray[np.float64],
    h: NDArray[np.float64],
    by: NDArray[np.float64],
    move: NDArray[np.float64],
    by2: NDArray[np.float64],
    move2: NDArray[np.float64],
) -> float:
    """Scalar product of two steps: times count in errors, parameters by their information."""
    total = 0.0
    for i in range(by.size):
        total += by[i] * _product(h[i], by2)
    for k in range(sig.size):
        total += (move[k] / sig[k]) * (move2[k] / sig[k])
    return total


@rare_kernel
def _step(
    t: NDArray[np.float64],
    sig: NDArray[np.float64],
    th: NDArray[np.float64],
    e: NDArray[np.float64],
    b: NDArray[np.float64],
    low: NDArray[np.float64],
    d: NDArray[np.float64],
    h: NDArray[np.float64],
    pull: NDArray[np.float64],
    white: NDArray[np.float64],
    by: NDArray[np.float64],
    move: NDArray[np.float64],
) -> float:
    """Fill by and move (steps of parameters and times) and white; their squared length, or nan.

    b, low, d (free, n: whitened) and h may be those of a point nearby. pull (free): half of the
    derivatives of what is known of the parameters. white: L⁻¹ of the
    equations as the measured times would have them.
    """
    n = e.size
    for j in range(n):
        white[j] = e[j] + _moved(b, t, th, j)
    _whiten(low, white)
    for i in range(by.size):
        by[i] = -_product(d[i], white) - pull[i]
    if not solve(h, by):
        return np.nan
    q = white.copy()
    for i in range(by.size):
        q += by[i] * d[i]
    _unwhiten(low, q)
    for k in range(t.size):
        move[k] = t[k] - th[k]
        for m in range(3):
            if 0 <= k - m < n:
                move[k] -= sig[k] ** 2 * b[k - m, m] * q[k - m]
    return _joint_product(sig, h, by, move, by, move)


@rare_kernel
def _part(p: NDArray[np.float64], free: NDArray[np.int64], by: NDArray[np.float64]) -> float:
    """The largest part of a step that moves no parameter too far."""
    part = 1.0
    for i in range(free.size):
        most = 0.3 * abs(p[free[i]]) + 1e-300 if free[i] == AMPLITUDE else 0.2
        if abs(by[i]) > most:
            part = min(part, most / abs(by[i]))
    return part


@rare_kernel
def _sum_of_steps(
    sig: NDArray[np.float64],
    h: NDArray[np.float64],
    by: NDArray[np.float64],
    move: NDArray[np.float64],
    last_by: NDArray[np.float64],
    last_move: NDArray[np.float64],
    last: float,
    part: float,
) -> float:
    """How many such steps all coming ones add up to, if each is the same part of the one before.

    `last`: squared length of the step before, inf if that was no whole one. `part`: of this step;
    it stays as it is if the step is no whole one.
    """
    if part < 1.0 or last == inf:
        return part
    share = _joint_product(sig, h, last_by, last_move, by, move) / last
    return 1.0 / max(1.0 - share, 1.0 / _MOST_STEPS)


@rare_kernel
def _sum_of_squares(
    t: NDArray[np.float64],
    sig: NDArray[np.float64],
    th: NDArray[np.float64],
    e: NDArray[np.float64],
    rho: float,
) -> float:
    """What the mode makes least, where it is not found."""
    total = 0.0
    for k in range(t.size):
        total += ((t[k] - th[k]) / sig[k]) ** 2
    for j in range(e.size):
        if rho == 0.0:
            return _IMPOSSIBLE
        total += (e[j] / rho) ** 2
    return total


@rare_kernel
def _excess(
    sig: NDArray[np.float64],
    b: NDArray[np.float64],
    rho: float,
    low: NDArray[np.float64],
) -> float:
    """Logarithm of det S over the determinant of the density of times; low (n, 3): the factor of S.

    Each time follows from the two before it, so that density is the product of b[:, 2]: the first
    two times are integrated over a flat measure.
    """
    total = _factor(b, sig, rho, low)
    for j in range(b.shape[0]):
        if b[j, 2] != 0.0:
            total -= 2.0 * log(abs(b[j, 2]) * sig[j + 2])
    return total


@entry(
    f"void({_ARRAY}, {_ARRAY}, int64[::1], int64[::1], {_ARRAY}, float64, float64, {_ARRAY}, "
    f"{_ARRAY})"
)
def excess_slopes(
    sig: NDArray[np.float64],
    p: NDArray[np.float64],
    free: NDArray[np.int64],
    kinds: NDArray[np.int64],
    th: NDArray[np.float64],
    g: float,
    rho: float,
    steps: NDArray[np.float64],
    slopes: NDArray[np.float64],
) -> None:
    """Fill slopes (6) of `_excess` at fixed times, by steps of the free parameters."""
    n = th.size - 2
    e, b, d, low = np.empty(n), np.empty((n, 3)), np.empty((PARAMETERS, n)), np.empty((n, 3))
    for i in free:
        if i == RESTITUTION:  # B does not depend on it
            continue
        q, found = p.copy(), 0.0
        for sign in (-1.0, 1.0):
            q[i] = p[i] + sign * steps[i]
            if not _equations(th, q, kinds, g, e, b, d):
                found = 0.0
                break
            found += sign * _excess(sig, b, rho, low)
        slopes[i] = found / (2.0 * steps[i])


@rare_kernel
def _whitened(
    low: NDArray[np.float64],
    every: NDArray[np.float64],
    free: NDArray[np.int64],
    known: NDArray[np.float64],
    d: NDArray[np.float64],
    h: NDArray[np.float64],
) -> None:
    """Fill d with L⁻¹ of the derivatives by the free parameters, h with ddᵀ and their weights."""
    for i in range(free.size):
        d[i] = every[free[i]]
        _whiten(low, d[i])
        for m in range(i + 1):
            h[i, m] = h[m, i] = _product(d[i], d[m])
        h[i, i] += known[1, free[i]]


@rare_kernel
def _pull(
    p: NDArray[np.float64],
    known: NDArray[np.float64],
    free: NDArray[np.int64],
    pull: NDArray[np.float64],
) -> float:
    """Fill pull (free) with the weighted distances from what is known; their sum of squares."""
    total = 0.0
    for i in range(free.size):
        away, weight = p[free[i]] - known[0, free[i]], known[1, free[i]]
        pull[i] = weight * away
        total += weight * away * away
    return total


@rare_kernel
def _added(
    p: NDArray[np.float64], free: NDArray[np.int64], part: float, by: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Parameters after a part of a step."""
    q = p.copy()
    for i in range(free.size):
        q[free[i]] += part * by[i]
    return q


@entry(
    f"UniTuple(float64, 2)({_ARRAY}, {_ARRAY}, {_ARRAY}, int64[::1], float64[:, ::1], int64[::1], "
    f"float64, float64, {_ARRAY}, float64[:, ::1], float64[:, ::1], float64[:, ::1])"
)
def fit_times(
    t: NDArray[np.float64],
    sig: NDArray[np.float64],
    p: NDArray[np.float64],
    free: NDArray[np.int64],
    known: NDArray[np.float64],
    kinds: NDArray[np.int64],
    g: float,
    rho: float,
    th: NDArray[np.float64],
    h: NDArray[np.float64],
    b: NDArray[np.float64],
    low: NDArray[np.float64],
) -> tuple[float, float]:
    """Move the free parameters and true times th to the least rᵀS⁻¹r; that, and `_excess`.

    1e300 where there is none. known (2, 6): values of parameters and their weights, in units of
    c⁻², which count among the squares; h (free, free): the information in units of c⁻²; b (n, 3):
    B; low (n, 3): Cholesky factor of S. A step of Gauss and Newton is shortened until that from its
    end, with the same derivatives, is shorter too (natural test of Deuflhard, "Newton Methods for
    Nonlinear Problems", 2004). Near the end each step is a nearly constant part of the one before,
    so after a whole step the next ones are made as one (Aitken's delta-squared process). Far from
    the times such steps can go back and forth for ever (Ascher and Osborne, "A note on solving
    nonlinear equations and the natural criterion function", 1987). So the search ends where steps
    do not become shorter.
    """
    n, size = t.size - 2, free.size
    e, every, d, white = np.empty(n), np.empty((PARAMETERS, n)), np.empty((size, n)), np.empty(n)
    e2, b2, every2, white2 = np.empty(n), np.empty((n, 3)), np.empty(every.shape), np.empty(n)
    pull, by, by2, move, move2 = (
        np.empty(size), np.empty(size), np.empty(size), np.empty(t.size), np.empty(t.size)
    )  # fmt: skip
    if not _equations(th, p, kinds, g, e, b, every):
        return _IMPOSSIBLE, 0.0
    part, length, is_found, least, since = 1.0, 0.0, False, inf, 0
    last_by, last_move, last = by.copy(), move.copy(), inf
    while since < _WAIT:
        if not _factor(b, sig, rho, low) < inf:
            return _IMPOSSIBLE, 0.0
        _whitened(low, every, free, known, d, h)
        _pull(p, known, free, pull)
        length = _step(t, sig, th, e, b, low, d, h, pull, white, by, move)
        if not length < inf:
            return _IMPOSSIBLE, 0.0
        is_found = length < _CLOSE * t.size
        least, since = (length, 0) if length < 0.5 * least else (least, since + 1)
        part = min(_part(p, free, by), 2.0 * part)
        part = _sum_of_steps(sig, h, by, move, last_by, last_move, last, part)
        while part > _LEAST_PART:
            q, places = _added(p, free, part, by), th + part * move
            if _equations(places, q, kinds, g, e2, b2, every2):
                _pull(q, known, free, pull)
                after = _step(t, sig, places, e2, b, low, d, h, pull, white2, by2, move2)
                most = (1.0 - 0.5 * min(part, 1.0)) ** 2 + max(part - 1.0, 0.0) ** 2
                if is_found or after < most * length:
                    th[:], p[:], e[:], b[:], every[:] = places, q, e2, b2, every2
                    last_by[:], last_move[:], last = by, move, length if part == 1.0 else inf
                    break
            part *= 0.5
        if is_found or part <= _LEAST_PART:
            break
    rss = _product(white, white)
    if not is_found and length > _NEAR * t.size:
        rss = _sum_of_squares(t, sig, th, e, rho)
    rss += _pull(p, known, np.arange(PARAMETERS), np.empty(PARAMETERS))
    total = _excess(sig, b, rho, np.empty((n, 3)))
    return (rss, total) if rss + abs(total) < _IMPOSSIBLE else (_IMPOSSIBLE, 0.0)


@entry(
    f"boolean({_ARRAY}, {_ARRAY}, {_ARRAY}, int64[::1], int64[::1], float64, float64, {_ARRAY}, "
    f"{_ARRAY}, float64[:, ::1])"
)
def whitened_residuals(
    t: NDArray[np.float64],
    sig: NDArray[np.float64],
    p: NDArray[np.float64],
    free: NDArray[np.int64],
    kinds: NDArray[np.int64],
    g: float,
    rho: float,
    th: NDArray[np.float64],
    white: NDArray[np.float64],
    d: NDArray[np.float64],
) -> bool:
    """Fill white (n) with L⁻¹ of the equations at the measured times, by those at true times th.

    d (free, n): its derivatives by the free parameters. If the model is true, white is c times
    independent normal numbers. False: there is no such motion.
    """
    n = t.size - 2
    b, low, every = np.empty((n, 3)), np.empty((n, 3)), np.empty((PARAMETERS, n))
    if not (_equations(th, p, kinds, g, white, b, every) and _factor(b, sig, rho, low) < inf):
        return False
    for j in range(n):
        white[j] += _moved(b, t, th, j)
    _whiten(low, white)
    for i in range(free.size):
        d[i] = every[free[i]]
        _whiten(low, d[i])
    return True


@entry(f"void(float64[:, ::1], {_ARRAY})")
def solve_factored(low: NDArray[np.float64], r: NDArray[np.float64]) -> None:
    """Replace r (n) by S⁻¹r; low (n, 3): Cholesky factor of S."""
    _whiten(low, r)
    _unwhiten(low, r)


@rare_kernel
def _below(b: NDArray[np.float64], sig: NDArray[np.float64], bound: float) -> int:
    """How many eigenvalues of BΣBᵀ are below a bound: negative pivots (Sylvester's law)."""
    count, pivot1, pivot2, l1_before = 0, 1.0, 1.0, 0.0
    for j in range(b.shape[0]):
        a0, a1, a2 = _covariances(b, sig, j, -bound)
        l1 = a1 - a2 * l1_before  # both times the pivot before
        pivot = a0 - l1 * l1 / pivot1 - a2 * a2 / pivot2
        if pivot == 0.0:
            pivot = -1e-300
        count += pivot < 0.0
        pivot2, pivot1, l1_before = pivot1, pivot, l1 / pivot1
    return count


@entry(f"float64(float64[:, ::1], {_ARRAY}, int64)")
def median_eigenvalue(b: NDArray[np.float64], sig: NDArray[np.float64], nothing: int) -> float:
    """Median eigenvalue of BΣBᵀ; `nothing`: how many equations, of nothing, do not count.

    By bisection, between 0 and the largest sum of a row.
    """
    n = b.shape[0]
    middle, most = nothing + (n - nothing) // 2, 0.0
    for j in range(n):
        row = abs(b[j, 0]) * sig[j] + abs(b[j, 1]) * sig[j + 1] + abs(b[j, 2]) * sig[j + 2]
        most = max(most, row)
    found = 0.0
    for place in (middle, middle - 1 + (n - nothing) % 2):
        low, high = 0.0, 3.0 * most * most
        while high - low > _EXACT * high:
            bound = 0.5 * (low + high)
            if _below(b, sig, bound) > place:
                high = bound
            else:
                low = bound
        found += 0.25 * (low + high)
    return found
