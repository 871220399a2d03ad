"""Corners of the model as scripts for the second method: ties, touches, and inputs at an event."""

from __future__ import annotations

import math

from bouncing_disk_ros.core.model import Disk, InitialState, Motion
from bouncing_disk_ros.units import NS
from support.random_runs import Input, Script

G, F = 10.0, 1.0
W = math.tau * F
DISK = Disk(0.25, 0.5, 0.6, 0.12, 0.1, G)
WEIGHT = DISK.mass * G
GRIP = DISK.friction * DISK.friction_radius * G / DISK.gyration_radius**2
"""α̈ by which friction turns the disk on a still platform, rad/s²."""
STILL = Motion(0.0, 0.0, F, 0.0)
START = InitialState()
CREST, TROUGH = 0.5 * math.pi, 1.5 * math.pi


def forced(axial_forcing: float, swing: float = 0.0, lag: float = 0.0) -> Motion:
    """A steady motion of a given Γ."""
    return Motion(axial_forcing * math.pi * G / W**2, swing, F, lag)


def separation(axial_forcing: float) -> float:
    """Forcing phase of separation, eq. 3."""
    return math.asin(1.0 / (math.pi * axial_forcing))


def ns_of(phase: float) -> int:
    """Nanoseconds in which the forcing phase grows by `phase`."""
    return round(phase / W * NS)


def script(
    motion: Motion, initial: InitialState = START, *inputs: Input, disk: Disk = DISK,
    seconds: float = 2.05, around: int = 0,
) -> Script:  # fmt: skip
    """A run that is compared ten times, and just before and after the instant `around`."""
    samples = {round(seconds * NS * k / 10) for k in range(1, 11)}
    near = {around - 2, around + 2} if around else set()
    return Script(motion, disk, initial, inputs, tuple(sorted(samples | near)))


def impulse(seconds: float, axial: float, angular: float = 0.0) -> Input:
    """An impulse in units of m·1 m/s and I·1 rad/s."""
    at_ns = round(seconds * NS)
    return Input(at_ns, "impulse", (at_ns, axial * DISK.mass, angular * DISK.inertia))


def at_separation(axial_forcing: float) -> Script:
    """Gap, velocity and acceleration are 0 together: no loop, and contact does not come again."""
    begin = separation(axial_forcing) - 0.1
    return script(forced(axial_forcing), InitialState(forcing_phase=begin), around=ns_of(0.1))


def graze(depth: float) -> Script:
    """A disk that meets the crest of Γ = 1.5 with no relative speed, misses it or falls short."""
    motion, late = forced(1.5), 0.05
    begin = CREST - W * late
    height = motion.axial_amplitude * (1.0 - math.sin(begin)) - 0.5 * G * late**2
    return script(motion, InitialState(height + depth, G * late, 0.0, 0.0, begin), seconds=0.5)


def tangential_touch(offset: float) -> Script:
    """α̇ falls as friction lets it and touches β̇ = Φω cos τ where β̈ is the same."""
    touch = 0.5
    swing = GRIP / (W**2 * math.sin(touch))
    speed = swing * W * math.cos(touch) + GRIP * touch / W + offset
    start = InitialState(angular_velocity=speed, forcing_phase=0.0)
    return script(Motion(0.0, swing, F, 0.0), start, seconds=0.2)


def before_separation(ratio: float) -> Script:
    """θ = −τ_sep: R and N vanish together; above 1 the torque vanishes too fast, and it slips."""
    motion, sep = forced(0.45), separation(0.45)
    rate = DISK.friction * DISK.friction_radius * DISK.mass * math.cos(sep) * motion.axial_amplitude
    swing, begin = ratio * rate / DISK.inertia, sep - 0.3
    spin = swing * W * math.cos(begin - sep)
    start = InitialState(angular_velocity=spin, forcing_phase=begin)
    motion = motion._replace(angular_amplitude=swing, phase_lag=-sep)
    return script(motion, start, seconds=0.5, around=ns_of(0.299))


def best_lag(axial_forcing: float) -> Script:
    """θ = −τ_sep and a small swing: it sticks up to separation, and leaves as fast as it can."""
    sep = separation(axial_forcing)
    spin = 0.05 * W * math.cos(TROUGH - sep)
    return script(forced(axial_forcing, 0.05, -sep), InitialState(angular_velocity=spin),
                  around=ns_of(sep + 0.5 * math.pi))  # fmt: skip


def fading_while_sticking(lag: float) -> Script:
    """A cross-fade slow enough for friction."""
    motion = forced(0.2, 0.02, lag)
    start = InitialState(angular_velocity=0.02 * W * math.cos(TROUGH + lag))
    target = motion._replace(angular_amplitude=0.03, frequency=0.97)
    fade = Input(0, "motion", (((2 * NS, target),), NS))
    return script(motion, start, fade, seconds=3.0, around=2 * NS)


def thrown(motion: Motion, speed: float, phase: float, restitution: float = 0.5) -> Script:
    """A disk that touches the platform with a relative speed, at the start."""
    climb = motion.axial_amplitude * W * math.cos(phase)
    start = InitialState(0.0, climb + speed, 0.0, 0.0, phase)
    return script(motion, start, disk=DISK._replace(restitution=restitution))


SLIP = 1.5 * GRIP / W**2
"""Φ of a platform that only rotates, where slip begins at sin τ = 2/3."""
CORNERS: dict[str, Script] = {
    # at rest on the platform the load decides
    **{f"at rest at the crest, Γ = {one}": script(forced(one), InitialState(forcing_phase=CREST))
       for one in (0.45, 2.0)},
    "at rest at the trough": script(forced(2.0)),
    **{f"never leaves, Γ = {one:.4f}": script(forced(one), seconds=5.0)
       for one in (0.0, 0.1, 0.3, 1.0 / math.pi)},
    "at rest where the load touches 0": script(
        forced(1.0 / math.pi), InitialState(forcing_phase=CREST), seconds=5.0),
    "a preload lifts the load": script(
        forced(0.45), InitialState(forcing_phase=0.4),
        Input(ns_of(0.2), "disk", (DISK._replace(preload=-0.5 * WEIGHT),))),
    "a preload lifts almost the whole weight": script(
        STILL, InitialState(height=0.005), disk=DISK._replace(preload=-0.999 * WEIGHT)),
    **{f"a fade to Γ = 2 in {one} s": script(
        STILL, InitialState(forcing_phase=0.0),
        Input(0, "motion", (((round(one * NS), forced(2.0)),), round(one * NS))))
       for one in (0.3, 0.55, 0.8)},
    # separation, grazes
    **{f"separation, Γ = {one}": at_separation(one) for one in (0.319, 0.34, 0.45, 1.0, 30.0)},
    **{f"a launch at separation {name}": script(forced(0.45), InitialState(forcing_phase=phase))
       for name, phase in (("", separation(0.45)),
                           ("but for a rounding", math.nextafter(separation(0.45), 0.0)),
                           ("and a rounding", math.nextafter(separation(0.45), 9.0)))},
    "an impact at the phase of separation": thrown(forced(0.45), -1.0, separation(0.45)),
    "an impact at time 0": thrown(forced(0.45), -1.0, math.pi),
    "an inelastic impact on a falling platform": thrown(forced(0.8), -0.5, CREST + 0.2, 0.0),
    **{f"a graze, {one:g} m": graze(one) for one in (1e-6, -1e-6, 1e-9, -1e-9, 1e-12, -1e-12)},
    # stick and slip
    "slip where friction does not suffice": script(
        Motion(0.0, SLIP, F, 0.0), InitialState(angular_velocity=SLIP * W, forcing_phase=0.0),
        seconds=0.3, around=ns_of(math.asin(2.0 / 3.0))),
    "slip that reverses": script(
        Motion(0.0, 0.5, F, 0.0), disk=DISK._replace(friction=0.01), seconds=4.0),
    **{f"a touch of the speeds by {one:g} rad/s": tangential_touch(one)
       for one in (1e-9, 1e-13, 0.0, -1e-15, 1e-15)},
    **{f"the best lag, Γ = {one}": best_lag(one) for one in (0.45, 0.7, 1.5)},
    **{f"slip before separation, {one}": before_separation(one) for one in (1.5, 0.7)},
    "slip at separation": script(
        forced(0.45, 0.5, 1.0), around=ns_of(separation(0.45) + 0.5 * math.pi)),
    **{f"a fade while it sticks, θ = {one}": fading_while_sticking(one)
       for one in (0.1, 0.7, 2.0, -1.3)},
    "no friction": script(forced(0.2, 0.5), disk=DISK._replace(friction=0.0)),
    "huge friction": script(
        forced(0.2, 0.5), InitialState(angular_velocity=3.0), disk=DISK._replace(friction=1e9)),
    "a load beyond friction": script(
        STILL, disk=DISK._replace(load_torque=2.0 * DISK.inertia * GRIP)),
    **{f"a load in flight, {one} rad/s": script(
        forced(0.0, 0.5), InitialState(10.0, None, one), disk=DISK._replace(load_torque=0.01),
        seconds=1.0) for one in (5.0, -5.0)},
    # chatter
    **{f"a drop, ε = {one}, {spin} rad/s": script(
        STILL, InitialState(0.2, None, spin), disk=DISK._replace(restitution=one, load_torque=load))
       for one in (0.0, 0.1, 0.5, 0.9, 1.0) for spin, load in ((1e4, 0.0), (0.0, 0.001))},
    **{f"chatter of every period, load {one} N·m": script(
        forced(0.6, 0.5), disk=DISK._replace(load_torque=one), seconds=6.0)
       for one in (0.0, 0.05)},
    "no swing": script(Motion(0.3, 0.0, F, 0.1), InitialState(0.05, None, 2.0), seconds=6.0),
    "no axial motion": script(Motion(0.0, 0.5, F, 0.1), InitialState(0.05, None, 2.0)),
    # inputs of one instant
    **{f"an impulse down in contact, ε = {one}": script(
        STILL, START, impulse(1.0, -2.0), disk=DISK._replace(restitution=one))
       for one in (0.0, 0.5, 1.0)},
    "an impulse up in contact": script(
        STILL, InitialState(angular_velocity=50.0), impulse(0.0, 2.0)),
    "two impulses that cancel": script(STILL, START, impulse(1.0, -1.0), impulse(1.0, 1.0)),
    "an angular impulse, then one down": script(
        STILL, START, impulse(1.0, 0.0, 1.0), impulse(1.0, -1.0)),
    "an angular impulse in contact": script(
        STILL, START, impulse(1.0, 0.0, 0.5), around=NS + round(0.5 / GRIP * NS)),
    "a reset in a fade, with an impulse waiting": script(
        forced(0.45), START, Input(0, "motion", (((4 * NS, forced(0.6)),), NS)),
        Input(0, "impulse", (5 * NS, 0.1, 0.0)),
        Input(3 * NS + NS // 2, "reset", (InitialState(height=0.1), forced(0.6, 1.0, 0.3))),
        seconds=6.0),
    "a fade of a nanosecond under a falling disk": script(
        Motion(0.0, 0.0, 2.0, 0.0), InitialState(0.0134, -1.1),
        Input(0, "motion", (((1, Motion(0.0, 0.0, 3.0, 1.0)),), 1)),
        disk=DISK._replace(restitution=1.0), seconds=0.5),
    "the angle and phase of the start": script(
        forced(0.5, 1.0), InitialState(0.5, 1.0, -3.0, 100.0, 0.7)),
}  # fmt: skip
