"""Results of 300 runs of all kinds, pinned by their digests: a change of the code changes no bit.

`python test/reference/test_pinned.py` computes all anew and rewrites pinned.json, and says what has
changed: for a change that is meant to change results, and says so in the changelog. The names of
studies have their revision, and a study of one revision keeps its numbers.
"""

from __future__ import annotations

import json
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path

if __name__ == "__main__":  # as pytest finds the tests' own modules
    sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import pytest
from numba import njit

from bouncing_disk_ros.maps.lanes.lane_basics import fused
from reference import pinned_maps, pinned_results, pinned_simulations
from reference.cases import in_soak
from support.digest import Digest, differences, digest_of
from support.pinned_draws import PinnedRun

FILE = Path(__file__).with_name("pinned.json")
RUNS = [*pinned_simulations.runs(), *pinned_maps.runs(), *pinned_results.runs()]
CHOSEN = [run for run in RUNS if not run.is_another or in_soak("all")]


def title(run: PinnedRun) -> str:
    return f"{run.kind}: {run.name}"


def read() -> dict[str, Digest]:
    """The digests that are pinned."""
    held = json.loads(FILE.read_text("utf-8")) if FILE.is_file() else {}
    return {
        name: Digest(numbers, words, tuple((digits, tuple(some)) for digits, some in near))
        for name, (numbers, words, near) in held.items()
    }


def is_fused() -> bool:
    """Whether the lanes round a product and its sum once, as most processors can."""
    probe = njit(lambda a, b, c: fused(a, b, c))
    return bool(probe(1.0 + 2.0**-30, 1.0 - 2.0**-30, -1.0) != 0.0)


PINNED = read()


@pytest.mark.parametrize("run", CHOSEN, ids=title)
def test_a_run_is_what_it_was(run: PinnedRun, tmp_path: Path) -> None:
    if run.in_lanes and not is_fused():
        pytest.skip("sums in lanes differ by roundings on a processor without fused multiply-add")
    found = digest_of(run.compute(tmp_path))
    said = differences(PINNED[title(run)], found)
    assert not said, f"{title(run)}: {'; '.join(said[:5])}"


def test_each_pinned_run_is_there() -> None:
    names = [title(run) for run in RUNS]
    assert len(names) == len(set(names))
    assert names == list(PINNED)


def unraised(found: Mapping[str, Digest]) -> list[str]:
    """The pinned studies whose numbers are others now, though their revision is the same."""
    return [
        name for name, digest in found.items()
        if name.startswith("study: ") and name in PINNED
        and differences(PINNED[name]._replace(words=digest.words), digest)
    ]  # fmt: skip


def test_a_study_with_other_numbers_needs_another_revision() -> None:
    """Stores of one revision are continued: nothing said that it had to be raised."""
    name, pinned = next(one for one in PINNED.items() if one[0].startswith("study: "))
    assert not unraised({**PINNED, name: pinned._replace(words="other")})
    assert unraised({**PINNED, name: pinned._replace(numbers="other")}) == [name]
    assert not unraised({f"{name} + 1": pinned._replace(numbers="other")})


def rewrite() -> None:
    """Compute all runs, say what differs, and pin them."""
    assert is_fused(), "this processor has no fused multiply-add: use another one"
    found = {}
    for run in RUNS:
        with tempfile.TemporaryDirectory() as folder:
            found[title(run)] = digest_of(run.compute(Path(folder)))
    for name, digest in found.items():
        said = differences(PINNED[name], digest) if name in PINNED else ["new"]
        if said:
            print(f"{name}: {'; '.join(said[:5])}")
    assert not unraised(found), f"raise the revision of these studies: {unraised(found)}"
    lines = [f"{json.dumps(name)}: {json.dumps(digest)}" for name, digest in found.items()]
    FILE.write_text("{\n" + ",\n".join(lines) + "\n}\n", "utf-8")
    print(f"{len(found)} runs are in {FILE.name}")


if __name__ == "__main__":
    rewrite()
