"""The other door of the pinned runs to the package: studies, bags, and what recorded runs show.

As `pinned`: plain values in, numbers, arrays and groups of them out, in an order that stays.
"""

from __future__ import annotations

import importlib
import json
import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from numpy.typing import NDArray

from bouncing_disk_ros import bag, study
from bouncing_disk_ros.core.model import Disk, Motion
from bouncing_disk_ros.nodes.replay.bag_streams import Recorded, replay_bag
from bouncing_disk_ros.parameters import Value
from bouncing_disk_ros.report.estimate import (
    Estimate,
    friction_of,
    platform_velocities,
    restitution_of,
)
from bouncing_disk_ros.report.impact_energy import impact_energy
from bouncing_disk_ros.report.orbit import Orbit, orbit_of
from bouncing_disk_ros.report.read_run import BagRun, ReadOptions
from bouncing_disk_ros.report.report_text import tables
from bouncing_disk_ros.report.run_report import Report, report_of
from bouncing_disk_ros.report.section import (
    section_velocity,
    single_impacts,
    successive_impacts,
)
from bouncing_disk_ros.report.transient import Transient, transient_of
from bouncing_disk_ros.run.simulate import simulate
from support.digest import nearly
from support.recorded import START_NS, RecordedRun

Rows = NDArray[np.void]
Content = Any

NUMBER = re.compile(r"[-−+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?")

SINCE_PINNED = (
    "region_done", "attractor_kind", "attractor_period", "attractor_cycles", "line_name",
    "attractor", "point", "point_forcing_phase", "point_velocity", "share_in_contact",
    "share_without_contact",
    *(f"{one}_of_attractor" for one in ("kind", "impacts", "cycles", "share")),
    *(f"line_{one}" for one in ("kind", "impacts", "cycles", "share", "share_without_contact")),
)  # fmt: skip
"""Variables of a result that were not there when it was pinned, or say nothing of it; so is an axis
by the name of its parameter."""


# --- studies --------------------------------------------------------------------------------------
def studied(folder: Path, name: str, **given: Value) -> Content:
    """The result of a study: its axes and fields, then what is derived from them."""
    made = study.named(name, **given)
    found = study.run(made, folder / "result.zarr")
    assert found is not None
    later = {*(SINCE_PINNED if name != "basins" else SINCE_PINNED[:4])}
    later.add(str(made.parameters.get("along", "")))
    first = [one for one in (*made.axes, *made.fields) if one not in later]
    derived = [str(one) for one in found.variables if one not in first and one not in later]
    result = {one: found[one].values for one in first}
    # what is derived is worked out by numpy and by Newton's method; a best value is flat
    digits = 5 if name in ("toss_map", "basin_shares") else 8
    rest = {one: nearly(_some(found[one].values), digits) for one in sorted(derived)}
    return {**{one: _kept(name, one, values) for one, values in result.items()}, **rest}


def _some(values: NDArray[Any]) -> NDArray[Any]:
    """The first of them, where they are the many points of a chaotic orbit."""
    return values[:50] if values.size > 1000 else values


def _kept(name: str, field: str, values: NDArray[Any]) -> Any:
    """Exact where kernels alone made it; else the digits that are the same everywhere."""
    if name in ("toss_paths", "toss_map"):  # amplitudes and paths by numpy's cosine
        return nearly(values, 10)
    if name == "basin_shares":  # the best phase lag is where a maximum lies
        return nearly(values, 5)
    if name in ("curves", "motor", "manifolds", "resilience", "juggling"):  # Newton's method
        return nearly(values, 8)
    # the logarithms of an exponent are the C library's; a start's speed is its cosine
    inexact = field == "lyapunov_exponent" or (name == "parameter_map" and field.startswith("mean"))
    return nearly(values, 9) if inexact else values


# --- bags -----------------------------------------------------------------------------------------
Act = tuple[float, str, tuple[Any, ...]]
"""When (a multiple of 0.1 s), what and with which numbers."""


def _act(what: str, given: tuple[Any, ...]) -> Callable[[Any], None]:
    def act(session: Any) -> None:
        now = session.input_ns
        match what:
            case "command":
                after, *values = given
                session.command([(now + round(after * 1e9), Motion(*values))])
            case "impulse":
                session.apply_impulse(now, *given)
            case "change":
                session.set_parameters(dict(given))
            case "pause":
                session.set_paused(*given)
            case "reset":
                session.reset()
            case "snapshot":
                session.snapshot()

    return act


def recorded(
    folder: Path, seconds: float, acts: tuple[Act, ...] = (), *,
    options: Mapping[str, Any] | None = None, namespaces: tuple[str, ...] = ("",),
    apart: float = 0.0, **given: Any,
) -> Path:  # fmt: skip
    """A bag of what simulators publish; each begins so many seconds after the one before."""
    path = folder / "run"
    with bag.Writer(path, bag.Options(**(options or {})), version="1.2.3") as writer:
        writer.attach("parameters.yaml", "text/yaml", b"friction: 0.6\n")
        for place, namespace in enumerate(namespaces):
            start_ns = START_NS + place * round(apart * 1e9)
            run = RecordedRun(writer, namespace, start_ns, **given)
            run.run(seconds, {at: _act(what, numbers) for at, what, numbers in acts})
    return path


def recovered(path: Path) -> Path:
    """A bag without its last bytes, mended."""
    file = max(path.glob("*.mcap"))
    file.write_bytes(file.read_bytes()[:-3000])
    (path / "metadata.yaml").unlink()
    bag.recover(path, path.with_name("mended"))
    return path.with_name("mended")


def content(path: Path) -> Content:
    """All that a bag holds, decoded; without the version of the package."""
    with bag.open(path) as opened:
        found: dict[str, Any] = {}
        for name, topic in sorted(opened.topics.items()):
            columns: Any = opened.columns(name)
            if name.endswith("disk/inputs"):
                texts = [json.loads(text) for text in columns["data"].tolist()]
                columns["data"] = [
                    {key: value for key, value in record.items() if key != "version"}
                    for record in texts
                ]
            times = [list(message[1:4]) for message in opened.messages(name)]
            found[name] = [topic.type, topic.count, np.array(times), columns]
        notes = {key: text for key, text in opened.notes.items() if key != "version"}
        return [found, notes, opened.attachments, opened.start_ns, opened.end_ns]


def replayed_bag(path: Path) -> Content:
    """The replay of a bag; it is identical."""
    with bag.open(path) as opened:
        found = replay_bag(Recorded(opened))
        assert found.identical, [run.difference for run in found.runs]
        return [found.impacts, found.rows, found.not_compared, len(found.runs)]


# --- what recorded runs show ----------------------------------------------------------------------
def report(path: Path, choice: str = "longest", **wish: Any) -> Report:
    """The report on a bag."""
    with bag.open(path) as opened:
        reader = BagRun(opened, ReadOptions(**wish))
        for _ in reader.read():
            pass
        return report_of(reader.record, reader.source, choice)


def _orbit(orbit: Orbit | None) -> Content:
    if orbit is None:
        return None
    exponent = nearly(list(orbit.exponent[:3]), 6) if orbit.exponent else None
    return [str(orbit.kind), *orbit[1:5], exponent]


def _transient(found: Transient | None) -> Content:
    if found is None:
        return None
    kind, finished, initial, final, constant, rate, end, _ = found
    # least squares by LAPACK, and the ends of intervals by halving
    numbers = nearly([np.array([initial, final]), constant[:3], rate[:3], end], 5)
    return [str(kind), finished, numbers]


def _estimate(found: Estimate) -> Content:
    """Velocities of the platform are numpy's cosine: an interval may be as narrow as its error."""
    return [nearly(np.array(found[:3]), 10), found.impacts]


def report_numbers(found: Report) -> Content:
    """The numbers of a report."""
    segments = [
        [part.segment.begin, part.segment.end, part.segment.motion, list(part.segment.disk)[:8],
         part.rows, part.impacts, _orbit(part.orbit), _transient(part.transient),
         nearly(part.settled)]
        for part in found.segments
    ]  # fmt: skip
    kept = found.real_time and [part for part in found.real_time if not isinstance(part, str)]
    return [segments, found.shown, _estimate(found.restitution), _estimate(found.friction),
            nearly([found.ledger, kept]), found.begin, found.end]  # fmt: skip


def words(found: Report) -> dict[str, str]:
    """The texts in the tables of a report by their names."""
    return {name: text for table in tables(found) for name, text in table.rows}


def table_numbers(found: Report) -> Content:
    """The numbers in the tables of a report, in order: the words around them may change."""
    texts = [text for table in tables(found) for row in table.rows for text in row[1:]]
    numbers = [one for text in texts if "/" not in text for one in NUMBER.findall(text)]
    return nearly(np.array([float(one.replace("−", "-")) for one in numbers]), 6)


class Observed:
    """The impacts of a run of `simulate`, and the motion and disk that made them."""

    def __init__(self, seconds: float, **values: Any) -> None:
        found = simulate(seconds, sample_rate=20.0, **values)
        self.rows, self.samples = found.impacts, found.samples
        self.disk = Disk(*(float(found.parameters[name]) for name in Disk._fields))
        self.motion = Motion(*(float(found.parameters[name]) for name in Motion._fields))

    def estimates(self) -> Content:
        """Restitution by velocities and by impulses, and friction, with their intervals."""
        speeds = platform_velocities(self.rows, self.motion)
        found = (restitution_of(self.rows, speeds), restitution_of(self.rows, mass=self.disk.mass),
                 friction_of(self.rows, self.disk))  # fmt: skip
        return [_estimate(estimate) for estimate in found]

    def section(self) -> Content:
        """The section and the return map."""
        single, (first, second) = (
            self.rows[single_impacts(self.rows)],
            successive_impacts(self.rows),
        )
        given = self.motion, self.disk
        return [
            single["index"].astype(np.int64), single["forcing_phase"],
            section_velocity(single, *given), first["index"].astype(np.int64),
            first["forcing_phase"], second["forcing_phase"], section_velocity(first, *given),
            section_velocity(second, *given),
        ]  # fmt: skip

    def orbit(self) -> Content:
        """The orbit found, by the rows alone and with the map."""
        known = orbit_of(self.rows, motion=self.motion, disk=self.disk)
        return [_orbit(orbit_of(self.rows)), _orbit(known)]

    def transient(self) -> Content:
        """The transient of the speed."""
        return _transient(transient_of(self.samples["time_ns"] / 1e9,
                                       self.samples["angular_velocity"]))  # fmt: skip

    def energy(self) -> Content:
        """The losses in impacts."""
        return list(impact_energy(self.rows, self.disk))


def drawn(module: str, made: study.Study, result: xr.Dataset) -> list[Figure]:
    """The figures of a study's executable, from its module."""
    return list(importlib.import_module(module).DEFINITION.pictures(made, result).values())
