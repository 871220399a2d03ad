"""The C references, scalar and vectorised, compiled for this machine."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

SOURCE = Path(__file__).with_name("impacts.c")
LANES = Path(__file__).with_name("lanes.c")
#: what gcc needs to vectorise: no errno, no traps; nothing is reordered
VECTOR_FLAGS = (
    "-mprefer-vector-width=512",
    "-fno-math-errno",
    "-fno-trapping-math",
    "-fopenmp-simd",
)
FLAGS = ("-O3", "-march=native", "-shared", "-fPIC", "-lm")


class CReference:
    """`impacts` and `divisions` of impacts.c, compiled into a folder."""

    def __init__(self, folder: Path) -> None:
        library = folder / "impacts.so"
        subprocess.run(["gcc", *FLAGS[:-1], str(SOURCE), "-o", str(library), FLAGS[-1]], check=True)
        found = ctypes.CDLL(str(library))
        self._divisions = found.divisions
        self._divisions.argtypes, self._divisions.restype = [ctypes.c_long, ctypes.c_int], None
        self._impacts = found.impacts
        self._impacts.argtypes = [ctypes.c_double] * 4 + [ctypes.c_void_p, ctypes.c_long]
        self._impacts.restype = ctypes.c_long

    def impacts(
        self,
        axial_forcing: float,
        restitution: float,
        tau: float,
        u: float,
        out: NDArray[np.float64],
    ) -> int:
        """Fill out (n, 2) with the phase and |w_A| of n impacts; the whole cycles passed."""
        cycles: int = self._impacts(axial_forcing, restitution, tau, u, out.ctypes.data, len(out))
        return cycles

    def divisions(self, n: int, *, other: bool) -> None:
        """n chains of ten divisions, alone or with other work beside them."""
        self._divisions(n, other)

    @staticmethod
    def missing() -> str:
        """Why it cannot be had, or ''."""
        return "" if shutil.which("gcc") else "gcc is not installed"

    @staticmethod
    def name() -> str:
        """The compiler and its flags."""
        run = subprocess.run(["gcc", "--version"], capture_output=True, text=True, check=True)
        return f"{run.stdout.splitlines()[0]}, {' '.join(FLAGS[:2])}"


class CLanes:
    """`iterate` and `label` of lanes.c, compiled into a folder for a processor (gcc's name)."""

    def __init__(self, folder: Path, processor: str = "native") -> None:
        library = folder / f"lanes-{processor}.so"
        flags = (*FLAGS[:-1], *VECTOR_FLAGS, f"-march={processor}")
        subprocess.run(["gcc", *flags, str(LANES), "-o", str(library), FLAGS[-1]], check=True)
        number, whole, array = ctypes.c_double, ctypes.c_long, ctypes.c_void_p
        self._library = ctypes.CDLL(str(library))
        self._library.iterate.argtypes = [array, array, whole, number, number, whole]
        self._library.label.argtypes = [array, array, whole, *[number] * 6, whole, array]

    def iterate(
        self,
        tau: NDArray[np.float64],
        w: NDArray[np.float64],
        axial_forcing: float,
        restitution: float,
        impacts: int,
    ) -> None:
        """Carry trajectories on, in place."""
        states = (tau.ctypes.data, w.ctypes.data, len(tau))
        self._library.iterate(*states, axial_forcing, restitution, impacts)

    def label(
        self,
        tau: NDArray[np.float64],
        w: NDArray[np.float64],
        axial_forcing: float,
        restitution: float,
        point: tuple[float, float],
        rule: tuple[float, int, int],
        labels: NDArray[np.int32],
    ) -> None:
        """Label starts: 1 near `point`, 0 in contact, −1 neither; rule: tolerance, confirm, cap."""
        states = (tau.ctypes.data, w.ctypes.data, len(tau))
        numbers = (axial_forcing, restitution, *point, *rule)
        self._library.label(*states, *numbers, labels.ctypes.data)
