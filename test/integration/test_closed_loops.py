"""Closed loops: the same bits in every run, by the fixture and by lockstep."""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Callable, Iterator
from typing import Any

import pytest
import rclpy
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile
from sensor_msgs.msg import JointState, PointCloud2
from std_msgs.msg import String

from bouncing_disk_ros.nodes.simulator.simulator_node import SimulatorNode
from bouncing_disk_ros.run import control
from bouncing_disk_ros.testing import SteppedSimulator
from bouncing_disk_ros.units import NS
from support.controllers import GateController, ImpactAnswerer, SampleAnswerer, move
from support.digest import digest_of
from support.driven import replayed
from support.lockstep_loop import Loop, kept
from support.ros_peer import Peer

Make = Callable[..., SteppedSimulator]
KEEP_ALL = HistoryPolicy.KEEP_ALL


def state_digest(node: SimulatorNode) -> str:
    """A digest of all that the simulation depends on."""
    assert node.run is not None
    text = json.dumps(node.run.session.simulation.snapshot(), sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()


# --- the fixture ----------------------------------------------------------------------------------
def test_two_nodes_in_a_loop_give_the_same_bits_each_time(make: Make) -> None:
    found = []
    for _ in range(2):
        simulator = make(state_rate=50.0)
        records = kept(simulator.node)
        nodes = [cls(context=simulator.context) for cls in (ImpactAnswerer, SampleAnswerer)]
        for node in nodes:
            simulator.add_node(node)
        simulator.run(2.0)
        assert nodes[0].heard > 5
        assert nodes[1].heard >= 100
        kinds = [one["kind"] for one in records]
        assert kinds.count("trajectory") > 10
        assert kinds.count("motion") == 2
        found.append((state_digest(simulator.node), json.dumps(records)))
        for node in nodes:
            simulator.close_node(node)
    assert len(set(found)) == 1


def test_what_is_latched_is_counted_for_those_who_come_late(make: Make) -> None:
    """Else a message that is still on its way would pass for the latched one before it."""
    simulator = make()
    heard: list[str] = []
    node = rclpy.create_node("late", context=simulator.context, use_global_arguments=False)
    latched = QoSProfile(depth=1000, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    node.create_subscription(String, "disk/inputs", lambda msg: heard.append(msg.data), latched)
    simulator.add_node(node)
    simulator.run(0.01)
    assert len(heard) == 1
    for count in range(2, 8):
        simulator.command(axial_amplitude=0.01 * count)
        simulator.run(0.01)
        assert len(heard) == count
    simulator.close_node(node)


def test_run_to_impact_ends_after_the_next_row_has_been_heard(make: Make) -> None:
    simulator = make()
    node = ImpactAnswerer(context=simulator.context)
    simulator.add_node(node)
    for count in range(1, 6):
        simulator.run_to_impact()
        assert node.heard == count
        assert simulator.node.run is not None
        assert simulator.node.run.session.simulation.rows_total == count
    simulator.close_node(node)


def test_run_to_impact_says_when_there_is_none(make: Make) -> None:
    simulator = make(axial_amplitude=0.0)
    with pytest.raises(AssertionError, match=r"no impact within 0\.5 s"):
        simulator.run_to_impact(within=0.5)


# --- trajectories over ROS ------------------------------------------------------------------------
def test_a_trajectory_is_followed_recorded_shown_and_replayed(make: Make) -> None:
    simulator = make(axial_amplitude=0.0, angular_amplitude=0.0, publish_clock=True)
    assert simulator.node.run is not None
    records: list[dict[str, Any]] = []
    simulator.node.run.session._record = records.append
    simulator.node.run.session.snapshot()
    peer = Peer()
    try:
        heard, states = peer.heard["platform/offset"], peer.heard["joint_states"]
        peer.settle()
        peer.publish("platform/joint_trajectory", move("platform_axial", 0.02, 500_000_000))
        simulator.spin_until(lambda: any(one["kind"] == "trajectory" for one in records))
        simulator.advance(1.0)
        assert simulator.state.platform_position == 0.02
        assert simulator.state.axial_position == 0.02
        peer.spin_until(lambda: bool(heard) and list(heard[-1].points[1].positions) == [0.02, 0.0])
        peer.spin_until(lambda: bool(states) and states[-1].position[2] == 0.02)
    finally:
        peer.close()
    _, again = replayed(json.loads(json.dumps(records)), simulator.node.run.session.time_ns)
    assert again.sample() == simulator.state


# --- lockstep -------------------------------------------------------------------------------------
@pytest.fixture
def loops(ros_domain: int, warm_kernels: None) -> Iterator[Callable[..., Loop]]:
    made: list[Loop] = []

    def one(controllers: int, **values: Any) -> Loop:
        made.append(Loop(controllers, **values))
        return made[-1]

    yield one
    for loop in made:
        loop.close()


def test_lockstep_gives_the_same_inputs_each_time(loops: Callable[..., Loop]) -> None:
    """At each impact; at each tick, with controllers that are killed: test_lockstep_processes."""
    found = []
    for _ in range(2):
        loop = loops(2, lockstep="impact")
        loop.spin_until(lambda: loop.gate >= 40)  # noqa: B023
        inputs = [one for one in loop.records if one["kind"] == "trajectory"][:8]
        assert len(inputs) == 8
        found.append(json.dumps(inputs))
        loop.close()  # or the next controllers hear its gates
    assert len(set(found)) == 1


def test_time_stands_at_a_gate_and_services_answer(loops: Callable[..., Loop]) -> None:
    loop = loops(1, lockstep="impact", lockstep_timeout=0.05)
    loop.spin_until(lambda: loop.gate >= 3)
    loop.controllers[0].silent = True
    gate = loop.gate
    run = loop.node.run
    assert run is not None
    loop.spin_until(lambda: bool(run.gates and run.gates.is_closed))
    time_ns = run.session.time_ns
    loop.spin_until(lambda: loop.node._read().overdue)
    assert "no answer of controller 1" in loop.node._read().waiting
    assert run.session.time_ns == time_ns
    assert "paused" in run.pause(True)
    assert "running" in run.pause(False)
    assert loop.gate in (gate, gate + 1)
    second = GateController(1, context=loop.context)  # another one takes over
    loop.executor.add_node(second)
    loop.nodes.append(second)
    loop.spin_until(lambda: loop.gate >= gate + 5)


@pytest.mark.parametrize("first", ["controller", "simulator"])
def test_an_impact_at_time_0_comes_before_the_first_gate(
    loops: Callable[..., Loop], first: str
) -> None:
    """A controller does not answer it, whether it hears it or was started too late."""
    loop = loops(1, preset="swum", lockstep="impact", autostart=first == "simulator")
    if first == "controller":
        loop.spin_until(loop.controllers[0]._offsets.get_subscription_count)
        loop.node.trigger_configure()
        loop.watch()
        loop.node.trigger_activate()
    assert loop.node.run is not None
    assert loop.node.run.gates is not None
    assert (loop.gate, loop.node.run.gates.rows) == (0, 1)
    loop.spin_until(lambda: loop.gate >= 5)
    inputs = [one for one in loop.records if one["kind"] == "trajectory"]
    assert len(inputs) == loop.gate - 1  # none for row 0


def test_hundreds_of_inputs_at_one_gate_all_act_in_order(loops: Callable[..., Loop]) -> None:
    """In turns, between which services answer; a reset among them refuses the rest."""
    loop = loops(1, lockstep="tick")
    controller = loop.controllers[0]
    loop.spin_until(lambda: controller.is_matched)

    def hold(count: int) -> None:
        controller.silent = True
        for k in range(count):
            controller.send(move("platform_axial", 1e-6 * k))
        controller.silent = False

    def acted() -> list[float]:
        return [one["joints"]["platform_axial"][0][2] for one in loop.records if "joints" in one]

    hold(300)
    seen: set[int] = set()
    loop.spin_until(lambda: (seen.add(len(acted())), max(seen) >= 300)[-1])  # type: ignore[func-returns-value]
    assert acted()[:300] == [1e-6 * k for k in range(300)]
    assert len(seen & set(range(1, 300))) >= 3
    before = len(acted())
    hold(60)
    loop.spin_until(lambda: len(acted()) > before + 1)
    assert loop.node.run is not None
    health = loop.node._diagnostics._health
    begun, refused = len(acted()) - before, health.refused
    loop.node.run.reset()
    assert 0 < begun < 60
    assert health.refused - refused == 60 - begun
    gate = loop.gate
    loop.spin_until(lambda: loop.gate >= gate + 2)


def test_whatever_happens_at_a_gate_the_run_goes_on_and_replays(loops: Callable[..., Loop]) -> None:
    """Pause, step, reset, parameters, fades, trajectories, and a subscriber that takes nothing."""
    loop = loops(2, lockstep="impact", real_time_factor=0.0, step_until="impact")
    deaf = rclpy.create_node("deaf", context=loop.context, use_global_arguments=False)
    for kind, topic in ((PointCloud2, "disk/impacts"), (JointState, "joint_states")):
        deaf.create_subscription(kind, topic, print, QoSProfile(depth=0, history=KEEP_ALL))
    loop.executor.add_node(loop.controllers[1])
    run = loop.node.run
    assert run is not None
    one = loop.controllers[0]

    def goes_on(gates: int = 3) -> None:
        until = loop.gate + gates
        loop.spin_until(lambda: loop.gate >= until)

    goes_on()
    for again in range(2):
        run.pause(True)
        gate = loop.gate
        for k in range(1, 4):
            run.step()
            loop.spin_until(lambda: loop.gate >= gate + k and not run.stepping)  # noqa: B023
        run.pause(False)
        goes_on()
        loop.node.set_parameters_atomically([Parameter("restitution", value=0.45 + 0.1 * again)])
        goes_on()
        run.reset()
        goes_on()
        one.fade(0.030 + 0.01 * again)  # the next gate counts it
        goes_on()
        if not again:
            deaf.destroy_node()
    assert run.gates is not None
    assert loop.node.last_refusal is None or "before the reset" in str(loop.node.last_refusal)
    kinds = {record["kind"] for record in loop.records}
    assert kinds >= {"trajectory", "motion", "pause", "reset", "parameters"}
    again_rows, _ = replayed(loop.all_records, run.session.time_ns + 1)
    rows = loop.rows
    assert digest_of(again_rows[: len(rows)]) == digest_of(rows)
    assert len(rows) > 20


def test_a_wait_is_nobody_s_load_and_is_not_made_up_for(loops: Callable[..., Loop]) -> None:
    """In real time: the machine is not blamed, and time goes on at its own pace afterwards."""
    loop = loops(1, lockstep="tick", real_time_factor=1.0)
    controller = loop.controllers[0]
    loop.spin_until(lambda: loop.gate >= 3)
    controller.silent = True
    run = loop.node.run
    assert run is not None
    assert run.gates is not None
    loop.spin_until(lambda: bool(run.gates and run.gates.waited_ns(time.monotonic_ns()) > NS // 2))
    assert run.read().lag_ns == 0
    assert run.read().waiting == f"gate {loop.gate}: no answer of controller 1"
    controller.silent = False
    controller.answer()
    gate = loop.gate
    loop.spin_until(lambda: loop.gate > gate)
    assert run._lag_ns(time.monotonic_ns()) < 0.4 * NS


def test_steps_end_at_impacts_or_after_nanoseconds(
    make: Make, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(control, "STEP_NS", 10**11)  # on a busy machine they take longer
    simulator = make(step_until="impact")
    run = simulator.node.run
    assert run is not None
    for count in (1, 2, 3):
        assert "to the next impact" in run.step()
        assert run.session.simulation.rows_total == count
    simulator.node.set_parameters_atomically([Parameter("step_until", value="nanoseconds")])
    before = run.session.time_ns
    run.step()
    assert run.session.time_ns == before + 1_000_000


def test_simulators_of_one_name_log_without_a_warning_of_ros(
    make: Make, capfd: pytest.CaptureFixture[str]
) -> None:
    """ROS has one publisher of logs for each name in a process: the first one has it."""
    for _ in range(2):
        make()
    assert "already registered" not in "".join(capfd.readouterr())
