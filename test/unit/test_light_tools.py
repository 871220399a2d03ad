"""Executables start fast: no kernels where none are needed, and no matplotlib before the end."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from bouncing_disk_ros.executables import EXECUTABLES, entry_point
from support.processes import finished


def test_importing_a_tool_loads_no_kernels_and_light_names_nothing_heavy() -> None:
    modules = ("demo.demo_node", "performer", "impact_printer", "recorder.recorder_node")
    code = "import sys, bouncing_disk_ros\nbouncing_disk_ros.InputError, dir(bouncing_disk_ros)\n"
    code += "assert not {'numba', 'numpy', 'rclpy', 'matplotlib'} & set(sys.modules)\n"
    for module in modules:
        code += f"import bouncing_disk_ros.nodes.{module}\n"
        code += "slow = {'numba', 'matplotlib', 'scipy'} & set(sys.modules)\n"
        code += f"assert not slow, ({module!r}, slow)\n"
    finished(sys.executable, "-c", code)


HELP = """
import gc, importlib, os, sys
gc.disable()
import bouncing_disk_ros.study.command  # what most of them share is loaded once
for name in sys.argv[1:]:
    if os.fork() == 0:
        try:
            importlib.import_module(name).main(["--help"])
        finally:
            slow = {"rclpy", "numba", "numpy", "matplotlib", "xarray"} & set(sys.modules)
            assert not slow, (name, slow)
    code = os.waitstatus_to_exitcode(os.wait()[1])
    assert code == 0, (name, code)
"""


def test_help_waits_for_no_slow_import_and_fits_a_terminal_of_any_encoding() -> None:
    """Each executable in a process of its own, forked from one that has what they share."""
    modules = [entry_point(name).split(":")[0] for name in EXECUTABLES]
    env = {"PYTHONIOENCODING": "ascii:strict"}
    done = finished(sys.executable, "-c", HELP, *modules, env=env)
    assert done.stderr == ""
    assert all(f"usage: {name}" in done.stdout for name in EXECUTABLES)


def test_a_study_does_not_load_the_dask_and_the_zarr_that_are_installed(tmp_path: Path) -> None:
    """xarray did, for nothing: a small study took half as long again."""
    pytest.importorskip("dask")
    options = ["--ros-args", "-p", f"output:={tmp_path}", "-p", "figures:=none", "-p", "points:=16"]
    code = "import sys; from bouncing_disk_ros.study.toss_paths.options import main\n"
    code += f"assert main({options!r}) == 0\n"
    code += "print('loaded:', *{'dask.base', 'distributed', 'xarray', 'zarr'} & set(sys.modules))"
    done = finished(sys.executable, "-c", code)
    assert done.stdout.splitlines()[-1] == "loaded: xarray"
