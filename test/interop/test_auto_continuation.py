"""AUTO-07p follows the doublings of periods 2 and 4 in the plane of Γ and ε to the same curves.

AUTO continues fixed points of a map that bounces.c computes from the paper's equations: another
method (return map, not impact times) by another program.
"""

from __future__ import annotations

import math
import os
import shutil
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from bouncing_disk_ros.maps.bifurcations import period_doublings
from bouncing_disk_ros.maps.periodic_orbit import fixed_point
from bouncing_disk_ros.orbit_studies.orbit_branch import orbit_curve
from bouncing_disk_ros.orbit_studies.orbit_curves import Window
from support.processes import finished

pytestmark = [pytest.mark.interop, pytest.mark.timeout(600)]

SOURCE = Path(__file__).with_name("bounces.c")
LOW, HIGH = 0.3, 0.8  # restitution
RESTITUTION = 0.5
STABLE_AT = {2: 0.50, 4: 0.535}
"""Γ at which the orbit of so many impacts attracts, at this restitution."""
TOLERANCES = """ITMX=9, ITNW=9, NWTN=3, JAC=1, EPSL=1e-11, EPSU=1e-11, EPSS=1e-11
DSMIN=1e-8, DSMAX=1e-2, IADS=1, IID=2, ILP=0, MXBF=0
"""
ALONG_FORCING = """NDIM=2, IPS=-1, IRS=0, ICP=[1], ISP=2, ISW=1, NMX=2000, NPR=0, DS=1e-3
SP=['PD1'], UZSTOP={1: [0.4, 0.7]}
"""
IN_THE_PLANE = """NDIM=2, IPS=-1, IRS='PD1', ICP=[1, 2], ISP=0, ISW=2, NMX=4000, NPR=1
"""
AGREEMENT = 1e-10
"""AUTO prints 11 digits of numbers below 2 and solves to 1e-11; Γ and phase change with ε by less
than 5 times as much."""


def auto_folder() -> Path:
    """Where AUTO's object files are; skips the test where there is none."""
    given = os.environ.get("AUTO_DIR", "/usr/lib/auto-07p")
    if not (Path(given) / "lib" / "libauto_c.a").is_file():
        pytest.skip("no AUTO-07p here: apt install auto-07p, or set AUTO_DIR to its folder")
    for compiler in ("gcc", "gfortran"):
        if shutil.which(compiler) is None:
            pytest.skip(f"AUTO-07p needs {compiler} to link equations: apt install {compiler}")
    return Path(given)


def continued_by_auto(folder: Path, impacts: int) -> NDArray[np.float64]:
    """Rows (m, 3) of Γ, ε and the phase of an impact along AUTO's doubling curve."""
    auto = auto_folder()
    given = {"IMPACTS": impacts, "FORCING": STABLE_AT[impacts], "RESTITUTION": RESTITUTION}
    run = partial(finished, cwd=folder, timeout=300.0)
    run("gcc", "-O2", f"-I{auto / 'include'}", *(f"-D{k}={v}" for k, v in given.items()),
        "-c", SOURCE, "-o", "bounces.o")  # fmt: skip
    objects = [str(path) for path in sorted((auto / "lib").glob("*.o"))]
    run("gfortran", "-fopenmp", "bounces.o", *objects, f"-L{auto / 'lib'}", "-lauto_c",
        "-o", "bounces")  # fmt: skip
    (folder / "fort.2").write_text(ALONG_FORCING + TOLERANCES, "utf-8")
    shown = run("./bounces").stdout
    assert " PD " in shown, shown
    (folder / "fort.8").rename(folder / "fort.3")
    rows = []
    for step in (1e-3, -1e-3):
        ends = f"DS={step}, UZSTOP={{2: [{LOW}, {HIGH}]}}\n"
        (folder / "fort.2").write_text(IN_THE_PLANE + TOLERANCES + ends, "utf-8")
        shown = run("./bounces").stdout
        assert " UZ " in shown, shown  # it came to the end of the window
        lines = (folder / "fort.7").read_text("utf-8").splitlines()
        rows += [line.split()[4:] for line in lines if line.split()[0] != "0"]
    return np.array(rows, float)[:, [0, 4, 2]]


def interpolated(x: NDArray[np.float64], y: NDArray[np.float64], at: float) -> NDArray[np.float64]:
    """y (m, …) at `at` between points no further apart than 0.002, by Lagrange of degree 7."""
    near = np.argsort(np.abs(x - at))[:8]
    weights = [math.prod((at - x[k]) / (x[j] - x[k]) for k in near if k != j) for j in near]
    return np.asarray(np.tensordot(weights, y[near], axes=1))


@pytest.mark.parametrize("impacts", [2, 4])
def test_auto_finds_the_same_doublings(impacts: int, tmp_path: Path) -> None:
    rows = continued_by_auto(tmp_path, impacts)
    assert len(rows) >= 50
    assert (rows[:, 1].min(), rows[:, 1].max()) == pytest.approx((LOW, HIGH), abs=1e-9)
    found = period_doublings(fixed_point(0.45, RESTITUTION), "axial_forcing", 0.6, 3)
    orbit = next(point.orbit for point in found if point.orbit.impacts == impacts)
    window = Window((0.3, 0.9), (LOW - 0.02, HIGH + 0.01))
    curve = orbit_curve(orbit, "doubling", window, largest_step=0.002)
    e = curve.restitution
    assert np.all(np.diff(e) < 0.0) or np.all(np.diff(e) > 0.0)
    phases = np.unwrap(curve.forcing_phase, axis=0)
    apart = []
    for forcing, restitution, phase in rows:
        own = interpolated(e, phases, restitution) - phase
        away = np.min(np.abs(np.angle(np.exp(1j * own))))
        apart.append((abs(interpolated(e, curve.axial_forcing, restitution) - forcing), away))
    largest = np.max(apart, axis=0)
    print(f"period {impacts}: {len(rows)} points, largest difference of Γ {largest[0]:.1e}, "
          f"of the phase {largest[1]:.1e}")  # fmt: skip
    assert np.all(largest < AGREEMENT), largest
