"""Kernels of the core, called from Python: they have no wrappers for it of their own."""

from __future__ import annotations

from functools import cache
from types import ModuleType
from typing import Any

from numba import njit

from bouncing_disk_ros.kernel_cache import share_compiled_kernels


@cache
def from_python(kernel: Any) -> Any:
    """The same function, compiled so that Python can call it: once for each version of sources."""
    share_compiled_kernels()
    fastmath = kernel.targetoptions.get("fastmath", False)
    return njit(error_model="numpy", nogil=True, cache=True, fastmath=fastmath)(kernel.py_func)


class Kernels:
    """A module whose kernels can be called from Python; all else is as in the module."""

    def __init__(self, module: ModuleType) -> None:
        self._module = module

    def __getattr__(self, name: str) -> Any:
        found = getattr(self._module, name)
        inner = getattr(found, "targetoptions", {}).get("no_cpython_wrapper", False)
        return from_python(found) if inner else found
