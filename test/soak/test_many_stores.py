"""A thousand damaged results of a study: none is read wrong, none gives a traceback.

make soak
BOUNCING_DISK_SOAK_STORES=100 BOUNCING_DISK_SOAK_SEED=7 make soak
"""

from __future__ import annotations

import os
import shutil
from collections import Counter
from pathlib import Path

import pytest

from bouncing_disk_ros.study import run
from support.hostile_stores import HOSTILE, attempt, check_hostile, disturb, flip, whole

STORES = int(os.environ.get("BOUNCING_DISK_SOAK_STORES", "1000"))
SEED = int(os.environ.get("BOUNCING_DISK_SOAK_SEED", "20090501"))

pytestmark = [pytest.mark.soak, pytest.mark.timeout(7200)]


def test_damaged_stores_give_the_same_numbers_or_a_refusal(tmp_path: Path) -> None:
    study = whole(tmp_path / "r.zarr")
    expected = run(study, tmp_path / "r.zarr")
    assert expected is not None
    expected.load()
    seen: Counter[tuple[bool, bool]] = Counter()
    for seed in range(SEED, SEED + STORES):
        copy = shutil.copytree(tmp_path / "r.zarr", tmp_path / "copy.zarr")
        for further in range(1 + seed % 3):
            (flip if seed % 2 else disturb)(copy, seed + further * STORES)
        opened, again = attempt(study, copy, expected)
        seen[opened == "same", again == "same"] += 1
        shutil.rmtree(copy)
    print(f"\n{STORES} stores: (opened, run again) the same {dict(seen)}")
    assert seen[False, True] > STORES / 10


def test_every_hostile_store_is_refused_in_one_line_or_computed_anew(tmp_path: Path) -> None:
    study = whole(tmp_path / "r.zarr")
    expected = run(study, tmp_path / "r.zarr")
    assert expected is not None
    expected.load()
    for name in HOSTILE:
        copy = tmp_path / name / "r.zarr"
        check_hostile(name, study, Path(shutil.copytree(tmp_path / "r.zarr", copy)), expected)
