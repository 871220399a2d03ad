"""What every compiled function keeps to, so that a study leaves the rest of its process in peace.

A kernel releases the interpreter's lock, or a simulator in another thread would stand still; none
starts threads of numba's own (`parallel`), whose layer ends the process when two Python threads
call it at once.
"""

from __future__ import annotations

import importlib
import pkgutil
import re
import sys
from collections.abc import Iterator
from pathlib import Path

from numba import types
from numba.core.dispatcher import Dispatcher

import bouncing_disk_ros
from bouncing_disk_ros.core import compilation
from support.processes import finished

PACKAGE = Path(bouncing_disk_ros.__file__).parent
PACKAGES = ("maps", "core", "motor_study", "juggling.kernels", "measured.kernels")
"""Those that may import numba (test_architecture.py)."""


def kernels() -> Iterator[tuple[str, Dispatcher]]:
    for folder in PACKAGES:
        package = importlib.import_module(f"bouncing_disk_ros.{folder}")
        for found in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
            module = importlib.import_module(found.name)
            for name, value in vars(module).items():
                if isinstance(value, Dispatcher):
                    yield f"{found.name}.{name}", value


def test_every_kernel_releases_the_lock_has_no_threads_and_fuses_only_where_it_says_so() -> None:
    found = dict(kernels())
    # the walk finds what the studies and the simulator call
    for name in (
        "basin_labels._label_lanes",
        "lanes.axial_lanes._iterate_axial",
        "engine.advance",
    ):
        assert any(full.endswith(name) for full in found), f"{name} is not among {len(found)}"
    keeps = [
        name for name, kernel in found.items() if kernel.targetoptions.get("nogil") is not True
    ]
    threads = [name for name, k in found.items() if k.targetoptions.get("parallel")]
    # left to fuse as it likes, the compiler changed bits with the seed of Python's hashes
    given = {name: kernel.targetoptions.get("fastmath") for name, kernel in found.items()}
    fuses = [name for name, flags in given.items() if flags is True or "contract" in (flags or ())]
    assert (keeps, threads, fuses) == ([], [], [])


def test_one_file_compiles_for_all() -> None:
    """The walk has all that it makes; it would not see functions within functions of others."""
    ways = re.compile(r"n?jit\b|jitable|prange|vectorize|stencil|\bcfunc\b|import numba\b")
    files = PACKAGE.rglob("*.py")
    found = {file.name for file in files if ways.search(file.read_text("utf-8"))}
    assert found == {"compilation.py"}


LOADED = """
import sys
import bouncing_disk_ros.nodes.simulator.simulator_node
from bouncing_disk_ros.core import next_event
print(next_event.find_next.signatures)
print([name for name in sys.modules if ".maps.lanes" in name])
"""


def test_a_start_loads_no_kernel_that_only_kernels_call(warm_kernels: None) -> None:
    """A tenth of a second of each start: the kernels that Python calls hold their code.

    Nor lanes, which compile at import, where they are not cached.
    """
    done = finished(sys.executable, "-c", LOADED)
    assert done.stdout == "[]\n[]\n"


@compilation.rare_kernel
def a_cube(x: float, n: int) -> float:
    return n * x * x * x


@compilation.kernel
def two_cubes(x: float) -> float:
    return float(a_cube(x, 1) + a_cube(x, 2))


def test_a_rare_kernel_is_one_function_that_is_not_inlined_by_force() -> None:
    """Numba lets a callee inherit inlining from its first caller; a literal is a type to it."""
    two_cubes.compile((types.float64,))  # type: ignore[attr-defined]
    (compiled,) = a_cube.overloads.values()  # type: ignore[attr-defined]
    assert not compiled.fndesc.inline
    (compiled,) = two_cubes.overloads.values()  # type: ignore[attr-defined]
    assert compiled.fndesc.inline
