"""The state at any instant of a long run: from the nearest snapshot, beside REBOUND's archive.

Both runs have a snapshot each PERIODS periods of their problem, and are asked for the state at
random instants. Ours: a disk that bounces, with snapshots as `disk/inputs` has them (one JSON text
each). REBOUND: a planet about a star by its Wisdom-Holman integrator with 20 steps a period, in a
Simulationarchive. The work since a snapshot is not the same, so the rows say how many impacts or
steps that is: REBOUND has no impacts of this kind.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np

from bench.axial import REGIMES
from bench.many_references import missing
from bench.per_impact import full_simulation
from bench.table import Row, compared, row
from bench.turns import interleaved
from bouncing_disk_ros.core.simulation import Simulation

PART = "long runs"
PERIODS, SNAPSHOTS = 1000, 50
STEPS_A_PERIOD = 20
ROUNDS = 200
SEED = 20090501
REBOUND = "REBOUND"


class OwnRun:
    """A chaotic run with a snapshot each PERIODS periods, in one text each."""

    period_ns = round(math.tau * 1e9)

    def __init__(self) -> None:
        run = full_simulation(REGIMES[1])
        self._texts = [json.dumps(run.snapshot())]
        self.impacts = 0
        for k in range(1, SNAPSHOTS + 1):
            self.impacts += len(run.advance(k * PERIODS * self.period_ns)[0])
            self._texts.append(json.dumps(run.snapshot()))
        self._check(run)

    def _check(self, run: Simulation) -> None:
        """The end from the snapshot before it has the bits of the run that went through."""
        found = self.at(self.period_ns * PERIODS * SNAPSHOTS - 1)
        found.advance(run.time_ns)
        assert found.snapshot() == run.snapshot()

    @property
    def bytes_of_snapshots(self) -> int:
        """What the snapshots take."""
        return sum(map(len, self._texts))

    def at(self, instant_ns: int) -> Simulation:
        """The simulation at an instant."""
        found = Simulation.restore(json.loads(self._texts[instant_ns // self.period_ns // PERIODS]))
        found.advance(instant_ns)
        return found


class ReboundRun:
    """A planet about a star, with a snapshot each PERIODS orbits."""

    def __init__(self, folder: Path) -> None:
        import rebound

        self._file = folder / "planet.bin"
        run = rebound.Simulation()
        run.add(m=1.0)
        run.add(m=1e-3, a=1.0, e=0.3)
        run.integrator = "whfast"
        run.dt = math.tau / STEPS_A_PERIOD
        run.save_to_file(str(self._file), step=PERIODS * STEPS_A_PERIOD)
        run.integrate(math.tau * PERIODS * SNAPSHOTS)
        self._archive = rebound.Simulationarchive(str(self._file))

    @property
    def bytes_of_snapshots(self) -> int:
        """What the archive takes."""
        return self._file.stat().st_size

    def at(self, time: float) -> float:
        """Where the planet is at an instant."""
        found: float = self._archive.getSimulation(time, mode="exact").particles[1].x
        return found


def measure(folder: Path) -> tuple[list[Row], list[str]]:
    """The rows of this part, and the peer that was skipped."""
    own = OwnRun()
    rng = np.random.default_rng(SEED)
    instants = [float(share) for share in rng.uniform(0.0, SNAPSHOTS * PERIODS, 2 * ROUNDS)]
    runs: dict[str, Callable[[], int]] = {"snapshots": _asked(
        lambda periods: own.at(round(periods * own.period_ns)).sample(), instants)}  # fmt: skip
    sizes = {"snapshots": own.bytes_of_snapshots}
    notes = []
    if why := missing("rebound"):
        notes.append(f"skipped among long runs: {why}")
    else:
        peer = ReboundRun(folder)
        runs[REBOUND] = _asked(lambda periods: peer.at(periods * math.tau), instants)
        sizes[REBOUND] = peer.bytes_of_snapshots
    times = {name: 1e-6 * found for name, found in interleaved(runs, ROUNDS).items()}
    work = {
        "snapshots": f"some {own.impacts / SNAPSHOTS / 2:.0f} impacts after one",
        REBOUND: f"some {PERIODS * STEPS_A_PERIOD // 2} steps after one",
    }
    rows = compared(
        PART,
        "the state at any instant",
        "ms",
        {f"{name}, {work[name]}": found for name, found in times.items()},
        [(f"snapshots, {work['snapshots']}", f"{REBOUND}, {work[REBOUND]}", "snapshots / REBOUND",
          None)],
    )  # fmt: skip
    rows += [
        row(PART, f"a snapshot, {name}", "B", [size / (SNAPSHOTS + 1)])
        for name, size in sizes.items()
    ]
    return rows, notes


def _asked(at: Callable[[float], object], instants: list[float]) -> Callable[[], int]:
    """A run that asks for the next instant each time, in periods."""
    left = iter(instants)

    def run() -> int:
        at(next(left))
        return 1

    run()
    return run
