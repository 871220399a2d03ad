"""Bags and stores of studies that version 0.2.0 wrote are read, replayed, resumed and drawn.

version_0_2_0/ was written by the code of that version: `live` by its simulator and recorder, the
other bags by its writer and recovery; and a small store of each study. `expected.json` holds what
0.2.0 itself read in them: contents, reports, replays and results.
"""

from __future__ import annotations

import json
import shutil
import zipfile
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pytest

from bouncing_disk_ros import bag, study
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.executables import entry_point
from bouncing_disk_ros.nodes.replay.bag_streams import Recorded, replay_bag
from bouncing_disk_ros.parameters import Value
from bouncing_disk_ros.report.run_report import Report
from support import pinned_results
from support.digest import Digest, differences, digest_of, nearly

FILES = Path(__file__).with_name("version_0_2_0")
EXPECTED: dict[str, dict[str, Any]] = json.loads((FILES / "expected.json").read_text("utf-8"))
REPAIRED = {"motor": "stall_torque"}
"""A number of a result that version 0.3 mends: T* was taken for it."""
FEW: dict[str, Value] = {"settling": 100, "measured": 300}
STUDIES: dict[str, dict[str, Value]] = {
    "basins": {"width": 20, "height": 12, "axial_forcing": 0.45, "angular_velocities": "0 -1"},
    "bifurcation": {"count": 70, "kept": 6, "doublings": 1, "end": 0.5, **FEW},
    "parameter_map": {"x_count": 6, "y_count": 5, **FEW},
    "basin_shares": {"count": 2, "samples": 8, "begin": 0.34, "end": 0.45},
    "toss_map": {"phase_lag_count": 70, "amplitude_angle_count": 5},
    "toss_paths": {"points": 17},
    "curves": {"doublings": 0, "axial_forcing_count": 4, "restitution_count": 3,
               "largest_step": 0.05, "settling": 100, "measured": 256, "axial_forcing_begin": 0.4,
               "axial_forcing_end": 0.5, "restitution_begin": 0.45, "restitution_end": 0.55},
    "motor": {"x_count": 3, "y_count": 2},
    "manifolds": {"width": 12, "height": 8, "distance": 0.2, "points": 300, "repetitions": 4.0,
                  "pairs": 2},
    "resilience": {"count": 2, "samples": 12, "instants": 4, "begin": 0.4, "end": 0.45,
                   "periods": 100.0},
    "juggling": {"width": 3, "height": 3, "deadline": 5.0},
}  # fmt: skip


def pinned(group: str, name: str, what: str = "") -> Digest:
    """A digest of 0.2.0."""
    numbers, words, near = EXPECTED[group][name][what] if what else EXPECTED[group][name]
    return Digest(numbers, words, tuple((digits, tuple(some)) for digits, some in near))


def unrepaired(report: Report, *, motions: bool) -> Any:
    """The numbers of a report that no repair of version 0.3 changed.

    It takes mean speeds over whole periods, fits transients and estimates by impacts that no input
    is near, works the ledger out between two of its reports, and takes a motion that no message
    tells from the record of inputs.
    """
    segments = [
        [*part.segment[:2], part.segment.motion if motions else None, list(part.segment.disk)[:8],
         part.rows, part.impacts, pinned_results._orbit(part.orbit)]
        for part in report.segments
    ]  # fmt: skip
    return [[*segments, report.begin, report.end]]


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the bags of 0.2.0; `crashed` is `live` as a killed recorder leaves it."""
    folder = tmp_path_factory.mktemp("bags")
    shutil.copytree(FILES, folder, dirs_exist_ok=True)
    crashed = shutil.copytree(folder / "live", folder / "crashed")
    (crashed / "metadata.yaml").unlink()
    file = crashed / "live_0.mcap"
    file.write_bytes(file.read_bytes()[:-20_000])
    return folder


def unpacked(name: str, folder: Path) -> Path:
    """A store of 0.2.0."""
    with zipfile.ZipFile(FILES / "studies.zip") as packed:
        packed.extractall(folder, [one for one in packed.namelist() if one.split("/")[0] == name])
    return folder / name


@pytest.mark.parametrize("name", EXPECTED["bags"])
def test_a_bag_reads_reports_and_replays_as_it_did(name: str, runs: Path) -> None:
    folder, _, namespace = name.partition(" ")
    found = pinned_results.report(runs / folder, namespace=namespace or None)
    assert found.source.version == ("" if folder == "simulated" else "0.2.0")
    seen = {
        "content": pinned_results.content(runs / folder),
        "report": unrepaired(found, motions=folder != "simulated"),
    }
    for what, value in seen.items():
        assert not differences(pinned("bags", name, what), digest_of(value)), what
    with bag.open(runs / folder) as opened:
        again = replay_bag(Recorded(opened, namespace or None))
    counts = [again.impacts, again.rows, again.not_compared, len(again.runs)]
    assert [again.identical, *counts] == EXPECTED["bags"][name]["replayed"]


@pytest.mark.parametrize("name", STUDIES)
def test_a_whole_store_is_opened_and_drawn(name: str, tmp_path: Path) -> None:
    made = study.named(name, **STUDIES[name])
    seen: list[study.Progress] = []
    found = study.run(made, unpacked(f"{name}.zarr", tmp_path), on_progress=seen.append)
    assert found is not None
    assert seen[0].resumed == seen[0].total, "computed anew"
    assert found.attrs["source"] == "bouncing_disk_ros 0.2.0"
    is_older = found.attrs["identity"]["revision"] < made.revision
    assert ("computed other numbers" in seen[0].note) == is_older
    names = sorted({*map(str, found.variables)} - {REPAIRED.get(name)})
    values = {one: nearly(found[one].values.ravel()[:20], 8) for one in names}
    assert not differences(pinned("stores", name), digest_of(values))
    figures = pinned_results.drawn(entry_point(name).split(":")[0], made, found)
    assert figures
    for figure in figures:
        plt.close(figure)


def test_a_store_that_was_begun_is_resumed(tmp_path: Path) -> None:
    made, path = study.named("toss_map", **STUDIES["toss_map"]), unpacked("toss_map.zarr", tmp_path)
    with pytest.warns(RuntimeWarning, match="made by an earlier version without checksums"):
        whole = study.open_result(path).load()
    (path / "region_done" / "c" / "1").unlink()
    seen: list[study.Progress] = []
    found = study.run(made, path, on_progress=seen.append)
    assert found is not None
    assert (seen[0].resumed, seen[-1].done, seen[-1].total) == (1, 2, 2)
    assert "without checksums" in seen[0].note
    for name in made.fields:
        # on another processor, last digits of what follows a logarithm or a cosine may differ
        np.testing.assert_allclose(found[name].values, whole[name].values, rtol=1e-9, atol=1e-12)


def test_a_store_that_was_begun_with_other_numbers_is_refused(tmp_path: Path) -> None:
    """It was continued: one result had the numbers of two versions."""
    made = study.named("bifurcation", **STUDIES["bifurcation"])
    with pytest.raises(InputError, match=r"unfinished: there the revision is 1, not 2"):
        study.run(made, unpacked("bifurcation_begun.zarr", tmp_path))
