"""The whole model by one implicit step: an independent second method, for tests alone.

Written from the model's equations; it shares nothing with the core and knows no events. Over a step
the friction's and the brake's impulse are those of the inclusion

    I (v⁺ − v) + T_L h + μ a_e m ∫(g + s̈) dt Sgn(v⁺ − β̇⁺) + T_B h Sgn(v⁺) ∋ 0,

which is exact where no sign changes within the step, whatever holds there: sliding, sticking, held
or rest. A step is kept where functions sampled at its begin, middle and end show that none does;
otherwise it is halved. So each change is reached by steps of the size of rounding, and the
inclusion alone decides what follows. Flight is integrated by the same steps: an impact is bracketed
where the gap is concave and changes its sign, and then the law of impacts holds. Bounces are
resolved one by one until all that are left take less than rounding.

`noise` changes every speed after an impact or an input by that part of it, and the phase at the
start: what two runs with noise differ by tells how far errors grow.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from bouncing_disk_ros.core.model import Disk, InitialState, Motion
from reference.offset_path import Piece, Point, Trajectory, pieces
from support.random_runs import Input

NS = 1_000_000_000
CELLS = 24  # steps of a period, of a cross-fade, of a piece of an offset, at least
TIE = 1e-10  # rad of phase: an impact as near to an input's instant goes before it
ENDED = 1e-15  # rad of phase: what is left of a chatter when it counts as ended
TIED = 1e-13  # of the impulses of a step: equal to this, they balance
SLACK = 1e-14  # of its scale: a sign within this is none
MOST_STEPS = 1_000_000  # of one stretch
MOST_IMPACTS = 3000  # of one run; a run with more ends there
SHORTEST = 1e-13  # of a step, at which it is taken as it is

GAP, SPEED, ANGLE, SPIN, BRAKE, SLIDING, AXIAL, FRICTION, SPIN_SCALE = range(9)
STATE = 9
"""Of a state: gap, ẋ − ṡ, α, α̇, what brake, sliding and impacts have taken (over I or m), and the
largest of |α̇|, |β̇| and ωΦ so far."""

# A stretch in which the platform follows one formula, as one array: seconds since the cross-fade's
# begin (or 0), its duration (or 0), τ then, A, ΔA, Φ, ΔΦ, ω, Δω, θ, Δθ; seconds since the begin of
# the offset's piece and six coefficients, of either joint; ε, g + P/m, μ a_e m/I, T_L/I, T_B/I,
# the longest step and 1/ω.
P, Q = 11, 18
RESTITUTION, GRAVITY, GRIP, LAG, BRAKE_LAG, LONGEST, RADIAN = range(25, 32)

_X5, _W5 = np.polynomial.legendre.leggauss(5)
_X5, _W5 = 0.5 * (_X5 + 1.0), 0.5 * _W5


inner = njit(error_model="numpy", no_cpython_wrapper=True, no_cfunc_wrapper=True, forceinline=False)


@inner
def _blend(c, d):  # type: ignore[no-untyped-def]
    """b, ḃ, b̈ and ∫b dt of a cross-fade d seconds into a stretch."""
    e, lasts = c[0] + d, c[1]
    if lasts <= 0.0:
        return 0.0, 0.0, 0.0, 0.0
    x = e / lasts
    y = 1.0 - x
    return (
        x * x * x * (10.0 + x * (-15.0 + x * 6.0)),
        30.0 * x * x * y * y / lasts,
        60.0 * x * y * (1.0 - 2.0 * x) / (lasts * lasts),
        lasts * x * x * x * x * (2.5 + x * (-3.0 + x)),
    )


@inner
def _offset(c, place, d):  # type: ignore[no-untyped-def]
    """An offset and its first two derivatives."""
    x, value, slope, curvature = c[place] + d, 0.0, 0.0, 0.0
    for i in range(place + 6, place, -1):
        curvature = curvature * x + 2.0 * slope
        slope = slope * x + value
        value = value * x + c[i]
    return value, slope, curvature


@inner
def _joint(c, d, amplitude, offset, lag, lags):  # type: ignore[no-untyped-def]
    """Position, velocity and acceleration of a joint from its places in a stretch and its lag."""
    b, b1, b2, since = _blend(c, d)
    tau = c[2] + c[7] * (c[0] + d) + c[8] * since + lag + lags * b
    w, w1 = c[7] + c[8] * b + lags * b1, c[8] * b1 + lags * b2
    a, a1, a2 = c[amplitude] + c[amplitude + 1] * b, c[amplitude + 1] * b1, c[amplitude + 1] * b2
    sine, cosine = math.sin(tau), math.cos(tau)
    q, q1, q2 = _offset(c, offset, d)
    return (
        a * sine + q,
        a1 * sine + a * w * cosine + q1,
        a2 * sine + (2.0 * a1 * w + a * w1) * cosine - a * w * w * sine + q2,
    )


@njit(cache=True, error_model="numpy")
def _axial(c, d):  # type: ignore[no-untyped-def]
    """s, ṡ, s̈."""
    return _joint(c, d, 3, P, 0.0, 0.0)


@inner
def _angular(c, d):  # type: ignore[no-untyped-def]
    """β, β̇, β̈."""
    return _joint(c, d, 5, Q, c[9], c[10])


@inner
def _loads_at(c, d, h):  # type: ignore[no-untyped-def]
    """a at begin, middle and end of a step, and below what it is none."""
    g = c[GRAVITY]
    x, y, z = _axial(c, d)[2], _axial(c, d + 0.5 * h)[2], _axial(c, d + h)[2]
    return g + x, g + y, g + z, SLACK * (abs(g) + max(abs(x), abs(y), abs(z)))


@inner
def _load(c, d, h):  # type: ignore[no-untyped-def]
    """∫a dr and ∫(h − r)a dr over h seconds from d on, a = g + s̈."""
    once = twice = 0.0
    for k in range(5):
        r = _X5[k] * h
        part = _W5[k] * h * (c[GRAVITY] + _axial(c, d + r)[2])
        once += part
        twice += (h - r) * part
    return once, twice


@inner
def _dips(a, b, c, slack):  # type: ignore[no-untyped-def]
    """Whether a function with these values at begin, middle and end may fall below −slack."""
    return min(a, b, c) - abs(a - 2.0 * b + c) < -slack


@inner
def _prox(v, push, platform, rub, hold):  # type: ignore[no-untyped-def]
    """The x with x − v + push + rub Sgn(x − platform) + hold Sgn(x) ∋ 0; ties stay where they are.

    It is `platform` or 0 itself where the inclusion holds with these.
    """
    free, tie = v - push, TIED * (abs(push) + rub + hold)
    low, high = min(platform, 0.0), max(platform, 0.0)
    at_low, at_high = (rub, hold) if platform < 0.0 else (hold, rub)
    between = at_low - at_high  # the sum of both between the two
    if free > high + rub + hold + tie:
        return free - rub - hold
    if free < low - rub - hold - tie:
        return free + rub + hold
    if free >= high + between - tie:
        return high
    if free <= low + between + tie:
        return low
    return free - between


@inner
def _sign(value):  # type: ignore[no-untyped-def]
    return 1.0 if value > 0.0 else (-1.0 if value < 0.0 else 0.0)


@inner
def _keeps(x0, x1, x2, slack):  # type: ignore[no-untyped-def]
    """The sign of a speed over a step, and whether it keeps it; 0 where it is none to rounding."""
    sign = _sign(x2)
    if max(abs(x0), abs(x1), abs(x2)) <= slack:
        return 0.0, True
    if sign == 0.0 or sign != _sign(x1):
        return sign, sign == _sign(x1) and abs(x0) <= slack
    return sign, not _dips(sign * x0, sign * x1, sign * x2, slack)


@inner
def _both_ways(f, r, most, slack):  # type: ignore[no-untyped-def]
    """Whether |f + r| ≤ most at begin, middle and end, and between."""
    up = _dips(most[0] - f[0] - r[0], most[1] - f[1] - r[1], most[2] - f[2] - r[2], slack)
    low = _dips(most[0] + f[0] + r[0], most[1] + f[1] + r[1], most[2] + f[2] + r[2], slack)
    return not (up or low)


@inner
def _stays(c, grip, side, spin, loads, betas, slack):  # type: ignore[no-untyped-def]
    """Whether friction and brake can keep w_T = 0, or the brake α̇ = 0, all over a step."""
    lag, brake = c[LAG], c[BRAKE_LAG]
    none, drag = (0.0, 0.0, 0.0), (lag, lag, lag)
    f = (grip * loads[0], grip * loads[1], grip * loads[2])
    slack = max(slack, 2.0 * TIED * (abs(lag) + brake + max(f) + abs(betas[0]) + abs(betas[2])))
    if grip > 0.0 and side == 0.0 and (spin != 0.0 or brake == 0.0):  # sticking
        drag = (lag + brake * spin, lag + brake * spin, lag + brake * spin)
        return _both_ways(betas, drag, f, slack)
    if grip > 0.0 and side == 0.0:  # at rest
        return _both_ways(none, drag, (f[0] + brake, f[1] + brake, f[2] + brake), slack)
    if brake > 0.0 and spin == 0.0:  # held
        pull = (side * f[0], side * f[1], side * f[2])
        return _both_ways(pull, drag, (brake, brake, brake), slack)
    return True


@inner
def _spin(state, c, grip, d, h, half, full, loads):  # type: ignore[no-untyped-def]
    """The spin after a step; whether a sign may change within it; the signs of slip and spin.

    half, full: ∫a dr to the middle and to the end; loads: a at begin, middle and end.
    """
    lag, brake, v = c[LAG], c[BRAKE_LAG], state[SPIN]
    # a tie of impulses that `_prox` takes for a balance leaves no speed either
    slack = max(SLACK * state[SPIN_SCALE], TIED * (h * abs(lag) + grip * full + h * brake))
    b0, b1, b2 = _angular(c, d), _angular(c, d + 0.5 * h), _angular(c, d + h)
    middle = _prox(v, 0.5 * h * lag, b1[1], grip * half, 0.5 * h * brake)
    after = _prox(v, h * lag, b2[1], grip * full, h * brake)
    side, spin, slips, turns = 0.0, 0.0, True, True
    if grip > 0.0:
        side, slips = _keeps(v - b0[1], middle - b1[1], after - b2[1], slack)
    if brake > 0.0:
        spin, turns = _keeps(v, middle, after, slack)
    # a torque too large by less than slack/h changes no speed by more than the slack
    stays = _stays(c, grip, side, spin, loads, (b0[2], b1[2], b2[2]), slack / h)
    return after, not (slips and turns and stays), side, spin


@inner
def _rub(state, c, d, h, side, spin):  # type: ignore[no-untyped-def]
    """Loss by friction over a step of one sign of the slip, over I."""
    total, s1 = 0.0, _axial(c, d)[1]
    for i in range(5):
        r = _X5[i] * h
        at = _axial(c, d + r)
        slip = state[SPIN] - _angular(c, d + r)[1]
        if spin != 0.0 or c[BRAKE_LAG] == 0.0:  # not held
            push = c[GRAVITY] * r + at[1] - s1
            slip -= r * (c[LAG] + c[BRAKE_LAG] * spin) + side * c[GRIP] * push
        total += _W5[i] * h * c[GRIP] * (c[GRAVITY] + at[2]) * abs(slip)
    return total


@inner
def _turn(state, c, d, h, after, full, twice, side, spin):  # type: ignore[no-untyped-def]
    """Angle and losses over a step that is kept; full 0 in flight."""
    v, grip = state[SPIN], c[GRIP]
    turned = 0.5 * h * (v + after)
    if grip > 0.0 and full > 0.0 and side == 0.0:  # sticking, or at rest
        turned = 0.0
        for i in range(5):
            turned += _W5[i] * h * _angular(c, d + _X5[i] * h)[1]
    elif grip > 0.0 and full > 0.0 and side != 0.0:
        if spin != 0.0 or c[BRAKE_LAG] == 0.0:  # sliding; else held
            turned += side * grip * (0.5 * h * full - twice)
        state[SLIDING] += _rub(state, c, d, h, side, spin)
    state[ANGLE] += turned
    state[BRAKE] += c[BRAKE_LAG] * abs(turned)
    state[SPIN] = after


@inner
def _rest_of_chatter(state, c, a):  # type: ignore[no-untyped-def]
    """Whether the bounces that are left take less than rounding: then contact."""
    if state[SPEED] == 0.0:
        return True
    if c[RESTITUTION] >= 1.0 or a <= 0.0:
        return False
    return 2.0 * state[SPEED] / (a * (1.0 - c[RESTITUTION])) < ENDED * c[RADIAN]


@inner
def _ends_by(state, c, d):  # type: ignore[no-untyped-def]
    """Whether a chatter ends within TIE of an instant in the midst of a flight."""
    a, e = c[GRAVITY] + _axial(c, d)[2], c[RESTITUTION]
    if e >= 1.0 or a <= 0.0:
        return False
    lands = math.sqrt(state[SPEED] * state[SPEED] + 2.0 * a * state[GAP])
    return abs(state[SPEED]) + lands + 2.0 * e * lands / (1.0 - e) <= a * TIE * c[RADIAN]


@njit(cache=True, error_model="numpy")
def _impact(state, c, d, noise, log, count):  # type: ignore[no-untyped-def]
    """The law of impacts for the speed in the state, and its row; whether contact follows."""
    w, b = state[SPEED], _angular(c, d)
    slip = state[SPIN] - b[1]
    given = c[GRIP] * (1.0 + c[RESTITUTION]) * abs(w)
    change = -_sign(slip) * min(abs(slip), given)
    state[AXIAL] += 0.5 * (1.0 - c[RESTITUTION] * c[RESTITUTION]) * w * w
    state[FRICTION] += abs(change) * (abs(slip) - 0.5 * abs(change))
    state[SPIN] += change
    state[SPEED], state[GAP] = -c[RESTITUTION] * w, 0.0
    state[SPEED] *= 1.0 + noise[count, 0]
    state[SPIN] += noise[count, 1] * (abs(state[SPIN]) + abs(b[1]))
    s2 = _axial(c, d)[2]
    log[count, 0], log[count, 1], log[count, 2], log[count, 3] = d, w, slip, state[SPIN]
    log[count, 4] = (abs(c[GRAVITY]) + abs(s2)) * c[RADIAN]
    return _rest_of_chatter(state, c, c[GRAVITY] + s2)


@inner
def _leap(state, c, d, span, top):  # type: ignore[no-untyped-def]
    """A long step above all that the platform reaches; 0: none."""
    s, s1, _ = _axial(c, d)
    x, v, g = s + state[GAP], s1 + state[SPEED], c[GRAVITY]
    h = 4.0 * c[LONGEST]
    if h > span or x + h * (v - 0.5 * g * h) <= top or x <= top:
        return 0.0
    while 2.0 * h <= span and x + 2.0 * h * (v - g * h) > top:
        h *= 2.0
    return h


@inner
def _lands(a, scale, gap, middle, end, u, shortest):  # type: ignore[no-untyped-def]
    """Whether the gap reaches 0 within a step: 1, 0, or −1 where a shorter step is to tell."""
    if min(a) - abs(a[0] - 2.0 * a[1] + a[2]) >= 0.0:  # concave: no dip between the ends
        return 1 if end <= 0.0 else 0
    if max(a) <= scale and u >= 0.0:  # convex and rising: launched
        return 0
    if _dips(gap, middle, end, 0.0) and not shortest:
        return -1
    return 1 if end <= 0.0 else 0


@inner
def _root(c, d, h, gap, u):  # type: ignore[no-untyped-def]
    """Where a concave gap that is below 0 at the end of a step reaches 0, by Newton's method.

    0 where the only root is the launch itself.
    """
    x = h
    for _ in range(200):
        once, twice = _load(c, d, x)
        slope = u - once
        if slope >= 0.0:
            return 0.0
        step = (gap + x * u - twice) / slope
        x = max(x - step, 0.0)
        if abs(step) <= 1e-15 * x:
            break
    return x


@inner
def _soar(state, c, d, span, top):  # type: ignore[no-untyped-def]
    """A step of flight above all that the platform reaches: its length, 0 where there is none."""
    h, gap, u, g = _leap(state, c, d, span, top), state[GAP], state[SPEED], c[GRAVITY]
    if h == 0.0:
        return 0.0
    after, switch, _, spin = _spin(state, c, 0.0, d, h, 0.0, 0.0, (0.0, 0.0, 0.0))
    if switch:
        return 0.0
    s, s1, _ = _axial(c, d)
    t, t1, _ = _axial(c, d + h)
    state[GAP], state[SPEED] = s + gap + h * (s1 + u - 0.5 * g * h) - t, s1 + u - g * h - t1
    _turn(state, c, d, h, after, 0.0, 0.0, 0.0, spin)
    return h


@inner
def _fly(state, c, d, h, log, count, noise):  # type: ignore[no-untyped-def]
    """One step of flight: its length (0: to be halved), the impacts so far, contact."""
    gap, u, shortest = state[GAP], state[SPEED], h <= SHORTEST * c[LONGEST]
    a0, a1, a2, scale = _loads_at(c, d, h)
    half, full = _load(c, d, 0.5 * h), _load(c, d, h)
    middle, end = gap + 0.5 * h * u - half[1], gap + h * u - full[1]
    lands = _lands((a0, a1, a2), scale, gap, middle, end, u, shortest)
    if lands == 1:
        x = _root(c, d, h, gap, u)
        if x > 0.0:
            h, full = x, _load(c, d, x)
        else:
            lands = 0
    after, switch, _, spin = _spin(state, c, 0.0, d, h, 0.0, 0.0, (0.0, 0.0, 0.0))
    if lands < 0 or (switch and not shortest):
        return 0.0, count, False
    _turn(state, c, d, h, after, 0.0, 0.0, 0.0, spin)
    state[GAP], state[SPEED] = max(gap + h * u - full[1], 0.0), u - full[0]
    if lands == 1 and state[SPEED] < 0.0:
        return h, count + 1, _impact(state, c, d + h, noise, log, count)
    return h, count, False


@inner
def _press(state, c, d, h):  # type: ignore[no-untyped-def]
    """One step of contact: its length (0: to be halved, −1: the disk leaves)."""
    a0, a1, a2, scale = _loads_at(c, d, h)
    if a0 < -scale or (a0 <= 0.5 * scale and a1 < 0.0 and a2 < -scale):
        return -1.0
    if _dips(a0, a1, a2, scale) and h > SHORTEST * c[LONGEST]:
        return 0.0
    half, full = _load(c, d, 0.5 * h), _load(c, d, h)
    once, twice = max(full[0], 0.0), max(full[1], 0.0)
    loads = (max(a0, 0.0), max(a1, 0.0), max(a2, 0.0))
    after, switch, side, spin = _spin(state, c, c[GRIP], d, h, max(half[0], 0.0), once, loads)
    if switch and h > SHORTEST * c[LONGEST]:
        return 0.0
    _turn(state, c, d, h, after, once, twice, side, spin)
    return h


@njit(cache=True, error_model="numpy")
def _advance(state, contact, c, span, top, noise, log, count, tie):  # type: ignore[no-untyped-def]
    """Integrate over a stretch in which the platform follows one formula.

    Returns contact, impacts and steps.
    """
    d, h, steps = 0.0, c[LONGEST], 0
    swing = max(abs(c[5]), abs(c[5] + c[6])) * max(c[7], c[7] + c[8])  # whose rounding β̇ has
    state[SPIN_SCALE] = max(state[SPIN_SCALE], swing)
    while d < span and count < MOST_IMPACTS and steps < MOST_STEPS:
        steps += 1
        h = min(h, span - d, c[LONGEST])
        state[SPIN_SCALE] = max(state[SPIN_SCALE], abs(state[SPIN]), abs(_angular(c, d)[1]))
        if contact:
            done = _press(state, c, d, h)
            if done < 0.0:
                contact, done = False, 0.0
                h *= 2.0
        else:
            done = _soar(state, c, d, span - d, top)
            if done == 0.0:
                done, count, contact = _fly(state, c, d, h, log, count, noise)
        if done == 0.0:
            h *= 0.5
            if d + h == d:
                d += 1e-300
            continue
        d = span if done == span - d else d + done
        h = c[LONGEST] if done > h else 2.0 * h
    if tie and not contact and _ends_by(state, c, span):  # at an input's instant
        contact = True
        state[GAP] = state[SPEED] = 0.0
    elif tie and not contact and 0.0 <= state[GAP] <= -state[SPEED] * TIE * c[RADIAN]:
        contact = _impact(state, c, span, noise, log, count)
        count += 1
    return contact, count, steps


# --- a run ----------------------------------------------------------------------------------------
class Path(NamedTuple):
    """What a run was: the states at the instants asked for, and its impacts."""

    states: NDArray[np.float64]  # gap, ẋ − ṡ, α, α̇, losses of brake, sliding, impacts (both)
    impacts: NDArray[np.float64]  # time (s), w_A, w_T, α̇ after, (g + P/m + |s̈|)/ω
    ended_ns: int  # the last instant that was reached: all, or where impacts were too many
    steps: int


class _Fade(NamedTuple):
    begin_ns: int
    end_ns: int
    target: Motion


class _Sinusoid:
    """The commanded motion since a start: cross-fades planned, and the exact phase."""

    def __init__(self, begin_ns: int, motion: Motion, phase: float) -> None:
        self.phase, self.start = phase, _Fade(begin_ns, begin_ns, motion)
        self.fades: list[_Fade] = []

    def command(self, now_ns: int, points: Sequence[tuple[int, Motion]], lasts: int) -> None:
        """Plan cross-fades: what has not begun is replaced."""
        self.fades = [fade for fade in self.fades if fade.begin_ns <= now_ns]
        last = (self.fades or [self.start])[-1]
        free, motion = max(now_ns, last.end_ns), last.target
        for at_ns, target in points:
            period = NS / min(motion.frequency, target.frequency)
            shortest = round(1e6 / max(motion.frequency, target.frequency))
            duration = max(lasts, shortest, 1) if lasts else max(round(period), 1)
            begin = max(at_ns - duration, free)
            free, motion = max(at_ns, begin + duration), target
            self.fades.append(_Fade(begin, free, target))

    def boundaries(self) -> list[int]:
        return [instant for fade in self.fades for instant in fade[:2]]

    def row(self, now_ns: int) -> tuple[float, ...]:
        """The formula from an instant on (see `_axial`)."""
        turns, last = 0.0, self.start
        for fade in self.fades:
            before, after = last.target, fade.target
            turns += _turns(before.frequency, min(now_ns, fade.begin_ns) - last.end_ns)
            if now_ns < fade.begin_ns:
                return self._steady(before, turns)
            lasts = fade.end_ns - fade.begin_ns
            if now_ns < fade.end_ns:
                tau = self.phase + math.tau * (turns % 1.0)
                elapsed = now_ns - fade.begin_ns
                return (elapsed / NS, lasts / NS, tau, *_columns(before, after))
            turns += 0.5 * _turns(before.frequency, lasts, 2)
            turns += 0.5 * _turns(after.frequency, lasts, 2)
            last = fade
        turns += _turns(last.target.frequency, now_ns - last.end_ns)
        return self._steady(last.target, turns)

    def _steady(self, motion: Motion, turns: float) -> tuple[float, ...]:
        return (0.0, 0.0, self.phase + math.tau * (turns % 1.0), *_columns(motion, motion))


def _turns(frequency: float, lasts_ns: int, modulo: int = 1) -> float:
    """Turns in so many nanoseconds, but for multiples of a whole number; exact, rounded once."""
    above, below = frequency.as_integer_ratio()
    below *= NS
    return above * lasts_ns % (modulo * below) / below


def _columns(a: Motion, b: Motion) -> list[float]:
    short = (b.phase_lag - a.phase_lag + math.pi) % math.tau - math.pi  # θ goes the short way
    omega, after = math.tau * a.frequency, math.tau * b.frequency
    ends = (a.axial_amplitude, b.axial_amplitude, a.angular_amplitude, b.angular_amplitude)
    return [ends[0], ends[1] - ends[0], ends[2], ends[3] - ends[2],
            omega, after - omega, a.phase_lag, short]  # fmt: skip


class _Joint:
    """The offset of one joint since a start."""

    def __init__(self, begin_ns: int) -> None:
        self.begin_ns = begin_ns
        self.messages: list[Trajectory] = []
        self.found = pieces([], float)
        self.now, self.coefficients = self.found[0], [0.0] * 6

    def splice(self, begin_ns: int, points: Sequence[tuple[float, ...]]) -> None:
        if points:
            begin = self.begin_ns
            knots = tuple(Point(int(p[0]) - begin, p[1:]) for p in points)
            self.messages.append(Trajectory(begin_ns - begin, knots))
            self.found = pieces(self.messages, float)

    def boundaries(self) -> list[int]:
        return [self.begin_ns + round(piece.begin * NS) for piece in self.found]

    def follow(self, now_ns: int) -> float:
        """Put what begins at an instant in force; by how much its velocity jumps."""
        t = (now_ns - self.begin_ns) / NS
        after = max((p for p in self.found if p.begin <= t), key=lambda p: p.begin)
        before, self.now = self.now, after
        if before == after:
            return 0.0
        self.coefficients = taylor(after)
        old, new = float(before.at(t, 1)), float(after.at(t, 1))
        return new - old if abs(new - old) > 1e-12 * (abs(new) + abs(old)) else 0.0

    def row(self, now_ns: int) -> tuple[float, ...]:
        begin = round(self.now.begin * NS)
        return ((now_ns - self.begin_ns - begin) / NS, *self.coefficients)

    def longest(self) -> float:
        """The longest step that samples what is in force often enough, s."""
        return float(self.now.end - self.now.begin) / 8 if self.now.kind > 1 else math.inf


def taylor(piece: Piece) -> list[float]:
    """Coefficients of a piece in the time since its begin."""
    d = piece.end - piece.begin if piece.kind else 1.0
    c = [value / d**k for k, value in enumerate(piece.coefficients())]
    return [float(value) for value in (c + [0.0] * 6)[:6]]


class _Run:
    """A run in progress."""

    def __init__(self, noise: float, seed: int) -> None:
        self.noise, self.rng = noise, np.random.default_rng(seed)
        self.disturbs = noise * self.rng.normal(size=(MOST_IMPACTS + 1, 2))
        self.state = np.zeros(STATE)
        self.contact, self.steps = False, 0
        self.log, self.stretch = np.zeros((MOST_IMPACTS + 1, 5)), np.zeros(32)
        self.impacts: list[NDArray[np.float64]] = []
        self.kicks: list[tuple[int, float, float]] = []

    def place(self, now_ns: int, initial: InitialState, motion: Motion) -> None:
        """Start, or start again."""
        phase = initial.forcing_phase * (1.0 + self.noise * self.rng.normal())
        self.sinusoid, self.kicks = _Sinusoid(now_ns, motion, phase), []
        self.joints = _Joint(now_ns), _Joint(now_ns)
        self.state[:] = 0.0
        self.set_stretch(now_ns)
        s1 = _axial(self.stretch, 0.0)[1]
        self.state[GAP] = initial.height * (1.0 + self.noise * self.rng.normal())
        self.state[ANGLE], self.state[SPIN] = initial.angle, initial.angular_velocity
        self.state[SPEED] = 0.0 if initial.axial_velocity is None else initial.axial_velocity - s1

    def set_stretch(self, now_ns: int) -> None:
        """What holds from an instant on, as one array."""
        rows = (self.sinusoid.row(now_ns), *(joint.row(now_ns) for joint in self.joints))
        m = rows[0]
        longest = math.tau / max(m[7], m[7] + m[8]) / CELLS
        longest = min(longest, *(joint.longest() for joint in self.joints))
        if m[1]:
            longest = min(longest, m[1] / CELLS)
        self.stretch = np.array([*m, *rows[1], *rows[2], *self.constants, longest, 1.0 / m[7]])

    def set_disk(self, disk: Disk) -> None:
        self.disk = disk
        inertia = disk.mass * disk.gyration_radius**2 + disk.load_inertia
        self.constants = (
            disk.restitution,
            disk.gravity + disk.preload / disk.mass,
            disk.friction * disk.friction_radius * disk.mass / inertia,
            disk.load_torque / inertia,
            disk.brake_torque / inertia,
        )
        self.inertia = inertia

    def settle(self, now_ns: int) -> None:
        """The law of impacts, contact or flight after the inputs of one instant."""
        self.set_stretch(now_ns)
        if self.state[GAP] > 0.0:
            self.contact = False
        elif self.state[SPEED] < 0.0:
            self.contact = _impact(self.state, self.stretch, 0.0, self.disturbs, self.log, 0)
            self._note(now_ns, 1)
        else:
            self.contact = self.state[SPEED] == 0.0
        if self.contact:
            self.state[SPEED] = 0.0

    def _note(self, now_ns: int, count: int) -> None:
        rows = self.log[:count].copy()
        rows[:, 0] += now_ns / NS
        self.impacts.append(rows)

    def integrate(self, now_ns: int, until_ns: int, tie: bool) -> bool:
        """Up to the next instant; False where there were too many impacts."""
        span, c = (until_ns - now_ns) / NS, self.stretch
        top = max(abs(c[3]), abs(c[3] + c[4])) * 1.001 + self._highest(c[P:Q], span)
        self.contact, count, steps = _advance(
            self.state, self.contact, c, span, top, self.disturbs, self.log, 0, tie
        )
        if steps == MOST_STEPS:
            raise RuntimeError(f"the second method takes {steps} steps within {span} s")
        self._note(now_ns, count)
        self.steps += steps
        if self.contact:
            self.state[GAP] = self.state[SPEED] = 0.0
        return count < MOST_IMPACTS

    @staticmethod
    def _highest(p: NDArray[np.float64], span: float) -> float:
        """What a polynomial stays below over a stretch."""
        if not any(p[2:]):
            return float(p[1])
        at = p[0] + span * np.linspace(0.0, 1.0, 65)
        values = np.polynomial.polynomial.polyval(at, p[1:])
        return float(values.max() + 0.1 * (values.max() - values.min()))

    def act(self, one: Input, now_ns: int) -> None:
        """Take an input that arrives."""
        match one.kind, one.values:
            case "motion", (points, lasts):
                self.sinusoid.command(now_ns, points, lasts)
            case "trajectory", (begin_ns, *joints):
                for joint, points in zip(self.joints, joints, strict=True):
                    joint.splice(max(begin_ns, now_ns), points)
            case "impulse", (at_ns, axial, angular):
                self.kicks.append((max(at_ns, now_ns), axial, angular))
            case "disk", (disk,):
                self.set_disk(disk)
            case "reset", (initial, motion):
                self.place(now_ns, initial, motion)
            case "snapshot", ():
                return
            case kind, _:
                raise ValueError(kind)
        self.due(now_ns)

    def due(self, now_ns: int) -> None:
        """What acts at an instant: the offsets, then impulses."""
        jumps = [joint.follow(now_ns) for joint in self.joints]
        self.state[SPEED] -= jumps[0]
        for kick in [kick for kick in self.kicks if kick[0] == now_ns]:
            self.kicks.remove(kick)
            self.state[SPEED] += kick[1] / self.disk.mass
            self.state[SPIN] += kick[2] / self.inertia
        self.state[[SPEED, SPIN]] *= 1.0 + self.noise * self.rng.normal(size=2)
        self.settle(now_ns)

    def next_due(self, now_ns: int) -> int:
        instants = [*self.sinusoid.boundaries(), *(kick[0] for kick in self.kicks)]
        instants += [at for joint in self.joints for at in joint.boundaries()]
        return min((at for at in instants if at > now_ns), default=2**62)


def integrate(
    start: tuple[Motion, Disk, InitialState],
    inputs: Sequence[Input],
    samples_ns: Sequence[int],
    noise: float = 0.0,
    seed: int = 0,
) -> Path:
    """A run from t = 0 through its inputs (in order of arrival), sampled at rising instants.

    An input or sample at an instant comes after all that is due there.
    """
    run = _Run(noise, seed)
    run.set_disk(start[1])
    run.place(0, start[2], start[0])
    run.settle(0)
    states, now, waiting, left = [], 0, list(inputs), list(samples_ns)
    while left:
        while waiting and waiting[0].arrives_ns == now:
            run.act(waiting.pop(0), now)
        while left and left[0] == now:
            states.append(run.state.copy())
            states[-1][[BRAKE, SLIDING, FRICTION]] *= run.inertia
            states[-1][AXIAL] *= run.disk.mass
            left.pop(0)
        if not left:
            break
        due = min(run.next_due(now), waiting[0].arrives_ns if waiting else 2**62)
        then = min(due, left[0])
        if not run.integrate(now, then, then == due):
            break
        now = then
        run.due(now)
    impacts = np.concatenate([np.zeros((0, 5)), *run.impacts])
    return Path(np.array(states).reshape(-1, STATE), impacts, now, run.steps)
