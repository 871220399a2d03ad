"""Executables start fast: no kernels where none are needed, and no matplotlib before the end."""

from __future__ import annotations

import subprocess
import sys

import pytest

from bouncing_disk_ros.executables import EXECUTABLES, entry_point


@pytest.mark.parametrize(
    "module", ["demo.demo_node", "live.performer", "live.impact_printer", "recorder.recorder_node"]
)
def test_importing_a_tool_loads_no_kernels(module: str) -> None:
    code = (
        f"import sys, bouncing_disk_ros.nodes.{module}; "
        "sys.exit(' '.join({'numba', 'matplotlib', 'scipy'} & set(sys.modules)) or 0)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("name", sorted(EXECUTABLES))
def test_help_waits_for_no_slow_import(name: str) -> None:
    module, _ = entry_point(name).split(":")
    code = (
        f"import sys, {module} as executable\n"
        "try:\n"
        "    executable.main(['--help'])\n"
        "finally:\n"
        "    slow = {'rclpy', 'numba', 'matplotlib', 'xarray'} & set(sys.modules)\n"
        "    print('slow:', *slow, file=sys.stderr)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert done.returncode == 0
    assert name in done.stdout
    assert done.stderr == "slow:\n"
