"""Kernels compiled for another processor give the same bits: each is compiled anew here."""

from __future__ import annotations

import hashlib
import sys

import pytest

from support.processes import finished

pytestmark = [pytest.mark.interop, pytest.mark.timeout(300)]

SCENARIO = """
import hashlib
from bouncing_disk_ros.core.model import Disk, InitialState, Motion
from bouncing_disk_ros.core.simulation import Simulation
disk = Disk(0.3, 0.5, 0.6, 0.12, 0.106, 10.0)
sim = Simulation(Motion(0.05, 0.5, 3.0, -0.7), disk, InitialState())
sim.command([(5 * 10**9, Motion(0.045, 0.7, 3.3, 0.3)), (9 * 10**9, Motion(0.06, 0.5, 2.0, 2.9))])
sim.apply_impulse(6 * 10**9 + 1, 0.1, -0.002)
rows, _ = sim.advance(30 * 10**9)
print(hashlib.sha256(rows.tobytes() + repr(sim.sample()).encode()).hexdigest())
"""


def digest(**environment: str) -> str:
    return finished(sys.executable, "-c", SCENARIO, env=environment, timeout=280.0).stdout


def test_bits_do_not_depend_on_the_processor() -> None:
    """Kernels compiled for the oldest x86-64 (no AVX, no fused multiply-add) give the same bits."""
    here = digest()
    assert len(here.strip()) == len(hashlib.sha256().hexdigest())
    assert digest(NUMBA_CPU_NAME="x86-64", NUMBA_CPU_FEATURES="") == here
