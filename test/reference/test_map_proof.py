"""Lanes against a proof of the next-collision map: one flight or one contact from an impact (τ, w).

Units of the map: time 1/ω, length πg/ω², so that g = 1/π, s = Γ sin τ. The first impact after
(τ, w) is enclosed by a search of the referee's own and compared with what is reported. Where a
chatter completes, contact lasts until sin τ = 1/(πΓ), and the flight begins there. `make soak` has
a million steps. Other steps than those of the lanes are refuted.
"""

from __future__ import annotations

import math
from collections import Counter
from enum import IntEnum
from typing import NamedTuple

import numpy as np
import pytest
from flint import arb, ctx
from numpy.typing import NDArray

from bouncing_disk_ros.core.model import Phase
from bouncing_disk_ros.core.roots import INSTANT
from bouncing_disk_ros.maps.lanes.axial_lanes import (
    COUNT_CONTACTS,
    COUNT_RESTS,
    iterate_axial,
)
from bouncing_disk_ros.proof.event_functions import HALF_ULP, ROUNDINGS, Watched, gap_of
from bouncing_disk_ros.proof.event_proof import chatter_tail
from bouncing_disk_ros.proof.exact_records import DiskRecord, MotionRecord, State
from bouncing_disk_ros.proof.platforms import Platform
from bouncing_disk_ros.proof.positivity import Found, first_zero, opens
from bouncing_disk_ros.proof.verdicts import Outcome, Verdict, compared, worst
from reference.cases import FIRST, examples

Floats = NDArray[np.float64]
COLLISIONS, UNDECIDED_PART = examples(1_000, 1_000_000), 3e-3
"""Steps, and the part of them that may be undecided: grazes."""
GRAVITY = 1.0 / math.pi
_PRECISION = 192
_LATER = 1.0  # rad, after the reported impact


class MapKind(IntEnum):
    """How the next impact came about."""

    IMPACT = 0  # after a flight
    CONTACT = 1  # after a chatter, contact until separation and a flight
    REST = 2  # not at all


class Collision(NamedTuple):
    """One step of the map: from (tau, w) to (next_tau, next_w), w just before the impact."""

    tau: float
    w: float
    axial_forcing: float
    restitution: float
    next_tau: float
    next_w: float
    kind: MapKind = MapKind.IMPACT


_NO_BOUNCE = 1.0001 * 2.0 * math.pi * INSTANT
"""A bounce that lasts less than this (rad), the instant of one event, is contact."""


def prove_collision(collision: Collision) -> Verdict:
    """Prove or refute one step of the next-collision map."""
    u = collision.restitution * -collision.w
    small = -math.log2(u) if 0.0 < u < 1.0 else 0.0
    with ctx.workprec(_PRECISION + 2 * math.ceil(small)):
        return _prove(collision, u)


def _prove(collision: Collision, u: float) -> Verdict:
    if collision.kind is MapKind.IMPACT:
        return _prove_landing(collision, collision.tau, u)
    if u > 0.0:
        ends = _prove_chatter(collision, u)
        if ends.outcome is not Outcome.PROVED:
            return ends
    leaves = arb(collision.axial_forcing) * arb.pi() > 1 + 8 * HALF_ULP
    if collision.kind is MapKind.REST:
        if leaves:
            return Verdict(Outcome.REFUTED, "contact does not last: the disk separates")
        return Verdict(Outcome.PROVED)
    if not leaves:
        return Verdict(Outcome.REFUTED, "contact lasts for good: the disk never separates")
    leave = (1 / (arb.pi() * arb(collision.axial_forcing))).asin()
    return _prove_landing(collision, float(leave), 0.0)


def _platform(axial_forcing: float, tau: float) -> tuple[Platform, State]:
    state = State(0, 0.0, 0, tau, Phase.FLIGHT, 0.0, 0.0, 0.0, 0.0)
    motion = MotionRecord(False, 0, 0, 0, tau, axial_forcing, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    return Platform(motion, state, arb(1)), state


def _prove_chatter(collision: Collision, u: float) -> Verdict:
    """The chatter ends before the load does."""
    platform, _ = _platform(collision.axial_forcing, collision.tau)
    restitution, g = arb(collision.restitution), arb(GRAVITY)
    pull = platform.mix(arb(1), arb(0)).jet(arb(0))[2] + g
    if not pull > 0:
        return Verdict(Outcome.REFUTED, "a chatter completes where the platform falls away")
    if 2 * u <= _NO_BOUNCE * pull:
        return Verdict(Outcome.PROVED, "a bounce without duration")
    about = float(2 * arb(u) / (pull * (1 - restitution)))
    tail = chatter_tail(platform, restitution, g, arb(0), arb(u), about)
    if tail is None:
        return Verdict(Outcome.REFUTED, "the chatter does not surely end")
    turned = tail.remainder * about
    if turned <= ROUNDINGS * HALF_ULP:
        return Verdict(Outcome.PROVED)
    return Verdict(Outcome.UNDECIDED, f"the chatter's closed form is exact to {turned:.3g} rad")


def _prove_landing(collision: Collision, tau: float, u: float) -> Verdict:
    """The first impact after a launch at tau with u is the reported one."""
    platform, state = _platform(collision.axial_forcing, tau)
    disk = DiskRecord(collision.restitution, GRAVITY, 0.0, 0.0)
    gap = gap_of(platform, state._replace(u=u), disk)
    if not (math.isfinite(collision.next_tau) and -math.inf < collision.next_w < 0.0):
        reason = f"an impact at {collision.next_tau!r} rad with w = {collision.next_w!r}"
        return Verdict(Outcome.REFUTED, reason)
    latest = _about(collision, tau, u) + _LATER
    first = opens(gap, latest, 1.0)
    if first is None:
        return Verdict(Outcome.UNDECIDED, "the gap does not surely open")
    zero = first_zero(gap, first, latest, gap.floor_zeros())
    if zero.found is Found.NONE:
        reason = f"no impact up to {latest!r} rad, after the one that is reported"
        return Verdict(Outcome.REFUTED, reason, gap.tolerance(latest), zero.pieces)
    if zero.found is Found.UNKNOWN:
        reason = f"the first impact is not decided at {float(zero.at)!r} rad"
        return Verdict(Outcome.UNDECIDED, reason, 0.0, zero.pieces)
    return _compare(collision, gap, tau, zero.at)._replace(pieces=zero.pieces)


def _about(collision: Collision, tau: float, u: float) -> float:
    """The time of the reported impact by the speeds: w = u − d/π − Γ(cos τ′ − cos τ)."""
    turned = collision.axial_forcing * (math.cos(collision.next_tau) - math.cos(tau))
    return max(math.pi * (u - collision.next_w - turned), 0.0)


def _compare(collision: Collision, gap: Watched, tau: float, d: arb) -> Verdict:
    """Phase and speed at the enclosed impact, with those that are reported."""
    lasted = float(d)
    _, slope, curvature = gap.jet(d)[:3]
    margin = gap.tolerance(lasted) / float(abs(slope)) + ROUNDINGS * HALF_ULP * (
        lasted + 2.0 * math.pi
    )
    turn = arb.pi() * 2
    off = arb(tau) + d - arb(collision.next_tau)
    off -= turn * (off / turn + arb(0.5)).floor().mid()
    phase = compared(off, margin, "τ")
    bend = float(abs(curvature).upper())
    allowed = gap.tolerance(lasted, 1) + gap.tolerance(lasted) / float(abs(slope)) * bend
    return worst([phase, compared(slope - arb(collision.next_w), allowed, "w")])


def by_lanes(tau: Floats, w: Floats, axial_forcing: Floats, restitution: Floats) -> list[Collision]:
    """What the lanes say of one step each."""
    next_tau, next_w, counts = tau.copy(), w.copy(), np.zeros((len(tau), 2), np.int64)
    iterate_axial(next_tau, next_w, axial_forcing, restitution, 1, counts)
    kinds = np.where(counts[:, COUNT_RESTS] > 0, 2, np.where(counts[:, COUNT_CONTACTS] > 0, 1, 0))
    table = np.stack([tau, w, axial_forcing, restitution, next_tau, next_w], axis=1)
    return [
        Collision(*row)._replace(kind=MapKind(kind))
        for row, kind in zip(table.tolist(), kinds.tolist(), strict=True)
    ]


def steps(n: int) -> list[Collision]:
    """Steps from random impacts, none of them at the ends of the parameters."""
    rng = np.random.default_rng(1)
    tau = rng.uniform(0.0, math.tau, n)
    w = -np.where(np.arange(n) % 3 == 0, 10.0 ** rng.uniform(-12, -6, n), rng.uniform(0, 4, n))
    return by_lanes(tau, w, rng.uniform(0.0, 1.2, n), rng.uniform(0.0, 0.9, n))


def log_uniforms(rng: np.random.Generator, low: float, high: float, n: int) -> Floats:
    """Numbers between low and high whose logarithms are uniform."""
    found: Floats = np.exp(rng.uniform(math.log(low), math.log(high), n))
    return found


def random_collisions(seed: int, n: int) -> list[Collision]:
    """Steps from random impacts: Γ 0 to 1.5, some 1e-9 to 1e6; ε in [0, 1], often near its ends;
    |w| from 1e-12 to 1e4."""
    rng, k = np.random.default_rng(seed), np.arange(n)
    tau = rng.uniform(0.0, math.tau, n)
    axial_forcing = np.choose(
        k % 5, [rng.uniform(0.0, 0.33, n), log_uniforms(rng, 1e-9, 1e6, n)]
        + [rng.uniform(0.3, 1.5, n)] * 3,
    )  # fmt: skip
    restitution = np.choose(
        k % 7, [rng.integers(0, 2, n), 1.0 - log_uniforms(rng, 1e-6, 1.0, n)]
        + [rng.uniform(0.0, 1.0, n)] * 5,
    )  # fmt: skip
    speed = np.choose(
        k % 3,
        [log_uniforms(rng, 1e-12, 1.0, n), rng.uniform(0.0, 5.0, n),
         log_uniforms(rng, 1e-3, 1e4, n)],
    )  # fmt: skip
    return by_lanes(tau, -speed, axial_forcing, restitution)


def test_steps_of_the_lanes_are_proved() -> None:
    counts: Counter[Outcome] = Counter()
    for collision in random_collisions(FIRST + 1, COLLISIONS):
        verdict = prove_collision(collision)
        counts[verdict.outcome] += 1
        assert verdict.outcome is not Outcome.REFUTED, (collision, verdict)
    assert counts[Outcome.UNDECIDED] <= UNDECIDED_PART * COLLISIONS


@pytest.mark.parametrize("field", ["next_tau", "next_w"])
@pytest.mark.parametrize("change", [1e-9, -1e-9, 0.1])
def test_other_impacts_are_refuted(field: str, change: float) -> None:
    for step in steps(100):
        if step.kind is MapKind.REST:
            continue
        other = step._replace(**{field: getattr(step, field) + change})
        assert prove_collision(other).outcome is Outcome.REFUTED, other


def test_another_kind_is_not_proved() -> None:
    """A chatter that is far from complete is not shown to end; a flight in its place is none."""
    for step in steps(100):
        for kind in set(MapKind) - {step.kind}:
            outcome = prove_collision(step._replace(kind=kind)).outcome
            assert outcome is not Outcome.PROVED
            if kind is MapKind.IMPACT:
                assert outcome is Outcome.REFUTED


@pytest.mark.parametrize("w", [math.nan, 0.0, 1.0, -math.inf])
def test_an_impact_that_is_none_is_refuted(w: float) -> None:
    step = steps(1)[0]._replace(next_w=w, kind=MapKind.IMPACT)
    assert prove_collision(step).outcome is Outcome.REFUTED
