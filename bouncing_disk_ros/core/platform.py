"""Platform motion: derivatives, cross-fades and the bounds that certify root finding.

In a cross-fade A, Φ, f and θ each go from v to v + Δv as v + Δv b(σ), σ = (t − begin)/duration,
with the C² blend b = 10σ³ − 15σ⁴ + 6σ⁵; there is one forcing phase τ = ∫ω dt, so s = A sin τ and β
= Φ sin(τ + θ) keep closed forms (paper, eq. 1, for a steady motion).
"""

from __future__ import annotations

import math
from collections import namedtuple
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.core.arithmetic import (
    GIGA,
    TWO_PI,
    pair_sum,
    sincos,
    sine_and_cosine,
    two_product,
    wrapped,
)
from bouncing_disk_ros.core.compilation import kernel, rare_kernel
from bouncing_disk_ros.core.layout import (
    FADE,
    MOTION_DTYPE,
    MOVING,
    NEVER,
    OFFSET_DEGREE,
    PLATFORM_DTYPE,
    STEADY,
)

if TYPE_CHECKING:
    from bouncing_disk_ros.core.model import Motion


Record = Any  # a numba record: one element of an array with a dtype of `layout`
Jet = tuple[float, float, float, float, float]
Table = Any  # float64 (6, 6, 2), or None
Six = tuple[float, float, float, float, float, float]

PAST_END = 4.0
"""ns: how far past its end a segment is followed (events are searched a little past a boundary)."""
_SLACK = 2e-15  # of the sum of a polynomial's coefficients: the rounding of its bounds

_JUST_PAST = 1.0 + 1e-9  # more than half a period ahead lies the zero that has just been
# Largest values of b', b'', b''', b'''' on [0, 1].
_BLEND_BOUNDS = (15.0 / 8.0, 10.0 / math.sqrt(3.0), 60.0, 360.0)


@kernel
def blend_jet(x: float, duration: float) -> Jet:
    """b at x = σ in [0, 1] and its first four derivatives in time."""
    y = 1.0 - x
    r = 1.0 / duration
    b0 = x * x * x * (10.0 - 15.0 * x + 6.0 * x * x)
    b1 = 30.0 * x * x * y * y * r
    b2 = 60.0 * x * y * (1.0 - 2.0 * x) * r * r
    b3 = 60.0 * (1.0 - 6.0 * x * y) * r * r * r
    b4 = 360.0 * (2.0 * x - 1.0) * r * r * r * r
    return b0, b1, b2, b3, b4


@kernel
def _product_jet(z: Jet, sine: float, cosine: float, q: Jet) -> Jet:
    """Derivatives of A sin χ from those of A (z) and of χ (q[1:]), with s = sin χ, c = cos χ."""
    _, q1, q2, q3, q4 = q
    y1 = cosine * q1
    y2 = cosine * q2 - sine * q1 * q1
    y3 = cosine * (q3 - q1 * q1 * q1) - 3.0 * sine * q1 * q2
    y4 = cosine * (q4 - 6.0 * q1 * q1 * q2) - sine * (
        4.0 * q1 * q3 + 3.0 * q2 * q2 - q1 * q1 * q1 * q1
    )
    z0, z1, z2, z3, z4 = z
    return (
        z0 * sine,
        z1 * sine + z0 * y1,
        z2 * sine + 2.0 * z1 * y1 + z0 * y2,
        z3 * sine + 3.0 * (z2 * y1 + z1 * y2) + z0 * y3,
        z4 * sine + 4.0 * (z3 * y1 + z1 * y3) + 6.0 * z2 * y2 + z0 * y4,
    )


@kernel
def _steady_jet(amplitude: float, sine: float, cosine: float, w: float) -> Jet:
    z0 = amplitude * sine
    z1 = amplitude * w * cosine
    w2 = w * w
    return z0, z1, -w2 * z0, -w2 * z1, w2 * w2 * z0


# ------------------------------------------------------------------------------------------------
# What an offset adds. A table of None, as a SteadyMotion has, adds nothing: numba then leaves out
# the rest.


@rare_kernel
def offset_at(table: Table, duration: float, time: float) -> Six:
    """Derivatives 0 to 5 of a segment of `duration` ns, `time` s after its begin, to rounding."""
    if table is None:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    t, more = two_product(time, GIGA)
    x = t / duration
    p, e = two_product(x, duration)
    rest = (((t - p) - e) + more) / duration  # of the quotient
    d0 = d1 = d2 = d3 = d4 = d5 = 0.0
    for order in range(OFFSET_DEGREE + 1):
        high = low = 0.0
        for i in range(OFFSET_DEGREE - order, -1, -1):
            # Horner's step with pairs: what x lacks and the products' errors are carried along
            p, e = two_product(high, x)
            e += high * rest + low * x
            high, low = pair_sum(p, e, table[order, i, 0], table[order, i, 1])
        if order == 0:
            d0 = high
        elif order == 1:
            d1 = high
        elif order == 2:
            d2 = high
        elif order == 3:
            d3 = high
        elif order == 4:
            d4 = high
        else:
            d5 = high
    return d0, d1, d2, d3, d4, d5


@kernel
def added(jet: Jet, p: Six) -> Jet:
    """A platform's jet with an offset."""
    return jet[0] + p[0], jet[1] + p[1], jet[2] + p[2], jet[3] + p[3], jet[4] + p[4]


@rare_kernel
def offset_bounds(
    table: Table, duration: float, begin: float, end: float
) -> tuple[float, float, float]:
    """Largest absolute second, third and fourth derivative between two times of a segment, s.

    At the ends, or where the next derivative is 0; rounded up.
    """
    if table is None:
        return 0.0, 0.0, 0.0
    x0 = begin * GIGA / duration
    x1 = max(x0, min(end * GIGA, duration + PAST_END) / duration)
    a, b = table[4, 0, 0], table[4, 1, 0]
    s4 = max(abs(a + b * x0), abs(a + b * x1))
    s4 += _SLACK * (abs(a) + abs(b))
    a, b, c = table[3, 0, 0], table[3, 1, 0], table[3, 2, 0]
    s3 = max(abs(a + x0 * (b + x0 * c)), abs(a + x1 * (b + x1 * c)))
    if c != 0.0:
        x = min(max(-0.5 * b / c, x0), x1)
        s3 = max(s3, abs(a + x * (b + x * c)))
    s3 += _SLACK * (abs(a) + abs(b) + abs(c))
    a, b, c, e = table[2, 0, 0], table[2, 1, 0], table[2, 2, 0], table[2, 3, 0]
    s2 = max(abs(a + x0 * (b + x0 * (c + x0 * e))), abs(a + x1 * (b + x1 * (c + x1 * e))))
    root = c * c - 3.0 * b * e
    if root >= 0.0:
        q = -(c + (math.sqrt(root) if c >= 0.0 else -math.sqrt(root)))
        x = x0 if e == 0.0 else min(max(q / (3.0 * e), x0), x1)
        y = x0 if q == 0.0 else min(max(b / q, x0), x1)
        s2 = max(s2, abs(a + x * (b + x * (c + x * e))), abs(a + y * (b + y * (c + y * e))))
    s2 += _SLACK * (abs(a) + abs(b) + abs(c) + abs(e))
    return s2, s3, s4


# ------------------------------------------------------------------------------------------------
# The platform's motion: sinusoid or cross-fade, and offset.


@kernel
def axial_jet(motion: Record, sine: float, cosine: float, elapsed: float) -> Jet:
    """s and its first four derivatives where sin τ = s, cos τ = c, `elapsed` s into a fade."""
    if motion.kind == STEADY and motion.offset == 0:
        return _steady_jet(motion.a, sine, cosine, motion.omega)
    return _changing_axial_jet(motion, sine, cosine, elapsed)


@rare_kernel
def _changing_axial_jet(motion: Record, sine: float, cosine: float, elapsed: float) -> Jet:
    jet = sinusoid_jet(motion, sine, cosine, elapsed)
    if motion.offset == 0:
        return jet
    time = elapsed + motion.axial_lead
    return added(jet, offset_at(motion.axial, motion.axial_duration, time))


@kernel
def sinusoid_jet(motion: Record, sine: float, cosine: float, elapsed: float) -> Jet:
    """`axial_jet` without what an offset adds."""
    if motion.kind != FADE:
        return _steady_jet(motion.a, sine, cosine, motion.omega)
    return _fading_axial_jet(motion, sine, cosine, elapsed)


@rare_kernel
def _fading_axial_jet(motion: Record, sine: float, cosine: float, elapsed: float) -> Jet:
    b0, b1, b2, b3, b4 = blend_jet((elapsed + motion.fade_lead) / motion.duration, motion.duration)
    d = motion.da
    z = (motion.a + d * b0, d * b1, d * b2, d * b3, d * b4)
    w = TWO_PI * motion.df
    q = (0.0, TWO_PI * (motion.f + motion.df * b0), w * b1, w * b2, w * b3)
    return _product_jet(z, sine, cosine, q)


@kernel
def angular_jet(motion: Record, s: float, c: float, elapsed: float) -> Jet:
    """β and its first four derivatives; arguments as in `axial_jet`."""
    if motion.kind == STEADY and motion.offset == 0:
        return _turned_jet(motion, s, c)
    return _changing_angular_jet(motion, s, c, elapsed)


@rare_kernel
def _changing_angular_jet(motion: Record, s: float, c: float, elapsed: float) -> Jet:
    if motion.kind != FADE:
        jet = _turned_jet(motion, s, c)
    else:
        jet = _fading_angular_jet(motion, s, c, elapsed)
    if motion.offset == 0:
        return jet
    time = elapsed + motion.angular_lead
    return added(jet, offset_at(motion.angular, motion.angular_duration, time))


@kernel
def _turned_jet(motion: Record, s: float, c: float) -> Jet:
    sine = s * motion.lag_cosine + c * motion.lag_sine
    cosine = c * motion.lag_cosine - s * motion.lag_sine
    return _steady_jet(motion.p, sine, cosine, motion.omega)


@rare_kernel
def _fading_angular_jet(motion: Record, s: float, c: float, elapsed: float) -> Jet:
    b0, b1, b2, b3, b4 = blend_jet((elapsed + motion.fade_lead) / motion.duration, motion.duration)
    lag_sine, lag_cosine = sincos(motion.lag + motion.dlag * b0)
    sine = s * lag_cosine + c * lag_sine
    cosine = c * lag_cosine - s * lag_sine
    d = motion.dp
    z = (motion.p + d * b0, d * b1, d * b2, d * b3, d * b4)
    w = TWO_PI * motion.df
    v = motion.dlag
    q1 = TWO_PI * (motion.f + motion.df * b0) + v * b1
    return _product_jet(
        z, sine, cosine, (0.0, q1, w * b1 + v * b2, w * b2 + v * b3, w * b3 + v * b4)
    )


@kernel
def relative_blend(motion: Record, elapsed: float) -> Jet:
    """Coefficients c1 … c5 of b(σ + δ) − b(σ) = Σ c_k δ^k, `elapsed` s into a fade."""
    x = (elapsed + motion.fade_lead) / motion.duration
    y = 1.0 - x
    return (
        30.0 * x * x * y * y,
        30.0 * x * y * (1.0 - 2.0 * x),
        10.0 * (1.0 - 6.0 * x * y),
        15.0 * (2.0 * x - 1.0),
        6.0,
    )


@kernel
def phase_advance(motion: Record, elapsed: float, d: float) -> float:
    """Growth of τ in d seconds, rad, beginning `elapsed` seconds after a fade began."""
    if motion.kind != FADE:
        return motion.omega * d
    c1, c2, c3, c4, c5 = relative_blend(motion, elapsed)
    b0, _, _, _, _ = blend_jet((elapsed + motion.fade_lead) / motion.duration, motion.duration)
    x = d / motion.duration
    grown = x * x * (c1 / 2.0 + x * (c2 / 3.0 + x * (c3 / 4.0 + x * (c4 / 5.0 + x * c5 / 6.0))))
    return TWO_PI * ((motion.f + motion.df * b0) * d + motion.df * motion.duration * grown)


@kernel
def turns_not(motion: Record) -> bool:
    """Whether the platform does not turn, over all of its motion in force."""
    return motion.p == 0.0 and motion.dp == 0.0 and motion.turning == 0


@kernel
def turns_next(motion: Record, b: Jet) -> int:
    """Sign with which a platform whose β̇ is 0 turns from here on; 0: it stands."""
    if turns_not(motion):
        return 0
    for derivative in (b[2], b[3], b[4], motion.fifth):
        if derivative != 0.0:
            return 1 if derivative > 0.0 else -1
    return 0


@kernel
def turning_phase(motion: Record, sign: float) -> float:
    """Forcing phase at which β̇ of a steady motion falls (sign 1) or rises through zero, rad."""
    phase = (0.5 if sign > 0.0 else 1.5) * math.pi - motion.lag
    return wrapped(phase - TWO_PI * math.floor(phase / TWO_PI))


@kernel
def until_turning(motion: Record, tau: float, sign: float) -> float:
    """Seconds until β̇ of a steady motion, which has this sign, is zero."""
    ahead = wrapped(turning_phase(motion, sign) - tau)
    return 0.0 if ahead > math.pi * _JUST_PAST else ahead / motion.omega


DERIVATIVE_RATIO = 18.0
"""Over a segment of duration T no derivative from the third on is larger than this over T times
that before it (Markov's inequality for degree 3)."""
ROOM = 1.0 + 1e-12  # bounds are rounded up by more than the rounding of their own sums


_tuple_of: Callable[..., Any] = namedtuple  # mypy knows those of literal names alone
SteadyMotion = _tuple_of(
    "SteadyMotion",
    [name for name in PLATFORM_DTYPE.names or () if name not in ("end_ns", "cycles", "tau")],
)
"""A steady motion with the fields of layout.PLATFORM_DTYPE that kernels read.

Given in place of a record: without an offset numba leaves out what a steady motion does not need.
"""


@kernel
def steady_motion(
    a: float, p: float, f: float, w: float, lag: float, lag_sine: float, lag_cosine: float
) -> Record:
    """s = a sin ωt, β = p sin(ωt + lag) with ω = w = 2πf, and the bounds that certify roots."""
    s2, b2 = a * w * w * ROOM, p * w * w * ROOM
    return SteadyMotion(
        kind=STEADY, begin_ns=0, duration=math.inf, a=a, da=0.0, p=p, dp=0.0, f=f, df=0.0,
        lag=lag, dlag=0.0, lag_sine=lag_sine, lag_cosine=lag_cosine, omega=w, omega_max=w,
        top=a * ROOM, s2=s2, s3=s2 * w, s4=s2 * w * w, b2=b2, b3=b2 * w, b4=b2 * w * w,
        offset=0, axial=None, angular=None, axial_duration=1.0, angular_duration=1.0,
        span=math.inf, origin_ns=0, axial_lead=0.0, angular_lead=0.0, fade_lead=0.0,
        fade_end=math.inf, turning=0, bending=0, fifth=0.0, separation_g=math.nan,
        separation_phase=0.0,
    )  # fmt: skip


@rare_kernel
def moved_motion(motion: Record, moves: bool, table: Table, span: float, since: float) -> Record:
    """A steady motion up and down that an axial offset moves besides, `since` s after its begin.

    `table` of a segment that lasts `span` s (`offset_at`); not `moves`: it adds nothing.
    """
    m, duration = motion, span * GIGA
    kind, top, fastest = STEADY, m.top, m.omega
    s2 = s3 = s4 = 0.0
    if moves:
        kind, top, fastest = MOVING, math.inf, max(m.omega, DERIVATIVE_RATIO / span)
        s2, s3, s4 = offset_bounds(table, duration, 0.0, span)
    s2, s3, s4 = m.s2 + s2 * ROOM, m.s3 + s3 * ROOM, m.s4 + s4 * ROOM
    bent = int(moves)
    return SteadyMotion(
        kind=kind, begin_ns=0, duration=math.inf, a=m.a, da=0.0, p=0.0, dp=0.0, f=m.f, df=0.0,
        lag=0.0, dlag=0.0, lag_sine=0.0, lag_cosine=1.0, omega=m.omega, omega_max=fastest,
        top=top, s2=s2, s3=s3, s4=s4, b2=0.0, b3=0.0, b4=0.0,
        offset=bent, axial=table, angular=None, axial_duration=duration, angular_duration=1.0,
        span=math.inf, origin_ns=0, axial_lead=since, angular_lead=0.0, fade_lead=0.0,
        fade_end=math.inf, turning=0, bending=bent, fifth=0.0, separation_g=math.nan,
        separation_phase=0.0,
    )  # fmt: skip


def _amplitude_bounds(begin: float, change: float, duration: float) -> tuple[float, ...]:
    rates = (abs(change) * b / duration**order for order, b in enumerate(_BLEND_BOUNDS, start=1))
    return (max(begin, begin + change), *rates)


@kernel
def derivative_bounds(
    z: Jet, q1: float, q2: float, q3: float, q4: float
) -> tuple[float, float, float]:
    """Bounds of the second to fourth derivatives of A sin χ from those of A (z) and χ (q)."""
    y1 = q1
    y2 = q2 + q1**2
    y3 = q3 + q1**3 + 3 * q1 * q2
    y4 = q4 + 6 * q1**2 * q2 + 4 * q1 * q3 + 3 * q2**2 + q1**4
    return (
        z[2] + 2 * z[1] * y1 + z[0] * y2,
        z[3] + 3 * z[2] * y1 + 3 * z[1] * y2 + z[0] * y3,
        z[4] + 4 * z[3] * y1 + 6 * z[2] * y2 + 4 * z[1] * y3 + z[0] * y4,
    )


def derive(m: NDArray[np.void]) -> None:
    """Fill in what follows from the other fields of a motion's record: bounds, ω, sin θ, cos θ."""
    r = m[0]
    duration = float(r["duration"]) if r["kind"] == FADE else math.inf
    spread = [b / duration**order for order, b in enumerate(_BLEND_BOUNDS, start=1)]
    w = TWO_PI * max(r["f"], r["f"] + r["df"])
    dw, dlag = TWO_PI * abs(r["df"]), abs(r["dlag"])
    a = _amplitude_bounds(float(r["a"]), float(r["da"]), duration)
    p = _amplitude_bounds(float(r["p"]), float(r["dp"]), duration)
    bounds = getattr(derivative_bounds, "py_func", derivative_bounds)  # without compiling it
    s = bounds(a, w, dw * spread[0], dw * spread[1], dw * spread[2])
    b = bounds(
        p,
        w + dlag * spread[0],
        dw * spread[0] + dlag * spread[1],
        dw * spread[1] + dlag * spread[2],
        dw * spread[2] + dlag * spread[3],
    )
    r["omega"] = TWO_PI * r["f"]
    r["lag_sine"], r["lag_cosine"] = sine_and_cosine(float(r["lag"]))
    r["omega_max"] = w
    r["top"] = a[0] * ROOM
    r["s2"], r["s3"], r["s4"] = (x * ROOM for x in s)
    r["b2"], r["b3"], r["b4"] = (x * ROOM for x in b)


def steady(motion: Motion, begin_ns: int, cycles: int, tau: float) -> NDArray[np.void]:
    """Record of a steady motion whose forcing phase at begin_ns is (cycles, tau)."""
    m = np.zeros(1, MOTION_DTYPE)
    m["kind"], m["begin_ns"], m["end_ns"], m["cycles"], m["tau"] = (
        STEADY,
        begin_ns,
        NEVER,
        cycles,
        tau,
    )
    m["a"], m["p"], m["f"], m["lag"] = motion
    derive(m)
    return m


def fade(
    start: Motion, target: Motion, begin_ns: int, end_ns: int, cycles: int, tau: float
) -> NDArray[np.void]:
    """Record of a cross-fade between two motions; the phase lag takes the shortest way."""
    m = steady(start, begin_ns, cycles, tau)
    m["kind"], m["end_ns"], m["duration"] = FADE, end_ns, (end_ns - begin_ns) * 1e-9
    m["da"] = target.axial_amplitude - start.axial_amplitude
    m["dp"] = target.angular_amplitude - start.angular_amplitude
    m["df"] = target.frequency - start.frequency
    m["dlag"] = math.remainder(target.phase_lag - start.phase_lag, TWO_PI)
    derive(m)
    return m


def without_offset(sinusoid: NDArray[np.void]) -> NDArray[np.void]:
    """What the kernels read of a sinusoid or a cross-fade (layout.PLATFORM_DTYPE)."""
    m = np.zeros(1, PLATFORM_DTYPE)
    m.view(np.uint8)[: sinusoid.nbytes] = sinusoid.view(np.uint8)  # the record begins with it
    m["origin_ns"], m["span"] = m["begin_ns"], math.inf
    m["fade_end"] = m["duration"] if m["kind"][0] == FADE else math.inf
    m["axial_duration"] = m["angular_duration"] = 1e9
    m["separation_g"] = math.nan
    return m


# ------------------------------------------------------------------------------------------------
# Bounds of the platform's derivatives over a piece of a motion: what certifies each search step.
#
# A steady motion has one set of bounds for all times. A cross-fade is cut into panels of at most
# one period of the moment, over which the frequency at most doubles: so the steps of a search
# follow the frequency of the moment, not the highest of the whole fade.


_FEWEST_PANELS = 16.0
_SECOND_PEAK = 0.5 - math.sqrt(3.0) / 6.0  # where |b''| is largest, 10/√3; and at 1 minus that


class Bounds(NamedTuple):
    """Bounds of |s̈|, |s⃛|, |s⁗| and |β̈|, |β⃛|, |β⁗|, valid up to the delay `until` (s)."""

    s2: float
    s3: float
    s4: float
    b2: float
    b3: float
    b4: float
    until: float


@kernel
def bounds_from(motion: Record, elapsed: float, d: float) -> Bounds:
    """Bounds from the delay d on, to the end of the panel of a cross-fade that holds d.

    `elapsed` is that of delay 0 in the cross-fade, in s.
    """
    if motion.kind == STEADY:
        return _whole(motion)
    return _fading_bounds_from(motion, elapsed, d)


@rare_kernel
def _fading_bounds_from(motion: Record, elapsed: float, d: float) -> Bounds:
    span = span_from(motion, elapsed + d, motion.duration / _FEWEST_PANELS, 1.0)
    return _fading_bounds(motion, elapsed, d, d + min(span, motion.span))


@kernel
def span_from(motion: Record, elapsed: float, longest: float, periods: float) -> float:
    """Seconds: at most `longest`, and so many periods of the moment; the frequency doubles at most.

    `elapsed` seconds into a cross-fade.
    """
    f = frequency_at(motion, elapsed)
    span = min(longest, periods / f)
    for _ in range(60):
        if frequency_at(motion, elapsed + span) <= 2.0 * f:
            break
        span *= 0.5
    return span


@kernel
def frequency_at(motion: Record, elapsed: float) -> float:
    """f, `elapsed` seconds into a cross-fade, Hz; that of its end after it."""
    x = min(max((elapsed + motion.fade_lead) / motion.duration, 0.0), 1.0)
    return motion.f + motion.df * _blend(x)


@kernel
def _whole(motion: Record) -> Bounds:
    return Bounds(motion.s2, motion.s3, motion.s4, motion.b2, motion.b3, motion.b4, math.inf)


@kernel
def bounds_between(motion: Record, elapsed: float, d: float, end: float) -> Bounds:
    """Bounds between two delays, s."""
    if motion.kind == STEADY:
        return _whole(motion)
    return _fading_bounds(motion, elapsed, d, end)


@rare_kernel
def _fading_bounds(motion: Record, elapsed: float, d: float, end: float) -> Bounds:
    r = 1.0 / motion.duration
    since = elapsed + motion.fade_lead
    x0, x1 = min(max(since + d, 0.0) * r, 1.0), min(max(since + end, 0.0) * r, 1.0)
    b1, b2, b3, b4 = _blend_bounds(x0, x1, r)
    low, high = _blend(x0), _blend(x1)
    w = TWO_PI * _largest(motion.f, motion.df, low, high)
    dw, turn = TWO_PI * abs(motion.df), abs(motion.dlag)
    a = _largest(motion.a, motion.da, low, high)
    p = _largest(motion.p, motion.dp, low, high)
    z, y = abs(motion.da), abs(motion.dp)
    s2, s3, s4 = derivative_bounds(
        (a, z * b1, z * b2, z * b3, z * b4), w, dw * b1, dw * b2, dw * b3
    )
    q2, q3, q4 = dw * b1 + turn * b2, dw * b2 + turn * b3, dw * b3 + turn * b4
    c2, c3, c4 = derivative_bounds((p, y * b1, y * b2, y * b3, y * b4), w + turn * b1, q2, q3, q4)
    lead = elapsed + motion.axial_lead
    x2, x3, x4 = offset_bounds(motion.axial, motion.axial_duration, lead + d, lead + end)
    lead = elapsed + motion.angular_lead
    y2, y3, y4 = offset_bounds(motion.angular, motion.angular_duration, lead + d, lead + end)
    return Bounds(
        (s2 + x2) * ROOM, (s3 + x3) * ROOM, (s4 + x4) * ROOM,
        (c2 + y2) * ROOM, (c3 + y3) * ROOM, (c4 + y4) * ROOM, end,
    )  # fmt: skip


@kernel
def _largest(begin: float, change: float, low: float, high: float) -> float:
    """Bound of a value that fades, also as it is rounded where it comes near 0."""
    largest = max(begin + change * low, begin + change * high)
    return largest + 2e-15 * max(begin, begin + change)


@kernel
def _blend(x: float) -> float:
    return x * x * x * (10.0 - 15.0 * x + 6.0 * x * x)


@kernel
def _second(x: float) -> float:
    return abs(60.0 * x * (1.0 - x) * (1.0 - 2.0 * x))


@kernel
def _blend_bounds(x0: float, x1: float, r: float) -> tuple[float, float, float, float]:
    """Largest |b'|, |b''|, |b'''|, |b''''| in time for σ in [x0, x1]; r = 1/duration."""
    x = min(max(0.5, x0), x1)
    b1 = 30.0 * x * x * (1.0 - x) * (1.0 - x)
    b2 = max(_second(x0), _second(x1))
    if x0 <= _SECOND_PEAK <= x1 or x0 <= 1.0 - _SECOND_PEAK <= x1:
        b2 = 10.0 / math.sqrt(3.0)
    b3 = max(abs(1.0 - 6.0 * x0 * (1.0 - x0)), abs(1.0 - 6.0 * x1 * (1.0 - x1)))
    b3 = 60.0 * max(b3, 0.5)  # |b'''| = 30 in the middle
    b4 = 360.0 * max(abs(2.0 * x0 - 1.0), abs(2.0 * x1 - 1.0))
    # with what σ itself is rounded by, where a derivative is next to 0
    b1, b2, b4 = b1 + 1e-15, b2 + 1e-13, b4 + 1e-12
    return b1 * r, b2 * r * r, b3 * r * r * r, b4 * r * r * r * r
