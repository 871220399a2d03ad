"""Energy ledger: each entry is computed by itself, none as a remainder.

Closed forms; in cross-fades Gauss–Legendre quadrature to rounding for the sliding terms.

Kinetic + potential energy ((m g + P) x + T_L α) changes by the work of the platform and of impulses
and by parameter changes, less the losses in impacts and in sliding; that balance is an invariant
to rounding.
"""

from __future__ import annotations

import math
from typing import Any

from bouncing_disk_ros.core.arithmetic import TWO_PI, sincos, two_sum
from bouncing_disk_ros.core.compilation import kernel, rare_kernel
from bouncing_disk_ros.core.flight import Launch, gap_after
from bouncing_disk_ros.core.layout import (
    L_AXIAL,
    L_BRAKE,
    L_FRICTION,
    L_SLIDING,
    STEADY,
    THROUGHPUT,
    W_ANGULAR,
    W_AXIAL,
    Slide,
)
from bouncing_disk_ros.core.platform import (
    Jet,
    Record,
    angular_jet,
    axial_jet,
    frequency_at,
    phase_advance,
    turning_phase,
    until_turning,
)
from bouncing_disk_ros.core.restitution import lost_part

Ledger = Any  # float64 (2, 9): sums and what their rounding left out

# Gauss–Legendre, 12 points. Written out: numpy computes them by LAPACK, whose last digits differ
# from version to version. The nodes are good to 1 ulp, the weights to 7e-16; records hold sums made
# of these very digits.
_RIGHT_NODES = (
    0.1252334085114689,
    0.3678314989981802,
    0.5873179542866175,
    0.7699026741943047,
    0.9041172563704748,
    0.9815606342467192,
)
_RIGHT_WEIGHTS = (
    0.2491470458134027,
    0.2334925365383546,
    0.20316742672306573,
    0.16007832854334642,
    0.10693932599531907,
    0.04717533638651141,
)
NODES = (*(-node for node in reversed(_RIGHT_NODES)), *_RIGHT_NODES)
WEIGHTS = (*reversed(_RIGHT_WEIGHTS), *_RIGHT_WEIGHTS)
_PANEL = 0.25 * math.pi  # phase of one panel: the 12-point rule is exact to rounding on it


@kernel
def add_entry(ledger: Ledger, which: int, amount: float) -> None:
    """Add to one entry with a compensated sum, and its magnitude to the throughput."""
    ledger[0, THROUGHPUT] += _entered(ledger, which, amount)


@kernel
def _entered(ledger: Ledger, which: int, amount: float) -> float:
    """Add to one entry alone; returns the magnitude."""
    ledger[0, which], rest = two_sum(ledger[0, which], amount)
    ledger[1, which] += rest
    return abs(amount)


@kernel
def mechanical_energy(
    disk: Record, x: float, v: float, turns: int, angle: float, omega: float
) -> float:
    """Kinetic and potential energy of the disk, J."""
    kinetic = 0.5 * disk.mass * v * v + 0.5 * disk.inertia * omega * omega
    return kinetic + disk.weight * x + disk.load_torque * (TWO_PI * turns + angle)


@kernel
def add_impact_energy(
    ledger: Ledger,
    disk: Record,
    w: float,
    slip: float,
    push: float,
    twist: float,
    climb: float,
    spin: float,
) -> None:
    """One impact: w = |w_A|, slip the mean of w_T before and after, climb and spin of the platform.

    `push` and `twist` are the impulses over m and over m a_g². What the flight before it exchanged
    between kinetic and potential energy is work of nobody, but part of the scale of the residual.
    """
    lost = lost_part(-w, disk.restitution)
    through = ledger[0, THROUGHPUT] + disk.mass * (climb * climb + w * w)
    through += _entered(ledger, W_AXIAL, disk.mass * push * climb)
    through += _entered(ledger, L_AXIAL, 0.5 * disk.mass * lost * w * w)
    through += _entered(ledger, W_ANGULAR, disk.inertia * twist * spin)
    through += _entered(ledger, L_FRICTION, -disk.inertia * twist * slip)
    ledger[0, THROUGHPUT] = through  # once: each sum in memory would wait for the one before


@kernel
def add_axial_work(ledger: Ledger, disk: Record, s: Jet, s_end: Jet) -> None:
    """Axial work of the platform in contact, ∫N ṡ dt, from the jets of s at begin and end."""
    work = disk.weight * (s_end[0] - s[0])
    work += 0.5 * disk.mass * (s_end[1] - s[1]) * (s_end[1] + s[1])
    add_entry(ledger, W_AXIAL, work)


@kernel
def add_sticking_work(ledger: Ledger, disk: Record, spin: int, b: Jet, b_end: Jet) -> None:
    """Angular work of the platform while the disk sticks to it, from the jets of β.

    `spin` is the sign of the brake's direction. What it takes is entered by itself.
    """
    work = disk.load_torque * (b_end[0] - b[0])
    if spin != 0:
        work += disk.brake_torque * spin * (b_end[0] - b[0])
    work += 0.5 * disk.inertia * (b_end[1] - b[1]) * (b_end[1] + b[1])
    add_entry(ledger, W_ANGULAR, work)


@kernel
def add_sliding_work(
    ledger: Ledger,
    motion: Record,
    disk: Record,
    begin: Slide,
    slip: float,
    t: float,
    q: float,
    pushed: float,
    b: Jet,
    b_end: Jet,
) -> None:
    """Angular work and loss in t seconds of sliding that begin with w_T = slip.

    With a = g + s̈, q = ∫a dt and pushed = ∫∫a dt dt: the work is −sign·I·grip ∫a β̇ dt, the loss
    sign·I·grip ∫a w_T dt.
    """
    if disk.grip == 0.0:
        return
    elapsed, tau, _, _, sign, drag = begin
    drift = _power_beyond(motion, disk.g, elapsed, tau, t, q, b, b_end)
    scale = disk.inertia * disk.grip
    add_entry(ledger, W_ANGULAR, -sign * scale * (b[1] * q + drift))
    rubbed = slip * q - 0.5 * sign * disk.grip * q * q - drag * (t * q - pushed) - drift
    add_entry(ledger, L_SLIDING, sign * scale * rubbed)


@kernel
def _power_beyond(
    motion: Record, g: float, elapsed: float, tau: float, t: float, q: float, b: Jet, b_end: Jet
) -> float:
    """∫(g + s̈)(β̇ − β̇₀)dt over t seconds, with q = ∫(g + s̈)dt."""
    if motion.kind == STEADY and motion.omega * t > 0.5:
        return g * (b_end[0] - b[0]) + shared_power(motion, tau, t) - b[1] * q
    return _drift(motion, g, elapsed, tau, t, b[1])


@rare_kernel
def rubbing(motion: Record, disk: Record, elapsed: float, tau: float, t: float) -> float:
    """∫ μ a_e N β̇ dt over t seconds of contact, J: what friction takes with α̇ = 0."""
    sine, cosine = sincos(tau)
    sine_end, cosine_end = sincos(tau + phase_advance(motion, elapsed, t))
    b = angular_jet(motion, sine, cosine, elapsed)
    b_end = angular_jet(motion, sine_end, cosine_end, elapsed + t)
    q = -gap_after(motion, Launch(elapsed, sine, cosine, disk.g, 0.0, 0.0), t)[1]
    drift = _power_beyond(motion, disk.g, elapsed, tau, t, q, b, b_end)
    return disk.inertia * disk.grip * (b[1] * q + drift)


@rare_kernel
def add_held_work(
    ledger: Ledger, state: Record, motion: Record, disk: Record, elapsed: float, d: float
) -> None:
    """Work of the platform that slides beneath a held disk, all of it lost; the sign of the slip.

    A steady motion may turn back many times on the way.
    """
    rubbed, tau, left, sign = 0.0, state.tau, d, float(state.slip_sign)
    if motion.kind == STEADY:
        half = math.pi / motion.omega
        for _ in range(4):
            span = until_turning(motion, tau, -sign)
            if span >= left:
                break
            rubbed -= sign * rubbing(motion, disk, elapsed, tau, span)
            left -= span
            tau = turning_phase(motion, -sign)
            sign = -sign
            periods = math.floor(left / (2.0 * half))
            if periods >= 1.0:
                other = turning_phase(motion, -sign)
                rubbed -= sign * periods * rubbing(motion, disk, elapsed, tau, half)
                rubbed += sign * periods * rubbing(motion, disk, elapsed, other, half)
                left = max(left - periods * 2.0 * half, 0.0)
    rubbed -= sign * rubbing(motion, disk, elapsed, tau, left)
    state.slip_sign = int(sign)
    add_entry(ledger, W_ANGULAR, rubbed)
    add_entry(ledger, L_SLIDING, rubbed)


@kernel
def add_brake_loss(ledger: Ledger, disk: Record, way: float) -> None:
    """What the brake takes while the disk turns by `way` rad, against which the brake acts."""
    if disk.brake > 0.0:
        add_entry(ledger, L_BRAKE, disk.brake_torque * way)


@kernel
def shared_power(motion: Record, tau: float, t: float) -> float:
    """∫ s̈ β̇ dt over t seconds of a steady motion."""
    x = motion.omega * t
    middle, _ = sincos(2.0 * tau + x + motion.lag)
    half, _ = sincos(x)
    scale = -motion.a * motion.p * motion.omega * motion.omega
    return scale * 0.5 * (middle * half - motion.lag_sine * x)


@kernel
def _drift(motion: Record, g: float, elapsed: float, tau: float, t: float, spin: float) -> float:
    """∫(g + s̈)(β̇ − spin)dt over t seconds by quadrature.

    For cross-fades, and for slips so short that the closed form is a difference of near equals.
    """
    if motion.kind == STEADY:
        panels = math.ceil(motion.omega * t / _PANEL) + 1
    else:
        f = max(frequency_at(motion, elapsed), frequency_at(motion, elapsed + t))
        panels = math.ceil(TWO_PI * f * t / _PANEL) + 1
        panels = max(panels, math.ceil(8.0 * t / motion.duration))
    width = t / panels
    total = 0.0
    for i in range(panels):
        part = 0.0
        for j in range(len(NODES)):
            d = width * (i + 0.5 * (1.0 + NODES[j]))
            sine, cosine = sincos(tau + phase_advance(motion, elapsed, d))
            s = axial_jet(motion, sine, cosine, elapsed + d)
            b = angular_jet(motion, sine, cosine, elapsed + d)
            part += WEIGHTS[j] * (g + s[2]) * (b[1] - spin)
        total += 0.5 * width * part
    return total
