"""A dry brake on the disk's shaft: −T_B sgn α̇, and at α̇ = 0 whatever within ±T_B keeps it at rest.

In contact α̈ is the one solution of α̈ + lag + grip·a·Sgn(w_T) + brake·Sgn(α̇) ∋ 0, where a sign
that is not decided (w_T or α̇ = 0) is that of the derivative, and anything in [−1, 1] where that is
0 too. Between its events the brake is a constant torque: `drag` stands for it and the load. Only
disks with a brake come here: without one nothing changes, to the bit.
"""

from __future__ import annotations

from bouncing_disk_ros.core.arithmetic import kernel, rare_kernel
from bouncing_disk_ros.core.layout import HELD, LETS_GO, SLIDING, STICKING, STOPS
from bouncing_disk_ros.core.platform import Jet, Record, turns_not

STOPPED_TAIL = 3.0
"""Value of a CHATTER_ENDS whose flights each stop the disk, by its brake; times the slip's sign."""


@kernel
def sign_of(value: float) -> float:
    """−1, 0 or 1."""
    return 1.0 if value > 0.0 else (-1.0 if value < 0.0 else 0.0)


@kernel
def left_over(load: float, brake: float) -> float:
    """What a brake leaves of a load on a disk at rest; 0 where it holds."""
    return load - sign_of(load) * min(abs(load), brake)


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


# --- how contact begins ---------------------------------------------------------------------------
@kernel
def _stick(state: Record, disk: Record, spin: float) -> None:
    state.phase = STICKING
    state.spin_sign = spin
    state.drag = disk.lag + disk.brake * spin


@kernel
def _slide(state: Record, disk: Record, side: float, spin: float) -> None:
    state.phase = SLIDING
    state.slip_sign = side
    state.spin_sign = spin
    state.drag = disk.lag + disk.brake * spin


@kernel
def _hold(state: Record, disk: Record, side: float) -> None:
    state.phase = HELD
    state.slip_sign = side
    state.spin_sign = 0.0
    state.drag = disk.lag
    state.omega = 0.0


@kernel
def _from_rest(state: Record, disk: Record, side: float, grip: float) -> None:
    """A disk at rest over a platform that slides beneath: held, or set in motion."""
    torque = disk.lag + side * grip
    if abs(torque) <= disk.brake:
        _hold(state, disk, side)
    else:
        _slide(state, disk, side, -sign_of(torque))


@kernel
def _both_at_rest(state: Record, motion: Record, disk: Record, grip: float, b: Jet) -> None:
    """Disk and platform at rest at the same instant: what the platform does next decides."""
    ahead = 0.0
    if not turns_not(motion):
        for derivative in b[2:]:
            if ahead == 0.0:
                ahead = sign_of(derivative)
    lag, brake = disk.lag, disk.brake
    if ahead == 0.0:  # nothing moves: the brake holds first, friction what is left
        rest = left_over(lag, brake)
        if abs(rest) <= grip:
            _stick(state, disk, 0.0)
            state.drag = rest
        else:
            _slide(state, disk, -sign_of(rest), -sign_of(rest))
    elif abs(b[2] + lag + brake * ahead) <= grip:
        _stick(state, disk, ahead)
    elif abs(lag - grip * ahead) <= brake:
        _hold(state, disk, -ahead)
    elif grip + brake - lag < min(b[2], 0.0):
        _slide(state, disk, -1.0, -1.0)
    elif -(grip + brake) - lag > max(b[2], 0.0):
        _slide(state, disk, 1.0, 1.0)
    else:
        _slide(state, disk, -ahead, ahead)


@rare_kernel
def begin_braked_contact(state: Record, motion: Record, disk: Record, a: float, b: Jet) -> None:
    """Sticking, sliding or held, for a disk that is in contact with the load a = g + s̈ (≥ 0)."""
    slip = state.omega - b[1]
    spin = sign_of(state.omega)
    grip = disk.grip * a
    if slip != 0.0:
        if spin == 0.0:
            _from_rest(state, disk, sign_of(slip), grip)
        else:
            _slide(state, disk, sign_of(slip), spin)
    elif spin == 0.0:
        _both_at_rest(state, motion, disk, grip, b)
    else:
        rho = b[2] + disk.lag + disk.brake * spin
        if disk.grip > 0.0 and abs(rho) <= grip:
            _stick(state, disk, spin)
        else:
            _slide(state, disk, slip_out_sign(rho), spin)


@rare_kernel
def end_braked_phase(
    state: Record, motion: Record, disk: Record, kind: int, value: float, a: float, b: Jet
) -> None:
    """Go through STOPS, TURNS or LETS_GO at their instant."""
    grip = disk.grip * a
    state.omega = 0.0
    if kind == LETS_GO:
        _slide(state, disk, state.slip_sign, value)
    elif kind == STOPS:
        _from_rest(state, disk, state.slip_sign, grip)
    else:
        _both_at_rest(state, motion, disk, grip, b)
        if state.phase == STICKING:
            state.omega = b[1]


@rare_kernel
def stick_or_reverse_braked(state: Record, motion: Record, disk: Record, a: float, b: Jet) -> None:
    """Where a slip has reached w_T = 0 (contact.stick_or_reverse)."""
    grip = disk.grip * a
    spin = sign_of(b[1])
    if spin == 0.0:
        state.omega = 0.0
        _both_at_rest(state, motion, disk, grip, b)
        return
    rho = b[2] + disk.lag + disk.brake * spin
    if abs(rho) <= grip:
        state.omega = b[1]
        _stick(state, disk, spin)
    else:
        _slide(state, disk, slip_out_sign(rho), spin)


@kernel
def slip_out_sign(rho: float) -> float:
    """Sign with which a slip starts out of w_T = 0: against what sticking would need."""
    return -1.0 if rho > 0.0 else 1.0


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
    later = 0.5 * squares / (disk.brake - disk.lag * side)
    spin = sign_of(omega)
    first = 0.0
    if spin != 0.0:
        first = 0.5 * omega * omega / (disk.brake + disk.lag * spin)
    return spin * first - side * later, first + later, squares
