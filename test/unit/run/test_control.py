"""The control of a run without ROS: what a line, a gate, a pause and a reset do to it."""

from __future__ import annotations

import time
from typing import Any

import pytest
from numpy.typing import NDArray

from bouncing_disk_ros import parameters
from bouncing_disk_ros.core.model import Sample
from bouncing_disk_ros.run.control import RunControl
from bouncing_disk_ros.run.gates import Gates
from bouncing_disk_ros.run.input_records import Record
from bouncing_disk_ros.run.session import Session
from bouncing_disk_ros.run.time_map import TimeMap
from bouncing_disk_ros.units import NS

WALL = 1_800_000_000 * NS


class Clock:
    """The steady clock, which the test moves."""

    now_ns = 5 * NS


class Kept:
    """An outlet that keeps records and mean speeds."""

    times: TimeMap

    def __init__(self) -> None:
        self.records: list[Record] = []
        self.speeds: list[float] = []

    def record(self, record: Record) -> None:
        self.records.append(record)

    def speed(self, first: Sample, second: Sample) -> None:
        self.speeds.append(first.mean_speeds(second)[1])

    def sample(self, sample: Sample) -> None:
        """Nothing is kept of samples."""

    def impacts(self, rows: NDArray[Any]) -> None:
        """Nor of impacts."""

    def state(self, session: Session, running: bool) -> None:
        """Nor of what is in force."""

    def ended(self, fault: str) -> None:
        raise AssertionError(fault)


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch, warm_kernels: None) -> Clock:
    clock = Clock()
    monkeypatch.setattr(time, "monotonic_ns", lambda: clock.now_ns)
    return clock


def run_of(clock: Clock, gates: Gates | None = None, **values: Any) -> tuple[RunControl, Kept]:
    """A run that is active, on a clock of the test."""
    kept = Kept()
    run = RunControl(
        "/node", parameters.complete(values), kept, gates=gates,
        ros_now=lambda: WALL + clock.now_ns,
    )  # fmt: skip
    run.set_active(True)
    return run, kept


def catch_up(run: RunControl, clock: Clock) -> None:
    """All slices of what is due."""
    while not run.tick(clock.now_ns):
        pass


def test_a_new_factor_sets_the_line_anew(clock: Clock) -> None:
    values = parameters.complete({})
    kept = Kept()
    run = RunControl("/node", values, kept, ros_now=lambda: WALL + clock.now_ns)
    run.set_active(True)
    clock.now_ns += NS
    catch_up(run, clock)
    values["real_time_factor"] = 10.0
    run.set_parameters({"real_time_factor": 10.0})
    reached = run.session.time_ns
    assert (run.times.simulated_ns, run.times.steady_ns) == (reached, clock.now_ns)
    assert run.times == kept.times
    clock.now_ns += NS // 10
    catch_up(run, clock)
    assert run.session.time_ns == reached + NS


def test_a_shorter_snapshot_period_holds_at_once(clock: Clock) -> None:
    """It held only once the longer one was over."""
    values, kept = parameters.complete({"snapshot_period": 1e6}), Kept()
    run = RunControl("/node", values, kept, ros_now=lambda: WALL + clock.now_ns)
    run.set_active(True)
    values["snapshot_period"] = 1.0
    run.set_parameters({"snapshot_period": 1.0})
    for _ in range(5):
        clock.now_ns += NS // 2
        catch_up(run, clock)
    assert [one["kind"] for one in kept.records].count("snapshot") == 3


def test_a_reset_is_not_rotation(clock: Clock) -> None:
    """In flight the disk turns as it was thrown, before and after."""
    thrown: dict[str, Any] = {"initial_height": 1000.0, "initial_angular_velocity": 5.0}
    run, kept = run_of(clock, rotor_speed_rate=10.0, **thrown)
    for _ in range(3):
        clock.now_ns += NS // 4
        catch_up(run, clock)
        run.reset()
    assert kept.speeds == pytest.approx([5.0] * len(kept.speeds), rel=1e-9)
    assert len(kept.speeds) > 4


def test_at_gates_snapshots_go_by_simulated_time_and_stamps_by_the_line(clock: Clock) -> None:
    gates = Gates([1], NS)
    values: dict[str, Any] = {"lockstep": "tick", "lockstep_controllers": "1", "state_rate": 10.0}
    run, kept = run_of(clock, gates, snapshot_period=0.25, real_time_factor=0.0, **values)
    for _ in range(10):
        clock.now_ns += 100 * NS  # the machine is slow
        gates.answer([1, gate := gates.number, 0])
        while gates.number == gate:
            run.tick(clock.now_ns)
    times = [one["time_ns"] for one in kept.records if one["kind"] == "snapshot"]
    assert times == [0, 3 * NS // 10, 6 * NS // 10, 9 * NS // 10]
    line = run.times
    run.pause(True)
    clock.now_ns += 100 * NS
    _, arrival = run.arrival("an input")
    assert arrival.times == line


def test_a_row_that_a_parameter_brings_about_has_a_gate(clock: Clock) -> None:
    """It cuts a chatter while time goes on: no gate was closed that could be replaced."""
    gates = Gates([1], NS)
    values: dict[str, Any] = {"lockstep": "impact", "axial_amplitude": 0.0}
    run, _ = run_of(clock, gates, initial_height=0.05, chatter_report_speed=0.3, **values)
    for _ in range(28):
        clock.now_ns += NS // 100
        while not run.tick(clock.now_ns):
            gates.answer([1, gates.number, 0])
    assert (gates.is_closed, gates.rows) == (False, 2)
    run.set_parameters({"gravity": 5.0})
    assert (gates.is_closed, gates.rows) == (True, 3)


def test_a_row_is_published_before_the_gate_that_counts_it(clock: Clock) -> None:
    """An impulse brought it about at its own instant: it came when time went on, who waited for it
    never answered."""
    published: list[int] = []
    counted: list[tuple[int, int]] = []
    gates = Gates([1], NS, announce=lambda _, __, rows: counted.append((rows, sum(published))))
    run, kept = run_of(clock, gates, lockstep="impact", axial_amplitude=0.0)
    kept.impacts = lambda rows: published.append(len(rows))  # type: ignore[method-assign]
    session = run.session
    gates.hold("a", 1, b"", lambda: session.apply_impulse(session.input_ns, -0.1, 0.0))
    gates.answer([1, 0, 1])
    run.tick(clock.now_ns)
    assert counted == [(0, 0), (1, 1)]


def test_a_gate_closes_at_the_instant_that_brings_about_its_row(clock: Clock) -> None:
    """An input that had waited cuts a chatter: the gate came at the next sample, or tick."""
    instants: list[int] = []
    gates = Gates([1], NS, announce=lambda _, time_ns, __: instants.append(time_ns))
    values: dict[str, Any] = {"lockstep": "impact", "axial_amplitude": 0.0, "initial_height": 0.05}
    run, _ = run_of(clock, gates, chatter_report_speed=0.3, real_time_factor=0.0, **values)
    run.session.apply_impulse(275_100_000, 0.0, 0.0)
    while gates.rows < 3:
        gates.answer([1, gates.number, 0])
        run.tick(clock.now_ns)
    assert instants[-1] == 275_100_000


def test_steps_to_an_impact_may_be_several(clock: Clock) -> None:
    run, _ = run_of(clock, start_paused=True, step_until="impact", initial_height=0.05)
    assert "over 3 impacts, now at" in run.step(3)
    assert run.session.simulation.rows_total == 3
    assert "to the next impact, now at" in run.step()
    assert run.session.simulation.rows_total == 4


@pytest.mark.parametrize(("first", "other"), [("periods", "impact"), ("impact", "periods")])
def test_a_long_step_goes_on_as_it_began(clock: Clock, first: str, other: str) -> None:
    """Whatever is set meanwhile: it ended at the next impact, or never."""
    gates = Gates([1], NS)
    values = parameters.complete({
        "start_paused": True, "lockstep": "tick", "step_until": first, "step_periods": 6,
        "initial_height": 0.05, "state_rate": 10.0,
    })  # fmt: skip
    run = RunControl("/node", values, Kept(), gates=gates, ros_now=lambda: WALL + clock.now_ns)
    run.set_active(True)
    assert "under way" in run.step(2)
    values["step_until"] = other
    for _ in range(60):
        if run.stepping and gates.is_closed:
            gates.answer([1, gates.number, 0])
        run.tick(clock.now_ns)
    assert not run.stepping
    if first == "periods":
        assert run.session.time_ns == 4 * NS
    else:
        assert run.session.simulation.rows_total == 2
