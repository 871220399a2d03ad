"""A disk in contact with a steady motion, up to separation: the one loop of tosses and of the map.

A disk in contact sticks and slides until the platform falls away from under it (eq. 3). The events
and the closed forms between them are those of the stepper, given named tuples in place of its
records: numba leaves out what a steady motion does not need.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from bouncing_disk_ros.core.arithmetic import Kernel, rare_kernel, sincos
from bouncing_disk_ros.core.brake import sign_of
from bouncing_disk_ros.core.contact_events import load, slide
from bouncing_disk_ros.core.contact_table import what_holds
from bouncing_disk_ros.core.flight import separation_phase
from bouncing_disk_ros.core.forcing_clock import phase_after
from bouncing_disk_ros.core.layout import SEPARATION, SLIP, SLIP_ENDS, Slide
from bouncing_disk_ros.core.next_event import after_sliding, after_sticking
from bouncing_disk_ros.core.platform import Jet, Record, angular_jet, axial_jet


class ContactState(NamedTuple):
    """The disk on the platform, with the fields of layout.STATE_DTYPE that kernels read."""

    tau: float
    sine: float
    cosine: float
    slip_sign: float
    drag: float
    omega: float


class Stretch(NamedTuple):
    """A phase of contact: how it begins, how long it lasts, the platform at both ends.

    `slip`: w_T at its begin. `turned` and the two integrals are those of `slide`; 0 in sticking.
    """

    begin: Slide  # of the sign 0: the disk sticks
    slip: float
    duration: float
    turned: float
    pushed: float
    q: float
    axial: tuple[Jet, Jet]
    angular: tuple[Jet, Jet]


class Contact(NamedTuple):
    """Contact up to separation; nan where it takes more phases than allowed."""

    duration: float
    omega: float  # at its end
    turned: float
    sign: float  # of the slip in the last phase; 0: the disk left sticking


def contact_run(add: Kernel) -> Kernel:
    """Compile the loop, with what is summed up over its phases: add(sums, motion, disk, stretch).

    A function of its own for each `add`: one that is given as an argument could not be cached.
    """

    @rare_kernel
    def contact_until_flight(
        motion: Record, disk: Record, tau: float, omega: float, most: int, sums: Any
    ) -> Contact:
        """Contact from τ until separation, which comes, in at most so many phases; no brake."""
        lasted = turned = 0.0
        sine, cosine = sincos(tau)
        s = axial_jet(motion, sine, cosine, 0.0)
        b = angular_jet(motion, sine, cosine, 0.0)
        a, _ = load(motion, disk.g, s)
        sign = float(what_holds(sign_of(omega - b[1]), 0, 0, disk, a, b)[0])
        for _ in range(most):
            state = ContactState(tau, sine, cosine, sign, disk.lag, omega)
            begin = Slide(0.0, tau, sine, cosine, sign, disk.lag)
            if sign == 0.0:
                kind, d, value, _ = after_sticking(state, motion, disk, 0.0, math.inf)
            else:
                kind, d, value, _ = after_sliding(state, motion, disk, 0.0, math.inf)
            leaves = kind == SEPARATION
            tau = (
                separation_phase(motion, disk.g)
                if leaves
                else phase_after(tau, motion.omega * d)[1]
            )
            sine, cosine = sincos(tau)
            axial = (s, axial_jet(motion, sine, cosine, 0.0))
            angular = (b, angular_jet(motion, sine, cosine, 0.0))
            slip = omega - b[1]
            s, b = axial[1], angular[1]
            angle, pushed, q = b[0] - angular[0][0], 0.0, 0.0
            if sign == 0.0:
                omega = b[1]
            else:
                angle, omega, pushed, q = slide(motion, disk, begin, omega, d)
            add(sums, motion, disk, Stretch(begin, slip, d, angle, pushed, q, axial, angular))
            lasted += d
            turned += angle
            if leaves:
                return Contact(lasted, omega, turned, sign)
            if kind == SLIP:
                sign = value
            elif kind == SLIP_ENDS:
                sign = float(what_holds(0, 0, 0, disk, disk.g + s[2], b)[0])
                omega = b[1] if sign == 0.0 else omega
        return Contact(math.nan, math.nan, math.nan, sign)

    return contact_until_flight
