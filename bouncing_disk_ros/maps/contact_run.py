"""Contact with a steady motion up to separation (eq. 3): the loop of single tosses and of the map.

Events, and closed forms between them, are those of the stepper, given named tuples in place of its
records: numba leaves out what a steady motion does not need.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from bouncing_disk_ros.core.arithmetic import sincos
from bouncing_disk_ros.core.brake import sign_of
from bouncing_disk_ros.core.compilation import Kernel, rare_kernel
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
    """A phase of contact: how it begins, how long it lasts, the platform at both ends."""

    begin: Slide  # of the sign 0: the disk sticks
    slip: float  # w_T at its begin
    duration: float
    pushed: float  # the integrals of `slide`; 0 in sticking
    q: float
    axial: tuple[Jet, Jet]
    angular: tuple[Jet, Jet]


def contact_run(add: Kernel) -> Kernel:
    """Compile the loop, with what is summed up over its phases: add(sums, motion, disk, stretch).

    A function of its own for each `add`: one that is given as an argument could not be cached.
    """

    @rare_kernel
    def contact_until_flight(
        motion: Record, disk: Record, tau: float, omega: float, most: int, sums: Any
    ) -> tuple[float, float, float, float]:
        """Seconds from τ until separation, which comes; α̇ there, angle turned, sign of the slip.

        Of the last phase, 0: the disk sticks. nan after `most` phases without it. No brake.
        """
        lasted = turned = 0.0
        sine, cosine = sincos(tau)
        s, b = axial_jet(motion, sine, cosine, 0.0), angular_jet(motion, sine, cosine, 0.0)
        a, _ = load(motion, disk.g, s)
        sign = float(what_holds(sign_of(omega - b[1]), 0, 0, disk, a, b)[0])
        for _ in range(most):
            state = ContactState(tau, sine, cosine, sign, disk.lag, omega)
            begin, slip = Slide(0.0, tau, sine, cosine, sign, disk.lag), omega - b[1]
            if sign == 0.0:
                kind, d, value, _ = after_sticking(state, motion, disk, 0.0, math.inf)
            else:
                kind, d, value, _ = after_sliding(state, motion, disk, 0.0, math.inf)
            tau = phase_after(tau, motion.omega * d)[1]
            if kind == SEPARATION:
                tau = separation_phase(motion, disk.g)
            sine, cosine = sincos(tau)
            s1, b1 = axial_jet(motion, sine, cosine, 0.0), angular_jet(motion, sine, cosine, 0.0)
            angle, pushed, q = b1[0] - b[0], 0.0, 0.0
            if sign == 0.0:
                omega = b1[1]
            else:
                angle, omega, pushed, q = slide(motion, disk, begin, omega, d)
            add(sums, motion, disk, Stretch(begin, slip, d, pushed, q, (s, s1), (b, b1)))
            lasted += d
            turned += angle
            s, b = s1, b1
            if kind == SEPARATION:
                return lasted, omega, turned, sign
            if kind == SLIP:
                sign = value
            elif kind == SLIP_ENDS:
                sign = float(what_holds(0, 0, 0, disk, disk.g + s[2], b)[0])
                omega = b[1] if sign == 0.0 else omega
        return math.nan, math.nan, math.nan, sign

    return contact_until_flight
