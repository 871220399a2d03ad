"""A reference case by SciPy's solve_ivp with events, and how far it is from the rigid-impact law.

    python examples/case_by_solve_ivp.py [CASE] [RTOL]      (default: chaos 1e-3, SciPy's own)

Prints the comparison. The platform is the sinusoid of the case, and no impacts end in contact:
drop, elastic_drop, period_1, period_2, chaos, near_miss and near_touch can be asked for.
"""

import sys

if "--help" in sys.argv:  # before the imports, which take seconds
    print(__doc__)
    sys.exit()

import numpy as np
from scipy.integrate import solve_ivp

from bouncing_disk_ros import ReferenceCase, compare_with_case, reference_case

CASES = ("drop", "elastic_drop", "period_1", "period_2", "chaos", "near_miss", "near_touch")


def impacts(case: ReferenceCase, rtol: float) -> dict[str, list[float]]:
    """Times of the impacts and speeds after them, solve_ivp restarted at each impact."""
    p = case.keywords()
    g, omega, amplitude = p["gravity"], 2.0 * np.pi * p["frequency"], p["axial_amplitude"]

    def gap(t: float, y: np.ndarray) -> float:
        return y[0] - amplitude * np.sin(omega * t)

    gap.terminal, gap.direction = True, -1  # type: ignore[attr-defined]
    t, y = 0.0, np.array([p["initial_height"], p["initial_axial_velocity"]])
    found: dict[str, list[float]] = {"time": [], "velocity_after": []}
    most = 1e-3 if rtol < 1e-3 else np.inf  # s: a step must not jump over an impact
    while True:
        run = solve_ivp(
            lambda _, y: [y[1], -g], (t, case.duration), y,
            events=gap, rtol=rtol, atol=1e-3 * rtol, max_step=most,
        )  # fmt: skip
        if run.status != 1:
            return found
        t, y = float(run.t_events[0][0]), run.y_events[0][0]
        speed = amplitude * omega * np.cos(omega * t)
        y = np.array([amplitude * np.sin(omega * t), speed - p["restitution"] * (y[1] - speed)])
        found["time"].append(t)
        found["velocity_after"].append(float(y[1]))


def main(name: str = "chaos", rtol: str = "1e-3") -> None:
    """Run the case, and print how far it is from the law."""
    if name not in CASES:  # chatter has no last impact, and other cases have more than one motion
        sys.exit(f"CASE: got {name}, allowed: {', '.join(CASES)}")
    case = reference_case(name)
    print("\n".join(compare_with_case(name, impacts(case, float(rtol)), tolerance=1e-6).lines))


if __name__ == "__main__":
    main(*sys.argv[1:])
