"""A period-2 orbit, followed along the axial forcing from where it is born to where it doubles.

    python examples/follow_period_2.py [RESTITUTION]      (default: 0.5)

Both ends are points of doubling, where a multiplier is −1: computed, not read off a diagram.
"""

import sys
from dataclasses import replace

if "--help" in sys.argv:  # before the imports, which take seconds
    print(__doc__)
    sys.exit()

import numpy as np

from bouncing_disk_ros import fixed_point, period_doublings, periodic_orbit


def main(restitution: float = 0.5) -> None:
    """Find both doublings; print the orbit between them."""
    least = (1.0 - restitution) / (1.0 + restitution)  # Γ, where the period-1 orbit begins
    stable = fixed_point(least + 0.01, restitution)
    born, doubled = period_doublings(stable, "axial_forcing", limit=least + 0.4, count=2)
    print(f"period 1 → 2 at Γ = {born.value:.10f}, 2 → 4 at Γ = {doubled.value:.10f}")

    orbit = doubled.orbit  # of two impacts, at its upper end
    print("       Γ      τ of both impacts      w_A of both            larger multiplier")
    for forcing in np.linspace(doubled.value, born.value + 0.002, 10):
        # from the state before: near enough for Newton's method
        orbit = periodic_orbit(replace(orbit.map, axial_forcing=forcing), orbit.state, 2)
        phases = "  ".join(f"{phase:8.5f}" for phase in orbit.forcing_phase)
        speeds = "  ".join(f"{speed:9.5f}" for speed in orbit.axial_impact_velocity)
        print(f"{forcing:.6f}  {phases}  {speeds}  {orbit.multipliers[0]:+.5f}")


if __name__ == "__main__":
    main(*map(float, sys.argv[1:]))
