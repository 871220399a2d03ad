"""Bags and stores of studies that version 0.1.0 wrote are read, replayed, resumed and drawn.

version_0_1_0/ was written by the code of that version: two runs of three seconds with impulses,
changed parameters, a pause, a reset and snapshots, one in steady motion, split into files, and one
with cross-fades; and a small study of each kind.
"""

from __future__ import annotations

import shutil
import zipfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pytest

from bouncing_disk_ros import bag, study
from bouncing_disk_ros.executables import entry_point
from bouncing_disk_ros.parameters import Value
from support import pinned_results

FILES = Path(__file__).with_name("version_0_1_0")
FEW: dict[str, Value] = {"settling": 100, "measured": 300}
STUDIES: dict[str, dict[str, Value]] = {
    "basins": {"width": 20, "height": 12, "axial_forcing": 0.45, "angular_velocities": "0 -1"},
    "bifurcation": {"count": 70, "kept": 6, "doublings": 1, "end": 0.5, **FEW},
    "parameter_map": {"x_count": 6, "y_count": 5, **FEW},
    "basin_shares": {"count": 2, "samples": 8, "begin": 0.34, "end": 0.45},
    "toss_map": {"phase_lag_count": 70, "amplitude_angle_count": 5},
    "toss_paths": {"points": 17},
}


@pytest.fixture
def stores(tmp_path: Path) -> Path:
    """A folder with the stores of 0.1.0."""
    with zipfile.ZipFile(FILES / "studies.zip") as packed:
        packed.extractall(tmp_path)
    return tmp_path


@pytest.fixture
def runs(tmp_path: Path) -> Path:
    """A folder with the bags of 0.1.0, so that nothing can change those of the tree."""
    return Path(shutil.copytree(FILES, tmp_path / "runs"))


@pytest.mark.parametrize("name", ["steady_run", "fading_run"])
def test_a_bag_is_read_and_reported(name: str, runs: Path) -> None:
    with bag.open(runs / name) as opened:
        assert opened.complete, opened.remarks
        assert opened.notes["version"] == "0.1.0"
        assert opened.attachments["parameters.yaml"] == b"friction: 0.6\n"
        rows = opened.rows("/disk/impacts")
        assert rows["index"].tolist() == list(range(len(rows)))
    report = pinned_results.report(runs / name)
    assert len(report.rows) == len(rows) > 20
    assert report.source.version == "0.1.0"
    assert pinned_results.table_numbers(report)


def test_a_run_in_steady_motion_is_replayed_bit_by_bit(runs: Path) -> None:
    impacts, rows, not_compared, count = pinned_results.replayed_bag(runs / "steady_run")
    with bag.open(runs / "steady_run") as opened:
        assert rows == len(opened.rows("/disk/impacts")) > 20
    assert impacts >= rows
    assert (not_compared, count) == (0, 1)


def test_a_run_with_cross_fades_is_replayed_up_to_the_last_digits_of_the_first_fade(
    runs: Path,
) -> None:
    """The bounds of a search in a cross-fade follow the frequency since then (changelog)."""
    rows, time, recorded, replayed = pinned_results.first_difference(runs / "fading_run")
    assert rows == 11
    assert 0.3 < time < 0.8, "not in the first cross-fade"
    assert replayed == pytest.approx(recorded, rel=1e-14)


@pytest.mark.parametrize("name", STUDIES)
def test_a_whole_store_is_opened_and_drawn(name: str, stores: Path) -> None:
    made = study.named(name, **STUDIES[name])
    seen: list[study.Progress] = []
    found = study.run(made, stores / f"{name}.zarr", on_progress=seen.append)
    assert found is not None
    assert seen[0].resumed == seen[0].total, "computed anew"
    assert found.attrs["source"] == "bouncing_disk_ros 0.1.0"
    figures = pinned_results.drawn(entry_point(name).split(":")[0], made, found)
    assert figures
    for figure in figures:
        plt.close(figure)


def test_a_store_that_was_begun_is_resumed(stores: Path) -> None:
    made = study.named("bifurcation", **STUDIES["bifurcation"])
    seen: list[study.Progress] = []
    found = study.run(made, stores / "bifurcation_begun.zarr", on_progress=seen.append)
    assert found is not None
    assert (seen[0].resumed, seen[-1].done, seen[-1].total) == (1, 2, 2)
    assert "without checksums" in seen[0].note
    with pytest.warns(RuntimeWarning, match="made by an earlier version without checksums"):
        whole = study.open_result(stores / "bifurcation.zarr")
    for name in made.fields:
        # on another processor, last digits of what follows a logarithm or a cosine may differ
        np.testing.assert_allclose(found[name].values, whole[name].values, rtol=1e-9, atol=1e-12)
