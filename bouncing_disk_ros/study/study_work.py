"""A study at work: computed in a thread, progress on the terminal, result shown and stored.

With ROS a node wraps it (`study_node`), without ROS `run_study` runs it as it is.
"""

from __future__ import annotations

import hashlib
import io
import json
import os
import sys
import threading
import time
from collections.abc import Callable, Collection, Mapping
from functools import partial
from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from numpy.typing import NDArray

from bouncing_disk_ros.errors import ExitCode, FailedError, InputError
from bouncing_disk_ros.maps.row_blocks import downsample
from bouncing_disk_ros.parameters import Value
from bouncing_disk_ros.regular_file import replaced
from bouncing_disk_ros.ros.startup import figure_kinds
from bouncing_disk_ros.ros.stop import Stop
from bouncing_disk_ros.run.presets import load_preset
from bouncing_disk_ros.study import Progress, export, run
from bouncing_disk_ros.study.store import RESULT, require_netcdf
from bouncing_disk_ros.study.study_definition import StudyDefinition

MOST_SENT = 2048
"""Pixels along a side of the published map, or less than twice as many: some 64 MB."""
FIGURE_DPI = 160
REPORT_SECONDS = 0.2
"""How often progress is looked at."""
LOG_SECONDS = 10.0
"""Without a terminal: how often a line says how much is done."""


class Outlet:
    """Where a study tells how it goes, beside the terminal; this one, without ROS: nowhere."""

    stop: Stop
    takes_result = False

    def wait(self, condition: Callable[[], bool], meanwhile: Callable[[], None]) -> bool:
        """Wait until a condition holds or a signal came; whether it holds."""
        while not condition() and not self.stop.asked:
            time.sleep(REPORT_SECONDS / 4)
            meanwhile()
        return condition()

    def progress(self, share: float) -> None:
        """Take how much is done, 0 to 1."""

    def result(self, png: bytes, field: NDArray[np.generic] | None) -> None:
        """Take the first figure, and of a map its field."""


def run_study(
    definition: StudyDefinition,
    values: Mapping[str, Value],
    given: Collection[str],
    stop: Stop,
) -> int:
    """Run a study where there is no ROS; the exit code. As `StudyWork`."""
    if values["hold"]:
        hint = "There are no topics to hold."
        raise InputError("hold", values["hold"], "false where ROS 2 is not installed", hint)
    work = StudyWork(definition, values, given)
    outlet = Outlet()
    outlet.stop = stop
    stop.running = True
    return work.present(outlet, stop)


class StudyWork:
    """One study with its options; InputError for those that cannot be used.

    `given`: the names of the options that the user has set.
    """

    def __init__(
        self,
        definition: StudyDefinition,
        values: Mapping[str, Value],
        given: Collection[str],
    ) -> None:
        self._definition, self._options, self._given = definition, values, given
        self._name = definition.name
        self._kinds = figure_kinds(str(values["figures"]))
        own = {name: values[name] for name in definition.options}
        own |= {**self._from_preset(own), **self._from_bag(own)}
        self._study = definition.make(own)
        definition.refuse_idle(values)  # of what the user has set, not of a preset or a bag
        folder = str(values["output"]) or _default_folder(self._name, self._study.parameters)
        self._folder = Path(folder).expanduser()
        self._netcdf = bool(values["netcdf"]) and self._has_netcdf()
        self._progress, self._told = Progress(0, 1, 0), time.monotonic()
        self._error: BaseException | None = None
        self._result: xr.Dataset | None = None

    def _from_preset(self, own: Mapping[str, Value]) -> dict[str, Value]:
        """What a preset says and the user does not."""
        name = str(self._options.get("preset", ""))
        if not name:
            return {}
        if self._options["bag"]:
            raise InputError("preset", name, "none with bag", "The bag has all parameters.")
        found = load_preset(name)
        return {key: value for key, value in found.items() if key in own and key not in self._given}

    def _from_bag(self, own: Mapping[str, Value]) -> dict[str, Value]:
        """What a recorded run says and the user does not."""
        bag, namespace = (str(self._options.get(name, "")) for name in ("bag", "namespace"))
        if not bag or not self._definition.takes_bag:
            if namespace:
                raise InputError("namespace", namespace, "none without bag", "Give bag too.")
            return {}
        from bouncing_disk_ros.study.from_bag import read_bag, wanted

        specs = wanted(self._definition, own, self._given)
        loads = "load_torque" in self._definition.table
        found = read_bag(bag, namespace or None, specs, takes_loads=loads)
        print(f"{self._name}: {found.text}", flush=True)
        for warning in found.warnings:
            print(f"{self._name}: {warning}", file=sys.stderr, flush=True)
        return dict(found.values)

    def _has_netcdf(self) -> bool:
        """Whether NetCDF can be written: refused where it is asked for and cannot, else told."""
        try:
            require_netcdf()
        except InputError as error:
            if "netcdf" in self._given:
                raise
            print(f"{self._name}: no result.nc: {error.hint}", file=sys.stderr, flush=True)
            return False
        return True

    # --- computing --------------------------------------------------------------------------------
    def present(self, outlet: Outlet, stop: Stop) -> int:
        """Compute, show, keep; the exit code."""
        print(f"{self._name}: result in {self._folder}", flush=True)
        worker = threading.Thread(target=self._compute, args=(stop,), daemon=True)
        worker.start()
        shown: Progress | None = None

        def report() -> None:
            nonlocal shown
            if self._progress is not shown:
                shown = self._progress
                outlet.progress(shown.done / max(1, shown.total))

        if not outlet.wait(lambda: not worker.is_alive(), report):
            print(f"{self._name}: stopping after the parts that are being computed",
                  file=sys.stderr, flush=True)  # fmt: skip
        worker.join()  # a signal: what is at work is finished and kept
        report()
        self._raise_error()
        if self._result is None:
            done, total = self._progress[:2]
            print(
                f"{self._name}: interrupted; {done} of {total} parts are kept in "
                f"{self._folder}, and the same command goes on from there",
                file=sys.stderr,
                flush=True,
            )
            return ExitCode.INTERRUPTED
        self._show(self._result, outlet)
        if self._options["hold"]:
            print(f"{self._name}: running until Ctrl-C, so that the topics can be read", flush=True)
            outlet.wait(lambda: False, lambda: None)
        return ExitCode.DONE

    def _raise_error(self) -> None:
        if isinstance(self._error, OSError):  # a full disk, a scheduler that is gone
            why = " ".join(str(self._error).split()) or type(self._error).__name__
            line = f"{why}; the parts that are done are kept in {self._folder}"
            raise FailedError(line) from self._error
        if self._error is not None:
            raise self._error

    def _compute(self, stop: Stop) -> None:
        try:
            self._result = run(
                self._study,
                self._folder / RESULT,
                workers=int(self._options["workers"]) or os.cpu_count() or 1,
                scheduler=str(self._options["scheduler"]),
                progress=sys.stderr.isatty(),
                on_progress=self._note,
                stopped=lambda: stop.asked,
            )
        except BaseException as error:  # noqa: BLE001 (raised again in the main thread)
            self._error = error

    def _note(self, progress: Progress) -> None:
        if progress.note:
            print(f"{self._name}: {progress.note}", file=sys.stderr, flush=True)
        if 0 < progress.resumed == progress.done < progress.total:
            there = f"{progress.resumed} of {progress.total} parts are done"
            print(f"{self._name}: continuing: {there}", flush=True)
        if not sys.stderr.isatty() and time.monotonic() - self._told > LOG_SECONDS:
            self._told = time.monotonic()
            done = f"{progress.done} of {progress.total} parts"
            print(f"{self._name}: {done}", file=sys.stderr, flush=True)
        self._progress = progress

    # --- the result -------------------------------------------------------------------------------
    def _show(self, result: xr.Dataset, outlet: Outlet) -> None:
        print("\n".join(self._definition.lines(result)), flush=True)
        figures = self._definition.pictures(self._study, result)
        files = []
        for name, figure in figures.items():
            for kind in self._kinds:
                files.append(self._folder / f"{name}.{kind}")
                replaced(files[-1], partial(figure.savefig, dpi=FIGURE_DPI))
        if self._netcdf:
            files.append(self._folder / "result.nc")
            replaced(files[-1], partial(export, result))
        print("written: " + ", ".join(map(str, [*files, self._folder / RESULT])), flush=True)
        if outlet.takes_result:
            drawn = next((file for file in files if file.suffix == ".png"), None)
            png = drawn.read_bytes() if drawn else _png(next(iter(figures.values())))
            image = self._definition.image
            field = downsample(result[image], MOST_SENT) if image else None
            outlet.result(png, field)


def _default_folder(name: str, values: object) -> str:
    digest = hashlib.sha256(json.dumps(values, sort_keys=True).encode()).hexdigest()
    return f"output/{name}_{digest[:8]}"


def _png(figure: Figure) -> bytes:
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=FIGURE_DPI)
    return buffer.getvalue()
