"""What every compiled function keeps to, so that a study leaves the rest of its process in peace.

A kernel releases the interpreter's lock, or a simulator in another thread would stand still; none
starts threads of numba's own (`parallel`), whose layer ends the process when two Python threads
call it at once.
"""

from __future__ import annotations

import ast
import importlib
import pkgutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from numba import types
from numba.core.dispatcher import Dispatcher

import bouncing_disk_ros
from bouncing_disk_ros.core import arithmetic

PACKAGE = Path(bouncing_disk_ros.__file__).parent
PACKAGES = ("maps", "core", "motor_study", "juggling.kernels", "measured.kernels")
"""Those that may import numba (test_architecture.py)."""
TAKEN = {"numba": {"config", "from_dtype", "njit", "types"},
         "numba.extending": {"intrinsic"}, "numba.core": {"event", "caching"},
         "numba.core.codegen": {"JITCodeLibrary"}, "numba.core.compiler": {"Compiler"},
         "numba.core.typing": {"cffi_utils"}, "numba.np": {"arraymath"}}  # fmt: skip
"""All that is taken from numba; `jit` keeps the lock, `prange` and `vectorize` have threads."""


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
        "lanes.basin_kernel._label_lanes",
        "lanes.axial_lanes._iterate_axial",
        "stepper.advance",
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


def offences(tree: ast.AST) -> Iterator[str]:
    """What in a file could keep the lock or start threads, found in its text."""
    called: dict[int, ast.Call] = {
        id(node.func): node for node in ast.walk(tree) if isinstance(node, ast.Call)
    }
    for node in ast.walk(tree):
        match node:
            case ast.Import(names=names):
                taken = {alias.name for alias in names if alias.name.split(".")[0] == "numba"}
            case ast.ImportFrom(module=str(module), names=names) if f"{module}.".startswith(
                "numba."
            ):
                taken = {alias.name for alias in names} - TAKEN.get(module, set())
            case ast.Name(id="njit"):
                call = called.get(id(node))
                given = {} if call is None else {k.arg: ast.unparse(k.value) for k in call.keywords}
                safe = given.get("nogil") == "True" and "parallel" not in given
                taken = set() if safe else {"njit"}
            case _:
                taken = set()
        for name in taken:
            yield f"line {node.lineno}: {name}"  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    "text",
    [
        "import numba",
        "from numba import prange",
        "from numba.extending import register_jitable",
        "from numba.np.ufunc.parallel import get_num_threads",
        "@njit\ndef f(): ...",
        "njit(cache=True)(f)",
        "njit(nogil=False)(f)",
        "njit(nogil=True, parallel=True)(f)",
    ],
)
def test_offences_are_seen(text: str) -> None:
    assert len(list(offences(ast.parse(text)))) == 1


def test_no_file_compiles_otherwise() -> None:
    """Also what the walk cannot see: functions within functions."""
    found = {
        file.name: told
        for file in PACKAGE.rglob("*.py")
        if any(word in (text := file.read_text("utf-8")) for word in ("numba", "njit"))
        and (told := list(offences(ast.parse(text))))
    }
    assert found == {}


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
    done = subprocess.run(
        [sys.executable, "-c", LOADED], capture_output=True, text=True, check=True, timeout=100
    )
    assert done.stdout == "[]\n[]\n"


@arithmetic.rare_kernel
def a_cube(x: float, n: int) -> float:
    return n * x * x * x


@arithmetic.kernel
def two_cubes(x: float) -> float:
    return float(a_cube(x, 1) + a_cube(x, 2))


def test_a_rare_kernel_is_one_function_that_is_not_inlined_by_force() -> None:
    """Numba lets a callee inherit inlining from its first caller; a literal is a type to it."""
    two_cubes.compile((types.float64,))  # type: ignore[attr-defined]
    (compiled,) = a_cube.overloads.values()  # type: ignore[attr-defined]
    assert not compiled.fndesc.inline
    (compiled,) = two_cubes.overloads.values()  # type: ignore[attr-defined]
    assert compiled.fndesc.inline
