"""Pinned runs of the simulator: steady, in cross-fades, with impulses, in contact, and replayed."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros import Simulation, parameters, simulate
from bouncing_disk_ros.core.arithmetic import sine_and_cosine
from bouncing_disk_ros.core.model import Disk, InitialState, Motion, join_rows
from bouncing_disk_ros.run.input_records import Record
from bouncing_disk_ros.run.input_replay import restored
from bouncing_disk_ros.run.replay import replay
from bouncing_disk_ros.run.what_if import changes_of
from bouncing_disk_ros.run.what_if import what_if as compare
from support.driven import Driven
from support.pinned_draws import GRAVITY, Draw, Runs, amplitude, drawn, drawn_values, plain, six

NS = 1_000_000_000
Values = Mapping[str, Any]
Rows = NDArray[np.void]
COMMANDS = {
    "axial_amplitude": (0.03, 0.015),
    "angular_amplitude": (0.6, 0.4),
    "frequency": (3.0, 1.2),
    "phase_lag": (0.2, 1.5),
}
"""Command -> middle and swing of a programme that follows a sine."""


def without_version(records: Sequence[Record]) -> list[Record]:
    """Records as they are published, but for the version of the package."""
    return [{k: v for k, v in record.items() if k != "version"} for record in records]


def without_snapshots(records: Sequence[Record]) -> list[Record]:
    """Records of what drove a run alone."""
    return [record for record in records if record["kind"] != "snapshot"]


def simulated(
    duration: float,
    programme: Sequence[tuple[float, Mapping[str, float]]] = (),
    impulses: Sequence[tuple[float, float, float]] = (),
    sample_rate: float | None = 50.0,
    preset: str = "",
    **values: Any,
) -> Any:
    """Rows of impacts, samples and inputs of a run of `simulate`."""
    found = simulate(
        duration,
        programme=programme, impulses=impulses, sample_rate=sample_rate, preset=preset, **values,
    )  # fmt: skip
    return [found.impacts, found.samples, without_snapshots(found.inputs)]


def started(values: Values) -> Simulation:
    """The core's simulation from some parameters of the table."""
    whole = parameters.complete(values)

    def some(*names: str) -> list[float]:
        return [float(whole[name]) for name in names]

    speed = None if whole["initial_with_platform"] else float(whole["initial_axial_velocity"])
    height, *rest = some(
        "initial_height", "initial_angular_velocity", "initial_angle", "initial_forcing_phase"
    )
    return Simulation(
        Motion(*some("axial_amplitude", "angular_amplitude", "frequency", "phase_lag")),
        Disk(*some("mass", "restitution", "friction", "friction_radius", "gyration_radius",
                   "gravity", "preload", "load_torque")),
        InitialState(height, speed, *rest),
        chatter_report_speed=float(whole["chatter_report_speed"]),
    )  # fmt: skip


def stepped(run: Simulation, instants_ns: Sequence[int], max_events: int = 1_000_000) -> Any:
    """Rows, samples and energies of a run that is advanced from instant to instant."""
    rows, samples, energies = [], [], []
    for at in instants_ns:
        behind = True
        while behind:
            some, behind = run.advance(at, max_events)
            rows.append(some)
        samples.append(list(run.sample()))
        energies.append(energy_before(run))
    table = np.array(samples, float)
    return [join_rows([part for part in rows if len(part)]), table, np.array(energies, float)]


_LATER = ("spin_sign", "drag", "rows_entered", "brake_torque", "brake", "load_inertia")


def energy_before(run: Simulation) -> list[float]:
    """The energy ledger without the loss in a brake, which no pinned run has."""
    energy = run.energy()._asdict()
    assert energy.pop("loss_brake") == 0.0
    return list(energy.values())


def before_loads(value: Any) -> Any:
    """Records as they were before disks had a brake and a load inertia, which no pinned run has."""
    if isinstance(value, dict):
        found = {name: before_loads(part) for name, part in value.items() if name not in _LATER}
        if isinstance(found.get("disk"), list):
            found["disk"] = found["disk"][:8]
        if "slip_sign" in found:
            found["slip_sign"] = float(found["slip_sign"])
        if "books" in found:
            found["books"] = [row[:7] + row[8:] for row in found["books"]]
        return found
    return [before_loads(part) for part in value] if isinstance(value, list) else value


def command(run: Driven, points: Sequence[tuple[float, Sequence[float]]]) -> None:
    """A programme: (seconds from now, A, Φ, f, θ)."""
    now = run.session.input_ns
    run.session.command([(now + round(at * NS), Motion(*to)) for at, to in points])


def impulse(run: Driven, after: float, axial: float, angular: float) -> None:
    """An impulse some seconds from now."""
    run.session.apply_impulse(run.session.input_ns + round(after * NS), axial, angular)


def content(run: Driven, snapshots: bool = False) -> Any:
    """Rows, records (snapshots too, if wanted), the state and the energies at the end."""
    simulation = run.session.simulation
    records = (without_version if snapshots else without_snapshots)(run.record_list)
    return [
        join_rows(run.batches), before_loads(records), list(simulation.sample()),
        energy_before(simulation),
    ]  # fmt: skip


def steady(seed: int) -> Any:
    draw = Draw(1000 + seed)
    return simulated(6.0, **drawn_values(draw))


def preset(name: str, phase: float) -> Any:
    return simulated(8.0, preset=name, initial_forcing_phase=phase)


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
    return simulated(7.0, programme, crossfade_duration=duration, **values)


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
    return simulated(6.0, programme, crossfade_duration=0.25)


def pushed(seed: int) -> Any:
    """Impulses at any time, some at one instant and in contact."""
    draw = Draw(3000 + seed)
    values = drawn_values(draw, mass=0.25)
    impulses = [
        (draw.one_of(1.0, draw.number(0.0, 4.0)), draw.one_of(0.0, draw.number(-0.3, 0.3)),
         draw.one_of(0.0, draw.number(-0.02, 0.02)))
        for _ in range(draw.whole(1, 12))
    ]  # fmt: skip
    return simulated(5.0, impulses=impulses, **values)


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
    return simulated(5.0, sample_rate=100.0, **values)


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
    return simulated(4.0, **values)


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
    return simulated(5.0, **values)


def resting(seed: int) -> Any:
    """A platform that stands, turns only, or moves up and down only."""
    draw = Draw(7000 + seed)
    values = drawn_values(draw)
    still = draw.one_of("axial_amplitude", "angular_amplitude")
    values |= {still: 0.0, "initial_height": draw.one_of(0.0, 0.05)}
    values |= {"axial_amplitude": 0.0} if seed % 2 else {}
    return simulated(4.0, **values)


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
    return simulated(six(60.0 / frequency), sample_rate=10e3, **values)


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
    run = started(values)
    period = NS / frequency
    return stepped(run, [round(period * k) for k in (1, 2, 5, 20)])


def ticked(pattern: str) -> Any:
    """One run with inputs, advanced in one of several ways: impacts do not depend on it."""
    run = Driven(axial_amplitude=0.045, angular_amplitude=0.7)
    draw = Draw(77)
    ways = {
        "in one go": [4.0], "by seconds": [1.0] * 4, "by periods": [0.25] * 16,
        "by 10 ms": [0.01] * 400, "by 1 ms": [0.001] * 4000, "first short": [1e-9, 3.999999999],
        "last short": [3.999999999, 1e-9], "uneven": [0.7, 0.001, 1.299, 1.0, 1e-6, 0.999999],
        "no time": [0.0, 0.0, 2.0, 0.0, 2.0],
        "drawn": [draw.number(0.0, 0.02) for _ in range(390)],
    }  # fmt: skip
    run.session.set_paused(True)
    impulse(run, 0.8, 0.05, 0.002)
    command(run, [(1.5, (0.03, 1.0, 4.0, 0.3)), (3.0, (0.05, 0.2, 2.5, -1.0))])
    run.session.set_paused(False)
    for seconds in ways[pattern]:
        run.advance(seconds)
    return content(run)


TICKS = ("in one go", "by seconds", "by periods", "by 10 ms", "by 1 ms", "first short",
         "last short", "uneven", "no time", "drawn")  # fmt: skip


@cache
def driven(seed: int) -> Driven:
    """A run with inputs of every kind: parameters that change, pauses, resets, snapshots."""
    draw = Draw(10_000 + seed)
    run = Driven(**drawn_values(draw, frequency=3.0, axial_amplitude=0.045))
    for _ in range(25):
        run.advance(draw.one_of(0.0, 1e-9, 0.001, draw.number(0.0, 0.3)))
        an_input(run, draw)
    run.session.set_paused(False)
    run.advance(1.0)
    return run


def an_input(run: Driven, draw: Draw) -> None:
    session = run.session
    match draw.whole(0, 8):
        case 0 | 1:
            first = draw.number(0.0, 0.2)
            motion = (draw.number(0.0, 0.06), draw.number(0.0, 1.0), draw.number(2.0, 6.0), 0.3)
            command(run, [(first, motion), (first + 0.1, (*motion[:3], -1.0))])
        case 2 | 3:
            impulse(run, draw.one_of(0.0, draw.number(0.0, 1.0)), draw.number(-0.1, 0.1),
                    draw.number(-0.01, 0.01))  # fmt: skip
        case 4:
            values = {"restitution": draw.number(0.0, 0.9), "friction": draw.number(0.0, 1.0)}
            session.set_parameters(parameters.checked(values))
        case 5:
            values = {"preload": draw.number(-0.5, 2.0), "load_torque": 0.001}
            session.set_parameters(parameters.checked(values))
            speed = draw.one_of(0.0, 1e-3, 0.3)
            session.set_parameters(parameters.checked({"chatter_report_speed": speed}))
        case 6:
            session.set_paused(draw.one_of(True, False))
        case 7:
            session.snapshot()
        case _:
            session.reset()


def sines(low: float, high: float) -> Any:
    count = 20_001
    angles = (low + (high - low) * (i / (count - 1)) for i in range(count))
    return np.array([sine_and_cosine(angle) for angle in angles])


def replayed(seed: int, first: int = 0) -> Any:
    run = driven(seed)
    found = replay(run.record_list[first:], run.batches)
    assert found.identical, found.difference
    return [found.impacts, found.rows, found.missing, found.not_compared, found.records,
            found.snapshots, found.first_row, found.start_ns, found.end_ns,
            [list(gap) for gap in found.gaps]]  # fmt: skip


def cut(seed: int) -> Any:
    """A replay of what is left when the first records are missing, and a run that goes on there."""
    records = driven(seed).record_list
    first = max(i for i, record in enumerate(records) if record["kind"] == "snapshot")
    run = restored(records[first])
    return [replayed(seed, first), stepped(run, [run.time_ns + 2 * NS])]


def resumed(seed: int) -> Any:
    """A run from its checkpoint in mid-run: the checkpoint, and all that follows."""
    draw = Draw(11_000 + seed)
    run = started(drawn_values(draw))
    first, checkpoint = stepped(run, [round(draw.number(0.1, 3.0) * NS)]), run.snapshot()
    again = Simulation.restore(json.loads(json.dumps(checkpoint)))
    until = [run.time_ns + round(k * 0.4 * NS) for k in range(1, 5)]
    return [first, before_loads(checkpoint), stepped(again, until)]


def what_if(seed: int) -> Any:
    """A run and a changed one: rows, samples, rotor speeds and where the two part."""
    run, values = (
        driven(seed),
        {"restitution": 0.45, "friction": 0.2, "frequency": 3.3, "phase_lag": -1.2},
    )
    name = Draw(12_000 + seed).one_of(*values)
    found = compare(run.record_list, changes_of({name: values[name]}), run.session.time_ns)
    apart = found.divergence
    return [list(found.first), list(found.second), found.start_ns, found.end_ns,
            found.divergence_time_ns, apart and [apart.recorded, apart.replayed]]  # fmt: skip


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
    yield from drawn("replayed", "driven", 8, lambda seed: content(driven(seed), True))
    yield from drawn("replayed", "replayed", 8, replayed)
    yield from drawn("replayed", "from the last snapshot", 4, cut)
    yield from drawn("replayed", "from a checkpoint", 6, resumed)
    yield from drawn("replayed", "what if", 4, what_if)
