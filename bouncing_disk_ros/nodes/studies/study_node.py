"""The node of every study: computes in a thread, reports progress, shows and stores the result."""

from __future__ import annotations

import hashlib
import io
import json
import math
import os
import sys
import threading
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from numpy.typing import NDArray
from rclpy.node import Node
from sensor_msgs.msg import CompressedImage, Image
from std_msgs.msg import Float32
from tqdm import tqdm

from bouncing_disk_ros.analysis.dynamics.row_blocks import downsample
from bouncing_disk_ros.errors import ExitCode, FailedError, InputError
from bouncing_disk_ros.nodes.shared.figure_kinds import figure_kinds
from bouncing_disk_ros.nodes.shared.node_tool import options, wait_for
from bouncing_disk_ros.nodes.studies.study_view import StudyView
from bouncing_disk_ros.parameters import Spec, Value
from bouncing_disk_ros.ros.qos import profile_of
from bouncing_disk_ros.ros.stop import Stop
from bouncing_disk_ros.run.presets import load_preset
from bouncing_disk_ros.study import Progress, export, run
from bouncing_disk_ros.study_tables import COMMON, LISTS
from bouncing_disk_ros.topics import Qos

_LATCHED = Qos(1, latched=True)
MOST_SENT = 2048
"""Pixels along a side of the published map, or less than twice as many: some 64 MB."""
FIGURE_DPI = 160


class StudyNode(Node):
    """Runs one study; topics ~/progress, ~/figure/compressed and, for a map, ~/result."""

    def __init__(
        self, name: str, table: Mapping[str, Spec], make_view: Callable[[], StudyView[Any]]
    ) -> None:
        super().__init__(name)
        self._name, self._table = name, table
        values = options(self, table, LISTS)
        self._options = values
        self._kinds = figure_kinds(str(values["figures"]))
        self._view = make_view()
        own = {name: value for name, value in values.items() if name not in COMMON}
        own |= {**self._from_preset(own), **self._from_bag(own)}
        self._study = self._view.make(own)
        folder = str(values["output"]) or _default_folder(name, self._study.parameters)
        self._folder = Path(folder).expanduser()
        self._progress_topic = self.create_publisher(Float32, "~/progress", profile_of(_LATCHED))
        self._figure_topic = self.create_publisher(
            CompressedImage, "~/figure/compressed", profile_of(_LATCHED)
        )
        self._result_topic = None
        if self._view.image:
            self._result_topic = self.create_publisher(Image, "~/result", profile_of(_LATCHED))
        self._progress = Progress(0, 1, 0)
        self._error: BaseException | None = None
        self._result: xr.Dataset | None = None

    def _from_preset(self, own: Mapping[str, Value]) -> dict[str, Value]:
        """What a preset says and the user does not."""
        name = str(self._options.get("preset", ""))
        if not name:
            return {}
        if self._options["bag"]:
            raise InputError("preset", name, "none with bag", "The bag has all parameters.")
        given = set(self._parameter_overrides)
        found = load_preset(name)
        return {key: value for key, value in found.items() if key in own and key not in given}

    def _from_bag(self, own: Mapping[str, Value]) -> dict[str, Value]:
        """What a recorded run says and the user does not."""
        bag, namespace = (str(self._options.get(name, "")) for name in ("bag", "namespace"))
        if not bag or self._view.from_bag is None:
            if namespace:
                raise InputError("namespace", namespace, "none without bag", "Give bag too.")
            return {}
        from bouncing_disk_ros.nodes.studies.study_bag import read_bag

        given = set(self._parameter_overrides)
        wanted = [name for name in self._view.from_bag(own) if name not in given]
        specs = {name: self._table[name] for name in wanted}
        loads = "load_torque" in self._table
        found = read_bag(bag, namespace or None, specs, takes_loads=loads)
        print(f"{self._name}: {found.text}", flush=True)
        for warning in found.warnings:
            print(f"{self._name}: {warning}", file=sys.stderr, flush=True)
        return dict(found.values)

    # --- computing --------------------------------------------------------------------------------
    def present(self, stop: Stop) -> int:
        """Compute, show, keep; the exit code."""
        print(f"{self._name}: result in {self._folder}", flush=True)
        worker = threading.Thread(target=self._compute, args=(stop,), daemon=True)
        worker.start()
        with Bar(self._name) as bar:
            timer = self.create_timer(0.2, lambda: self._report_progress(bar))
            if not wait_for(self, stop, lambda: not worker.is_alive(), math.inf):
                print(f"{self._name}: stopping when the parts at work are done",
                      file=sys.stderr, flush=True)  # fmt: skip
            worker.join()  # a signal: what is at work is finished and kept
            self._report_progress(bar)
            self.destroy_timer(timer)
        if isinstance(self._error, OSError):  # a full disk, a scheduler that is gone
            why = " ".join(str(self._error).split()) or type(self._error).__name__
            raise FailedError(f"{why}; what is done is kept in {self._folder}") from self._error
        if self._error is not None:
            raise self._error
        if self._result is None:
            done, total, _ = self._progress
            print(
                f"{self._name}: interrupted; {done} of {total} parts are kept in "
                f"{self._folder}, and the same command goes on from there",
                file=sys.stderr,
                flush=True,
            )
            return ExitCode.INTERRUPTED
        self._show(self._result)
        if self._options["hold"]:
            print(f"{self._name}: holding the topics until Ctrl-C", flush=True)
            wait_for(self, stop, lambda: False, math.inf)
        return ExitCode.DONE

    def _compute(self, stop: Stop) -> None:
        try:
            self._result = run(
                self._study,
                self._folder / "result.zarr",
                workers=int(self._options["workers"]) or os.cpu_count() or 1,
                scheduler=str(self._options["scheduler"]),
                on_progress=self._note,
                stopped=lambda: stop.asked,
            )
        except BaseException as error:  # noqa: BLE001 (raised again in the main thread)
            self._error = error

    def _note(self, progress: Progress) -> None:
        if 0 < progress.resumed == progress.done < progress.total:
            there = f"{progress.resumed} of {progress.total} parts are there"
            print(f"{self._name}: going on: {there}", flush=True)
        self._progress = progress

    def _report_progress(self, bar: Bar) -> None:
        if bar.show(self._progress):
            share = self._progress.done / max(1, self._progress.total)
            self._progress_topic.publish(Float32(data=share))

    # --- the result -------------------------------------------------------------------------------
    def _show(self, result: xr.Dataset) -> None:
        print("\n".join(self._view.lines(result)), flush=True)
        figures = self._view.pictures(self._study, result)
        try:
            files = [
                _saved(figure, self._folder / f"{name}.{kind}")
                for name, figure in figures.items()
                for kind in self._kinds
            ]
            if self._options["netcdf"]:
                export(result, self._folder / "result.nc")
                files.append(self._folder / "result.nc")
        except OSError as error:
            raise FailedError(f"{self._folder} cannot be written: {error}") from None
        print("written: " + ", ".join(map(str, [*files, self._folder / "result.zarr"])), flush=True)
        stamp = self.get_clock().now().to_msg()
        drawn = next((file for file in files if file.suffix == ".png"), None)
        png = drawn.read_bytes() if drawn else _png(next(iter(figures.values())))
        message = CompressedImage(format="png", data=png)
        message.header.stamp = stamp
        self._figure_topic.publish(message)
        if self._result_topic is not None:
            image = image_message(downsample(result[self._view.image], MOST_SENT))
            image.header.stamp = stamp
            self._result_topic.publish(image)


class Bar:
    """Progress on the terminal: a bar with the time left, or a line now and then in a log."""

    EVERY_SECONDS = 10.0

    def __init__(self, name: str) -> None:
        self._name = name
        self._bar: Any = None  # tqdm has no types
        self._shown, self._told = -1, time.monotonic()

    def __enter__(self) -> Bar:
        return self

    def __exit__(self, *_: object) -> None:
        if self._bar is not None:
            self._bar.close()

    def show(self, progress: Progress) -> bool:
        """Show it; whether it has changed."""
        if progress.done == self._shown:
            return False
        self._shown = progress.done
        if sys.stderr.isatty():
            if self._bar is None:
                self._bar = tqdm(
                    total=progress.total, initial=progress.resumed, desc=self._name, unit="part"
                )
            self._bar.total = progress.total
            self._bar.update(progress.done - self._bar.n)
        elif time.monotonic() - self._told > self.EVERY_SECONDS:
            self._told = time.monotonic()
            print(f"{self._name}: {progress.done} of {progress.total} parts", file=sys.stderr)
        return True


def image_message(array: NDArray[np.generic]) -> Image:
    """A map as an image: row 0 of the array, the least value of its axis, is the lowest row."""
    integer = array.dtype.kind in "iu"
    upright = np.ascontiguousarray(array[::-1], np.int32 if integer else np.float32)
    return Image(
        height=upright.shape[0],
        width=upright.shape[1],
        encoding="32SC1" if integer else "32FC1",
        is_bigendian=0,
        step=4 * upright.shape[1],
        data=upright.tobytes(),
    )


def _default_folder(name: str, values: object) -> str:
    digest = hashlib.sha256(json.dumps(values, sort_keys=True).encode()).hexdigest()
    return f"output/{name}_{digest[:8]}"


def _saved(figure: Figure, path: Path) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=FIGURE_DPI)
    return path


def _png(figure: Figure) -> bytes:
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=FIGURE_DPI)
    return buffer.getvalue()
