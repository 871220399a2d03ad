"""What holds for a disk in contact: a table of the signs of w_T and of α̇, which are state.

In contact α̈ is the one solution of α̈ + lag + grip·a·Sgn(w_T) + brake·Sgn(α̇) ∋ 0, a = g + s̈. A
sign that is 0 is that of the next derivative, and anything in [−1, 1] where all are 0.

| w_T | α̇ | holds from here on | ends at |
|---|---|---|---|
| ± | ± | sliding | w_T = 0; α̇ = 0 |
| ± | 0 | held, if the brake can; else sliding | β̇ = 0; it can no longer |
| 0 | ± | sticking, if friction can; else sliding | β̇ = 0; it can no longer |
| 0 | 0 | rest, held, sticking or sliding, by the next derivative of β | as these |

Events and inputs set the signs (0 where a slip ends, a disk stops, or the platform turns beneath
a disk that sticks or is held); they are never read again from rounded numbers. All paths ask
`what_holds`; `next_event` finds what ends a row. Equality holds: a tie rests. Without a brake the
sign of α̇ is not kept: it gives no torque.
"""

from __future__ import annotations

from bouncing_disk_ros.core.brake import left_over, sign_of, tie
from bouncing_disk_ros.core.compilation import kernel, rare_kernel
from bouncing_disk_ros.core.layout import HELD, SLIDING, STICKING
from bouncing_disk_ros.core.platform import Jet, Record


@kernel
def _at_rest(disk: Record, grip: float, b2: float, ahead: int) -> tuple[int, int]:
    """Signs of w_T and α̇ just after an instant at which both, and so β̇, are 0."""
    lag, brake, slack = disk.lag, disk.brake, tie(disk)
    if ahead == 0:  # nothing turns: the brake holds first, friction what is left
        rest = left_over(lag, brake)
        sign = 0 if abs(rest) <= grip + slack else -sign_of(rest)
        return sign, sign
    if abs(lag - ahead * grip) <= brake + slack:
        return -ahead, 0
    pull = b2 if b2 * ahead > 0.0 else 0.0  # β̈, but for rounding
    if abs(pull + lag + brake * ahead) <= grip + slack:
        return 0, ahead
    if grip + brake - lag < min(pull, 0.0):
        return -1, -1
    if -(grip + brake) - lag > max(pull, 0.0):
        return 1, 1
    return -ahead, ahead


@rare_kernel
def what_holds(slip: int, spin: int, ahead: int, disk: Record, a: float, b: Jet) -> tuple[int, int]:
    """Signs of w_T and α̇ from here on, from those at this instant, the load a and the jet of β.

    `ahead` is the sign of β̇ from here on, which counts where all three are 0.
    """
    grip = disk.grip * a
    if disk.brake == 0.0:
        rho = b[2] + disk.lag
        if slip != 0 or (disk.grip > 0.0 and abs(rho) <= grip + tie(disk)):
            return slip, 0
        return (-1 if rho > 0.0 else 1), 0
    if slip != 0 and spin != 0:
        return slip, spin
    if slip != 0:
        torque = disk.lag + slip * grip
        return slip, 0 if abs(torque) <= disk.brake + tie(disk) else -sign_of(torque)
    if spin != 0:
        rho = b[2] + disk.lag + disk.brake * spin
        return (0 if abs(rho) <= grip + tie(disk) else -sign_of(rho)), spin
    return _at_rest(disk, grip, b[2], ahead)


@kernel
def enter(state: Record, disk: Record, slip: int, spin: int) -> None:
    """Put a row of the table in force."""
    state.slip_sign = slip
    state.spin_sign = spin
    state.drag = disk.lag
    if disk.brake > 0.0:
        state.drag = disk.lag + disk.brake * spin
        if slip == 0 and spin == 0:
            state.drag = left_over(disk.lag, disk.brake)
    state.phase = STICKING if slip == 0 else SLIDING
    if disk.brake > 0.0 and slip != 0 and spin == 0:
        state.phase = HELD
        state.omega = 0.0


@kernel
def enter_what_holds(
    state: Record, disk: Record, slip: int, spin: int, ahead: int, a: float, b: Jet
) -> None:
    """Put the row in force that follows from the signs at this instant.

    Only sticking takes over the platform's velocity: its rounding is that of ωΦ, not of the disk's.
    """
    slip, spin = what_holds(slip, spin, ahead, disk, a, b)
    enter(state, disk, slip, spin)
    if slip == 0 and state.omega != b[1]:
        state.omega = b[1]


@kernel
def row_bit(state: Record) -> int:
    """The row in force as one bit."""
    return 1 << (3 * (state.slip_sign + 1) + state.spin_sign + 1)
