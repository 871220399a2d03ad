"""The node `juggle` against a simulator: the verdicts and impacts of the loop in one process."""

from __future__ import annotations

import math
from array import array
from collections.abc import Iterator
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rclpy.parameter import Parameter
from sensor_msgs.msg import PointCloud2

from bouncing_disk_ros.core.model import IMPACT_DTYPE, InitialState
from bouncing_disk_ros.core.offset_extremes import newest_extremes
from bouncing_disk_ros.core.simulation import Simulation
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.juggling.juggle import OPTIONS
from bouncing_disk_ros.juggling.juggle_node import JuggleNode
from bouncing_disk_ros.juggling.juggler import Juggler
from bouncing_disk_ros.juggling.loop_settings import Sensor, period_one_points
from bouncing_disk_ros.juggling.loop_verdict import Outcome
from bouncing_disk_ros.juggling.simulated_loop import run_loop
from bouncing_disk_ros.ros.from_messages import impacts_from_msg
from bouncing_disk_ros.ros.to_messages import impacts_to_msg
from reference.cases import in_soak
from support.juggle_loops import (
    DISK,
    FREQUENCY,
    GRAVITY,
    REPORTED,
    Make,
    juggler_of,
    motion_of,
    run_both,
    watched,
)
from support.ros import Nodes, overrides_of

ROOT = Path(__file__).resolve().parents[2]
PERIODS = 12
"""Of the platform: from rest deadbeat captures within 6 of them, and 4 more show it."""


@pytest.fixture
def make(make: Make) -> Make:
    return lambda **values: make(publish_clock=True, **values)  # stamps are simulated time


CASES: dict[str, tuple[float, float, Sensor]] = {
    "delay and missed": (0.60, 0.0, Sensor(delay=0.25, missed=0.1, seed=2)),
    "exact": (0.45, 0.0, Sensor()),
    "restitution believed too low": (0.45, -0.2, Sensor()),
    "restitution believed too high": (0.45, 0.2, Sensor()),
    "delay": (0.45, 0.0, Sensor(delay=0.5)),
    "missed": (0.45, 0.0, Sensor(missed=0.2)),
    "jitter": (0.45, 0.0, Sensor(jitter=0.005)),
    "0.50": (0.50, 0.0, Sensor()),
    "0.55": (0.55, 0.0, Sensor()),
    "0.60": (0.60, 0.0, Sensor()),
}
STARTS: dict[str, tuple[float, float] | None] = {
    "rest": None,
    "slow": (2.0, -0.6),
    "fast": (5.0, -4.5),
}


@pytest.mark.parametrize(
    ("case", "strategy", "start"),
    [
        ("delay and missed", "impact_time", "rest"),
        *in_soak(*product(list(CASES)[1:], ("none", "impact_time", "deadbeat"), STARTS)),
    ],
)
def test_through_ros_the_impacts_are_the_same_to_the_bit(
    make: Make, case: str, strategy: str, start: str
) -> None:
    forcing, error, sensor = CASES[case]
    state, place = None, STARTS[start]
    if place is not None:
        phase, w = place
        velocity = (forcing * math.cos(phase) - 0.5 * w) * GRAVITY / (2.0 * FREQUENCY)
        state = InitialState(axial_velocity=velocity, forcing_phase=phase)
    rows, record, status = run_both(
        make, forcing, strategy, sensor, periods=30, start=state, error=error
    )
    np.testing.assert_array_equal(rows["time"], record.rows["time"])
    np.testing.assert_array_equal(rows["axial_velocity"], record.rows["axial_velocity"])
    captured = record.verdict.outcome is Outcome.CAPTURED
    assert captured == (": captured" in status)
    assert captured or strategy == "none"
    phase = state.forcing_phase if state else 1.5 * math.pi
    alone = watched(record.rows, forcing, strategy, sensor, error=error, phase=phase)
    assert status == alone.status
    if case == "delay and missed":
        assert status == f"{strategy}: captured after {record.verdict.impacts} impacts"


@pytest.fixture
def nodes(warm_kernels: None) -> Iterator[Nodes]:
    made = Nodes()
    yield made
    made.close()


def test_in_lockstep_the_node_answers_the_gates_and_the_impacts_are_the_same(
    nodes: Nodes,
) -> None:
    """The simulator runs as fast as it can and waits for the node at each impact."""
    motion, disk = motion_of(0.55), DISK
    values: dict[str, Any] = {
        **motion._asdict(), **disk._asdict(), "initial_forcing_phase": 1.5 * math.pi,
        "lockstep": "impact", "real_time_factor": 0.0, "publish_clock": True,
    }  # fmt: skip
    nodes.simulator(**values)
    values = {"gravity": GRAVITY, "lead": 0.0, "lockstep_number": 1}
    node = JuggleNode(OPTIONS, context=nodes.context, parameter_overrides=overrides_of(values))
    nodes.add(node)
    rows: list[Any] = []
    node.create_subscription(
        PointCloud2, "disk/impacts", lambda cloud: rows.append(impacts_from_msg(cloud).copy()), 1000
    )
    nodes.spin_until(lambda: len(rows) >= 25)
    simulation = Simulation(motion, disk, InitialState(), chatter_report_speed=REPORTED)
    record = run_loop(simulation, Juggler("deadbeat", motion, disk), periods=2 * PERIODS)
    found = np.concatenate(rows)[:25]
    np.testing.assert_array_equal(found["time"], record.rows["time"][:25])
    np.testing.assert_array_equal(found["axial_velocity"], record.rows["axial_velocity"][:25])
    assert "deadbeat: captured" in node.status


def test_an_own_controller_is_used_and_a_wrong_one_refused(make: Make, tmp_path: Path) -> None:
    motion = motion_of(0.55)
    simulator = make(**motion._asdict(), gravity=GRAVITY, restitution=0.5)
    node = juggler_of(simulator, controller=str(ROOT / "examples" / "own_controller.py"))
    simulator.run(1.0)
    assert "own_controller.py: " in node.status
    simulator.close_node(node)
    wrong = tmp_path / "wrong.py"
    wrong.write_text("make_controller = lambda setup: 1\n")
    node = juggler_of(simulator, controller=str(wrong))
    simulator.run(0.5)
    assert "cannot juggle: controller: got 'make_controller that returns int'" in node.status
    simulator.close_node(node)


def test_a_message_without_impacts_changes_nothing(make: Make) -> None:
    """It ended the node."""
    simulator = make(**motion_of(0.45)._asdict(), gravity=GRAVITY, restitution=0.5)
    node = juggler_of(simulator)
    status = node.status
    node._on_impacts(PointCloud2())
    empty = impacts_to_msg(np.zeros(1, IMPACT_DTYPE), 0)
    empty.width, empty.row_step, empty.data = 0, 0, array("B")
    node._on_impacts(empty)
    assert node.status == status
    simulator.close_node(node)


def test_a_new_motion_begins_anew_and_one_without_an_orbit_is_named(make: Make) -> None:
    simulator = make(**motion_of(0.45)._asdict(), gravity=GRAVITY, restitution=0.5)
    node = juggler_of(simulator)
    simulator.run(0.1)
    assert node.status.startswith("deadbeat: not captured: ")
    simulator.command(axial_amplitude=motion_of(0.2).axial_amplitude)
    simulator.run(1.5)
    simulator.spin_until(lambda: "There is no period-1 orbit" in node.status)
    simulator.close_node(node)


def test_once_captured_the_disk_turns_as_fast_as_the_platform(make: Make) -> None:
    """The phase lag −τ_imp is commanded; its cross-fade does not make the loop begin anew."""
    motion = motion_of(0.60)._replace(angular_amplitude=0.5)
    simulator = make(**motion._asdict(), gravity=GRAVITY, restitution=0.5, friction=0.6)
    node = juggler_of(simulator)
    simulator.run(PERIODS / FREQUENCY)
    lag = -float(period_one_points(0.60, 0.5)[0, 0])
    assert simulator.motion.phase_lag == pytest.approx(lag, abs=1e-9)
    captured = node.status.partition(", rotor speed ")[0]
    simulator.run(PERIODS / FREQUENCY)
    assert node.status == f"{captured}, rotor speed 1.00 ωΦ"
    top = math.tau * FREQUENCY * 0.5
    assert simulator.state.angular_velocity == pytest.approx(top, rel=1e-6)
    simulator.close_node(node)


def test_the_target_is_switched_while_it_runs(make: Make) -> None:
    """From period 1 to the period-2 orbit that coexists at Γ = 0.48, and back."""
    simulator = make(**motion_of(0.48)._asdict(), gravity=GRAVITY, restitution=0.5)
    node = juggler_of(simulator)
    simulator.run(PERIODS / FREQUENCY)
    assert "deadbeat: captured" in node.status
    two = "period-2 in 1 cycle"
    for target, name in ((two, f"deadbeat to {two}"), ("period-1", "deadbeat")):
        done = node.set_parameters([Parameter("target", value=target)])[0]
        assert done.successful, done.reason
        assert node.status.startswith(f"{name}: not captured: ")
        simulator.run(PERIODS / FREQUENCY)
        assert node.status.startswith(f"{name}: captured after ")
    assert simulator.state.gap >= 0.0
    wrong = node.set_parameters([Parameter("target", value="period-7")])[0]
    assert (wrong.successful, "period-2 in 1 cycle" in wrong.reason) == (False, True)
    fixed = node.set_parameters([Parameter("delay", value=0.1)])[0]
    assert (fixed.successful, "read-only" in fixed.reason) == (False, True)
    simulator.close_node(node)


def test_small_feedback_goes_on_where_another_strategy_has_captured(make: Make) -> None:
    """At Γ = 0.60, with errors of the instants: the offset stays within 2 % of the amplitude."""
    motion = motion_of(0.60)
    simulator = make(**motion._asdict(), gravity=GRAVITY, restitution=0.5)
    node = juggler_of(simulator, jitter=0.001)
    simulator.run(PERIODS / FREQUENCY)
    captured = node.status.removeprefix("deadbeat: ")
    assert captured.startswith("captured")
    assert node.set_parameters([Parameter("strategy", value="small")])[0].successful
    assert node.status == f"small: {captured}"
    simulator.run(3.0 / FREQUENCY)  # the offset of the last answer of deadbeat is over
    sent, most = node.sent, 0.0
    for _ in range(2 * PERIODS):
        simulator.run_to_impact()
        assert simulator.node.run is not None
        newest = newest_extremes(simulator.node.run.session.simulation.offset.axial)
        most = max(most, newest.position)
    assert node.status == f"small: {captured}"
    assert node.sent > sent
    assert 0.0 < most <= 0.02 * motion.axial_amplitude * (1.0 + 1e-9)
    assert not node.set_parameters([Parameter("target", value="period-2")])[0].successful
    simulator.close_node(node)


def test_wrong_options_are_refused(make: Make) -> None:
    simulator = make()
    with pytest.raises(InputError, match="strategy: got 'mirror'"):
        juggler_of(simulator, strategy="mirror")
    with pytest.raises(InputError, match="Only impact_time and deadbeat aim at other orbits"):
        juggler_of(simulator, strategy="small", target="period-2 in 1 cycle")
