"""A study and a simulator in one process: neither changes a bit of the other (no clock here)."""

from __future__ import annotations

import os
import sys
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from types import FrameType
from typing import Any

import numba
import numpy as np
import pytest

from bouncing_disk_ros.niceness import NICENESS
from bouncing_disk_ros.study import Progress, Study, named, run
from bouncing_disk_ros.study.basins import compute
from support.driven import Driven

SEEDS = (3, 4)
PIXELS = 160


def study_of(side: int) -> Study:
    return named("basins", axial_forcing=0.45, width=side, height=side)


def labels_of(folder: Path, begun: threading.Event | None = None) -> dict[str, bytes]:
    def on_progress(_: Progress) -> None:
        if begun is not None:
            begun.set()

    result = run(study_of(PIXELS), folder, workers=2, on_progress=on_progress)
    assert result is not None
    return {str(name): array.values.tobytes() for name, array in result.data_vars.items()}


def driven(seed: int) -> list[Any]:
    """All that a wildly driven session publishes: its records of inputs and its rows, as bytes."""
    run_ = Driven().drive(seed)
    assert run_.impacts > 50
    return [run_.record_list, [rows.tobytes() for rows in run_.batches]]


def test_a_study_and_a_simulator_do_not_change_each_other(tmp_path: Path) -> None:
    runs_alone = [driven(seed) for seed in SEEDS]
    study_alone = labels_of(tmp_path / "alone")
    begun = threading.Event()
    with ThreadPoolExecutor(1) as pool:
        study = pool.submit(labels_of, tmp_path / "beside", begun)
        assert begun.wait(60.0)
        together = 0
        while not (together and study.done()):
            assert [driven(seed) for seed in SEEDS] == runs_alone
            together += 1
        assert study.result() == study_alone


def test_no_study_wakes_numba_s_threads(tmp_path: Path) -> None:
    labels_of(tmp_path / "result")
    with pytest.raises(ValueError, match="not initialized"):
        numba.threading_layer()


@pytest.mark.skipif(sys.platform != "linux", reason="niceness is that of the process elsewhere")
def test_shares_and_measures_of_basins_give_way_to_a_simulator(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """At the niceness of the caller, shares kept the threads of the measures from the processor,
    for up to 8 ms while one held the interpreter's lock."""
    found: dict[str, int] = {}

    def watch(name: str, function: Callable[..., Any]) -> None:
        def watched(*args: Any, **given: Any) -> Any:
            found[name] = os.getpriority(os.PRIO_PROCESS, 0)  # 0: of this thread
            return function(*args, **given)

        monkeypatch.setattr(compute, name, watched)

    names = ("shares", "uncertainty_exponent", "box_dimension", "basin_entropy")
    for name in names:
        watch(name, getattr(compute, name))
    labels_of(tmp_path / "result")
    here = os.getpriority(os.PRIO_PROCESS, 0)
    assert found == dict.fromkeys(names, min(here + NICENESS, 19))


@pytest.mark.parametrize(
    ("name", "sides"),
    [
        ("basins", ("width", "height")),
        ("toss_map", ("phase_lag_count", "amplitude_angle_count")),
    ],
)
def test_the_interpreter_works_as_much_for_a_large_region_as_for_a_small_one(
    name: str, sides: tuple[str, str]
) -> None:
    """Between kernels it holds the lock: the calls that it makes do not grow with the pixels."""

    def calls(side: int) -> int:
        study = named(name, **dict.fromkeys(sides, side))
        region, context = next(iter(study.regions())), study.context()
        study.compute(region, context, None)
        count = 0

        def note(_frame: FrameType, event: str, _: Any) -> None:
            nonlocal count
            count += event in ("call", "c_call")

        sys.setprofile(note)
        try:
            found = study.compute(region, context, None)
        finally:
            sys.setprofile(None)
        assert all(np.prod(array.shape) >= side * side for array in found.values())
        return count

    small, large = calls(24), calls(60)
    assert large <= 1.1 * small, f"{small} calls for 24 × 24 pixels, {large} for 60 × 60"
