"""`simulate`: a run of the disk as a function call, without ROS and without a clock."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from operator import itemgetter
from pathlib import Path
from typing import Any, NamedTuple, SupportsFloat

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros import parameters
from bouncing_disk_ros.core.model import SAMPLE_DTYPE, Energy, Motion, join_rows
from bouncing_disk_ros.errors import FailedError, InputError, closest, counted
from bouncing_disk_ros.field_checks import plain
from bouncing_disk_ros.parameters import Value
from bouncing_disk_ros.run.apply_request import Request, apply_request
from bouncing_disk_ros.run.command_validation import (
    ImpulseRequest,
    Instant,
    PointRequest,
    ProgrammeRequest,
    accept_programme,
)
from bouncing_disk_ros.run.input_records import Record
from bouncing_disk_ros.run.presets import load_preset
from bouncing_disk_ros.run.programmes import load_programme, performed
from bouncing_disk_ros.run.session import Session
from bouncing_disk_ros.run.time_map import SIMULATED, Grid
from bouncing_disk_ros.run.trajectory_validation import instant, trajectory_of
from bouncing_disk_ros.units import NS

MOST_SAMPLES = 10_000_000
"""Samples of one run: 1.4 GB."""
_POINTS = "a list of (time in s, {name: value}), or the name or path of a programme"
_IMPULSES = "a list of (time in s, axial impulse in N·s, angular impulse in N·m·s)"
_KNOTS = "a list of (time in s, {joint: values})"

Point = tuple[SupportsFloat, Mapping[str, Any]]
ImpulseRow = tuple[SupportsFloat, SupportsFloat, SupportsFloat]


class _Recorded(NamedTuple):
    """What there is to unpack of a result."""

    impacts: NDArray[np.void]  # rows of IMPACT_DTYPE in the order of their index
    samples: NDArray[np.void]  # rows of SAMPLE_DTYPE on the grid k / sample_rate, from t = 0
    inputs: list[Record]  # the exact record of what drove the run, as on disk/inputs
    parameters: dict[str, Value]


class Result(_Recorded):
    """Result of `simulate`: impacts, samples, inputs, parameters and derived numbers.

    `energy` is the energy ledger at the end, J, and `duration` the time simulated, s.
    """

    energy: Energy
    duration: float
    turned: float  # angle of the disk from the start to the end, rad

    @property
    def mean_speed(self) -> float:
        """Mean angular velocity of the disk over the whole run, rad/s; nan for no time."""
        return self.turned / self.duration if self.duration > 0.0 else math.nan

    @property
    def unwrapped_angle(self) -> NDArray[np.float64]:
        """Angle of the disk with its whole turns, of each sample, rad."""
        samples = self.samples
        return np.asarray(math.tau * samples["turns"] + samples["angle"], float)

    @property
    def input_work(self) -> float:
        """Work of both motions of the platform on the disk, J."""
        return self.energy.work_axial + self.energy.work_angular

    @property
    def output_work(self) -> float:
        """Work of the disk on its load torque and its brake, J."""
        return float(self.parameters["load_torque"]) * self.turned + self.energy.loss_brake

    @property
    def efficiency(self) -> float:
        """Output over input, 1; nan unless both are positive.

        Over the whole run: what the disk's own energy has changed by is in the difference.
        """
        if self.input_work > 0.0 and self.output_work > 0.0:
            return self.output_work / self.input_work
        return math.nan

    def animate(self, file: str | Path, *, real_time_factor: float | None = None) -> None:
        """Write the samples as a moving picture (GIF): side view, top view, path.

        `real_time_factor`: simulated over watched time. None: real time, or so slow that a period
        of the platform lasts a quarter of a second. Raises InputError without samples, for more
        than 2000 frames, and where the file cannot be written.

        >>> simulate(3.0, preset="pizza_multiple_toss", sample_rate=100.0).animate("toss.gif")
        """
        from bouncing_disk_ros.animation import write_animation

        write_animation(
            Path(file), self.samples, real_time_factor=real_time_factor,
            frequency=float(self.parameters["frequency"]),
            gyration_radius=float(self.parameters["gyration_radius"]),
        )  # fmt: skip

    def __repr__(self) -> str:
        """What there is, in numbers."""
        counts = f"{len(self.impacts)} rows of impacts, {len(self.samples)} samples"
        return f"<result of simulate: {counts}, {len(self.inputs)} inputs>"


_KEYWORDS = ("axial_forcing", "impulses", "preset", "programme", "sample_rate", "trajectory")


def simulate(
    duration: SupportsFloat,
    *,
    programme: Sequence[Point | Mapping[str, Any]] | str = (),
    impulses: Sequence[ImpulseRow] = (),
    trajectory: Sequence[Point] = (),
    sample_rate: SupportsFloat | None = None,
    preset: str = "",
    axial_forcing: SupportsFloat | None = None,
    **values: object,
) -> Result:
    """Run of the disk for `duration` seconds, without ROS: impacts, samples, energy.

    Parameters of docs/parameters.md are keywords (SI units, rad); `preset` names their defaults.

    - Motion: `axial_amplitude` or `axial_forcing` (Γ = Aω²/(π(g + P/m)), in place of it),
      `angular_amplitude`, `frequency`, `phase_lag`.
    - Disk: `mass`, `restitution`, `friction`, `friction_radius`, `gyration_radius`, `gravity`,
      `preload`, `load_torque`, `brake_torque`, `load_inertia`.
    - Start: `initial_height`, `initial_with_platform`, `initial_axial_velocity`,
      `initial_angular_velocity`, `initial_angle`, `initial_forcing_phase`.
    - Inputs: `programme`: (time in s, {name: value}) in increasing time, as on platform/command;
      names left out keep the value of the point before; or the name or path of a programme,
      which begins at the first instant at which its phase is aligned.
      `impulses`: (time in s, axial impulse in N·s, angular impulse in N·m·s). `trajectory`: offsets
      on top of the motion from t = 0 on, (time in s, {joint: position, or (position, velocity), or
      with acceleration}), joints platform_axial (m) and platform_rotation (rad), as on
      platform/joint_trajectory.
    - Output: `sample_rate` in Hz; None takes no samples, and more than MOST_SAMPLES are refused.
      `chatter_report_speed`: slower impacts of a chatter share a row.

    Raises InputError for values that the simulator node would refuse. Raises FailedError where the
    state leaves the range of numbers, time does not advance, or the energy ledger does not close.

    >>> result = simulate(10.0, preset="pizza_multiple_toss", sample_rate=100.0)
    >>> result.impacts["axial_impact_velocity"]
    """
    pushes = _listed("impulses", impulses, _IMPULSES)
    for name in values:
        if name not in parameters.TABLE:
            hint = closest(name, [*parameters.TABLE, *_KEYWORDS])
            allowed = "a parameter of docs/parameters.md, or " + ", ".join(_KEYWORDS)
            raise InputError("keyword", name, allowed, hint)
    chosen = {**({} if preset == "" else load_preset(preset)), **values}
    if axial_forcing is not None:
        if "axial_amplitude" in values:
            hint = "Each is computed from the other: give one."
            raise InputError("axial_forcing", axial_forcing, "none with axial_amplitude", hint)
        forcing = float(parameters.AXIAL_FORCING.checked(axial_forcing))
        whole = {**parameters.DEFAULTS, **parameters.checked(chosen)}
        chosen["axial_amplitude"] = parameters.amplitude_of(forcing, whole)
    whole = parameters.complete(chosen)
    end = instant("duration", duration)
    records: list[Record] = []
    session = Session(whole, records.append, paused=True)
    arrival = Instant(0, SIMULATED, 0)
    knots = _listed("trajectory", trajectory, _KNOTS)
    requests: list[Request] = [trajectory_of(knots)] if knots else []
    if isinstance(programme, str):
        requests += performed(load_programme(programme), session, 0)
        if len(requests) > 2:
            allowed = "none with a programme that has a trajectory"
            raise InputError("trajectory", counted(len(knots), "point"), allowed)
    elif points := _listed("programme", programme, _POINTS):
        session.command(_points(points, arrival, session.latest_target))
    for request in requests:
        apply_request(request, lambda: (session, arrival))
    for seconds, axial, angular in sorted(map(_impulse, pushes), key=itemgetter(0)):
        impulse = ImpulseRequest((0.0, 0.0, axial), (0.0, 0.0, angular), field="impulses")
        _push(session, impulse, arrival._replace(now_ns=instant("impulses time", seconds)))
    first = session.simulation.sample()
    samples = _run(session, end, sample_rate)
    result = Result(join_rows(session.take_rows()), samples, records, whole)
    result.energy, result.duration = _closed(session), end / NS
    last = session.simulation.sample()  # not rounded on all turns of the disk
    result.turned = math.tau * (last.turns - first.turns) + (last.angle - first.angle)
    return result


def _listed(field: str, given: object, allowed: str) -> list[Any]:
    """The entries of a list, a tuple or an array; InputError for anything else."""
    entries = plain(given)
    if isinstance(entries, (list, tuple)):
        return list(entries)
    raise InputError(field, given, allowed)


def _impulse(given: object) -> tuple[float, float, float]:
    """Time (s), axial and angular impulse of an entry of `impulses`."""
    row = given if isinstance(given, (tuple, list, np.ndarray)) else ()
    numbers = [plain(one) for one in row]
    if len(numbers) != 3 or not all(isinstance(one, (int, float)) for one in numbers):
        allowed = "(time in s, axial impulse in N·s, angular impulse in N·m·s)"
        raise InputError("impulses", given, allowed)
    at, axial, angular = numbers
    return float(at), float(axial), float(angular)  # type: ignore[arg-type]


def _push(session: Session, impulse: ImpulseRequest, at: Instant) -> None:
    apply_request(impulse, lambda: (session, at))


def _timed(i: int, given: object) -> tuple[object, Mapping[str, object]]:
    """Time and values of a point: (time, {name: value}), or as in a file, with a key `time`."""
    if isinstance(given, Mapping) and "time" in given:
        return given["time"], {name: given[name] for name in given if name != "time"}
    if isinstance(given, (tuple, list)) and len(given) == 2 and isinstance(given[1], Mapping):
        return given[0], given[1]
    allowed = "(time in s, {name: value}) or {'time': ..., name: value}"
    raise InputError(f"programme[{i}]", given, allowed)


def _points(
    programme: Sequence[Any], arrival: Instant, latest: Motion
) -> tuple[tuple[int, Motion], ...]:
    """Each point validated as on platform/command, one after the other."""
    accepted: list[tuple[int, Motion]] = []
    for i, (at, values) in enumerate(itertools.starmap(_timed, enumerate(programme))):
        numbers: tuple[Any, ...] = tuple(map(plain, values.values()))
        point = PointRequest(numbers, instant(f"programme[{i}] time", at))
        request = ProgrammeRequest(tuple(values), (point,), field=f"programme[{i}]")
        (((effect, latest)),) = accept_programme(request, arrival, latest)
        if accepted and effect <= accepted[-1][0]:
            raise InputError(f"programme[{i}] time", f"{at} s", "strictly increasing times")
        accepted.append((effect, latest))
    return tuple(accepted)


def _run(session: Session, end_ns: int, sample_rate: SupportsFloat | None) -> NDArray[np.void]:
    """Advance to the end, with samples at a rate that is checked."""
    if sample_rate is None:
        advance_to(session, end_ns)
        return np.zeros(0, SAMPLE_DTYPE)
    rate = float(parameters.TABLE["state_rate"].checked(sample_rate))
    if int(end_ns / NS * rate) + 2 > MOST_SAMPLES:
        given = f"{sample_rate} Hz over {end_ns / NS:g} s"
        raise InputError("sample_rate", given, f"at most {MOST_SAMPLES} samples")
    return sampled(session, end_ns, rate)


def sampled(session: Session, end_ns: int, rate: float) -> NDArray[np.void]:
    """Advance to the end, with a sample at each instant k / rate (Hz): rows of SAMPLE_DTYPE."""
    rows, count, grid = np.zeros(int(end_ns / NS * rate) + 2, SAMPLE_DTYPE), 0, Grid(rate, -1)
    while grid.next_ns <= end_ns:
        advance_to(session, grid.next_ns)
        rows[count] = tuple(session.simulation.sample())
        count += 1
        grid.advance()
    advance_to(session, end_ns)
    return rows[:count].copy()


def _closed(session: Session) -> Energy:
    """The energy ledger at the end; FailedError where it does not close."""
    energy = session.checked_energy()
    if session.fault:
        raise FailedError(session.fault)
    return energy


def advance_to(session: Session, until_ns: int) -> None:
    """Simulate up to an instant. FailedError where it cannot go on."""
    while not session.resolve_waiting() or session.advance(until_ns):
        if session.fault:
            raise FailedError(session.fault)
