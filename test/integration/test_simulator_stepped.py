"""The simulator in the process of the test, paused, stepped: exact results, no clock involved."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from rclpy.lifecycle import TransitionCallbackReturn
from rclpy.parameter import Parameter, parameter_dict_from_yaml_file

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.nodes.simulator.outputs import Outputs
from bouncing_disk_ros.parameters import TABLE
from bouncing_disk_ros.ros.from_messages import time_to_ns
from bouncing_disk_ros.run.time_map import MARGIN_NS
from bouncing_disk_ros.testing import SteppedSimulator
from bouncing_disk_ros.units import NS
from support.ros_peer import Peer

Make = Callable[..., SteppedSimulator]
SUCCESS = TransitionCallbackReturn.SUCCESS


def state_of(simulator: SteppedSimulator) -> dict[str, Any]:
    assert simulator.node.run is not None
    return simulator.node.run.session.simulation.snapshot()


# --- exactness ------------------------------------------------------------------------------------


def test_a_fade_over_many_decades_leaves_the_node_answering(make: Make) -> None:
    simulator = make(frequency=0.1, axial_amplitude=1e-9, real_time_factor=1.0)
    run = simulator.node.run
    assert run is not None
    simulator.command(frequency=40_000.0)
    run.pause(False)
    for k in range(1, 200):  # each tick is a slice of bounded work
        run.tick(k * 50_000_000 + run.times.steady_ns)
    assert run.session.time_ns > NS
    assert run.session.fault == ""
    run.pause(True)
    assert run.session.paused


def test_a_run_that_cannot_go_on_says_so_once_and_refuses_inputs(make: Make) -> None:
    simulator = make(initial_height=1.0)
    run = simulator.node.run
    assert run is not None
    run.session.simulation._engine.state["u"] = float("nan")
    run.session.simulation._engine.invalidate_next_event()
    simulator.advance(1.0)
    assert run.read().fault
    with pytest.raises(InputError):
        simulator.apply_impulse(0.1)
    with pytest.raises(InputError, match="cleanup, configure"):
        run.reset()


def test_a_refused_command_raises_what_the_simulator_says(make: Make) -> None:
    simulator = make()
    with pytest.raises(InputError, match=r"frequency \(Hz\): got -1\.0, allowed: a finite"):
        simulator.command(frequency=-1.0)
    with pytest.raises(InputError, match="Did you mean frequency"):
        simulator.command(frequenzy=3.0)
    with pytest.raises(InputError):
        simulator.apply_impulse(float("nan"))
    assert simulator.command(frequency=np.float32(4.0), phase_lag=np.int64(1))
    assert (simulator.motion.frequency, simulator.motion.phase_lag) == (4.0, 1.0)


def test_waiting_for_a_topic_that_is_not_there_names_the_nearest(make: Make) -> None:
    simulator = make(restitution=np.float64(0.4))
    assert simulator.node.get_parameter("restitution").value == 0.4
    with pytest.raises(InputError, match=r"got '/disk/impact', .* Did you mean /disk/impacts\?"):
        simulator.wait_for_subscriber("disk/impact")


# --- parameters -----------------------------------------------------------------------------------
def set_one(simulator: SteppedSimulator, name: str, value: Any) -> tuple[bool, str]:
    result = simulator.node.set_parameters_atomically([Parameter(name, value=value)])
    return result.successful, result.reason


WRONG_PARAMETERS = [
    ("restitution", 1.5, "restitution: got 1.5, allowed: a finite number >= 0 and <= 1"),
    ("restitution", "high", "It is a double, not a string"),
    ("preload", -100.0, "preload: got -100.0, allowed: a finite number > "),
    ("mass", 1.0, "mass: got 1.0, allowed: no change while it runs"),
    ("restituton", 0.5, "Did you mean restitution?"),
    ("initial_axial_velocity", 1.0, "Set initial_with_platform to false"),
]


def test_wrong_parameters_change_nothing(make: Make) -> None:
    simulator = make()
    simulator.advance(0.5)
    before = state_of(simulator)
    for name, value, reason in WRONG_PARAMETERS:
        successful, given = set_one(simulator, name, value)
        assert not successful
        assert reason in given
        assert "\n" not in given
        assert state_of(simulator) == before
        if simulator.node.has_parameter(name):
            (result,) = simulator.node.set_parameters([Parameter(name, value=value)])
            assert not result.successful
            assert state_of(simulator) == before


def test_an_angle_can_be_given_as_a_part_of_pi(make: Make) -> None:
    simulator = make(initial_forcing_phase="0.5pi", phase_lag="-0.25pi")
    assert simulator.node.get_parameter("initial_forcing_phase").value == math.pi / 2
    assert simulator.motion.phase_lag == -math.pi / 4
    answer = "phase_lag acts at the next ~/reset"
    assert set_one(simulator, "phase_lag", "0.125pi") == (True, answer)
    assert simulator.node.get_parameter("phase_lag").value == math.pi / 8
    (result,) = simulator.node.set_parameters([Parameter("phase_lag", value="pi")])
    assert result.successful
    assert simulator.node.get_parameter("phase_lag").value == math.pi


def test_parameters_act_at_once_or_at_the_next_reset_and_say_so(make: Make) -> None:
    simulator = make(preset="pizza_multiple_toss", friction=0.25)
    node = simulator.node
    assert node.get_parameter("friction").value == 0.25  # beside a preset
    assert node.get_parameter("gravity").value == 10.0
    values = {"initial_height": 0.5, "frequency": 5.0, "restitution": 0.25, "preload": 1.0}
    result = node.set_parameters_atomically([Parameter(k, value=v) for k, v in values.items()])
    assert result.successful
    assert result.reason == "initial_height, frequency act at the next ~/reset"
    assert simulator.motion.frequency == 3.0
    assert node.run is not None
    disk = node.run.session.simulation.disk
    assert (disk.restitution, disk.preload) == (0.25, 1.0)
    assert set_one(simulator, "restitution", 1) == (True, "")
    assert node.get_parameter("restitution").value == 1.0
    assert set_one(simulator, "chatter_report_speed", 0.5)[0]
    assert node.run.session.simulation.chatter_report_speed == 0.5
    for name in ("friction", "mass", "preset"):
        result = node.set_parameters_atomically([Parameter(name)])
        assert result.reason.endswith("It cannot be deleted.")
        assert node.has_parameter(name)


def test_ranges_suit_sliders_and_refuse_nothing_that_is_allowed(make: Make) -> None:
    simulator = make()
    (bounds,) = simulator.node.describe_parameter("gravity").floating_point_range
    assert (bounds.from_value, bounds.to_value) == (0.0, 20.0)
    assert set_one(simulator, "gravity", 100.0) == (True, "")
    (bounds,) = simulator.node.describe_parameters(["gravity"])[0].floating_point_range
    assert (bounds.from_value, bounds.to_value) == (0.0, 200.0)


def test_use_sim_time_is_ignored_and_time_goes_on(make: Make) -> None:
    simulator = make(use_sim_time=True)
    node = simulator.node
    for _ in range(2):  # at the start, and when it is set
        assert node.get_parameter("use_sim_time").value is False
        assert node.get_clock().now().nanoseconds > 0  # nobody publishes /clock
        simulator.apply_impulse(0.01)
        assert set_one(simulator, "use_sim_time", True) == (True, "")
        assert node.set_parameters([Parameter("use_sim_time", value=True)])[0].successful


def test_what_a_run_is_made_of_can_be_set_while_unconfigured(make: Make) -> None:
    simulator = make(autostart=False)
    node = simulator.node
    for name, value in (("mass", 1.0), ("friction_radius", 0.1), ("gyration_radius", 0.2)):
        assert set_one(simulator, name, value) == (True, "")
    assert set_one(simulator, "initial_height", 0.5) == (True, "")  # the run begins with it
    assert set_one(simulator, "preset", "swum")[1].startswith("preset: got 'swum', allowed: no")
    assert node.trigger_configure() == SUCCESS
    assert node.run is not None
    assert node.run.session.simulation.disk.mass == 1.0
    refused = "mass: got 2.0, allowed: no change while it runs"
    assert set_one(simulator, "mass", 2.0)[1].startswith(refused)
    assert node.trigger_cleanup() == SUCCESS
    assert set_one(simulator, "mass", 2.0) == (True, "")


@pytest.mark.parametrize(
    "values",
    [
        {},
        {"lockstep": "tick", "lockstep_controllers": "1 2", "offset_limit": math.inf},
        {"lockstep": "impact", "lockstep_controllers": "7", "mass": 1e-6, "preload": 1e-07},
        {spec.name: spec.low for spec in TABLE.values() if spec.type is float and spec.low},
        {spec.name: spec.high for spec in TABLE.values() if spec.type is float and spec.high},
    ],
    ids=["defaults", "lockstep", "small", "lowest", "highest"],
)
def test_what_ros2_param_dump_writes_ros2_param_load_reads(
    make: Make, tmp_path: Path, values: dict[str, Any]
) -> None:
    """Also texts that it makes numbers or booleans of, and numbers that it makes texts of."""
    odd = {"initial_axial_velocity": 0.0, "real_time_factor": 1.0, "preload": 1e-07}
    simulator = make(autostart=False, **{**values, **{k: v for k, v in odd.items() if k in values}})
    node = simulator.node
    names = [*TABLE, "start_type_description_service"]
    before = {name: node.get_parameter(name).value for name in names}
    file = tmp_path / "dump.yaml"
    file.write_text(yaml.dump({"/bouncing_disk": {"ros__parameters": before}}))
    read = parameter_dict_from_yaml_file(str(file))
    for configured in (False, True):  # what is fixed then stays
        if configured:
            node.trigger_configure()
        for name, message in read.items():
            result = node.set_parameters_atomically([Parameter.from_parameter_msg(message)])
            assert result.successful, (name, message.value, result.reason)
    assert {name: node.get_parameter(name).value for name in names} == before


def test_a_new_rate_of_samples_acts_at_once(make: Make, monkeypatch: pytest.MonkeyPatch) -> None:
    times: list[int] = []
    monkeypatch.setattr(Outputs, "sample", lambda _, sample: times.append(sample.time_ns))
    simulator = make(state_rate=10.0)
    simulator.advance(1.0)
    assert set_one(simulator, "state_rate", 100.0) == (True, "")
    simulator.advance(0.03)
    assert [time_ns - NS for time_ns in times[-4:]] == [0, NS // 100, NS // 50, 3 * NS // 100]


# --- lifecycle ------------------------------------------------------------------------------------
def test_an_inactive_node_refuses_with_a_reason(make: Make) -> None:
    node = make(autostart=False, start_paused=False).node
    assert node.run is None
    with pytest.raises(InputError, match=r"while unconfigured.*configure, then activate"):
        node.arrival("~/pause")
    assert node.trigger_configure() == SUCCESS
    assert node.run is not None
    with pytest.raises(InputError, match=r"~/pause: got 'an input while inactive'.*activate"):
        node.run.pause(False)
    assert node.trigger_activate() == SUCCESS
    assert not node.run.session.paused


def test_deactivate_holds_and_cleanup_discards(make: Make) -> None:
    simulator = make()
    simulator.advance(1.0)
    node = simulator.node
    assert node.trigger_deactivate() == SUCCESS
    with pytest.raises(InputError):
        simulator.command(frequency=4.0)
    assert simulator.time == 1.0
    assert node.trigger_activate() == SUCCESS
    simulator.command(frequency=4.0)
    assert node.trigger_deactivate() == SUCCESS
    assert node.trigger_cleanup() == SUCCESS
    assert node.run is None
    assert node.trigger_configure() == SUCCESS
    assert node.trigger_activate() == SUCCESS
    assert simulator.time == 0.0
    assert node.trigger_shutdown() == SUCCESS
    assert node.finished


def test_ticks_begin_just_after_samples_are_due(make: Make) -> None:
    """After each resume, reset or change of a rate; else they came up to a period later."""
    simulator = make(start_paused=False)
    node, run = simulator.node, simulator.node.run
    assert run is not None

    def aligned() -> bool:
        timer = node.ticks._timer
        assert timer is not None
        next_ns = time.monotonic_ns() + timer.time_until_next_call()
        late_ns = next_ns - node._tick_plan().begin_before(next_ns)
        return -MARGIN_NS <= late_ns <= MARGIN_NS

    simulator.spin_until(aligned)
    for k in range(1, 6):
        run.pause(True)
        run.advance_to(run.session.time_ns + 1_700_000 * k)  # off the grid of samples
        run.pause(False)
        simulator.spin_until(aligned)
        values = {"state_rate": 130.0 + 40 * k, "real_time_factor": 1.0 - 0.1 * k}
        changes = [Parameter(name, value=value) for name, value in values.items()]
        assert node.set_parameters_atomically(changes).successful
        simulator.spin_until(aligned)
    run.reset()
    simulator.spin_until(aligned)


def test_the_clock_is_simulated_time_from_wall_time_on(make: Make) -> None:
    peer = Peer(without=())
    try:
        before = peer.now_ns()
        simulator = make(publish_clock=True, state_rate=10.0)
        simulator.wait_for_subscriber("joint_states")
        simulator.wait_for_subscriber("/clock")
        simulator.advance(2.0)

        run = simulator.node.run
        assert run is not None

        def clock() -> int:
            run.publish_state()  # /clock is best effort: publish it again until it is heard
            msgs = peer.heard["/clock"]
            return time_to_ns(msgs[-1].clock) if msgs else 0

        peer.spin_until(clock)
        first = clock()
        assert 0 <= first - 2 * NS - before < 30 * NS
        peer.spin_until(lambda: time_to_ns(peer.latest("joint_states").header.stamp) == first)
        simulator.advance(1.0)
        peer.spin_until(lambda: clock() == first + NS)
    finally:
        peer.close()
