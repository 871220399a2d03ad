"""Doublings in the plane of Γ and ε against Newton's method on the return map, with 40 digits.

The map is written here from the paper's equations: phase and velocity of the disk after an impact,
from one impact to the next; its derivatives are differences, which 40 digits allow.
"""

from __future__ import annotations

import mpmath
import numpy as np
import pytest
from mpmath import mp, mpf

from bouncing_disk_ros.maps.bifurcations import period_doublings
from bouncing_disk_ros.maps.periodic_orbit import fixed_point
from bouncing_disk_ros.orbit_studies.orbit_branch import orbit_curve
from bouncing_disk_ros.orbit_studies.orbit_curves import Window
from bouncing_disk_ros.orbit_studies.orbit_equations import CurveKind
from reference.cases import in_soak

DIGITS = 40
STEP = mpf("1e-12")  # of a central difference: its error is about 1e-24
State = tuple[mpf, mpf]


def after(state: State, durations: list[mpf], forcing: mpf, restitution: mpf) -> State:
    """Phase and velocity after the impacts that end flights of about these durations."""
    phase, launch = state
    for near in durations:

        def gap(d: mpf, t: mpf = phase, v: mpf = launch) -> mpf:
            return v * d - d * d / (2 * mp.pi) - forcing * (mp.sin(t + d) - mp.sin(t))

        since = mpmath.findroot(gap, (near, near + mpf("1e-9")), tol=mpf(10) ** (5 - 2 * DIGITS))
        arrival = launch - since / mp.pi
        phase += since
        launch = (1 + restitution) * forcing * mp.cos(phase) - restitution * arrival
    return phase, launch


def doubling(start: State, durations: list[mpf], forcing: mpf, restitution: mpf) -> mpf:
    """Γ near `forcing` at which the orbit through about `start` has the multiplier −1."""

    def equations(phase: mpf, launch: mpf, g: mpf) -> list[mpf]:
        def ends(a: mpf, b: mpf) -> State:
            return after((a, b), durations, g, restitution)

        end = ends(phase, launch)
        sides = [
            (ends(phase + STEP, launch), ends(phase - STEP, launch)),
            (ends(phase, launch + STEP), ends(phase, launch - STEP)),
        ]
        (a, b), (c, d) = ([(p[i] - m[i]) / (2 * STEP) for i in range(2)] for p, m in sides)
        periods = mp.nint(sum(durations) / (2 * mp.pi))
        return [end[0] - phase - 2 * mp.pi * periods, end[1] - launch, (1 + a) * (1 + d) - b * c]

    found = mpmath.findroot(equations, (*start, forcing), tol=mpf("1e-30"))
    return found[2]


@pytest.mark.parametrize("impacts", [4, *in_soak(2)])
def test_doublings_agree_with_the_return_map(impacts: int) -> None:
    points = period_doublings(fixed_point(0.45, 0.5), "axial_forcing", 0.6, 3)
    orbit = next(point.orbit for point in points if point.orbit.impacts == impacts)
    curve = orbit_curve(orbit, CurveKind.DOUBLING, Window((0.3, 0.9), (0.3, 0.8)))
    with mp.workdps(DIGITS):
        for i in range(1, len(curve.restitution), len(curve.restitution) // 2):
            phases = curve.forcing_phase[i]
            apart = np.diff(np.append(phases, phases[0]))
            times = [mp.pi * 2 + mpf(float(d)) for d in np.angle(np.exp(1j * apart))]
            forcing, restitution = mpf(curve.axial_forcing[i]), mpf(curve.restitution[i])
            first, second = mpf(phases[0]), mpf(phases[1])
            rise = forcing * (mp.sin(second) - mp.sin(first))
            start = first, rise / times[0] + times[0] / (2 * mp.pi)
            exact = doubling(start, times, forcing, restitution)
            # residuals are below 1e-15, the inverse of the derivatives is below 100
            assert abs(float(exact - forcing)) < 1e-13
