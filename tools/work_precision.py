"""Draw docs/figures/work_precision.png: error of the time of impact 3 of a drop over time spent.

    python tools/work_precision.py      (MuJoCo is drawn where it is installed: pip install mujoco)

Each way runs the reference case `drop` up to impact 3 or longer; the times are medians of 7 runs.
"""

from __future__ import annotations

import statistics
import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numba
import numpy as np

from bouncing_disk_ros import reference_case, simulate
from bouncing_disk_ros.colours import BLUE, GREEN, GREY, ORANGE, VERMILION
from bouncing_disk_ros.matplotlib_figures import new_figure

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "examples"))
CASE = reference_case("drop")
TRUE = float(CASE.impacts["time_lower"][2])
Point = tuple[float, float]  # s spent, s of error


@numba.njit
def fixed_steps(h: float, g: float, height: float, restitution: float) -> float:
    """Time of the third impact: semi-implicit Euler, a bounce where the disk is below the table."""
    t, x, v, impacts = 0.0, height, 0.0, 0
    while impacts < 3:
        v -= g * h
        x += v * h
        t += h
        if x < 0.0 and v < 0.0:
            v, impacts = -restitution * v, impacts + 1
    return t


def measured(run: Callable[[], float]) -> Point:
    """Median time of a run, and the error of its third impact."""
    found, spent = run(), []
    for _ in range(7):
        begin = time.perf_counter()
        run()
        spent.append(time.perf_counter() - begin)
    return statistics.median(spent), abs(found - TRUE)


def ways() -> dict[str, tuple[str, list[Point]]]:
    """Name of each way -> its colour and points."""
    import case_by_solve_ivp

    def scipy(rtol: float) -> float:
        return case_by_solve_ivp.impacts(CASE, rtol)["time"][2]

    p = CASE.keywords()
    numbers = p["gravity"], p["initial_height"], p["restitution"]
    found = {
        "this package": (
            BLUE,
            [measured(lambda: float(simulate(2.0, **p).impacts["time"][2]))],
        ),
        "SciPy solve_ivp with events, rtol 1e-3 to 1e-12": (
            GREEN,
            [measured(partial(scipy, rtol)) for rtol in (1e-3, 1e-6, 1e-9, 1e-12)],
        ),
        "fixed steps of 10 ms to 1 µs, compiled": (
            ORANGE,
            [measured(partial(fixed_steps, h, *numbers)) for h in 10.0 ** -np.arange(2.0, 7.0)],
        ),
    }
    try:
        import case_by_mujoco
    except ImportError:
        return found
    from bouncing_disk_ros.cases.comparison import impacts_in

    def mujoco(step: float) -> float:
        return float(impacts_in(CASE, case_by_mujoco.samples(step, 10.0 * step))["time"][2])

    steps = (1e-3, 1e-4, 1e-5)
    name = "MuJoCo, steps of 1 ms to 10 µs, contact of 10 steps"
    found[name] = VERMILION, [measured(partial(mujoco, h)) for h in steps]
    return found


def main() -> None:
    """Measure, draw, and print the points."""
    figure = new_figure(8.0, 5.0)
    axes = figure.subplots()
    for name, (color, points) in ways().items():
        spent, errors = np.array(points).T
        axes.loglog(1e3 * spent, np.maximum(errors, 1e-17), "o-", color=color, label=name)
        print(name, *(f"{1e3 * t:.3g} ms {e:.2g} s" for t, e in points), sep="; ")
    axes.axhline(np.spacing(TRUE), color=GREY, lw=1.0, ls=":", label="rounding of a float64")
    axes.set_xlabel("time spent (ms)")
    axes.set_ylabel("error of the time of impact 3 (s)")
    axes.grid(visible=True, color="#dddddd", linewidth=0.6)
    axes.legend(fontsize=9)
    figure.savefig(ROOT / "docs" / "figures" / "work_precision.png", dpi=110)


if __name__ == "__main__":
    main()
