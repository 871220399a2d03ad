"""The studies as processes: topics, files, Ctrl-C and going on, refusals, a cluster, a bag."""

from __future__ import annotations

import io
import math
import os
import signal
import threading
from collections.abc import Mapping
from pathlib import Path
from typing import ClassVar

import numpy as np
import pytest
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.image import imread
from numpy.typing import NDArray
from sensor_msgs.msg import CompressedImage, Image
from std_msgs.msg import Float32

from bouncing_disk_ros.command_line.stop import Answer, Stop
from bouncing_disk_ros.parameters import Value
from bouncing_disk_ros.study import command, named, open_result, run, runner
from bouncing_disk_ros.study.by_name import definition_of
from bouncing_disk_ros.study.command import run_command
from bouncing_disk_ros.study.outlets import StudyOutlet, image_message
from support.processes import Process, Starter, wait_until
from support.ros import wait_for_message

pytestmark = pytest.mark.timeout(300)  # longer than any wait here

ROOT = Path(__file__).resolve().parents[2]
WAIT = 250.0  # s; matplotlib, xarray and zarr are slow to import on a loaded machine


def begin(start: Starter, name: str, folder: Path, *arguments: str, **values: object) -> Process:
    """Start a study with its output and its options."""
    return start(name, "--ros-args", *arguments, *options_of(folder, values))


def options_of(folder: Path, values: Mapping[str, object]) -> list[str]:
    """The options of a study with this output and these values; only PNG figures."""
    given = {"output": folder, "figures": "png", **values}
    return [word for key, value in given.items() for word in ("-p", f"{key}:={value}")]


def pixels(message: Image) -> NDArray[np.generic]:
    kind = {"32FC1": np.float32, "32SC1": np.int32}[message.encoding]
    assert (message.is_bigendian, message.step) == (0, 4 * message.width)
    return np.frombuffer(bytes(message.data), kind).reshape(message.height, message.width)


def check_figure(topic: str, file: Path) -> None:
    message = wait_for_message(CompressedImage, topic, latched=True)
    assert message.format == "png"
    drawn = imread(io.BytesIO(bytes(message.data)))
    assert drawn.shape == imread(file).shape
    assert drawn.std() > 0.01, "an empty picture"


def test_a_late_subscriber_gets_the_labels_with_the_lowest_row_at_the_bottom(
    start: Starter, tmp_path: Path
) -> None:
    files = ("-r", "__ns:=/lab", "--params-file", str(ROOT / "config" / "fig4a.yaml"))
    node = begin(start, "basins", tmp_path / "b", *files, width=40, height=30, hold="true")
    node.wait_for("running until Ctrl-C", WAIT)
    labels = pixels(wait_for_message(Image, "/lab/basins/result", latched=True))
    assert wait_for_message(Float32, "/lab/basins/progress", latched=True).data == 1.0
    check_figure("/lab/basins/figure/compressed", tmp_path / "b" / "basins.png")
    assert node.end(signal.SIGINT) == 0
    assert node.complaints == []
    stored = open_result(tmp_path / "b" / "result.zarr")
    assert stored.attrs["parameter_axial_forcing"] == 0.34  # of the file
    assert np.array_equal(labels, stored["label"].values[::-1])
    # w_A is near 0 in the upper rows: no disk comes from there to the period-1 orbit
    assert len(np.unique(labels[0])) == 1
    assert len(np.unique(labels)) > 1
    with xr.open_dataset(tmp_path / "b" / "result.nc", engine="netcdf4") as exported:
        assert np.array_equal(exported["label"], stored["label"])


def test_speeds_are_an_image_of_floats() -> None:
    speeds = np.array([[0.1, math.nan, -2.0], [3.0, 0.0, 1e9]])
    np.testing.assert_array_equal(pixels(image_message(speeds)), speeds[::-1].astype(np.float32))


@pytest.mark.parametrize("heard", [False, True])
def test_without_files_a_figure_is_drawn_only_for_those_who_hear_it(
    tmp_path: Path, heard: bool
) -> None:
    class Outlet(StudyOutlet):
        figures: ClassVar[list[Figure | None]] = []

        def is_heard(self) -> bool:
            return heard

        def result(self, figure: Figure | None, file: Path | None, result: xr.Dataset) -> None:
            self.figures.append(figure)

    definition = definition_of("toss_paths")
    given: dict[str, Value] = {"output": str(tmp_path), "figures": "none", "points": 16}
    defaults = {key: spec.default for key, spec in definition.table.items()}
    work = command.StudyWork(definition, {**defaults, **given}, given.keys())
    assert work.present(Outlet(Stop())) == 0
    (figure,) = Outlet.figures
    assert (figure is not None) == heard


def test_interrupted_work_is_kept_and_the_same_command_goes_on(
    start: Starter, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """Progress shows with use_sim_time, as launch files set it, though nobody publishes /clock."""
    values: dict[str, Value] = {"begin": 0.4, "end": 0.6, "count": 8, "samples": 50}
    store = tmp_path / "s" / "result.zarr"
    node = begin(start, "basin_shares", tmp_path / "s", workers=1, use_sim_time="true", **values)
    first = wait_for_message(Float32, "/basin_shares/progress", latched=True, timeout=WAIT)
    assert first.data < 1.0
    wait_until(lambda: list((store / "region_done").glob("c/*")), told=lambda: node.output)
    assert node.end(signal.SIGINT, WAIT) == 130
    found = node.wait_for(r"interrupted; (\d+) of 8 parts are kept in .*, and the same command")
    assert 1 <= int(found.group(1)) < 8
    assert "Traceback" not in node.output
    definition = definition_of("basin_shares")
    given: dict[str, Value] = {
        "output": str(tmp_path / "s"),
        "figures": "none",
        "netcdf": False,
        **values,
    }
    defaults = {key: spec.default for key, spec in definition.table.items()}
    assert run_command(definition, {**defaults, **given}, given.keys(), Stop()) == 0
    assert f"continuing: {found.group(1)} of 8 parts are done" in capfd.readouterr().out
    at_once, resumed = run(named("basin_shares", **values)), open_result(store)
    assert at_once is not None
    for name in at_once.data_vars:
        if name in resumed:  # the others are derived
            np.testing.assert_array_equal(resumed[name].values, at_once[name].values, str(name))


def test_a_part_that_takes_long_does_not_hold_up_an_end(start: Starter, tmp_path: Path) -> None:
    """Each of these parts takes minutes, so an end that waits for one does not come in time."""
    node = begin(start, "basin_shares", tmp_path / "s", workers=1, count=2, samples=20_000)
    node.wait_for("result in ")
    assert node.end(signal.SIGINT, 20.0) == 130
    assert "interrupted; 0 of 2 parts are kept" in node.output
    assert "Traceback" not in node.output


def test_a_second_signal_ends_it_at_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    released, definition, stop = threading.Event(), definition_of("toss_paths"), Stop()

    def ended(code: int) -> None:
        raise SystemExit(code)

    monkeypatch.setattr(runner, "run", lambda *_, **__: released.wait())
    monkeypatch.setattr(command, "STOP_SECONDS", 0.1)
    monkeypatch.setattr(os, "_exit", ended)
    stop.asked = True
    values = {key: spec.default for key, spec in definition.table.items()}
    values["output"] = str(tmp_path / "s")
    with pytest.raises(SystemExit, match="130"):
        run_command(definition, values, {"output"}, stop)
    released.set()
    assert stop.answer is Answer.END
    assert "another Ctrl-C ends it at once" in capfd.readouterr().err


@pytest.mark.interop  # 30 s; test_cluster.py has clusters without a process of their own
def test_a_cluster_computes_the_same(
    start: Starter, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    distributed = pytest.importorskip("distributed")
    values = {"phase_lag_count": 130, "amplitude_angle_count": 5}  # three parts
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, processes=True, dashboard_address=None,
        scheduler_kwargs={"dashboard_address": ":0"},  # not 8787, which another test may take
        local_directory=str(tmp_path / "dask"), silence_logs=50,
    ) as cluster:  # fmt: skip
        address = cluster.scheduler_address
        node = begin(start, "toss_map", tmp_path / "there", scheduler=address, **values)
        assert node.wait(WAIT) == 0, node.output
    here = run(named("toss_map", **values), tmp_path / "here.zarr")
    assert here is not None
    there = open_result(tmp_path / "there" / "result.zarr")
    for name in ("airborne_speed", "speed_ratio", "efficiency", "delay", "code"):
        np.testing.assert_array_equal(here[name].values, there[name].values, name)
