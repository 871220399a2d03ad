"""What a user waits for: executables from their start to their end, with next to no work.

With kernels cached, and with a new and empty cache folder.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

from bench.table import Row, row
from support.processes import executed
from support.recorded import period_one_bag
from support.studies import SMALLEST

CACHED_RUNS = 3
PATIENCE = 300.0  # s, compiling on a loaded machine


def commands(bag: str, fresh: Callable[[], Path]) -> dict[str, Callable[[], list[str]]]:
    """Executable -> what gives the arguments of one run; a study stores in a new folder."""

    def study(name: str) -> list[str]:
        given = {"output": fresh(), "figures": "none", **SMALLEST[name]}
        return ["--ros-args", *(w for key, v in given.items() for w in ("-p", f"{key}:={v}"))]

    tools = {"replay": lambda: [bag], "bag_report": lambda: [bag, "--text-only"]}
    return {**tools, **{name: partial(study, name) for name in SMALLEST}}


def measure(folder: Path, fresh: Callable[[], Path]) -> list[Row]:
    """The rows of this part; `fresh` names a new folder at each call."""
    bag = str(period_one_bag(folder / "run", 4.0))
    found = commands(bag, fresh).items()
    return [one for name, arguments in found for one in _rows(name, arguments, fresh)]


def _rows(name: str, arguments: Callable[[], list[str]], fresh: Callable[[], Path]) -> list[Row]:
    def seconds(env: dict[str, str]) -> float:
        given = arguments()
        begin = time.perf_counter()
        executed(name, *given, env=env, timeout=PATIENCE)
        return time.perf_counter() - begin

    uncached = seconds({"NUMBA_CACHE_DIR": str(fresh())})
    seconds({})  # fills the cache, if it is empty
    cached = [seconds({}) for _ in range(CACHED_RUNS)]
    what = f"{name}, from start to end"
    return [
        row("cold start", f"{what}, cached", "s", cached),
        row("cold start", f"{what}, uncached", "s", [uncached]),
    ]
