"""The scalar C reference, compiled for this machine."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

SOURCE = Path(__file__).with_name("impacts.c")
FLAGS = ("-O3", "-march=native", "-shared", "-fPIC", "-lm")


class CReference:
    """`impacts` of impacts.c, compiled into a folder."""

    def __init__(self, folder: Path) -> None:
        library = folder / "impacts.so"
        subprocess.run(["gcc", *FLAGS[:-1], str(SOURCE), "-o", str(library), FLAGS[-1]], check=True)
        self._impacts = ctypes.CDLL(str(library)).impacts
        self._impacts.argtypes = [ctypes.c_double] * 4 + [ctypes.c_void_p, ctypes.c_long]
        self._impacts.restype = ctypes.c_long

    def impacts(
        self, forcing: float, restitution: float, tau: float, u: float, out: NDArray[np.float64]
    ) -> int:
        """Fill out (n, 2) with the phase and |w_A| of n impacts; the whole cycles passed."""
        cycles: int = self._impacts(forcing, restitution, tau, u, out.ctypes.data, len(out))
        return cycles

    @staticmethod
    def missing() -> str:
        """Why it cannot be had, or ''."""
        return "" if shutil.which("gcc") else "gcc is not installed"

    @staticmethod
    def name() -> str:
        """The compiler and its flags."""
        run = subprocess.run(["gcc", "--version"], capture_output=True, text=True, check=True)
        return f"{run.stdout.splitlines()[0]}, {' '.join(FLAGS[:2])}"
