"""Single tosses: how fast and how efficiently a platform motion throws the disk (paper, Fig. 2).

The disk starts in contact, sticking and sliding, until the platform falls away from
under it (eq. 3). All motions have the same arc amplitude c = √(A² + (a_e Φ)²) and differ only
in the phase lag θ and the amplitude angle φ_L: A = c cos φ_L, a_e Φ = c sin φ_L. The tosses
are computed by the core (maps.single_toss). SI units, angles in rad.

Source: Liu, Friend, Yeo, "The behavior of bouncing disks and pizza tossing" (EPL 2009).
"""

from __future__ import annotations

import math
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bouncing_disk_ros.core.layout import LEDGER_FIELDS, disk_record
from bouncing_disk_ros.core.model import Disk, Motion
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.field_checks import numbers
from bouncing_disk_ros.maps import single_toss
from bouncing_disk_ros.parameters import DEFAULTS, complete, spec_of

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


class TossSetting(NamedTuple):
    """Parameters that all tosses of a map share; the defaults are those of the paper's Fig. 2."""

    arc_amplitude: float = 0.25  # c, m: half of the 50 cm that a hand travels
    frequency: float = float(DEFAULTS["frequency"])  # ω/2π, Hz
    disk: Disk = PAPER_DISK


PAPER = TossSetting()
"""The setting of the paper's Figs. 1 and 2."""


class Toss(NamedTuple):
    """Single tosses, arrays of the broadcast shape of what was asked for; nan: see `code`."""

    airborne_speed: Floats  # α̇_f at the first separation, signed, rad/s
    speed_ratio: Floats  # ν = α̇_f/(ωΦ), signed, 1; nan where Φ = 0
    efficiency: Floats  # η = ΔE_r/E_in, 1; nan where E_in is not above 0
    rotational_energy: Floats  # ΔE_r, gain of the disk's rotational energy, J
    input_energy: Floats  # E_in = ∫(N ṡ + M β̇)dt from the start to the separation, J
    delay: Floats  # from the start to the separation, s
    code: Codes  # how the toss ended, see CODES


class TossTable:
    """A table of tosses to the first separation, with the work space of its kernel.

    Columns of `starts` (n, 5): A (m), Φ (rad), θ (rad), τ at the start (rad, in [0, 2π)), absolute
    α̇ there (rad/s); not checked. `events`: the most phases of contact of each. Columns of `out`
    (n, 4): α̇ (rad/s) at the separation, time until then (s), ∫N ṡ dt and ∫M β̇ dt until then (J).
    `code`: see CODES. A row depends on itself alone. The table may be computed again after its
    starts were changed: nothing is allocated for that.
    """

    def __init__(self, starts: Floats, frequency: float, disk: Disk, events: int = _EVENTS) -> None:
        self.starts = starts
        self.out = np.empty((len(starts), 4))  # columns: single_toss.RESULT_…
        self.code = np.empty(len(starts), np.int8)
        ledger, record = np.zeros((2, len(LEDGER_FIELDS))), disk_record(disk, 0.0)
        self._arguments = starts, frequency, record, events, ledger, self.out, self.code

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
    starts = np.stack((axial, angular, lag, start_phase(phase), speed), axis=-1).reshape(-1, 5)
    table = TossTable(starts, setting.frequency, setting.disk)
    table.compute()
    flat = _measures(table, setting)
    return Toss._make(part.reshape(lag.shape) for part in flat)


def start_phase(phase: Floats) -> Floats:
    """A forcing phase in [0, 2π); one just below 0 would round up to a whole turn."""
    tau = np.mod(phase, math.tau)
    return np.where(tau < math.tau, tau, 0.0)


def _measures(table: TossTable, setting: TossSetting) -> Toss:
    final, delay, work_axial, work_angular = np.ascontiguousarray(table.out.T)
    angular = table.starts[:, single_toss.START_ANGULAR_AMPLITUDE]
    start = table.starts[:, single_toss.START_ANGULAR_SPEED]
    gain = gained_energy(setting, start, final)
    work = work_axial + work_angular
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.where(angular > 0.0, final / platform_speed(setting, angular), np.nan)
        efficiency = np.where(work > 0.0, gain / work, np.nan)
    return Toss(final, ratio, efficiency, gain, work, delay, table.code)


def gained_energy(setting: TossSetting, start: Number, final: Number) -> Number:
    """Rotational energy that the disk gains from speed α̇ `start` to `final`, J."""
    return 0.5 * setting.disk.inertia * (final - start) * (final + start)


def platform_speed(setting: TossSetting, angular: Number) -> Number:
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


def _checked(name: str, given: ArrayLike, largest: float, unit: str) -> Floats:
    array = numbers(name, given)
    wrong = ~(np.abs(array) <= largest)  # nan too
    if wrong.any():
        raise InputError(
            name, float(array[wrong][0]), f"finite numbers, at most ±{largest:g} {unit}"
        )
    return array


def _checked_angle(given: ArrayLike) -> Floats:
    array = numbers("amplitude_angle", given)
    wrong = ~((array >= 0.0) & (array <= 0.5 * math.pi))
    if wrong.any():
        allowed = "0 (up and down) to pi/2 = 1.5708 rad (turning only)"
        raise InputError(
            "amplitude_angle", float(array[wrong][0]), allowed, "It is an angle in rad."
        )
    return array
