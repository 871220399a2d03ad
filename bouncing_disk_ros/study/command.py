"""The command of a study: the study computes in a thread, its result is shown and stored.

With ROS its options are parameters of a node, whose topics tell how it goes (`StudyTopics`). What
is slow to load is imported within functions: --help needs none of it.
"""

from __future__ import annotations

import hashlib
import json
import math
import os
import sys
import threading
import time
from collections.abc import Callable, Collection, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING

from bouncing_disk_ros.command_line.environment import ros_is_here
from bouncing_disk_ros.command_line.start import Start, figure_kinds, option_values
from bouncing_disk_ros.command_line.stop import Answer, Stop
from bouncing_disk_ros.errors import ExitCode, FailedError, InputError
from bouncing_disk_ros.executables import loaded
from bouncing_disk_ros.folders import user_path
from bouncing_disk_ros.kernel_cache import announce_compilation
from bouncing_disk_ros.parameters import Value
from bouncing_disk_ros.regular_file import replaced
from bouncing_disk_ros.study.definition import StudyDefinition
from bouncing_disk_ros.study.outlets import FIGURE_DPI, StudyOutlet, StudyTopics

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

    from bouncing_disk_ros.study.runner import Progress

STOP_SECONDS = 1.5
"""After a signal: how long parts at work have until they are given up, to be computed again."""
LOG_SECONDS = 10.0
"""Without a terminal: how often a line says how much is done."""


def main_of(definition: StudyDefinition) -> Callable[..., int]:
    """The function that runs a study: with the arguments of a command line, or with None.

    It returns the exit code: 0 done, 1 failed, 2 bad input, 130 interrupted (what is done is kept).
    """
    return partial(_main, definition)


def _main(study: StudyDefinition, args: Sequence[str] | None = None) -> int:
    code = ExitCode.INTERRUPTED
    start = Start(study.name, study.about, study.table, study.example, args, code, needs_ros=False)
    start.parse()
    if ros_is_here():
        return _run_as_node(study, start)
    return start.run(partial(_run_without_ros, study, start))


def _load(name: str, stop: Stop) -> None:
    """Load what is slow; a signal meanwhile ends the process at once."""
    with stop.loading():
        announce_compilation(name)


def _compile(definition: StudyDefinition, values: Mapping[str, Value], stop: Stop) -> None:
    """Import what draws and computes, once the options are known to be right.

    Kernels may be compiled.
    """
    with stop.loading():
        if figure_kinds(str(values["figures"])):
            from matplotlib import figure  # noqa: F401
        loaded(definition.study)


def _leave_dask_out(values: Mapping[str, Value]) -> None:
    """Let xarray find no Dask: where it is installed, it takes as long to load as all kernels.

    Not for a user's process: an xarray that is loaded may have found it already. The cluster of a
    `scheduler` needs it.
    """
    if not values["scheduler"] and "xarray" not in sys.modules:
        sys.modules.setdefault("dask", None)  # type: ignore[arg-type] # an import fails at once


def _run_without_ros(study: StudyDefinition, start: Start) -> int:
    study.refuse_not_taken(start.overrides)
    values = option_values(start.overrides, study.table)
    _leave_dask_out(values)
    _load(study.name, start.stop)
    return run_command(study, values, set(start.overrides), start.stop)


def run_command(
    definition: StudyDefinition,
    values: Mapping[str, Value],
    given: Collection[str],
    stop: Stop,
) -> int:
    """Run a study where there is no ROS; the exit code. As `StudyWork`."""
    if values["hold"]:
        hint = "There are no topics to hold."
        raise InputError("hold", values["hold"], "false where ROS 2 is not installed", hint)
    _compile(definition, values, stop)
    work = StudyWork(definition, values, given)
    stop.answer = Answer.NOTE
    return work.present(StudyOutlet(stop))


def _run_as_node(study: StudyDefinition, start: Start) -> int:
    _load(study.name, start.stop)
    with start.stop.loading():
        from rclpy.node import Node

        from bouncing_disk_ros.ros.node_tool import options, overrides_of
        from bouncing_disk_ros.ros.spin import run_node

    class StudyNode(Node):
        """Runs one study."""

        def __init__(self) -> None:
            super().__init__(study.name)
            given = overrides_of(self)
            study.refuse_not_taken(given)
            values = options(self, study.table)
            _leave_dask_out(values)
            _compile(study, values, start.stop)
            self._work = StudyWork(study, values, set(given))

        def present(self, stop: Stop) -> int:
            """Compute, show, keep; the exit code."""
            return self._work.present(StudyTopics(self, stop, study.image))

    return run_node(start, StudyNode, StudyNode.present)


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
        own |= self._from_run(own)
        self._study = definition.make(own)
        definition.refuse_idle(values)  # of what the user has set, not of a preset or a bag
        folder = str(values["output"]) or _default_folder(self._name, self._study.parameters)
        self._folder = user_path(folder)
        self._netcdf = bool(values["netcdf"]) and self._has_netcdf()
        self._progress: Progress | None = None
        self._told = time.monotonic()
        self._error: BaseException | None = None
        self._result: xr.Dataset | None = None

    def _from_run(self, own: Mapping[str, Value]) -> dict[str, Value]:
        """What a recorded run or a preset says and the user does not."""
        preset, bag, namespace = (
            str(self._options.get(name, "")) for name in ("preset", "bag", "namespace")
        )
        if preset and bag:
            raise InputError("preset", preset, "none with bag", "The bag has all parameters.")
        if namespace and not bag:
            raise InputError("namespace", namespace, "none without bag", "Give bag too.")
        if not (preset or bag):
            return {}
        from bouncing_disk_ros.study.from_run import of_preset, read_bag, wanted

        specs = wanted(self._definition, own, self._given)
        loads = "load_torque" in self._definition.table
        if preset:
            return of_preset(preset, specs, takes_loads=loads)
        found = read_bag(bag, namespace or None, specs, takes_loads=loads)
        print(f"{self._name}: {found.text}", flush=True)
        for warning in found.warnings:
            print(f"{self._name}: {warning}", file=sys.stderr, flush=True)
        return dict(found.values)

    def _has_netcdf(self) -> bool:
        """Whether NetCDF can be written: refused where it is asked for and cannot, else told."""
        from bouncing_disk_ros.study.exports import require_netcdf

        try:
            require_netcdf()
        except InputError as error:
            if "netcdf" in self._given:
                raise
            print(f"{self._name}: no result.nc: {error.hint}", file=sys.stderr, flush=True)
            return False
        return True

    # --- computing --------------------------------------------------------------------------------
    def present(self, outlet: StudyOutlet) -> int:
        """Compute, show, keep; the exit code."""
        print(f"{self._name}: result in {self._folder}", flush=True)
        worker = threading.Thread(target=self._compute, args=(outlet.stop,), daemon=True)
        worker.start()
        shown: Progress | None = None

        def report() -> None:
            nonlocal shown
            if self._progress is not None and self._progress is not shown:
                shown = self._progress
                outlet.progress(shown.done / max(1, shown.total))

        if not outlet.wait(lambda: not worker.is_alive(), report):
            print(f"{self._name}: stopping; another Ctrl-C ends it at once",
                  file=sys.stderr, flush=True)  # fmt: skip
            outlet.stop.answer = Answer.END
            worker.join(STOP_SECONDS)
            if worker.is_alive():
                self._say_interrupted()
                sys.stdout.flush()
                os._exit(int(ExitCode.INTERRUPTED))  # threads at work cannot be ended alone
        worker.join()
        report()
        self._raise_error()
        if self._result is None:
            self._say_interrupted()
            return ExitCode.INTERRUPTED
        self._show(self._result, outlet)
        if self._options["hold"]:
            print(f"{self._name}: running until Ctrl-C, so that the topics can be read", flush=True)
            outlet.wait(lambda: False, lambda: None)
        return ExitCode.DONE

    def _say_interrupted(self) -> None:
        total = math.prod(self._study.region_counts())
        done = self._progress.done if self._progress else 0
        kept = f"{done} of {total} parts are kept in {self._folder}"
        line = f"{self._name}: interrupted; {kept}, and the same command goes on from there"
        print(line, file=sys.stderr, flush=True)

    def _raise_error(self) -> None:
        if isinstance(self._error, OSError):  # a full disk, a scheduler that is gone
            why = " ".join(str(self._error).split()) or type(self._error).__name__
            line = f"{why}; the parts that are done are kept in {self._folder}"
            raise FailedError(line) from self._error
        if self._error is not None:
            raise self._error

    def _compute(self, stop: Stop) -> None:
        from bouncing_disk_ros.study.runner import run
        from bouncing_disk_ros.study.store import RESULT

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
        if self._progress is None and 0 < progress.resumed < progress.total:
            there = f"{progress.resumed} of {progress.total} parts are done"
            print(f"{self._name}: continuing: {there}", flush=True)
        if not sys.stderr.isatty() and time.monotonic() - self._told > LOG_SECONDS:
            self._told = time.monotonic()
            done = f"{progress.done} of {progress.total} parts"
            print(f"{self._name}: {done}", file=sys.stderr, flush=True)
        self._progress = progress

    # --- the result -------------------------------------------------------------------------------
    def _show(self, result: xr.Dataset, outlet: StudyOutlet) -> None:
        from bouncing_disk_ros.study.exports import export, export_tables
        from bouncing_disk_ros.study.store import RESULT

        print("\n".join(self._definition.lines(result)), flush=True)
        figures: Mapping[str, Figure] = {}
        if self._kinds or self._options["hold"] or outlet.is_heard():
            figures = self._definition.pictures(self._study, result)
        files = []
        for name, figure in figures.items():
            for kind in self._kinds:
                files.append(self._folder / f"{name}.{kind}")
                replaced(files[-1], partial(figure.savefig, dpi=FIGURE_DPI))
        if self._netcdf:
            files.append(self._folder / "result.nc")
            replaced(files[-1], partial(export, result))
        if self._options["csv"]:
            files += export_tables(result, self._folder)
        print("written: " + ", ".join(map(str, [*files, self._folder / RESULT])), flush=True)
        drawn = next((file for file in files if file.suffix == ".png"), None)
        outlet.result(next(iter(figures.values()), None), drawn, result)


def _default_folder(name: str, values: object) -> str:
    digest = hashlib.sha256(json.dumps(values, sort_keys=True).encode()).hexdigest()
    return f"output/{name}_{digest[:8]}"
