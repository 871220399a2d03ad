"""Pinned runs of the simulator: steady, in cross-fades, with impulses, in contact, and replayed."""

from __future__ import annotations

from functools import cache
from typing import Any

from support import pinned
from support.pinned_draws import GRAVITY, Draw, Runs, amplitude, drawn, drawn_values, plain, six

NS = pinned.NS
COMMANDS = {
    "axial_amplitude": (0.03, 0.015),
    "angular_amplitude": (0.6, 0.4),
    "frequency": (3.0, 1.2),
    "phase_lag": (0.2, 1.5),
}
"""Command -> middle and swing of a programme that follows a sine."""


def steady(seed: int) -> Any:
    draw = Draw(1000 + seed)
    return pinned.simulated(6.0, **drawn_values(draw))


def preset(name: str, phase: float) -> Any:
    return pinned.simulated(8.0, preset=name, initial_forcing_phase=phase)


def faded(seed: int) -> Any:
    """A programme of a few motions, some with a duration of the cross-fade of their own."""
    draw = Draw(2000 + seed)
    values = drawn_values(draw, frequency=3.0, axial_amplitude=0.03)
    programme, at = [], 0.0
    for _ in range(draw.whole(1, 4)):
        at = six(at + draw.number(0.2, 2.0))
        frequency = draw.number(1.5, 9.0)
        target = {
            "axial_amplitude": amplitude(draw.number(0.0, 0.8), frequency),
            "angular_amplitude": draw.number(0.0, 1.5),
            "frequency": frequency,
            "phase_lag": draw.number(-4.0, 4.0),
        }
        programme.append((at, target))
    duration = draw.one_of(0.0, draw.number(0.05, 1.0))
    return pinned.simulated(7.0, programme, crossfade_duration=duration, **values)


def commanded_by_a_sine(name: str, points: int) -> Any:
    """One value follows a sine in steps."""
    middle, swing = COMMANDS[name]
    # the points of a triangle stand for the sine's: no last digit of a sine gets in
    shape = [0.0, 0.5, 0.866025, 1.0, 0.866025, 0.5]
    signed = [*shape, *(-value for value in shape)]
    programme = [
        (six(0.4 + 0.3 * i), {name: six(middle + swing * signed[i % len(signed)])})
        for i in range(points)
    ]
    return pinned.simulated(6.0, programme, crossfade_duration=0.25)


def pushed(seed: int) -> Any:
    """Impulses at any time, some at one instant and in contact."""
    draw = Draw(3000 + seed)
    values = drawn_values(draw, mass=0.25)
    impulses = [
        (draw.one_of(1.0, draw.number(0.0, 4.0)), draw.one_of(0.0, draw.number(-0.3, 0.3)),
         draw.one_of(0.0, draw.number(-0.02, 0.02)))
        for _ in range(draw.whole(1, 12))
    ]  # fmt: skip
    return pinned.simulated(5.0, impulses=impulses, **values)


def in_contact(seed: int) -> Any:
    """Motions that throw the disk seldom or never: it sticks and slides, with loads."""
    draw = Draw(4000 + seed)
    values = drawn_values(draw)
    values["axial_amplitude"] = amplitude(draw.number(0.0, 0.4), values["frequency"])
    values |= {
        "angular_amplitude": draw.number(0.1, 3.0),
        "initial_height": 0.0,
        "friction": draw.one_of(0.0, 1e-3, 0.05, 0.3),
        "load_torque": draw.one_of(0.0, draw.number(-0.05, 0.05)),
    }
    return pinned.simulated(5.0, sample_rate=100.0, **values)


def chattering(seed: int) -> Any:
    """Drops on a platform that moves little, with every way of reporting them."""
    draw = Draw(5000 + seed)
    values = drawn_values(draw)
    values["axial_amplitude"] = amplitude(draw.number(0.0, 0.36), values["frequency"])
    values |= {
        "restitution": draw.one_of(0.0, 0.2, 0.6, 0.9, 0.97),
        "initial_height": draw.number(0.001, 0.1),
        "chatter_report_speed": draw.one_of(0.0, 1e-3, 0.1, 10.0),
    }
    return pinned.simulated(4.0, **values)


def pressed(seed: int) -> Any:
    """With a preload and a load torque."""
    draw = Draw(6000 + seed)
    values = drawn_values(draw)
    preload = six(draw.number(-0.7, 3.0) * 0.25 * GRAVITY)
    weight = GRAVITY + preload / 0.25
    values |= {
        "mass": 0.25,
        "preload": preload,
        "load_torque": draw.number(-0.05, 0.05),
        "axial_amplitude": amplitude(draw.number(0.3, 0.8), values["frequency"], weight),
    }
    return pinned.simulated(5.0, **values)


def resting(seed: int) -> Any:
    """A platform that stands, turns only, or moves up and down only."""
    draw = Draw(7000 + seed)
    values = drawn_values(draw)
    still = draw.one_of("axial_amplitude", "angular_amplitude")
    values |= {still: 0.0, "initial_height": draw.one_of(0.0, 0.05)}
    values |= {"axial_amplitude": 0.0} if seed % 2 else {}
    return pinned.simulated(4.0, **values)


def fast(seed: int) -> Any:
    """A platform of micrometres and kilohertz."""
    draw = Draw(8000 + seed)
    frequency = draw.one_of(40e3, draw.number(1e3, 4e4))
    values = drawn_values(draw, frequency=frequency)
    values |= {
        "axial_amplitude": amplitude(draw.number(0.3, 0.9), frequency),
        "angular_amplitude": draw.decades(-7, -5),
        "initial_height": draw.one_of(0.0, draw.decades(-9, -6)),
    }
    return pinned.simulated(six(60.0 / frequency), sample_rate=10e3, **values)


def wild(seed: int) -> Any:
    """Parameters over many decades; a run is ended by its number of periods."""
    draw = Draw(9000 + seed)
    frequency = draw.decades(-2, 5)
    values = {
        "frequency": frequency,
        "axial_amplitude": amplitude(draw.decades(-2, 2), frequency),
        "angular_amplitude": draw.decades(-3, 1),
        "phase_lag": draw.number(-3.1, 3.1),
        "mass": draw.decades(-3, 1),
        "restitution": draw.one_of(0.0, 1.0, draw.number(0.0, 1.0)),
        "friction": draw.decades(-3, 1),
        "friction_radius": draw.decades(-2, 0),
        "gyration_radius": draw.decades(-2, 0),
        "initial_with_platform": False,
        "initial_axial_velocity": draw.number(-2.0, 2.0),
        "initial_height": draw.decades(-8, 0),
    }
    run = pinned.started(values)
    period = NS / frequency
    return pinned.stepped(run, [round(period * k) for k in (1, 2, 5, 20)])


def ticked(pattern: str) -> Any:
    """One run with inputs, advanced in one of several ways: impacts do not depend on it."""
    run = pinned.DrivenRun({"axial_amplitude": 0.045, "angular_amplitude": 0.7})
    draw = Draw(77)
    ways = {
        "in one go": [4.0], "by seconds": [1.0] * 4, "by periods": [0.25] * 16,
        "by 10 ms": [0.01] * 400, "by 1 ms": [0.001] * 4000, "first short": [1e-9, 3.999999999],
        "last short": [3.999999999, 1e-9], "uneven": [0.7, 0.001, 1.299, 1.0, 1e-6, 0.999999],
        "no time": [0.0, 0.0, 2.0, 0.0, 2.0],
        "drawn": [draw.number(0.0, 0.02) for _ in range(390)],
    }  # fmt: skip
    run.pause(True)
    run.impulse(0.8, 0.05, 0.002)
    run.command([(1.5, (0.03, 1.0, 4.0, 0.3)), (3.0, (0.05, 0.2, 2.5, -1.0))])
    run.pause(False)
    for seconds in ways[pattern]:
        run.advance(seconds)
    return run.content()


TICKS = ("in one go", "by seconds", "by periods", "by 10 ms", "by 1 ms", "first short",
         "last short", "uneven", "no time", "drawn")  # fmt: skip


@cache
def driven(seed: int) -> pinned.DrivenRun:
    """A run with inputs of every kind: parameters that change, pauses, resets, snapshots."""
    draw = Draw(10_000 + seed)
    run = pinned.DrivenRun(drawn_values(draw, frequency=3.0, axial_amplitude=0.045))
    for _ in range(25):
        run.advance(draw.one_of(0.0, 1e-9, 0.001, draw.number(0.0, 0.3)))
        an_input(run, draw)
    run.pause(False)
    run.advance(1.0)
    return run


def an_input(run: pinned.DrivenRun, draw: Draw) -> None:
    match draw.whole(0, 8):
        case 0 | 1:
            first = draw.number(0.0, 0.2)
            motion = (draw.number(0.0, 0.06), draw.number(0.0, 1.0), draw.number(2.0, 6.0), 0.3)
            run.command([(first, motion), (first + 0.1, (*motion[:3], -1.0))])
        case 2 | 3:
            run.impulse(draw.one_of(0.0, draw.number(0.0, 1.0)), draw.number(-0.1, 0.1),
                        draw.number(-0.01, 0.01))  # fmt: skip
        case 4:
            run.change(restitution=draw.number(0.0, 0.9), friction=draw.number(0.0, 1.0))
        case 5:
            run.change(preload=draw.number(-0.5, 2.0), load_torque=0.001)
            run.change(chatter_report_speed=draw.one_of(0.0, 1e-3, 0.3))
        case 6:
            run.pause(draw.one_of(True, False))
        case 7:
            run.snapshot()
        case _:
            run.reset()


def sines(low: float, high: float) -> Any:
    count = 20_001
    return pinned.sines([low + (high - low) * (i / (count - 1)) for i in range(count)])


def replayed(seed: int) -> Any:
    run = driven(seed)
    return pinned.replayed(run.records, run.batches)


def cut(seed: int) -> Any:
    """A replay of what is left when the first records and some in the middle are missing."""
    run = driven(seed)
    snapshots = [i for i, record in enumerate(run.records) if record["kind"] == "snapshot"]
    first = snapshots[-1]
    found = [pinned.replayed(run.records[first:], run.batches)]
    return [*found, pinned.continued(run.records[first], 2.0)]


def resumed(seed: int) -> Any:
    """A run from its checkpoint in mid-run: the checkpoint, and all that follows."""
    draw = Draw(11_000 + seed)
    run = pinned.started(drawn_values(draw))
    first = pinned.stepped(run, [round(draw.number(0.1, 3.0) * NS)])
    again = pinned.resumed(run)
    until = [run.time_ns + round(k * 0.4 * NS) for k in range(1, 5)]
    return [first, pinned.checkpoint(run), pinned.stepped(again, until)]


def what_if(seed: int) -> Any:
    draw = Draw(12_000 + seed)
    run = driven(seed)
    names = {"restitution": 0.45, "friction": 0.2, "frequency": 3.3, "phase_lag": -1.2}
    name = draw.one_of(*names)
    return pinned.compared(run.records, {name: names[name]}, run.time_ns)


def runs() -> Runs:
    """All of this file."""
    yield from drawn("simulated", "steady", 20, steady)
    for name in ("pizza_multiple_toss", "pizza_single_toss"):
        for phase in (0.5, 4.0):
            yield plain("simulated", f"{name} from {phase}", preset, name, phase)
    yield from drawn("simulated", "faded", 18, faded)
    for name in COMMANDS:
        for points in (7, 18):
            title = f"{name} by {points} points of a sine"
            yield plain("simulated", title, commanded_by_a_sine, name, points)
    yield from drawn("simulated", "pushed", 12, pushed)
    yield from drawn("simulated", "in contact", 12, in_contact)
    yield from drawn("simulated", "chattering", 12, chattering)
    yield from drawn("simulated", "pressed", 8, pressed)
    yield from drawn("simulated", "resting", 6, resting)
    yield from drawn("simulated", "fast", 6, fast)
    yield from drawn("simulated", "wild", 10, wild)
    for pattern in TICKS:
        yield plain("simulated", f"ticks {pattern}", ticked, pattern)
    for low, high in ((-10.0, 10.0), (-1e5, 1e5), (0.0, 1e9), (-1e-9, 1e-9)):
        yield plain("simulated", f"sines {low:g} to {high:g}", sines, low, high)
    yield from drawn("replayed", "driven", 8, lambda seed: driven(seed).content(True))
    yield from drawn("replayed", "replayed", 8, replayed)
    yield from drawn("replayed", "from the last snapshot", 4, cut)
    yield from drawn("replayed", "from a checkpoint", 6, resumed)
    yield from drawn("replayed", "what if", 4, what_if)
