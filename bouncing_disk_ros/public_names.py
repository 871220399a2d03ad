"""Public names of a module: declared in the stub beside it, loaded when first used (PEP 562).

Type checkers read the stub, the .pyi file, in place of the module. `PublicNames` reads it too. Each
of its lines `from .maps.tosses import toss as toss` declares a name; ruff keeps one name to a line.
lazy_loader reads stubs too, but has no names that functions make, no hint for a mistyped name, and
takes a module for a package.
"""

from __future__ import annotations

import importlib
import re
import sys
from collections.abc import Callable, Mapping
from pathlib import Path


class PublicNames:
    """Public names of the module called `module`, whose source is `file`.

    `made`: functions that make the values of further names.
    """

    def __init__(
        self, module: str, file: str, made: Mapping[str, Callable[[], object]] | None = None
    ) -> None:
        self._module = sys.modules[module]
        self._made = made or {}
        text = Path(file).with_suffix(".pyi").read_text("utf-8")
        lines = re.findall(r"^from (\S+) import (\w+) as \2$", text, re.MULTILINE)
        self.homes = {name: home for home, name in lines}
        """Public name -> the module that has it."""
        self.all = sorted({*self.homes, *self._made})

    def load(self, name: str) -> object:
        """Value of a public name; the module keeps it. AttributeError: there is no such name."""
        if name in self._made:
            value = self._made[name]()
        elif name in self.homes:
            value = self._imported(self.homes[name], name)
        else:
            from bouncing_disk_ros.errors import closest

            text = f"module {self._module.__name__!r} has no attribute {name!r}"
            raise AttributeError(f"{text}. {closest(name, self.all)}".rstrip(". "))
        setattr(self._module, name, value)
        return value

    def _imported(self, home: str, name: str) -> object:
        if home == ".":
            return importlib.import_module(f".{name}", self._module.__package__)
        return getattr(importlib.import_module(home, self._module.__package__), name)

    def listed(self) -> list[str]:
        """What `dir` lists: the public names, loaded or not."""
        return sorted({*self.all, *(name for name in vars(self._module) if name[:2] == "__")})
