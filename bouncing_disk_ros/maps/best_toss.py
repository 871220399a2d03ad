"""The best single tosses: the largest speed, speed ratio or efficiency, and the line of ν = 1.

A toss of one arc amplitude has two free angles, θ and φ_L (`tosses`).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.maps.single_toss import TOSS_STUCK
from bouncing_disk_ros.maps.tosses import (
    LOWEST,
    PAPER,
    Floats,
    Toss,
    TossSetting,
    TossTable,
    amplitudes,
    gained_energy,
    platform_speed,
    separation_phase,
    start_phase,
    toss,
)
from bouncing_disk_ros.scalar_search import WIDTH, golden_section, halved

MEASURES = ("airborne_speed", "speed_ratio", "efficiency")
"""What may be made largest; of the speeds, the magnitude: they may turn either way."""
_LAGS, _ANGLES = 181, 91  # coarse grid: θ = 0 is on it
_LAG_WINDOW = 2.0 * math.tau / (_LAGS - 1)  # rad to each side: two pixels
_ANGLE_WINDOW = math.pi / (_ANGLES - 1)
_WINDOWS = 100  # moves of the window: enough to cross the map
_EDGE = 1e-6  # rad: nearer to the edge of a window, the top may lie beyond


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
    tau = float(start_phase(np.asarray(phase)))

    def height(lag: float, angle: float) -> float:
        axial, angular = (float(amplitude) for amplitude in amplitudes(angle, setting))
        table.starts[0] = axial, angular, lag, tau, speed
        table.compute()
        final, _, work_axial, work_angular = table.out[0].tolist()
        if measure == "airborne_speed":
            return abs(final)
        if measure == "speed_ratio":
            return abs(final / platform_speed(setting, angular)) if angular > 0.0 else math.nan
        work = work_axial + work_angular
        return gained_energy(setting, speed, final) / work if work > 0.0 else math.nan

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
    ends = angles[slipping[0] - 1 : slipping[0] + 1].tolist()
    return halved(
        lambda at: bool(toss(-separation_phase(at, setting), at, setting).code == TOSS_STUCK),
        *ends, width=WIDTH,
    )[0]  # fmt: skip
