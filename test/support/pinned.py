"""The only door of the pinned runs to the package: whatever is renamed is renamed here.

Plain numbers, names of the parameter table and of the topics go in; numbers, arrays, records and
groups of them come out, in an order that stays.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros import Simulation, parameters, simulate
from bouncing_disk_ros.core.arithmetic import sine_and_cosine
from bouncing_disk_ros.core.engine import joined
from bouncing_disk_ros.core.model import Disk, InitialState, Motion
from bouncing_disk_ros.parameters import Value
from bouncing_disk_ros.run.inputs import restored
from bouncing_disk_ros.run.records import Record, from_json, to_json
from bouncing_disk_ros.run.replay import replay
from bouncing_disk_ros.run.session import Session
from bouncing_disk_ros.run.what_if import changes_of, what_if

Values = Mapping[str, Any]
Floats = NDArray[np.float64]
Rows = NDArray[np.void]
Content = Any

NS = 1_000_000_000


def without_version(records: Sequence[Record]) -> list[Record]:
    """Records as they are published, but for the version of the package."""
    return [{k: v for k, v in record.items() if k != "version"} for record in records]


def without_snapshots(records: Sequence[Record]) -> list[Record]:
    """Records of what drove a run alone."""
    return [record for record in records if record["kind"] != "snapshot"]


# --- the simulator --------------------------------------------------------------------------------
def simulated(
    duration: float,
    programme: Sequence[tuple[float, Mapping[str, float]]] = (),
    impulses: Sequence[tuple[float, float, float]] = (),
    sample_rate: float | None = 50.0,
    preset: str = "",
    **values: Value,
) -> Content:
    """Rows of impacts, samples and inputs of a run of `simulate`."""
    found = simulate(
        duration,
        programme=programme, kicks=impulses, sample_rate=sample_rate, preset=preset, **values,
    )  # fmt: skip
    return [found.impacts, found.samples, without_snapshots(found.inputs)]


def sines(angles: Sequence[float]) -> Content:
    """Sine and cosine of the core."""
    return np.array([sine_and_cosine(angle) for angle in angles])


def started(values: Values) -> Simulation:
    """The core's simulation from some parameters of the table."""
    whole = parameters.complete(values)

    def some(*names: str) -> list[float]:
        return [float(whole[name]) for name in names]

    speed = None if whole["initial_with_platform"] else float(whole["initial_axial_velocity"])
    height, *rest = some(
        "initial_height", "initial_angular_velocity", "initial_angle", "initial_forcing_phase"
    )
    return Simulation(
        Motion(*some("axial_amplitude", "angular_amplitude", "frequency", "phase_lag")),
        Disk(*some("mass", "restitution", "friction", "friction_radius", "gyration_radius",
                   "gravity", "preload", "load_torque")),
        InitialState(height, speed, *rest),
        chatter_report_speed=float(whole["chatter_report_speed"]),
    )  # fmt: skip


def stepped(run: Simulation, instants_ns: Sequence[int], max_events: int = 1_000_000) -> Content:
    """Rows, samples and energies of a run that is advanced from instant to instant."""
    rows, samples, energies = [], [], []
    for at in instants_ns:
        behind = True
        while behind:
            some, behind = run.advance(at, max_events)
            rows.append(some)
        samples.append(list(run.sample()))
        energies.append(list(run.energy()))
    table = np.array(samples, float)
    return [joined([part for part in rows if len(part)]), table, np.array(energies, float)]


def resumed(run: Simulation) -> Simulation:
    """The same run from its checkpoint, through JSON."""
    import json

    return Simulation.restore(json.loads(json.dumps(run.snapshot())))


def checkpoint(run: Simulation) -> Content:
    """The checkpoint of a run."""
    return run.snapshot()


class DrivenRun:
    """A run with inputs of every kind, its records and its rows in batches."""

    def __init__(self, values: Values) -> None:
        self.records: list[Record] = []
        self.batches: list[Rows] = []
        self._session = Session(parameters.complete(values), self._take, held=False)

    def _take(self, record: Record) -> None:
        self.records.append(from_json(to_json(record)))

    @property
    def time_ns(self) -> int:
        """Simulated time."""
        return self._session.time_ns

    def advance(self, seconds: float) -> None:
        """Simulate for a while."""
        self._session.advance(self._session.time_ns + round(seconds * NS))
        self.batches += [rows for rows in self._session.take_rows() if len(rows)]

    def command(self, points: Sequence[tuple[float, Sequence[float]]]) -> None:
        """A programme: (seconds from now, A, Φ, f, θ)."""
        now = self._session.input_ns
        self._session.command([(now + round(at * NS), Motion(*to)) for at, to in points])

    def impulse(self, after: float, axial: float, angular: float) -> None:
        """An impulse some seconds from now."""
        self._session.kick(self._session.input_ns + round(after * NS), axial, angular)

    def change(self, **values: Value) -> None:
        """Parameters that change while it runs."""
        self._session.set_parameters(parameters.checked(values))

    def pause(self, paused: bool) -> None:
        """Pause or resume."""
        self._session.hold(paused)

    def reset(self) -> None:
        """Back to the initial state."""
        self._session.reset()

    def snapshot(self) -> None:
        """Put the state on record."""
        self._session.snapshot()

    def content(self, snapshots: bool = False) -> Content:
        """Rows, records (snapshots too, if wanted), the state and the energies at the end."""
        simulation = self._session.simulation
        records = without_version(self.records) if snapshots else without_snapshots(self.records)
        return [joined(self.batches), records, list(simulation.sample()), list(simulation.energy())]


def replayed(records: Sequence[Record], batches: Sequence[Rows]) -> Content:
    """What a replay finds."""
    found = replay(records, batches)
    assert found.identical, found.difference
    return [found.impacts, found.rows, found.missing, found.not_compared, found.records,
            found.snapshots, found.first_row, found.start_ns, found.end_ns,
            [list(gap) for gap in found.gaps]]  # fmt: skip


def continued(record: Record, seconds: float) -> Content:
    """Rows and state of a run that goes on from a snapshot on record."""
    run = restored(record)
    return stepped(run, [run.time_ns + round(seconds * NS)])


def compared(records: Sequence[Record], changes: Values, until_ns: int) -> Content:
    """A run and a changed one: rows, samples, rotor speeds and where the two part."""
    found = what_if(records, changes_of(changes), until_ns)
    parting = None if found.parting is None else [found.parting.recorded, found.parting.replayed]
    return [list(found.first), list(found.second), found.start_ns, found.end_ns, found.parted_ns,
            parting]  # fmt: skip
