"""Single tosses: how fast and how efficiently a platform motion throws the disk (paper, Fig. 2).

The disk starts in contact, sticking and sliding, until the platform falls away from
under it (eq. 3). All motions have the same arc amplitude c = √(A² + (a_e Φ)²) and differ only
in the phase lag θ and the amplitude angle φ_L: A = c cos φ_L, a_e Φ = c sin φ_L. The tosses
are computed by the core (maps.single_toss). SI units, angles in rad. Beside whole maps of tosses
there are the paths of the hand (Fig. 1), one toss in time (Fig. 2d), and the best tosses.

Source: Liu, Friend, Yeo, "The behavior of bouncing disks and pizza tossing" (EPL 2009).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bouncing_disk_ros.core.layout import LEDGER_FIELDS, STATE_DTYPE, disk_record
from bouncing_disk_ros.core.model import Disk, InitialState, Motion, Sample
from bouncing_disk_ros.core.simulation import Simulation
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.maps import single_toss
from bouncing_disk_ros.maps.scalar_search import WIDTH, golden_section
from bouncing_disk_ros.maps.single_toss import TOSS_STUCK
from bouncing_disk_ros.parameters import DEFAULTS, complete, spec_of
from bouncing_disk_ros.units import NS

Floats = NDArray[np.float64]
Codes = NDArray[np.int8]
Number = TypeVar("Number", float, Floats)

PAPER_DISK = Disk.of(DEFAULTS)._replace(gravity=10.0)
"""The paper's dough: the defaults (μ = 0.6, d = 0.30 m) with the paper's g. The mass is chosen: no
speed and no ratio depends on it. Nor does the restitution matter before the first impact."""
LOWEST = float(DEFAULTS["initial_forcing_phase"])
"""τ at the lowest point, where the paper's tosses start: 3π/2."""
CODES = {
    single_toss.TOSS_SLID: "the disk left the platform sliding",
    single_toss.TOSS_STUCK: "the disk left the platform sticking to it",
    single_toss.TOSS_NONE: "the platform fell away from under the disk at the start",
    single_toss.TOSS_STAYS: "the disk never leaves: axial forcing at most 1/pi",
    single_toss.TOSS_UNRESOLVED: "more phases of contact than allowed",
}
"""How a toss ended: the meaning of each code."""
_EVENTS = 1000  # phases of contact before separation; from rest there are three or four
MEASURES = ("airborne_speed", "speed_ratio", "efficiency")
"""What may be made largest; of the speeds, the magnitude: they may turn either way."""
_LAGS, _ANGLES = 181, 91  # coarse grid: θ = 0 is on it
_LAG_WINDOW = 2.0 * math.tau / (_LAGS - 1)  # rad to each side: two pixels
_ANGLE_WINDOW = math.pi / (_ANGLES - 1)
_WINDOWS = 100  # moves of the window: enough to cross the map
_EDGE = 1e-6  # rad: nearer to the edge of a window, the top may lie beyond


class TossSetting(NamedTuple):
    """Parameters that all tosses of a map share; the defaults are those of the paper's Fig. 2."""

    arc_amplitude: float = 0.25  # c, m: half of the 50 cm that a hand travels
    frequency: float = float(DEFAULTS["frequency"])  # ω/2π, Hz
    disk: Disk = PAPER_DISK


PAPER = TossSetting()
"""The setting of the paper's Figs. 1 and 2."""


class Pixels(NamedTuple):
    """Tosses of `toss_pixels`, one element each; nan where the disk did not leave."""

    airborne_speed: Floats  # (n,) α̇ at the first separation, rad/s
    delay: Floats  # (n,) from the start to the separation, s
    work_axial: Floats  # (n,) ∫N ṡ dt until then, J
    work_angular: Floats  # (n,) ∫M β̇ dt until then, J
    code: Codes  # (n,) see CODES


class Toss(NamedTuple):
    """Single tosses, arrays of the broadcast shape of what was asked for; nan: see `code`."""

    airborne_speed: Floats  # α̇_f at the first separation, signed, rad/s
    speed_ratio: Floats  # ν = α̇_f/(ωΦ), signed, 1; nan where Φ = 0
    efficiency: Floats  # η = ΔE_r/E_in, 1; nan where E_in is not above 0
    rotational_energy: Floats  # ΔE_r, gain of the disk's rotational energy, J
    input_energy: Floats  # E_in = ∫(N ṡ + M β̇)dt from the start to the separation, J
    delay: Floats  # from the start to the separation, s
    code: Codes  # how the toss ended, see CODES


def toss_pixels(starts: Floats, frequency: float, disk: Disk, events: int = _EVENTS) -> Pixels:
    """Tosses to the first separation, one for each row of `starts` (n, 5).

    Columns: A (m), Φ (rad), θ (rad), τ at the start (rad, in [0, 2π)), absolute α̇ there (rad/s);
    not checked. `events`: the most phases of contact of each. A row depends on itself alone, so the
    table may be cut anywhere; safe in threads.
    """
    table = TossTable(np.ascontiguousarray(starts, np.float64), frequency, disk, events)
    table.compute()
    speed, delay, axial, angular = np.ascontiguousarray(table.out.T)
    return Pixels(speed, delay, axial, angular, table.code)


class TossTable:
    """A table of tosses with the work space of its kernel: `starts` and `events` of `toss_pixels`.

    It may be computed again after its starts were changed: nothing is allocated for that.
    """

    def __init__(self, starts: Floats, frequency: float, disk: Disk, events: int = _EVENTS) -> None:
        self.starts = starts
        self.out = np.empty((len(starts), 4))  # columns: single_toss.RESULT_…
        self.code = np.empty(len(starts), np.int8)
        state, ledger = np.zeros(1, STATE_DTYPE), np.zeros((2, len(LEDGER_FIELDS)))
        record = disk_record(disk, 0.0)
        self._arguments = starts, frequency, record, events, state, ledger, self.out, self.code

    def compute(self) -> None:
        """Write a row of `out` and `code` for each row of `starts`."""
        single_toss.toss_each(*self._arguments)


def toss(
    phase_lag: ArrayLike,
    amplitude_angle: ArrayLike,
    setting: TossSetting = PAPER,
    *,
    angular_velocity: ArrayLike = 0.0,
    forcing_phase: ArrayLike = LOWEST,
) -> Toss:
    """Single tosses for arrays of θ and φ_L (rad, φ_L in [0, π/2]), broadcast together.

    The disk starts on the platform at `forcing_phase` (rad, the default is the lowest point) with
    the absolute `angular_velocity` (rad/s; 0 is the paper's rest). InputError for numbers that
    cannot be used.

    >>> toss(phase_lag=[0.0, -0.7], amplitude_angle=0.785).airborne_speed
    """
    check_setting(setting)
    lag, angle, speed, phase = _broadcast(
        phase_lag, amplitude_angle, angular_velocity, forcing_phase
    )
    axial, angular = amplitudes(angle, setting)
    starts = np.stack((axial, angular, lag, _start_phase(phase), speed), axis=-1).reshape(-1, 5)
    flat = _measures(toss_pixels(starts, setting.frequency, setting.disk), starts, setting)
    return Toss._make(part.reshape(lag.shape) for part in flat)


def _start_phase(phase: Floats) -> Floats:
    """A forcing phase in [0, 2π); one just below 0 would round up to a whole turn."""
    tau = np.mod(phase, math.tau)
    return np.where(tau < math.tau, tau, 0.0)


def _measures(pixels: Pixels, starts: Floats, setting: TossSetting) -> Toss:
    final = pixels.airborne_speed
    angular, start = (
        starts[:, single_toss.START_ANGULAR_AMPLITUDE],
        starts[:, single_toss.START_ANGULAR_SPEED],
    )
    gain = _gained_energy(setting, start, final)
    work = pixels.work_axial + pixels.work_angular
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.where(angular > 0.0, final / _platform_speed(setting, angular), np.nan)
        efficiency = np.where(work > 0.0, gain / work, np.nan)
    return Toss(final, ratio, efficiency, gain, work, pixels.delay, pixels.code)


def _gained_energy(setting: TossSetting, start: Number, final: Number) -> Number:
    """Rotational energy that the disk gains from speed α̇ `start` to `final`, J."""
    return 0.5 * setting.disk.inertia * (final - start) * (final + start)


def _platform_speed(setting: TossSetting, angular: Number) -> Number:
    """ωΦ, rad/s."""
    return math.tau * setting.frequency * angular


def amplitudes(amplitude_angle: ArrayLike, setting: TossSetting = PAPER) -> tuple[Floats, Floats]:
    """A (m) and Φ (rad) of an amplitude angle φ_L (rad): A = c cos φ_L, a_e Φ = c sin φ_L."""
    angle = np.asarray(amplitude_angle, np.float64)
    arc = setting.arc_amplitude
    return arc * np.cos(angle), arc * np.sin(angle) / setting.disk.friction_radius


def motion_of(phase_lag: float, amplitude_angle: float, setting: TossSetting = PAPER) -> Motion:
    """The platform motion of one toss."""
    axial, angular = amplitudes(amplitude_angle, setting)
    return Motion(float(axial), float(angular), setting.frequency, phase_lag)


def separation_phase(amplitude_angle: ArrayLike, setting: TossSetting = PAPER) -> Floats:
    """τ_sep (rad): sin τ_sep = 1/(πΓ) (eq. 3); nan where the disk never leaves."""
    axial, _ = amplitudes(amplitude_angle, setting)
    disk = setting.disk
    fall = disk.gravity + disk.preload / disk.mass
    with np.errstate(divide="ignore", invalid="ignore"):
        sine = fall / (axial * (math.tau * setting.frequency) ** 2)
        return np.where(sine < 1.0, np.arcsin(np.minimum(sine, 1.0)), np.nan)


def check_setting(setting: TossSetting) -> None:
    """InputError unless the setting can be used; parameters as the simulator takes them."""
    given = {**setting.disk._asdict(), "frequency": setting.frequency}
    # the table of parameters knows Python's numbers only
    complete({k: v.item() if isinstance(v, np.generic) else v for k, v in given.items()})
    if setting.disk.brake_torque != 0.0:
        hint = "Use `simulate`, which has brakes."
        raise InputError("brake_torque", setting.disk.brake_torque, "0 for single tosses", hint)
    arc = setting.arc_amplitude
    if not (math.isfinite(arc) and arc > 0.0):
        raise InputError("arc_amplitude", arc, "a finite number > 0 m")


def _broadcast(
    phase_lag: ArrayLike, amplitude_angle: ArrayLike, speed: ArrayLike, phase: ArrayLike
) -> list[Floats]:
    """The arrays of `toss` with one shape, each checked."""
    arrays = [
        _checked("phase_lag", phase_lag, float(spec_of("phase_lag").high or 0.0), "rad"),
        _checked_angle(amplitude_angle),
        _checked("angular_velocity", speed, 1e9, "rad/s"),
        _checked("forcing_phase", phase, 1e6, "rad"),
    ]
    try:
        return [np.asarray(array) for array in np.broadcast_arrays(*arrays)]
    except ValueError:
        shapes = ", ".join(str(array.shape) for array in arrays)
        hint = "For a map give phase_lag[:, None] and amplitude_angle[None, :]."
        raise InputError("toss", f"shapes {shapes}", "shapes that broadcast", hint) from None


def _numbers(name: str, given: ArrayLike) -> Floats:
    try:
        return np.asarray(given, np.float64)
    except (TypeError, ValueError):
        raise InputError(name, given, "numbers") from None


def _checked(name: str, given: ArrayLike, largest: float, unit: str) -> Floats:
    array = _numbers(name, given)
    wrong = ~(np.abs(array) <= largest)  # nan too
    if wrong.any():
        raise InputError(
            name, float(array[wrong][0]), f"finite numbers, at most ±{largest:g} {unit}"
        )
    return array


def _checked_angle(given: ArrayLike) -> Floats:
    array = _numbers("amplitude_angle", given)
    wrong = ~((array >= 0.0) & (array <= 0.5 * math.pi))
    if wrong.any():
        allowed = "0 (up and down) to pi/2 = 1.5708 rad (turning only)"
        raise InputError(
            "amplitude_angle", float(array[wrong][0]), allowed, "It is an angle in rad."
        )
    return array


class TossPaths(NamedTuple):
    """Closed paths of the hand; (...) is the broadcast shape of the θ and φ_L asked for."""

    forcing_phase: Floats  # (n,) τ, rad, from the lowest point through one whole period
    arc: Floats  # (..., n) a_e β, m: along the circle of radius a_e
    axial_position: Floats  # (..., n) s, m
    separation_phase: Floats  # (...) τ_sep, rad; nan where the disk never leaves
    separation_arc: Floats  # (...) a_e β there, m
    separation_position: Floats  # (...) s there, m


def toss_paths(
    phase_lag: ArrayLike,
    amplitude_angle: ArrayLike,
    setting: TossSetting = PAPER,
    *,
    points: int = 361,
) -> TossPaths:
    """Paths (a_e β, s) of a point of the hand at radius a_e (eq. 1), for θ and φ_L broadcast.

    `points` of each path, at least 2: the last is the first again.
    """
    if points < 2:
        raise InputError("points", points, "a whole number >= 2")
    lag, angle = np.broadcast_arrays(
        np.asarray(phase_lag, np.float64), np.asarray(amplitude_angle, np.float64)
    )
    toss(lag, angle, setting)  # refuses what cannot be used
    axial, angular = amplitudes(angle, setting)
    arc = setting.disk.friction_radius * angular
    tau = LOWEST + np.linspace(0.0, math.tau, points)
    leave = separation_phase(angle, setting)
    return TossPaths(
        tau,
        arc[..., None] * np.sin(tau + lag[..., None]),
        axial[..., None] * np.sin(tau),
        leave,
        arc * np.sin(leave + lag),
        axial * np.sin(leave),
    )


class TossTrajectory(NamedTuple):
    """Platform and disk in time, arrays (n,); angles counted from the start of the disk's."""

    time: Floats  # s after the start
    forcing_phase: Floats  # τ, rad, not taken back into [0, 2π)
    phase: NDArray[np.int8]  # model.Phase of the disk
    platform_position: Floats  # s, m
    platform_velocity: Floats  # ṡ, m/s
    platform_angle: Floats  # β, rad
    platform_angular_velocity: Floats  # β̇, rad/s
    axial_position: Floats  # x, m
    axial_velocity: Floats  # ẋ, m/s
    angle: Floats  # α, rad
    angular_velocity: Floats  # α̇, rad/s
    airborne_speed: float  # α̇_f at the separation, rad/s; nan where the disk never leaves
    separation_time: float  # s; nan where the disk never leaves
    landing_time: float  # of the first impact, s; nan where none is within the time looked at


def toss_trajectory(
    phase_lag: float,
    amplitude_angle: float,
    setting: TossSetting = PAPER,
    *,
    angular_velocity: float = 0.0,
    forcing_phase: float = LOWEST,
    duration: float | None = None,
    samples: int = 1001,
) -> TossTrajectory:
    """One toss in time, at evenly spaced instants (whole nanoseconds) from the start.

    `duration` (s): how long; without it, up to the first impact. InputError where the disk never
    leaves the platform and no duration is given.
    """
    if samples < 2:
        raise InputError("samples", samples, "a whole number >= 2")
    if duration is not None and not 0.0 < duration < 1e6:
        raise InputError("duration", duration, "a number > 0 and < 1e6 s")
    start = {"angular_velocity": angular_velocity, "forcing_phase": forcing_phase}
    found = toss(phase_lag, amplitude_angle, setting, **start)
    delay, speed = float(found.delay), float(found.airborne_speed)
    if math.isnan(delay) and duration is None:
        hint = "Give a duration, or choose a smaller amplitude angle or a larger arc amplitude."
        allowed = "an angle with axial forcing above 1/pi"
        raise InputError("amplitude_angle", amplitude_angle, allowed, hint)
    motion = motion_of(phase_lag, amplitude_angle, setting)
    initial = InitialState(angular_velocity=angular_velocity, forcing_phase=forcing_phase)
    run = Simulation(motion, setting.disk, initial)
    period = 1.0 / setting.frequency
    end = delay + period if duration is None else duration
    rows, _ = run.advance(round(end * NS))
    while len(rows) == 0 and duration is None:
        rows, _ = run.advance(run.time_ns + round(period * NS))
    landing = float(rows["time"][0]) if len(rows) else math.nan
    end = landing if duration is None else duration
    taken = _samples(Simulation(motion, setting.disk, initial), end, samples)
    return _trajectory(taken, speed, delay, landing)


def _samples(run: Simulation, end: float, count: int) -> list[Sample]:
    """States at `count` instants from 0 to `end` s, rounded down to whole nanoseconds."""
    taken = []
    for i in range(count):
        run.advance(math.floor(end * NS * i / (count - 1)))
        taken.append(run.sample())
    return taken


def _trajectory(taken: list[Sample], speed: float, delay: float, landing: float) -> TossTrajectory:
    columns = {
        name: np.array([getattr(sample, name) for sample in taken], np.float64)
        for name in (*TossTrajectory._fields[3:9], "angular_velocity")
    }
    return TossTrajectory(
        time=np.array([sample.time_ns / NS for sample in taken]),
        forcing_phase=np.array(
            [sample.forcing_phase + math.tau * sample.cycles for sample in taken]
        ),
        phase=np.array([sample.phase for sample in taken], np.int8),
        angle=np.array([sample.unwrapped_angle for sample in taken]),
        airborne_speed=speed,
        separation_time=delay,
        landing_time=landing,
        **columns,
    )


class Extreme(NamedTuple):
    """A toss that makes one measure largest."""

    measure: str  # the name of that measure
    phase_lag: float  # θ, rad, in [−π, π]
    amplitude_angle: float  # φ_L, rad
    airborne_speed: float  # α̇_f there, signed, rad/s
    speed_ratio: float  # ν there, signed, 1
    efficiency: float  # η there, 1


class Ridge(NamedTuple):
    """θ = −τ_sep: β̇ is at its peak as the disk leaves. Arrays (n,)."""

    amplitude_angle: Floats  # φ_L, rad, from next to 0 to where the disk no longer leaves
    phase_lag: Floats  # θ, rad
    speed_ratio: Floats  # ν, 1
    end: float  # largest φ_L at which the disk sticks until it leaves (ν = 1), rad, to 1e-7


def bounded_measures(setting: TossSetting, angular_velocity: float) -> tuple[str, ...]:
    """The measures that have a largest value, of MEASURES.

    Without friction none has: the platform turns no disk. A disk that turns without the platform,
    by its initial speed (rad/s) or by a load torque, has a speed ratio without bound as φ_L falls
    to 0.
    """
    if setting.disk.friction == 0.0:
        return ()
    if angular_velocity == 0.0 and setting.disk.load_torque == 0.0:
        return MEASURES
    return tuple(name for name in MEASURES if name != "speed_ratio")


def extreme(
    measure: str,
    setting: TossSetting = PAPER,
    *,
    phase_lag: float | None = None,
    angular_velocity: float = 0.0,
    forcing_phase: float = LOWEST,
) -> Extreme:
    """The toss with the largest efficiency or magnitude of a speed, over θ and φ_L or along one θ.

    A coarse grid finds the hill; golden sections (over φ_L, within it over θ) climb it. A hill
    narrower than the grid's 2° of θ and 1° of φ_L may be missed. Of mirror
    images (θ and θ ± π) the one nearer to θ = 0 is given. From rest the largest speed ratio is 1
    along a whole line (see `ridge`): one of its points is given.
    """
    if measure not in MEASURES:
        raise InputError("measure", measure, "one of " + ", ".join(MEASURES))
    if measure not in bounded_measures(setting, angular_velocity):
        allowed = "airborne_speed or efficiency for a disk that turns without the platform"
        if setting.disk.friction == 0.0:
            raise InputError("friction", 0.0, "> 0", "Without it no toss turns the disk.")
        raise InputError("measure", measure, allowed, "The ratio has no bound as φ_L falls to 0.")

    def tosses(lag: float | Floats, angle: float | Floats) -> Toss:
        return toss(
            lag, angle, setting, angular_velocity=angular_velocity, forcing_phase=forcing_phase
        )

    def sized(values: Floats) -> Floats:
        return values if measure == "efficiency" else np.abs(values)

    lags = np.linspace(-math.pi, math.pi, _LAGS) if phase_lag is None else np.array([phase_lag])
    angles = np.linspace(0.0, 0.5 * math.pi, _ANGLES)
    grid = sized(getattr(tosses(lags[:, None], angles[None, :]), measure))
    if np.isnan(grid).all():
        hint = "The arc amplitude or the frequency is too small."
        raise InputError("setting", setting, "a setting whose platform throws the disk", hint)
    row, column = _summit(grid, lags)
    free = math.inf if phase_lag is None else 0.0
    height = height_of(measure, setting, float(angular_velocity), float(forcing_phase))
    lag, angle = _climb(height, float(lags[row]), float(angles[column]), min(free, _LAG_WINDOW))
    lag = math.remainder(lag, math.tau) if phase_lag is None else lag
    best = tosses(lag, angle)
    return Extreme(measure, lag, angle, *(float(getattr(best, name)) for name in MEASURES))


def height_of(
    measure: str, setting: TossSetting, speed: float, phase: float
) -> Callable[[float, float], float]:
    """The efficiency, or the magnitude of a speed, at one θ and φ_L; nan where there is none.

    The same bits as `toss`, without its checks and new arrays, which take most of its time.
    """
    table = TossTable(np.empty((1, 5)), setting.frequency, setting.disk)
    tau = float(_start_phase(np.asarray(phase)))

    def height(lag: float, angle: float) -> float:
        axial, angular = (float(amplitude) for amplitude in amplitudes(angle, setting))
        table.starts[0] = axial, angular, lag, tau, speed
        table.compute()
        final, _, work_axial, work_angular = table.out[0].tolist()
        if measure == "airborne_speed":
            return abs(final)
        if measure == "speed_ratio":
            return abs(final / _platform_speed(setting, angular)) if angular > 0.0 else math.nan
        work = work_axial + work_angular
        return _gained_energy(setting, speed, final) / work if work > 0.0 else math.nan

    return height


def _climb(
    height: Callable[[float, float], float], lag: float, angle: float, reach: float
) -> tuple[float, float]:
    """Top of the hill near (θ, φ_L); where it leaves the window it is followed. reach 0: θ fixed.

    The hills have ridges oblique to the grid, so the highest pixel may lie far from the top.
    """

    def along(phi: float, centre: float) -> tuple[float, float]:
        if reach == 0.0:
            return centre, height(centre, phi)
        return golden_section(lambda x: height(x, phi), centre - reach, centre + reach)

    for _ in range(_WINDOWS):
        centre = lag
        low, high = max(angle - _ANGLE_WINDOW, 0.0), min(angle + _ANGLE_WINDOW, 0.5 * math.pi)
        angle, _ = golden_section(lambda phi, at=centre: along(phi, at)[1], low, high)  # type: ignore[misc]
        lag = along(angle, centre)[0]
        inside = reach == 0.0 or abs(lag - centre) < reach * 0.999
        if inside and (angle - low > _EDGE or low == 0.0) and (high - angle > _EDGE):
            break
    return lag, angle


def _summit(grid: Floats, lags: Floats) -> tuple[int, int]:
    """Row and column of the largest value; of equal ones, that with θ nearest to 0."""
    top = np.nanmax(grid)
    rows, columns = np.nonzero(grid >= top - 1e-9 * abs(top))
    nearest = int(np.argmin(np.abs(lags[rows])))
    return int(rows[nearest]), int(columns[nearest])


def ridge(setting: TossSetting = PAPER, points: int = 400) -> Ridge:
    """The line θ = −τ_sep for a disk at rest at the lowest point, and where ν = 1 ends on it."""
    if points < 2:
        raise InputError("points", points, "a whole number >= 2")
    lowest, highest = 1e-6, 0.5 * math.pi
    grid = np.linspace(lowest, highest, points)
    angles = grid[~np.isnan(separation_phase(grid, setting))]
    if len(angles) == 0:
        hint = "The arc amplitude or the frequency is too small."
        raise InputError("setting", setting, "a setting whose platform throws the disk", hint)
    lags = -separation_phase(angles, setting)
    found = toss(lags, angles, setting)
    stuck = found.code == TOSS_STUCK
    return Ridge(angles, lags, found.speed_ratio, _end(angles, stuck, setting))


def _end(angles: Floats, stuck: NDArray[np.bool_], setting: TossSetting) -> float:
    """Bisect between the last angle of the first stretch that sticks and the next.

    The core takes a last slip shorter than 1e-8 rad of phase as sticking: it changes ν by its
    square.
    """
    if not stuck[0]:
        return math.nan
    slipping = np.flatnonzero(~stuck)
    if len(slipping) == 0:
        return float(angles[-1])
    low, high = float(angles[slipping[0] - 1]), float(angles[slipping[0]])
    while high - low > WIDTH:
        middle = 0.5 * (low + high)
        if toss(-separation_phase(middle, setting), middle, setting).code == TOSS_STUCK:
            low = middle
        else:
            high = middle
    return low
