"""Attractors over planes of parameters: kind, period, Lyapunov exponent, speed.

One start for each point, iterated in lanes. Dimensionless, as in `next_collision`.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.angles import wrap_to_pi
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.maps.attractor_search import CLEARLY, LONGEST
from bouncing_disk_ros.maps.attractors import (
    LOWEST,
    SAME,
    AttractorKind,
    contact_is_forgotten,
)
from bouncing_disk_ros.maps.axial_map import (
    MAP_CONTACT,
    ORBIT_DELAY,
    ORBIT_KIND,
    ORBIT_TAU,
    ORBIT_W,
)
from bouncing_disk_ros.maps.lanes.attractor_lanes import measure_attractors
from bouncing_disk_ros.maps.period_one import existence_limit, impact_velocity
from bouncing_disk_ros.maps.rotation_map import (
    CONTACT_COUNT,
    LYAPUNOV,
    MEAN_PER_TIME,
    MEASURED,
    ORBIT_TURNED,
)

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]

UNRESOLVED = -1
REST, CHATTERING, PERIODIC, CHAOTIC = (list(AttractorKind).index(kind) for kind in AttractorKind)
"""Kinds by their number: the order of AttractorKind."""
KEPT = 2 * LONGEST
"""Impacts in which a repetition is looked for."""
_BESIDE = 1e-3


class Settled(NamedTuple):
    """Attractors that n trajectories have reached, arrays (n,)."""

    kind: Ints  # REST, CHATTERING, PERIODIC, CHAOTIC or UNRESOLVED
    period: Ints  # impacts in one repetition; 0: chaotic, at rest, longer or not known
    cycles: Ints  # periods of the platform in one repetition; 0 as above
    lyapunov_exponent: Floats  # of the axial part, per impact; −inf with contact, nan at rest
    mean_speed: Floats  # mean of α̇/(ωΦ) in time over the last repetition, of what does not repeat
    # over the last half measured; nan at rest, and where contact repeats after a number of impacts
    # that roundings decide, or that is not known
    mean_speed_change: Floats  # from the end of the first half measured, or from it, to that
    contacts: Floats  # phases of contact per impact


def start_states(
    parameters: Floats, start: str = "period-1", phase: float = 0.0, velocity: float = -1.0
) -> Floats:
    """States (n, 5) to begin with at parameters (n, 4): Γ, ε, θ, Γ_T; without slip (w_T = 0).

    period-1: 1e-3 rad beside the period-1 orbit, stable or not; where it does not exist, as
    contact: the disk lies on the platform at its lowest point. given: τ = `phase`, w_A = `velocity`
    < 0.
    """
    axial_forcing, restitution, lag, _ = parameters.T
    tau, w = np.full(len(axial_forcing), phase % math.tau), np.full(len(axial_forcing), velocity)
    if start != "given":
        tau[:], w[:] = LOWEST, 0.0
    if start == "period-1":
        least = existence_limit(restitution)
        there = (axial_forcing >= least) & (axial_forcing > 0.0)
        tau[there] = np.arccos(least[there] / axial_forcing[there]) + _BESIDE
        w[there] = impact_velocity(restitution[there])
    return np.stack((tau, w, np.cos(tau + lag), np.ones_like(tau), np.zeros_like(tau)), axis=1)


def settle_states(parameters: Floats, states: Floats, settling: int, measured: int) -> Settled:
    """Iterate each state (n, 5) at its parameters (n, 4) and classify its attractor.

    `settling` impacts are left out, `measured` ≥ 2 KEPT are looked at. In this order:

    - REST: contact lasts for good.
    - CHATTERING: contact twice at least. All contact ends in the same state, at separation: what
      comes once more repeats for ever. Its period is 0 where more impacts than are kept lie between
      contacts, or so many that roundings grow to the size of the attractor and decide the number.
    - CHAOTIC: a small change grows by more than e^CLEARLY.
    - PERIODIC: the last LONGEST impacts are, within SAME (rad, πg/ω), those of one repetition of at
      most LONGEST impacts before, and small changes die out.
    - UNRESOLVED: the rest, such as what has not settled near a bifurcation.

    Each result depends on its own state alone. Raises InputError.
    """
    if settling < 0 or measured < 2 * KEPT:
        name, given = ("settling", settling) if settling < 0 else ("measured", measured)
        raise InputError(name, given, f"a whole number >= {0 if settling < 0 else 2 * KEPT}")
    n, states = len(states), states.copy()
    half = measured // 2
    rows = np.empty((n, KEPT, ORBIT_TURNED + 1))
    first, last = np.empty((n, MEASURED + 1)), np.empty((n, MEASURED + 1))
    measure_attractors(states, parameters, settling, measured - half, rows, first)
    before = rows.copy()
    measure_attractors(states, parameters, 0, half, rows, last)
    exponent = ((measured - half) * first[:, LYAPUNOV] + half * last[:, LYAPUNOV]) / measured
    contacts = first[:, CONTACT_COUNT] + last[:, CONTACT_COUNT]
    kind = np.full(n, UNRESOLVED, np.int32)
    kind[np.isnan(contacts)] = REST
    kind[contacts >= 2.0] = CHATTERING
    kind[(contacts == 0.0) & (exponent * measured > CLEARLY)] = CHAOTIC
    period = np.zeros(n, np.int32)
    shaken = kind == CHATTERING
    period[shaken] = _between_contacts(rows[shaken])
    for i in np.flatnonzero(shaken & (period > 0)):
        if contact_is_forgotten(*parameters[i, :2].tolist(), KEPT):
            period[i] = 0
    calm = np.flatnonzero((contacts == 0.0) & (exponent < 0.0))
    period[calm] = _repetition(rows[calm])
    kind[calm[period[calm] > 0]] = PERIODIC
    speed = _mean_speeds(rows, period, np.where(shaken, math.nan, last[:, MEAN_PER_TIME]))
    change = speed - _mean_speeds(before, period, first[:, MEAN_PER_TIME])
    cycles = _cycles(rows, period)
    return Settled(kind, period, cycles, exponent, speed, change, contacts / measured)


def _between_contacts(rows: Floats) -> Ints:
    """Impacts from the last contact but one to the last; 0 where fewer are seen."""
    contact = rows[:, ::-1, ORBIT_KIND] == MAP_CONTACT
    last = contact.argmax(axis=1)
    later = np.arange(contact.shape[1]) > last[:, None]
    before = (contact & later).argmax(axis=1)
    return np.where(before > last, before - last, 0).astype(np.int32)


def _repetition(rows: Floats) -> Ints:
    """The least number of impacts after which the last LONGEST ones repeat; 0: more."""
    tau, w = rows[..., ORBIT_TAU], rows[..., ORBIT_W]
    found = np.zeros(len(rows), np.int32)
    for period in range(1, LONGEST + 1):
        some = np.flatnonzero(found == 0)
        for length in (1, LONGEST):  # one impact is enough for most that do not repeat
            now, then = np.s_[some, -length:], np.s_[some, -length - period : -period]
            turn = np.abs(wrap_to_pi(tau[now] - tau[then]))
            near = (turn <= SAME) & (np.abs(w[now] - w[then]) <= SAME)
            some = some[near.all(axis=1)]
        found[some] = period
    return found


def _in_repetition(rows: Floats, period: Ints, column: int) -> Floats:
    """Sum of a column over the last repetition; 0 where none is known."""
    taken = np.arange(rows.shape[1]) >= rows.shape[1] - period[:, None]
    sums: Floats = np.where(taken, rows[..., column], 0.0).sum(axis=1)
    return sums


def _mean_speeds(rows: Floats, period: Ints, others: Floats) -> Floats:
    """The mean speed in time over the last repetition; `others` where none is known."""
    time = _in_repetition(rows, period, ORBIT_DELAY)
    turned = _in_repetition(rows, period, ORBIT_TURNED)
    return np.divide(turned, time, out=others.copy(), where=period > 0)


def _cycles(rows: Floats, period: Ints) -> Ints:
    """Periods of the platform in one repetition."""
    return np.rint(_in_repetition(rows, period, ORBIT_DELAY) / math.tau).astype(np.int32)
