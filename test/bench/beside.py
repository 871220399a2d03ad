"""How late the simulator's ticks are beside a study: alone, beside one elsewhere, and beside it.

    python -m bench.beside

measures in a process of its own and prints JSON. A `SimulatorNode` at 1 kHz is spun in a thread;
the main thread waits, has another process run a study, and runs that study itself, in turns. What a
study in another process costs is the machine's (its cores, its kernel, its disk); what one in the
same process costs beyond that is the interpreter's lock.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from bench.cluster import basins
from bench.table import Aim, Row, row
from bench.turns import in_process
from bouncing_disk_ros.study import run

PART = "beside a study"
RATE = 1000.0  # Hz
ROUNDS = 5
SECONDS = 2.0  # of each turn, at least; a study is run again until then
SIDE = 2000
ALONE, ELSEWHERE, HERE = "alone", "study in another process", "study in the same process"
OTHER = """
import sys
from pathlib import Path
from bench.beside import studied
studied(Path(sys.argv[1]), 0.0)
print("ready", flush=True)
for line in sys.stdin:
    studied(Path(sys.argv[1]), float(line))
    print("done", flush=True)
"""


def measure() -> list[Row]:
    """The rows of this part."""
    printed = in_process("-m", "bench.beside")
    found: dict[str, list[list[float]]] = json.loads(printed.splitlines()[-1])
    rows = []
    for who, turns in found.items():
        for place, key in enumerate(("p50", "p99", "max")):
            aim = Aim(at_most=1.0) if (key, who) == ("p99", ELSEWHERE) else None
            values = [turn[place] for turn in turns]
            rows.append(row(PART, f"{key} of the ticks at {RATE:g} Hz, {who}", "ms", values, aim))
    ratio = [here[1] / other[1] for here, other in zip(found[HERE], found[ELSEWHERE], strict=True)]
    rows.append(row(PART, "p99, study in the same process / in another one", "×", ratio, Aim(1.2)))
    return rows


def studied(folder: Path, seconds: float) -> None:
    """Run a whole study, one worker, stored; again until so many seconds are over."""
    begin = time.monotonic()
    while True:
        with tempfile.TemporaryDirectory(dir=folder) as place:
            run(basins(SIDE), Path(place, "result"), workers=1)
        if time.monotonic() >= begin + seconds:
            return


@contextmanager
def _other_process(folder: Path) -> Iterator[Callable[[], None]]:
    """A process that runs the study whenever it is called."""
    with subprocess.Popen(
        [sys.executable, "-c", OTHER, str(folder)], text=True,
        stdin=subprocess.PIPE, stdout=subprocess.PIPE,
    ) as process:  # fmt: skip
        told, heard = process.stdin, process.stdout
        assert told is not None
        assert heard is not None
        assert heard.readline() == "ready\n"

        def call() -> None:
            told.write(f"{SECONDS}\n")
            told.flush()
            assert heard.readline() == "done\n"

        try:
            yield call
        finally:
            told.close()


@contextmanager
def _spinning() -> Iterator[list[tuple[int, int]]]:
    """A simulator in a thread: (instant, lateness) of its ticks in ns, as they come."""
    from bouncing_disk_ros import SimulatorNode
    from bouncing_disk_ros.ros.spin import spin_until
    from bouncing_disk_ros.run.health import Ticks
    from support.ros import Nodes, overrides_of

    ticks: list[tuple[int, int]] = []

    def note(self: Ticks, late_ns: int, note: Callable[[Ticks, int], None] = Ticks.note) -> None:
        note(self, late_ns)
        ticks.append((time.monotonic_ns(), late_ns))

    Ticks.note = note  # type: ignore[method-assign]
    nodes, given = Nodes(), {"state_rate": RATE, "preset": "pizza_multiple_toss"}
    node = SimulatorNode(
        context=nodes.context, use_global_arguments=False, parameter_overrides=overrides_of(given)
    )
    stop = threading.Event()
    thread = threading.Thread(target=spin_until, args=(node, stop.is_set))
    thread.start()
    try:
        yield ticks
    finally:
        stop.set()
        thread.join()
        node.destroy_node()
        nodes.close()


def _turn(ticks: list[tuple[int, int]], work: Callable[[], object]) -> list[float]:
    """p50, p99 and maximum of the lateness during some work, ms."""
    begin = time.monotonic_ns()
    work()
    end = time.monotonic_ns()
    late = [late for now, late in list(ticks) if begin <= now < end]
    return [float(value) * 1e-6 for value in (*np.percentile(late, [50, 99]), max(late))]


def _here() -> dict[str, list[list[float]]]:
    """p50, p99, maximum of each turn, by what the ticks had beside them."""
    with tempfile.TemporaryDirectory() as name, _other_process(Path(name)) as elsewhere:
        folder = Path(name)
        studied(folder, 0.0)  # kernels and libraries loaded
        with _spinning() as ticks:
            time.sleep(1.0)  # the first second holds the start
            works: dict[str, Callable[[], object]] = {
                ALONE: lambda: time.sleep(SECONDS),
                ELSEWHERE: elsewhere,
                HERE: lambda: studied(folder, SECONDS),
            }
            found: dict[str, list[list[float]]] = {who: [] for who in works}
            for _ in range(ROUNDS):
                for who, work in works.items():
                    found[who].append(_turn(ticks, work))
                ticks.clear()
    return found


if __name__ == "__main__":
    print(json.dumps(_here()))
