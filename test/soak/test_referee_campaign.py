"""The core against the referee for hours: a million flights, a million steps of lanes, 10⁵ tosses.

make soak                                       # with the rest; about an hour of one core
.venv/bin/pytest -m soak -s test/soak/test_referee_campaign.py
BOUNCING_DISK_REFEREE_FLIGHTS=20000 ...         # fewer; the lanes and tosses in proportion
BOUNCING_DISK_REFEREE_STATE=part_2.json ...     # a part of its own, beside others

The work is done in parts. After each the state file (output/referee.json) holds the counts so far:
what has been interrupted goes on there, and what is complete is begun anew with other seeds. The
first seed is drawn, printed and kept in the file; BOUNCING_DISK_REFEREE_SEED sets it.
"""

from __future__ import annotations

import json
import os
import secrets
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import pytest

from bouncing_disk_ros.proof.exact_records import Outcome, Verdict
from support.map_proof import prove_collision
from support.random_maps import random_collisions
from support.referee import FLIGHTS, GIVEN_UP, prove_runs

ROOT = Path(__file__).resolve().parents[2]
MANY_FLIGHTS = int(os.environ.get("BOUNCING_DISK_REFEREE_FLIGHTS", "1000000"))
STATE = Path(os.environ.get("BOUNCING_DISK_REFEREE_STATE", ROOT / "output" / "referee.json"))
RUNS, COLLISIONS = 500, 5_000
"""Of one part."""
PATIENCE = 60.0  # s for one run
GIVEN_UP_PART = 1e-3
"""Of all runs; each is named."""

pytestmark = [pytest.mark.soak, pytest.mark.timeout(12 * 3600)]


class Progress:
    """The state file: where each kind of work has come to, and what was found."""

    def __init__(self, file: Path) -> None:
        self.file = file
        self.seed = int(os.environ.get("BOUNCING_DISK_REFEREE_SEED", secrets.randbits(40)))
        self.parts: Counter[str] = Counter()
        self.counts: Counter[str] = Counter()
        if file.is_file():
            kept = json.loads(file.read_text("utf-8"))
            self.seed = kept["seed"]
            self.parts.update(kept["parts"])
            self.counts.update(kept["counts"])
        print(f"\nreferee: first seed {self.seed}, state in {file}")

    def keep(self) -> None:
        """Write the state whole or not at all."""
        self.file.parent.mkdir(parents=True, exist_ok=True)
        fresh = self.file.with_suffix(".new")
        text = json.dumps({"seed": self.seed, "parts": self.parts, "counts": self.counts}, indent=1)
        fresh.write_text(text, "utf-8")
        fresh.replace(self.file)

    def work(self, name: str, many: int, part: Callable[[int], Counter[str]]) -> Counter[str]:
        """Do parts until `many` of `name` are done; then forget that, for the next time."""
        while self.counts[name] < many:
            self.counts.update(part(self.seed + self.parts[name]))
            self.parts[name] += 1
            self.keep()
            if self.parts[name] % 20 == 0:
                print(f"  {name}: {self.counts[name]} of {many}", flush=True)
        done = Counter({key: n for key, n in self.counts.items() if key.startswith(name)})
        for key in done:
            del self.counts[key]
        self.seed += self.parts.pop(name)
        self.keep()
        print("\n".join(f"  {key}: {n}" for key, n in sorted(done.items())))
        return done


@pytest.fixture
def progress() -> Progress:
    return Progress(STATE)


def test_events_of_random_runs_are_proved(progress: Progress) -> None:
    def part(seed: int) -> Counter[str]:
        counts: Counter[str] = Counter()
        begin = seed * RUNS
        for found in prove_runs(range(begin, begin + RUNS), PATIENCE):
            assert found.refuted == [], "\n".join(found.refuted)
            for line in found.undecided:
                print(f"  undecided: {line}")
            if GIVEN_UP in found.counts:
                print(f"  given up: the run of seed {found.seed}")
            counts.update({f"{FLIGHTS}, {key}": n for key, n in found.counts.items()})
            counts[FLIGHTS] += found.counts.get(FLIGHTS, 0)
            counts[f"{FLIGHTS}, runs"] += 1
        return counts

    done = progress.work(FLIGHTS, MANY_FLIGHTS, part)
    assert done[f"{FLIGHTS}, {GIVEN_UP}"] <= GIVEN_UP_PART * done[f"{FLIGHTS}, runs"]


def _counted(name: str, said: object, verdict: Verdict) -> Counter[str]:
    assert verdict.outcome is not Outcome.REFUTED, (said, verdict)
    if verdict.outcome is Outcome.UNDECIDED:
        print(f"  undecided: {said!r}: {verdict.reason}")
    return Counter({name: 1, f"{name}, {verdict.outcome.value}": 1})


def test_steps_of_the_lanes_are_proved(progress: Progress) -> None:
    def part(seed: int) -> Counter[str]:
        counts: Counter[str] = Counter()
        for collision in random_collisions(seed, COLLISIONS):
            counts.update(_counted("lanes", collision, prove_collision(collision)))
        return counts

    progress.work("lanes", MANY_FLIGHTS, part)
