"""Programmes: platform motions over time in a YAML file, and when to start them.

    description: one line for people            # required
    align: {time: 3.0, forcing_phase: 1.77}     # optional: the phase (rad) wanted at a time (s)
    points:                                     # required: the motions and when they are reached
      - {time: 0.5, axial_amplitude: 0.0, frequency: 3.0}
    trajectory:                                 # optional: offsets on top of the motion
      - {time: 0.5, platform_axial: [0.02, 0.1]}

Times are seconds of simulated time after the start. Instead of a number, a value of the motion may
be {times: 1.734}, so many times that of the motion in force at the start, and a time of points and
align may be {periods: 400}, so many of its periods. A point has any of axial_amplitude (m),
angular_amplitude (rad), frequency (Hz), phase_lag (rad), the same ones in every point. A point of
the trajectory has platform_axial (m), platform_rotation (rad) or both: a position, or a list of
position, velocity and acceleration.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

from bouncing_disk_ros import parameters
from bouncing_disk_ros.core.model import Motion, MotionInForce
from bouncing_disk_ros.core.schedule import plan_fades
from bouncing_disk_ros.errors import InputError, closest
from bouncing_disk_ros.field_checks import number
from bouncing_disk_ros.folders import share_directory
from bouncing_disk_ros.run.command_validation import (
    Instant,
    PointRequest,
    ProgrammeRequest,
    accept_programme,
)
from bouncing_disk_ros.run.presets import named_file, read_yaml_file
from bouncing_disk_ros.run.time_map import FAR_NS, SIMULATED, TimeMap, nanoseconds, scaled
from bouncing_disk_ros.run.trajectory_validation import (
    TrajectoryRequest,
    trajectory_of,
    validate_trajectory,
)
from bouncing_disk_ros.topics import MOTION_NAMES, OFFSET_JOINTS
from bouncing_disk_ros.units import NS

if TYPE_CHECKING:
    from bouncing_disk_ros.run.session import Session

KEYS = ("description", "align", "points", "trajectory")


class Align(NamedTuple):
    """The forcing phase that the platform shall have at a time of the programme."""

    after_ns: int
    forcing_phase: float  # rad


class Programme(NamedTuple):
    """A checked programme; times are whole nanoseconds after its start."""

    name: str
    description: str
    request: ProgrammeRequest
    align: Align | None
    trajectory: TrajectoryRequest | None = None
    content: Mapping[str, Any] = MappingProxyType({})  # of its file

    def fitted(self, start: Motion) -> Programme:
        """The programme as it is from this motion on. Raises InputError for times of a 0."""
        return parse_programme(self.name, self.content, start) if self.content else self

    def targets(self, latest: Motion) -> tuple[tuple[int, Motion], ...]:
        """The full motions with their times; names left out keep the value of `latest`."""
        return accept_programme(self.fitted(latest).request, _AT_START, latest)


FIRST_TOSS = "first_toss_to_period_1"
"""A programme of the package in SI units, made for the pizza, that ends in its period-1 orbit."""
_AT_START = Instant(0, SIMULATED, 0)
_Timed = TypeVar("_Timed", ProgrammeRequest, TrajectoryRequest)
ANY_MOTION = Motion.of(parameters.DEFAULTS)
"""Where it does not matter which motion a programme begins with."""


def programmes_directory() -> Path:
    """Where the programmes of the package are."""
    return share_directory() / "config" / "programmes"


def programme_names() -> list[str]:
    """Names of the programmes that come with the package.

    >>> programme_names()
    """
    return sorted(file.stem for file in programmes_directory().glob("*.yaml"))


def load_programme(name: str) -> Programme:
    """Programme of platform motions, checked: a name in share/config/programmes, or a YAML file.

    >>> load_programme("first_toss_to_period_1").description
    """
    path = named_file("programme", name, programmes_directory, programme_names)
    content = read_yaml_file("programme", name, path)
    try:
        return parse_programme(path.stem, content)
    except InputError as error:
        raise error.inside(f"programme {path.name}, ") from None


def parse_programme(name: str, content: object, start: Motion = ANY_MOTION) -> Programme:
    """A programme from the content of its file, or InputError naming the field at fault.

    `start` is the motion that values and times may be multiples of.
    """
    if not isinstance(content, dict):
        raise InputError("content", content, "the keys " + ", ".join(KEYS))
    for key in content:
        _known(key, KEYS, "key")
    description = content.get("description")
    if not isinstance(description, str) or not description.strip():
        raise InputError("description", description, "a line of text")
    request = _request(content.get("points"), start)
    align = _align(content["align"], start) if "align" in content else None
    trajectory = _trajectory(content["trajectory"]) if "trajectory" in content else None
    programme = Programme(name, " ".join(description.split()), request, align, trajectory, content)
    accept_programme(request, _AT_START, start)  # checks every value and the order of times
    return programme


def _request(points: object, start: Motion) -> ProgrammeRequest:
    if not isinstance(points, list) or not points:
        raise InputError("points", points, "a list of at least one point")
    names: tuple[str, ...] | None = None
    requests = []
    for i, point in enumerate(points):
        field = f"points[{i}]"
        if not isinstance(point, dict):
            raise InputError(field, point, "time and any of " + ", ".join(MOTION_NAMES))
        for key in point:
            _known(key, ("time", *MOTION_NAMES), field)
        after_ns = _time(f"{field}.time", point.get("time"), start)
        mine = tuple(name for name in MOTION_NAMES if name in point)
        names = mine if names is None else names
        if mine != names:
            allowed = ", ".join(names) + " as in points[0]"
            raise InputError(field, ", ".join(mine), allowed, "Give every point the same names.")
        values = tuple(_value(f"{field}.{key}", point[key], getattr(start, key)) for key in mine)
        requests.append(PointRequest(values, after_ns))
    return ProgrammeRequest(names or (), tuple(requests), field="programme")


def _trajectory(given: object) -> TrajectoryRequest:
    if not isinstance(given, list) or not given:
        raise InputError("trajectory", given, "a list of at least one point")
    rows = []
    for i, point in enumerate(given):
        if not isinstance(point, dict) or "time" not in point or len(point) < 2:
            allowed = "time and any of " + ", ".join(OFFSET_JOINTS)
            raise InputError(f"trajectory[{i}]", point, allowed)
        rows.append((point["time"], {key: v for key, v in point.items() if key != "time"}))
    request = trajectory_of(rows)
    validate_trajectory(request)
    return request


def _align(given: object, start: Motion) -> Align:
    if not isinstance(given, dict) or set(given) != {"time", "forcing_phase"}:
        raise InputError("align", given, "{time: seconds, forcing_phase: rad}")
    phase = number("align.forcing_phase", given["forcing_phase"])
    return Align(_time("align.time", given["time"], start), phase)


def _known(key: object, keys: tuple[str, ...], field: str) -> None:
    if key not in keys:
        raise InputError(field, key, ", ".join(keys), closest(str(key), keys))


def _value(field: str, given: Any, start: float) -> float:
    """A value of a motion: a number, or a multiple of that at the start."""
    if not isinstance(given, dict):
        return number(field, given)
    if set(given) != {"times"}:
        raise InputError(field, given, "a number or {times: NUMBER}, times that of the start")
    if start == 0.0:
        hint = "Start the programme while the platform moves."
        raise InputError(field, given, "a number where that of the start is 0", hint)
    return number(f"{field}.times", given["times"]) * start


def _time(field: str, given: Any, start: Motion) -> int:
    if isinstance(given, dict) and set(given) != {"periods"}:
        raise InputError(
            field, given, "seconds >= 0 or {periods: NUMBER} of the motion at the start"
        )
    if isinstance(given, dict):
        seconds = number(f"{field}.periods", given["periods"]) / start.frequency
    else:
        seconds = number(field, given)
    if not 0.0 <= seconds <= FAR_NS / NS:
        raise InputError(field, given, "seconds >= 0")
    return nanoseconds(seconds)


def start_of(
    programme: Programme, motion: MotionInForce, earliest_ns: int, crossfade_ns: int = 0
) -> int:
    """The first instant from `earliest_ns` on at which to start, so that the phase is as aligned.

    `motion` is in force and nothing is pending behind it. A first point less than a cross-fade
    after the start is reached later than it says, and the phase is right only if the frequency
    stays.
    """
    if programme.align is None:
        return earliest_ns
    target = motion.target
    programme = programme.fitted(target)
    assert programme.align is not None
    earliest_ns = max(earliest_ns, motion.end_ns)
    mean = 0.5 * (motion.start.frequency + target.frequency)
    cycles = motion.forcing_phase / math.tau
    cycles += mean * (motion.end_ns - motion.begin_ns) / NS
    cycles += target.frequency * (earliest_ns - motion.end_ns) / NS
    cycles += _cycles_gained(programme.targets(target), target, programme.align, crossfade_ns)
    missing = (programme.align.forcing_phase / math.tau - cycles) % 1.0
    delay_ns, period_ns = (round(part / target.frequency * NS) for part in (missing, 1.0))
    return earliest_ns + (delay_ns if delay_ns < period_ns else 0)  # aligned but for a rounding


def requests_of(
    programme: Programme, motion: Motion, start_ns: int, times: TimeMap = SIMULATED
) -> Iterator[ProgrammeRequest | TrajectoryRequest]:
    """Requests that perform a programme from an instant of simulated time on: motions, offsets.

    `motion` is the one in force at the start. Stamps and times are ROS time on the line `times`.
    """
    programme = programme.fitted(motion)
    yield _timed(programme.request, start_ns, times)
    if programme.trajectory is not None:
        yield _timed(programme.trajectory, start_ns, times)


def performed(
    programme: Programme, session: Session, earliest_ns: int
) -> Iterator[ProgrammeRequest | TrajectoryRequest]:
    """`requests_of` in simulated time, from the first instant at which the phase is aligned."""
    motion = session.simulation.motion_in_force
    crossfade_ns = nanoseconds(float(session.latest_values["crossfade_duration"]))
    return requests_of(
        programme, motion.target, start_of(programme, motion, earliest_ns, crossfade_ns)
    )


def _timed(request: _Timed, start_ns: int, times: TimeMap) -> _Timed:
    points = tuple(
        point._replace(after_ns=scaled(point.after_ns, 1.0 / times.slope))
        for point in request.points
    )
    return request._replace(points=points, stamp_ns=times.to_ros(start_ns))


def _cycles_gained(
    targets: tuple[tuple[int, Motion], ...], start: Motion, align: Align, crossfade_ns: int
) -> float:
    """Cycles of the forcing between the start of a programme and its aligned instant."""
    now, frequency, cycles = 0, start.frequency, 0.0
    for fade in plan_fades(targets, start, 0, crossfade_ns):
        steady = min(fade.begin_ns, align.after_ns) - now
        cycles += frequency * steady / NS
        now += steady
        part = (min(fade.end_ns, align.after_ns) - fade.begin_ns) / (fade.end_ns - fade.begin_ns)
        if part <= 0.0:
            break
        duration = (fade.end_ns - fade.begin_ns) / NS
        blend = part**4 * (2.5 - 3.0 * part + part**2)  # integral of 10x³ − 15x⁴ + 6x⁵
        cycles += duration * (frequency * part + (fade.target.frequency - frequency) * blend)
        now, frequency = min(fade.end_ns, align.after_ns), fade.target.frequency
    return cycles + frequency * (align.after_ns - now) / NS
