"""A dry brake on the disk's shaft, in flight and in the tail of a chatter.

The brake gives −T_B sgn α̇, and at α̇ = 0 whatever within ±T_B keeps the disk at rest. While α̇
keeps its sign the brake is a constant torque: `drag` stands for the brake and the load. For a disk
in contact see `contact_table`.
"""

from __future__ import annotations

from bouncing_disk_ros.core.compilation import kernel, rare_kernel
from bouncing_disk_ros.core.platform import Record
from bouncing_disk_ros.core.roots import ROUNDING

STOPPED_TAIL = 3.0
"""Value of a CHATTER_ENDS whose flights each stop the disk, by its brake; times the slip's sign."""


@kernel
def sign_of(value: float) -> int:
    """−1, 0 or 1."""
    return 1 if value > 0.0 else (-1 if value < 0.0 else 0)


@kernel
def left_over(load: float, brake: float) -> float:
    """What a brake leaves of a load on a disk at rest; 0 where it holds."""
    return load - sign_of(load) * min(abs(load), brake)


@kernel
def tie(disk: Record) -> float:
    """What counts as equality where friction or a brake must hold a disk, rad/s²: rounding."""
    return 8.0 * ROUNDING * (abs(disk.lag) + disk.brake + disk.grip * disk.g)


# --- flight ---------------------------------------------------------------------------------------
@rare_kernel
def braked_spin(omega: float, disk: Record, d: float) -> tuple[float, float, float]:
    """Angle turned, α̇ and way (angle without its sign) after d seconds of flight."""
    turned = way = 0.0
    left = d
    if omega != 0.0:
        sign = sign_of(omega)
        drag = disk.lag + disk.brake * sign
        slows = drag * sign
        if slows * d < abs(omega):
            turned = (omega - 0.5 * drag * d) * d
            return turned, omega - drag * d, abs(turned)
        lasts = abs(omega) / slows
        turned = 0.5 * omega * lasts
        way = abs(turned)
        left = max(d - lasts, 0.0)
    rest = left_over(disk.lag, disk.brake)
    more = -0.5 * rest * left * left
    return turned + more, 0.0 - rest * left, way + abs(more)


# --- chatter --------------------------------------------------------------------------------------
@kernel
def chatter_drag(disk: Record, omega: float) -> float:
    """What load and brake take from α̇ in the flights of a chatter that keeps its direction."""
    if disk.brake == 0.0:
        return disk.lag
    if omega != 0.0:
        return disk.lag + disk.brake * sign_of(omega)
    return left_over(disk.lag, disk.brake)


@rare_kernel
def stopped_tail(disk: Record, side: float, u: float, omega: float) -> tuple[float, float, float]:
    """Angle turned, and way, in a chatter whose flights each stop the disk; Σ(Δα̇)² of its impacts.

    Each impact gives Δα̇ = −side·grip·(1+ε)w from rest, and the flight turns by
    (Δα̇)²/(2(brake + lag sgn Δα̇)), as the first one does with its α̇.
    """
    e = disk.restitution
    most = disk.grip * (1.0 + e) * u
    squares = most * most / (1.0 - e * e)
    # without friction the later impacts give nothing
    later = 0.5 * squares / (disk.brake - disk.lag * side) if squares > 0.0 else 0.0
    spin = sign_of(omega)
    first = 0.0
    if spin != 0:
        first = 0.5 * omega * omega / (disk.brake + disk.lag * spin)
    return spin * first - side * later, first + later, squares
