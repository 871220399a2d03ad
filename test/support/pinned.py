"""The only door of the pinned runs to the package: whatever is renamed is renamed here.

Plain numbers, names of the parameter table and of the topics go in; numbers, arrays, records and
groups of them come out, in an order that stays.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from bouncing_disk_ros import Simulation, parameters, simulate
from bouncing_disk_ros.core.arithmetic import sine_and_cosine
from bouncing_disk_ros.core.model import Disk, InitialState, Motion, join_rows
from bouncing_disk_ros.maps.attractor_search import find_attractors
from bouncing_disk_ros.maps.attractors import AttractorKind, Attractors
from bouncing_disk_ros.maps.axial_map import axial_orbit
from bouncing_disk_ros.maps.basin_labels import (
    LaneRule,
    StartLabels,
    known_points,
    label_lanes,
    label_starts,
)
from bouncing_disk_ros.maps.basin_measures import (
    basin_entropy,
    box_dimension,
    uncertainty_exponent,
)
from bouncing_disk_ros.maps.best_lag import best_lag
from bouncing_disk_ros.maps.best_toss import extreme
from bouncing_disk_ros.maps.bifurcations import period_doublings
from bouncing_disk_ros.maps.lanes.attractor_lanes import measure_attractors
from bouncing_disk_ros.maps.lanes.axial_lanes import iterate_axial
from bouncing_disk_ros.maps.lanes.lane_basics import fused
from bouncing_disk_ros.maps.map_tangent import axial_tangent
from bouncing_disk_ros.maps.next_collision import MapState, NextCollisionMap
from bouncing_disk_ros.maps.periodic_orbit import PeriodicOrbit, fixed_point
from bouncing_disk_ros.maps.rotation_map import collision_orbit, measure_attractor
from bouncing_disk_ros.maps.settled_speed import settled_speeds
from bouncing_disk_ros.maps.toss_paths import toss_paths, toss_trajectory
from bouncing_disk_ros.maps.tosses import TossSetting, toss, toss_pixels
from bouncing_disk_ros.parameters import Value
from bouncing_disk_ros.run.input_records import Record, from_json, to_json
from bouncing_disk_ros.run.input_replay import restored
from bouncing_disk_ros.run.replay import replay
from bouncing_disk_ros.run.session import Session
from bouncing_disk_ros.run.what_if import changes_of, what_if
from support.digest import Near, nearly

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
    **values: Any,
) -> Content:
    """Rows of impacts, samples and inputs of a run of `simulate`."""
    found = simulate(
        duration,
        programme=programme, impulses=impulses, sample_rate=sample_rate, preset=preset, **values,
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
        energies.append(energy_before(run))
    table = np.array(samples, float)
    return [join_rows([part for part in rows if len(part)]), table, np.array(energies, float)]


_LATER = ("spin_sign", "drag", "rows_entered", "brake_torque", "brake", "load_inertia")


def energy_before(run: Simulation) -> list[float]:
    """The energy ledger without the loss in a brake, which no pinned run has."""
    energy = run.energy()._asdict()
    assert energy.pop("loss_brake") == 0.0
    return list(energy.values())


def before_loads(value: Any) -> Any:
    """Records as they were before disks had a brake and a load inertia, which no pinned run has."""
    if isinstance(value, dict):
        found = {name: before_loads(part) for name, part in value.items() if name not in _LATER}
        if isinstance(found.get("disk"), list):
            found["disk"] = found["disk"][:8]
        if "slip_sign" in found:
            found["slip_sign"] = float(found["slip_sign"])
        if "books" in found:
            found["books"] = [row[:7] + row[8:] for row in found["books"]]
        return found
    return [before_loads(part) for part in value] if isinstance(value, list) else value


def resumed(run: Simulation) -> Simulation:
    """The same run from its checkpoint, through JSON."""
    import json

    return Simulation.restore(json.loads(json.dumps(run.snapshot())))


def checkpoint(run: Simulation) -> Content:
    """The checkpoint of a run."""
    return before_loads(run.snapshot())


class DrivenRun:
    """A run with inputs of every kind, its records and its rows in batches."""

    def __init__(self, values: Values) -> None:
        self.records: list[Record] = []
        self.batches: list[Rows] = []
        self._session = Session(parameters.complete(values), self._take, paused=False)

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
        self._session.apply_impulse(self._session.input_ns + round(after * NS), axial, angular)

    def change(self, **values: Value) -> None:
        """Parameters that change while it runs."""
        self._session.set_parameters(parameters.checked(values))

    def pause(self, paused: bool) -> None:
        """Pause or resume."""
        self._session.set_paused(paused)

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
        records = before_loads(records)
        return [
            join_rows(self.batches),
            records,
            list(simulation.sample()),
            energy_before(simulation),
        ]


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
    divergence = (
        None if found.divergence is None else [found.divergence.recorded, found.divergence.replayed]
    )
    return [list(found.first), list(found.second), found.start_ns, found.end_ns,
    found.divergence_time_ns,
            divergence]  # fmt: skip


def is_fused() -> bool:
    """Whether the lanes round a product and its sum once, as most processors can."""
    probe = njit(lambda a, b, c: fused(a, b, c))
    return bool(probe(1.0 + 2.0**-30, 1.0 - 2.0**-30, -1.0) != 0.0)


# --- the next-collision map -----------------------------------------------------------------------
def orbit(start: Sequence[float], given: Sequence[float], impacts: int) -> Content:
    """Impacts after (τ, w) at Γ, ε; or after (τ, w, α̇) at Γ, ε, θ, Γ_T."""
    follow, columns = (axial_orbit, 4) if len(start) == 2 else (collision_orbit, 6)
    out = np.zeros((impacts, columns))
    return [follow(*start, *given, impacts, out), out]


def measured(
    start: Sequence[float], given: Sequence[float], settling: int, impacts: int
) -> Content:
    """One attractor: last state, impacts and means."""
    state, out, results = np.array([*start, 1.0, 0.0]), np.zeros((20, 6)), np.zeros(5)
    count = measure_attractor(state, *given, settling, impacts, out, results)
    # with its Lyapunov exponent, which takes logarithms of the C library
    return [count, state, out, np.delete(results, 2), Near(results[2])]


def derivatives(start: Sequence[float], given: Sequence[float], impacts: int) -> Content:
    """An orbit of (τ, w) at Γ, ε with its derivatives."""
    states, tangent = np.zeros((impacts + 1, 3)), np.zeros((2, 4))
    return [axial_tangent(*start, *given, impacts, states, tangent), states, tangent]


def carried(starts: Floats, given: Floats, impacts: int) -> Content:
    """Many axial trajectories (n, 2) in lanes, at parameters (n, 2)."""
    tau, w = (column.copy() for column in starts.T)
    counts = np.zeros((len(starts), 2), np.int64)
    axial_forcing, restitution = (np.ascontiguousarray(column) for column in given.T)
    iterate_axial(tau, w, axial_forcing, restitution, impacts, counts)
    return [tau, w, counts]


def measured_in_lanes(starts: Floats, given: Floats, settling: int, impacts: int) -> Content:
    """Many attractors: starts (n, 3) at parameters (n, 4)."""
    n = len(starts)
    states = np.hstack([starts, np.ones((n, 1)), np.zeros((n, 1))])
    out, results = np.zeros((n, 5, 6)), np.zeros((n, 5))
    measure_attractors(states, given, settling, impacts, out, results)
    return [states, out, np.delete(results, 2, 1), nearly(results[:, 2])]


def labelled(
    starts: Floats,
    axial_forcing: float,
    restitution: float,
    points: Floats,
    of: Sequence[int],
    cap: int,
) -> Content:
    """Labels of starts (n, 2) by the rule of the lanes, with points (m, 2) given."""
    n = len(starts)
    tau, w = (column.copy() for column in starts.T)
    labels, impacts, time = np.zeros(n, np.int32), np.zeros(n, np.int32), np.zeros(n)
    known = known_points(points, np.array(of, np.int32))
    rule, found = LaneRule(1e-3, 8.0, 98, 99, cap), StartLabels(labels, impacts, time)
    label_lanes(tau, w, axial_forcing, restitution, known, rule, found)
    return [labels, impacts, time]


def attractors_of(axial_forcing: float, restitution: float, starts: Floats) -> Attractors:
    """The attractors that starts (n, 2) lead to."""
    return find_attractors(
        NextCollisionMap(axial_forcing, restitution), [(float(t), float(w)) for t, w in starts]
    )


def described(found: Attractors) -> Content:
    """Attractors as numbers: each kind by its place among the kinds."""
    kinds = list(AttractorKind)
    # points of periodic ones come from Newton's method, which solves equations by LAPACK
    rows = [
        [kinds.index(kind), cycles, nearly([multiplier]),
         nearly([phases, speeds]) if kind is AttractorKind.PERIODIC else [phases, speeds]]
        for kind, phases, speeds, cycles, multiplier in found.found
    ]  # fmt: skip
    return [rows, found.after_contact, found.unresolved]


def basins(found: Attractors, axial_forcing: float, restitution: float, starts: Floats) -> Content:
    """Labels of starts (n, 2)."""
    tau, w = (column.copy() for column in starts.T)
    return list(label_starts(found, NextCollisionMap(axial_forcing, restitution), tau, w))


def boundary(labels: NDArray[np.int32]) -> Content:
    """Entropy, box dimension and uncertainty exponent of a map of labels."""
    found = basin_entropy(labels), box_dimension(labels), uncertainty_exponent(labels)
    return nearly([list(one) for one in found])


def best_phase_lags(
    found: Attractors, axial_forcing: float, restitution: float, angular: float
) -> Content:
    """Best phase lag and speed of each attractor."""
    rows = [
        best_lag(one, NextCollisionMap(axial_forcing, restitution, 0.0, angular))
        for one in found.found
    ]
    # a maximum is flat: where it lies is known to half of the digits
    return [[nearly(lag, 5), nearly(speed)] for lag, speed in rows]


def speeds(found: Attractors, starts: Sequence[float], given: Sequence[float]) -> Content:
    """Mean speed that each attractor is left with, from each speed."""
    return settled_speeds(found, NextCollisionMap(*given), np.array(starts))


def jacobian(given: Sequence[float], start: Sequence[float], impacts: int) -> Content:
    """An orbit of the map as an object, and its derivatives."""
    section = NextCollisionMap(*given)
    state = MapState(*start)
    tau, w, slip, *rest = section.orbit(state, impacts)
    return [tau, w, rest, nearly([slip, section.jacobian(state, impacts)])]


def _orbit_numbers(orbit: PeriodicOrbit) -> Content:
    sizes = [abs(one) for one in orbit.multipliers]
    return nearly([*orbit[1:], np.array(sizes), orbit.lyapunov_exponent], 8)


def periodic(axial_forcing: float, restitution: float, lag: float, angular: float) -> Content:
    """The period-1 orbit."""
    return _orbit_numbers(fixed_point(axial_forcing, restitution, lag, angular))


def doublings(
    axial_forcing: float, restitution: float, axis: str, limit: float, count: int
) -> Content:
    """Points of period doubling on the way to a limit, along axial forcing or restitution."""
    found = period_doublings(fixed_point(axial_forcing, restitution), axis, limit, count)
    return [[nearly(point.value), _orbit_numbers(point.orbit)] for point in found]


# --- single tosses --------------------------------------------------------------------------------
def setting(arc: float, frequency: float, **values: float) -> TossSetting:
    """A setting of tosses; `values` are parameters of the disk."""
    whole = {**parameters.DEFAULTS, "gravity": 10.0, **values}
    return TossSetting(arc, frequency, Disk(*(float(whole[name]) for name in Disk._fields)))


def ridden(starts: Floats, given: TossSetting) -> Content:
    """Tosses of a table (n, 5): A, Φ, θ, τ, α̇."""
    return list(toss_pixels(starts, given.frequency, given.disk))


def toss_map(lags: Floats, angles: Floats, given: TossSetting, **start: float) -> Content:
    """Every measure of tosses over phase lag and amplitude angle."""
    return nearly(list(toss(lags[:, None], angles[None, :], given, **start)), 10)


def paths(lags: Floats, angles: Floats, given: TossSetting, points: int) -> Content:
    """Paths of the hand."""
    return nearly(list(toss_paths(lags, angles, given, points=points)), 12)


def trajectory(lag: float, angle: float, given: TossSetting, samples: int) -> Content:
    """One toss in time."""
    # by whole nanoseconds, which the last digit of an amplitude may move by one
    return nearly(list(toss_trajectory(lag, angle, given, samples=samples)), 7)


def best_toss(measure: str, given: TossSetting, **fixed: float) -> Content:
    """The toss that makes a measure largest: that measure."""
    return nearly(getattr(extreme(measure, given, **fixed), measure))
