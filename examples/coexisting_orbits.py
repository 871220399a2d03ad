"""The attractors that coexist at one axial forcing, with their Floquet multipliers.

    python examples/coexisting_orbits.py [AXIAL_FORCING [RESTITUTION]]      (default: 0.48, 0.5)

An orbit is stable when both multipliers are within the unit circle. Where the period-1 orbit is
unstable, and so no attractor, it is printed too.
"""

import sys

if "--help" in sys.argv:  # before the imports, which take seconds
    print(__doc__)
    sys.exit()

from bouncing_disk_ros import (
    AttractorKind,
    InputError,
    MapState,
    NextCollisionMap,
    find_attractors,
    fixed_point,
    periodic_orbit,
    spread_starts,
)


def main(axial_forcing: float = 0.48, restitution: float = 0.5) -> None:
    """Search from 400 starts; print each attractor."""
    section = NextCollisionMap(axial_forcing, restitution)
    starts = [
        (start.forcing_phase, start.axial_impact_velocity) for start in spread_starts(400, -5.0)
    ]
    for attractor in find_attractors(section, starts).found:
        if attractor.kind is not AttractorKind.PERIODIC:
            print(attractor.name)
            continue
        first = MapState(attractor.forcing_phases[0], attractor.velocities[0])
        orbit = periodic_orbit(section, first, len(attractor.forcing_phases))
        print(attractor.name, "with multipliers", *(f"{one:.6f}" for one in orbit.multipliers))
        for phase, velocity in zip(orbit.forcing_phase, orbit.axial_impact_velocity, strict=True):
            print(f"    τ = {phase:.6f} rad, w_A = {velocity:+.6f} πg/ω")
    try:
        single = fixed_point(axial_forcing, restitution)
    except InputError as error:
        print(error)  # no such orbit here
        return
    if not single.stable:
        print("beside them:", single)


if __name__ == "__main__":
    main(*map(float, sys.argv[1:]))
