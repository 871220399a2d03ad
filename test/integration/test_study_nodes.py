"""The studies as processes: topics, files, Ctrl-C and going on, refusals, a cluster, a bag."""

from __future__ import annotations

import io
import math
import re
import signal
import sys
import time
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from matplotlib.image import imread
from numpy.typing import NDArray
from sensor_msgs.msg import CompressedImage, Image
from std_msgs.msg import Float32

from bouncing_disk_ros import bag
from bouncing_disk_ros.study import named, open_result, run
from support.processes import Process, Starter
from support.recorded import RecordedRun, period_one_bag
from support.ros import wait_for_message

pytestmark = pytest.mark.timeout(300)  # longer than any wait here

ROOT = Path(__file__).resolve().parents[2]
SAFE: dict[str, object] = {
    "begin": 0.44, "end": 0.45, "count": 2, "samples": 20, "instants": 2, "resolution": 0.2,
}  # fmt: skip
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


def test_speeds_are_an_image_of_floats(start: Starter, tmp_path: Path) -> None:
    sizes = {"phase_lag_begin": "-0.5pi", "phase_lag_count": 9, "amplitude_angle_count": 7}
    node = begin(start, "toss_map", tmp_path / "m", **sizes, hold="true", netcdf="false")
    node.wait_for("running until Ctrl-C", WAIT)
    speeds = pixels(wait_for_message(Image, "/toss_map/result", latched=True))
    check_figure("/toss_map/figure/compressed", tmp_path / "m" / "toss_map.png")
    assert node.end(signal.SIGTERM) == 0
    result = open_result(tmp_path / "m" / "result.zarr")
    assert result["phase_lag"].values[0] == -math.pi / 2
    stored = result["airborne_speed"].values
    assert speeds.dtype == np.float32
    np.testing.assert_array_equal(speeds, stored[::-1].astype(np.float32))
    assert sorted(file.name for file in (tmp_path / "m").iterdir()) == [
        "result.zarr", "toss_map.png", "trajectories.png"
    ]  # fmt: skip


def test_progress_is_shown_though_time_stands_still(start: Starter, tmp_path: Path) -> None:
    """With use_sim_time, as launch files set it for all nodes, and nobody who publishes /clock."""
    values = {"begin": 0.4, "end": 0.6, "count": 12, "samples": 1000}
    node = begin(start, "basin_shares", tmp_path / "s", workers=1, use_sim_time="true", **values)
    first = wait_for_message(Float32, "/basin_shares/progress", latched=True, timeout=WAIT)
    assert first.data < 1.0
    assert node.running
    node.end(signal.SIGINT, WAIT)


def test_interrupted_work_is_kept_and_the_same_command_goes_on(
    start: Starter, tmp_path: Path
) -> None:
    values = {"begin": 0.4, "end": 0.6, "count": 12, "samples": 20}
    output = tmp_path / "s"
    node = begin(start, "basin_shares", output, workers=1, **values)
    deadline = time.monotonic() + WAIT
    while not list((output / "result.zarr" / "region_done").glob("c/*")):
        assert node.running, node.output
        assert time.monotonic() < deadline
        time.sleep(0.01)  # a poll of the condition
    assert node.end(signal.SIGINT, WAIT) == 130
    found = node.wait_for(r"interrupted; (\d+) of 12 parts are kept in .*, and the same command")
    assert 1 <= int(found.group(1)) < 12
    assert "Traceback" not in node.output
    again = begin(start, "basin_shares", output, workers=1, **values)
    assert again.wait(WAIT) == 0
    again.wait_for(f"continuing: {found.group(1)} of 12 parts are done")
    at_once = run(named("basin_shares", **values), tmp_path / "at_once.zarr", workers=1)
    assert at_once is not None
    store = output / "result.zarr"
    resumed = run(named("basin_shares", **values), store, workers=1)  # computes nothing
    assert resumed is not None
    for name in at_once.data_vars:
        np.testing.assert_array_equal(resumed[name].values, at_once[name].values, str(name))
    other = begin(start, "basin_shares", output, **{**values, "samples": 21})
    assert other.wait(WAIT) == 2
    other.wait_for(r"There samples is 20, not 21\. Choose another output, or remove it")


def test_what_cannot_be_used_is_one_line_and_code_2(start: Starter, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("mine")
    with bag.Writer(tmp_path / "two") as writer:
        for namespace in ("/left", "/right"):
            RecordedRun(writer, namespace, preset="pizza_multiple_toss").run(1.0)
    small = {"width": 8, "height": 8}
    cases: list[tuple[str, dict[str, object], str]] = [
        ("basins", {"axial_forcin": 0.4}, "got 'axial_forcin', .* Did you mean axial_forcing"),
        ("basins", {"phase_begin": 7.0}, "phase_begin: got 7.0, .* The window is empty"),
        ("basins", {"figures": "gif"}, "figures: got 'gif', allowed: any of png, pdf, svg"),
        ("basins", {**small, "output": tmp_path / "file" / "x"}, "output: got .*can be written"),
        ("basins", {"bag": tmp_path / "two"}, "a bag of 2 simulators', allowed: /left, /right"),
        ("motor", {"bag": "x", "preset": "swum"}, "preset: got 'swum', allowed: none with bag"),
        ("bifurcation", {"begin": 0.3}, r"begin: got 0\.3, allowed: Γ at least .* = 0\.333333\."),
        ("bifurcation", {"scheduler": "tcp://127.0.0.1:9"}, "allowed: none for bifurcation"),
        ("basins", {**small, "scheduler": "tcp://127.0.0.1:9"}, "address of a Dask scheduler"),
    ]  # fmt: skip
    words = []
    for place, (name, values, _) in enumerate(cases):
        words += ["+", name, "--ros-args", *options_of(tmp_path / f"out_{place}", values)]
    node = start.command([sys.executable, str(ROOT / "test/support/several.py"), *words[1:]])
    assert node.wait(WAIT) == 0, node.output
    assert len(node.complaints) == len(cases), node.output
    assert node.output.count(" ended with 2\n") == len(cases)
    for place, (line, (name, _, said)) in enumerate(zip(node.complaints, cases, strict=True)):
        assert re.match(f"{name}: .*{said}", line), line
        assert not (tmp_path / f"out_{place}" / "basins.png").exists()
    assert (tmp_path / "file").read_text() == "mine"


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
        resilient = run(named("resilience", **SAFE), tmp_path / "safe.zarr", scheduler=address)
        assert node.wait(WAIT) == 0, node.output
    alone = run(named("resilience", **SAFE), tmp_path / "alone.zarr")
    assert alone is not None
    assert resilient is not None
    assert set(alone.data_vars) == set(resilient.data_vars)
    for name in alone.data_vars:
        np.testing.assert_array_equal(alone[name].values, resilient[name].values, str(name))
    here = run(named("toss_map", **values), tmp_path / "here.zarr")
    assert here is not None
    there = open_result(tmp_path / "there" / "result.zarr")
    for name in ("airborne_speed", "speed_ratio", "efficiency", "delay", "code"):
        np.testing.assert_array_equal(here[name].values, there[name].values, name)


def test_a_recorded_run_says_which_disk_and_motion(start: Starter, tmp_path: Path) -> None:
    folder = period_one_bag(tmp_path / "run", 3.0, preload=0.5, load_torque=1e-4)
    small = {"bag": folder, "width": 8, "height": 8, "angular_velocities": 0, "netcdf": "false"}
    for _ in range(2):  # what was resolved is what a store is known by
        node = begin(start, "basins", tmp_path / "b", **small, restitution=0.4)
        assert node.wait(WAIT) == 0, node.output
    # the preset has Γ = 0.45 at g = 10 m/s² and 0.25 kg: the preload adds 2 m/s²
    node.wait_for(r"from .*run, steady motion from 0\.000 to 3\.000 s: Γ = 0\.375, θ = -0\.7366")
    assert len(node.complaints) == 1
    node.wait_for("the load torque of that run, 0.0001 N·m, is left out")
    stored = open_result(tmp_path / "b" / "result.zarr")
    assert stored.attrs["parameter_restitution"] == 0.4
    assert stored.attrs["parameter_axial_forcing"] == pytest.approx(0.375, rel=1e-12)
    assert "parameter_bag" not in stored.attrs


def test_a_motor_takes_a_preset_or_a_recorded_run(start: Starter, tmp_path: Path) -> None:
    sizes = {"x_axis": "brake_torque", "x_end": 0.001, "x_count": 2, "netcdf": "false"}
    axis = {"y_axis": "phase_lag", "y_begin": -1.0, "y_end": 1.0, "y_count": 2}
    preset = {"preset": "pizza_multiple_toss", "friction": 0.4}
    node = begin(start, "motor", tmp_path / "p", **sizes, **axis, **preset)
    assert node.wait(WAIT) == 0, node.output
    of_preset = open_result(tmp_path / "p" / "result.zarr")
    assert of_preset.attrs["parameter_frequency"] == 3.0
    assert of_preset.attrs["parameter_friction"] == 0.4, "what is given wins"
    assert "parameter_preset" not in of_preset.attrs
    folder = period_one_bag(tmp_path / "run", 4.0, load_torque=1e-4)
    node = begin(start, "motor", tmp_path / "b", **sizes, **axis, bag=folder)
    assert node.wait(WAIT) == 0, node.output
    assert "T_L = 0.0001 N·m" in node.output
    assert "left out" not in node.output
    of_bag = open_result(tmp_path / "b" / "result.zarr")
    assert of_bag.attrs["parameter_load_torque"] == 1e-4
    assert (of_bag["kind"].values == 0).all()


def test_help_names_options_units_and_what_is_allowed(start: Starter) -> None:
    code, node = start.finish("basins", "--help")
    assert code == 0
    assert "axial_forcing (double, default 0.45)" in node.stdout
    assert "velocity_begin (double, default -5 πg/ω)" in node.stdout
    assert "a finite number >= 0 and <= 1" in node.stdout
    assert "bag (string, default '')" in node.stdout
