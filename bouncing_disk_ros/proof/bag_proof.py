"""The proof of a recorded run: replayed from its inputs event by event, each one proved."""

from __future__ import annotations

import argparse
import importlib.util
import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

import bouncing_disk_ros
from bouncing_disk_ros import bag
from bouncing_disk_ros.errors import ExitCode, InputError, MissingLibraryError
from bouncing_disk_ros.field_checks import whole
from bouncing_disk_ros.report.read_run import choose, is_there
from bouncing_disk_ros.report.recorded_runs import IMPACTS, INPUTS, RecordedRuns, Run
from bouncing_disk_ros.units import NS

if TYPE_CHECKING:
    from bouncing_disk_ros.core.simulation import Simulation
    from bouncing_disk_ros.proof.verdicts import ProofCount


def prove_bag(given: argparse.Namespace) -> int:
    """Prove the events of the runs in a bag and print a summary; DONE where none is refuted."""
    if importlib.util.find_spec("flint") is None:
        raise MissingLibraryError("--prove", "python-flint")
    whole("every", given.every, 1)
    whole("run", given.run, 0)
    from tqdm import tqdm

    from bouncing_disk_ros.proof.verdicts import Outcome

    interrupted = False
    with bag.open(given.bag) as opened:
        prover = BagProver(opened, given)
        steps = tqdm(prover.work(), "proof", leave=False, disable=None, unit=" events")
        try:
            for time in steps:
                steps.set_postfix_str(f"t = {time:.3f} s", refresh=False)
        except KeyboardInterrupt:
            interrupted = True
        steps.close()
    print("\n".join(prover.lines(interrupted)), flush=True)
    if prover.tally.total(Outcome.REFUTED):
        return ExitCode.FAILED
    return ExitCode.INTERRUPTED if interrupted else ExitCode.DONE


class BagProver:
    """Replays the runs of a simulator in a bag and proves their events."""

    def __init__(self, opened: bag.Bag, given: argparse.Namespace) -> None:
        from bouncing_disk_ros.proof.verdicts import ProofCount

        self.tally: ProofCount = ProofCount()
        self._bag, self._given = opened, given
        base = choose(opened, given.namespace).rstrip("/")
        self._inputs, self._impacts = f"{base}/{INPUTS}", f"{base}/{IMPACTS}"
        if not is_there(opened, self._inputs, INPUTS):
            raise InputError(f"bag {opened.path}", f"no {self._inputs}", "a bag that has it")
        opened.check_installed(self._inputs)
        self._events = 0
        self._begun = self._reached = math.nan  # simulated s
        self._versions: set[str] = set()

    def work(self) -> Iterator[float]:
        """Prove the runs wished for: the simulated time, after each event."""
        runs = RecordedRuns(self._bag, self._inputs, self._impacts)
        for count, run in enumerate(runs, start=1):
            if self._given.run in (0, count):
                yield from self._prove_run(run)
        if self._given.run > len(runs):
            raise InputError("run", self._given.run, f"1 to {len(runs)}")
        if math.isnan(self._begun):
            allowed = "records with at least one snapshot"
            raise InputError(self._inputs, "records without a snapshot", allowed)

    def _prove_run(self, run: Run) -> Iterator[float]:
        """Prove from the first snapshot to the last instant that a topic shows."""
        from bouncing_disk_ros.run.input_replay import apply, steps

        simulation: Simulation | None = None
        for record, simulation, is_start, _ in steps(run.records):
            if simulation is None:
                continue
            if is_start:
                self._versions.add(str(record.get("version", "")))
                if math.isnan(self._begun):
                    self._begun = simulation.time_ns / NS
            else:
                yield from self._prove(simulation, int(record["time_ns"]), is_end=False)
                apply(simulation, record)
        if simulation is not None:
            yield from self._prove(simulation, _last_ns(run, simulation.time_ns), is_end=True)

    def _prove(self, simulation: Simulation, until_ns: int, *, is_end: bool) -> Iterator[float]:
        """Prove the events up to an instant."""
        from bouncing_disk_ros.proof.event_proof import prove
        from bouncing_disk_ros.proof.event_trace import trace

        for event in trace(simulation, until_ns, is_end=is_end):
            self._reached = event.before.ns / NS
            if self._is_wanted(self._reached):
                self.tally.take(event, prove(event))
            else:
                self.tally.leave_out()
            self._events += 1
            yield self._reached
        self._reached = until_ns / NS

    def _is_wanted(self, time: float) -> bool:
        begin, end = (vars(self._given)[name] for name in ("from", "to"))
        inside = (begin is None or time >= begin) and (end is None or time < end)
        return inside and self._events % self._given.every == 0

    def lines(self, interrupted: bool) -> Iterator[str]:
        """The summary."""
        stopped = "interrupted: " if interrupted else ""
        yield f"{stopped}proof of {self._bag.path}, {self._begun:.3f} s to {self._reached:.3f} s"
        yield from self.tally.lines()
        if self.tally.left_out:
            every = f", every {self._given.every}th only" if self._given.every > 1 else ""
            yield f"left out: {self.tally.left_out} events, as asked{every}"
        others = self._versions - {"", bouncing_disk_ros.__version__}
        if others:
            yield (
                f"recorded by version {', '.join(sorted(others))}: proved is what version "
                f"{bouncing_disk_ros.__version__} computes from the same inputs"
            )


def _last_ns(run: Run, reached_ns: int) -> int:
    """The last instant that a topic shows."""
    from bouncing_disk_ros.run.replay import comparable_rows

    last = max(reached_ns, run.end_ns)
    for rows in run.rows:
        times = comparable_rows(rows)["time"][-1:]
        if len(times) and math.isfinite(times[0]):
            last = max(last, math.floor(float(times[0]) * NS))
    return last
