"""The small executables start fast: no kernels, and no matplotlib before the end."""

from __future__ import annotations

import subprocess
import sys

import pytest


@pytest.mark.parametrize("module", ["show", "performer", "impact_printer", "recorder_node"])
def test_importing_a_tool_loads_no_kernels(module: str) -> None:
    code = (
        f"import sys, bouncing_disk_ros.nodes.{module}; "
        "sys.exit(' '.join({'numba', 'matplotlib', 'scipy'} & set(sys.modules)) or 0)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
