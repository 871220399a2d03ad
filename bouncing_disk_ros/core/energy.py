"""Energy books: each is computed by itself, none as a remainder.

Closed forms; in cross-fades Gauss–Legendre quadrature to rounding for the sliding terms.

Kinetic + potential energy ((m g + P) x + T_L α) changes by the work of the platform and of kicks
and by parameter changes, less the losses in impacts and in sliding; that balance is an invariant
to rounding.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from bouncing_disk_ros.core.arithmetic import TWO_PI, kernel, sincos, two_sum
from bouncing_disk_ros.core.layout import (
    L_AXIAL,
    L_FRICTION,
    L_SLIDING,
    STEADY,
    THROUGHPUT,
    W_ANGULAR,
    W_AXIAL,
)
from bouncing_disk_ros.core.platform import Jet, Record, angular_jet, axial_jet, phase_advance

Books = Any  # float64 (2, 8): sums and what their rounding left out

_NODES, _WEIGHTS = (tuple(float(v) for v in x) for x in np.polynomial.legendre.leggauss(12))
_PANEL = 0.25 * math.pi  # phase of one panel: the 12-point rule is exact to rounding on it


@kernel
def book(books: Books, which: int, amount: float) -> None:
    """Add to one book with a compensated sum, and its magnitude to the throughput."""
    books[0, which], rest = two_sum(books[0, which], amount)
    books[1, which] += rest
    books[0, THROUGHPUT] += abs(amount)


@kernel
def mechanical_energy(
    disk: Record, x: float, v: float, turns: int, angle: float, omega: float
) -> float:
    """Kinetic and potential energy of the disk, J."""
    kinetic = 0.5 * disk.mass * v * v + 0.5 * disk.inertia * omega * omega
    return kinetic + disk.weight * x + disk.load_torque * (TWO_PI * turns + angle)


@kernel
def book_impact(
    books: Books,
    disk: Record,
    w: float,
    slip: float,
    push: float,
    twist: float,
    climb: float,
    spin: float,
) -> None:
    """One impact: w = |w_A|, slip the mean of w_T before and after, climb and spin of the platform.

    `push` and `twist` are the impulses over m and over m a_g².
    """
    e = disk.restitution
    book(books, W_AXIAL, disk.mass * push * climb)
    book(books, L_AXIAL, 0.5 * disk.mass * (1.0 - e * e) * w * w)
    book(books, W_ANGULAR, disk.inertia * twist * spin)
    book(books, L_FRICTION, -disk.inertia * twist * slip)


@kernel
def book_sticking(books: Books, disk: Record, s: Jet, s_end: Jet, b: Jet, b_end: Jet) -> None:
    """Work of the platform while s and β carry the disk along, from the jets at begin and end."""
    axial = disk.weight * (s_end[0] - s[0]) + 0.5 * disk.mass * (s_end[1] - s[1]) * (
        s_end[1] + s[1]
    )
    angular = disk.load_torque * (b_end[0] - b[0]) + 0.5 * disk.inertia * (b_end[1] - b[1]) * (
        b_end[1] + b[1]
    )
    book(books, W_AXIAL, axial)
    book(books, W_ANGULAR, angular)


@kernel
def book_sliding(
    books: Books,
    motion: Record,
    disk: Record,
    sign: float,
    omega: float,
    elapsed: float,
    tau: float,
    t: float,
    s: Jet,
    s_end: Jet,
    b: Jet,
    b_end: Jet,
) -> None:
    """Work of the platform and loss while the disk slides for t seconds, from α̇ = omega."""
    g = disk.g
    rise = s_end[0] - s[0]
    axial = disk.weight * rise + 0.5 * disk.mass * (s_end[1] - s[1]) * (s_end[1] + s[1])
    book(books, W_AXIAL, axial)
    if disk.grip == 0.0:
        return
    q = g * t + (s_end[1] - s[1])  # ∫(g + s̈)dt
    platform = g * (b_end[0] - b[0]) + shared_power(motion, elapsed, tau, t)  # ∫(g + s̈)β̇ dt
    q_integral = 0.5 * g * t * t + rise - s[1] * t
    own = (
        omega * q - 0.5 * sign * disk.grip * q * q - disk.lag * (t * q - q_integral)
    )  # ∫(g + s̈)α̇ dt
    book(books, W_ANGULAR, -sign * disk.inertia * disk.grip * platform)
    book(books, L_SLIDING, sign * disk.inertia * disk.grip * (own - platform))


@kernel
def shared_power(motion: Record, elapsed: float, tau: float, t: float) -> float:
    """∫ s̈ β̇ dt over t seconds: closed form over a steady motion, quadrature over a cross-fade."""
    if motion.kind == STEADY:
        x = motion.omega * t
        middle, _ = sincos(2.0 * tau + x + motion.lag)
        half, _ = sincos(x)
        scale = -motion.a * motion.p * motion.omega * motion.omega
        return scale * 0.5 * (middle * half - motion.lag_sine * x)
    panels = math.ceil(motion.omega_max * t / _PANEL) + 1
    panels = max(panels, math.ceil(8.0 * t / motion.duration))
    width = t / panels
    total = 0.0
    for i in range(panels):
        part = 0.0
        for j in range(len(_NODES)):
            d = width * (i + 0.5 * (1.0 + _NODES[j]))
            phase = tau + phase_advance(motion, elapsed, d)
            sine, cosine = sincos(phase)
            s = axial_jet(motion, sine, cosine, elapsed + d)
            b = angular_jet(motion, sine, cosine, elapsed + d)
            part += _WEIGHTS[j] * s[2] * b[1]
        total += 0.5 * width * part
    return total
