"""The simulator as a process of its own: its start, its end, and what only a process can lose."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from rclpy.parameter import Parameter
from std_msgs.msg import Float64
from std_srvs.srv import SetBool, Trigger

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.nodes.simulator.simulator_node import SimulatorNode
from bouncing_disk_ros.ros.from_messages import time_to_ns
from reference.cases import in_soak
from support.processes import Process, Starter, any_ends, ends
from support.ros_peer import Peer


@pytest.fixture
def peers(ros_domain: int) -> Iterator[Callable[..., Peer]]:
    """Make peers, closed at the end."""
    made: list[Peer] = []

    def make(*args: Any, **kwargs: Any) -> Peer:
        made.append(Peer(*args, **kwargs))
        return made[-1]

    yield make
    for peer in made:
        peer.close()


def simulator(start: Starter, *parameters: str, arguments: tuple[str, ...] = ()) -> Process:
    """Start a simulator with parameters name:=value."""
    given = [part for parameter in parameters for part in ("-p", parameter)]
    return start("simulator", "--ros-args", *given, *arguments)


def test_commands_lost_are_counted_and_a_signal_ends_a_step_that_would_take_hours(
    start: Starter, peer: Peer
) -> None:
    process = simulator(start, "step_periods:=1000000", "restitution:=0.99")
    peer.settle()
    peer.publish("platform/axial_amplitude", Float64(data=0.03))
    peer.wait_for_record("motion")
    publisher = peer.publisher("platform/axial_amplitude")  # a stopped process is soon not heard of
    process.send(signal.SIGSTOP)
    for number in range(400):  # more than reader and writer hold
        publisher.publish(Float64(data=0.03 + 1e-6 * number))
    process.send(signal.SIGCONT)

    def counted() -> tuple[int, str]:
        values = peer.diagnostic("inputs")[2]
        return int(values["accepted"]) - 1, values["commands lost on the way"]  # 1: it was let go

    peer.spin_until(lambda: counted()[0] + int(counted()[1]) == 401)
    assert int(counted()[1]) > 0
    process.wait_for("inputs: .*; [0-9]+ commands were lost on the way: send them more slowly")
    assert peer.call(SetBool, "pause", SetBool.Request(data=True)).success
    client = peer.node.create_client(Trigger, "bouncing_disk/step")
    peer.spin_until(client.service_is_ready)
    client.call_async(Trigger.Request())
    rows = len(peer.rows)
    peer.spin_until(lambda: len(peer.rows) > rows + 100)
    assert process.end(signal.SIGTERM) == 0
    assert "Traceback" not in process.output
    assert "rror" not in process.stderr


def test_a_lifecycle_shutdown_ends_the_process(start: Starter, peer: Peer) -> None:
    from lifecycle_msgs.msg import Transition
    from lifecycle_msgs.srv import ChangeState

    process = simulator(start, "autostart:=false")
    request = ChangeState.Request()
    request.transition.id = Transition.TRANSITION_CONFIGURE
    assert peer.call(ChangeState, "change_state", request).success
    peer.publish("platform/frequency", Float64(data=2.0))
    process.wait_for("refused: platform/frequency: got 'an input while inactive'")
    request.transition.id = Transition.TRANSITION_INACTIVE_SHUTDOWN
    assert peer.call(ChangeState, "change_state", request).success
    assert process.wait() == 0


@pytest.mark.parametrize("again", [0, *in_soak(*range(1, 20))])
def test_of_simulators_that_publish_the_clock_one_runs(
    start: Starter, peers: Callable[..., Peer], again: int
) -> None:
    """Of two that are started together one ends with the reason; one that comes later never runs.

    The clock of the one that stays never goes back: not by a reset, nor as others come and go.
    """
    listeners = {name: peers(name, without=()) for name in ("first", "second")}
    # a clock that is set anew by wall time would go back by a reset
    given = ("publish_clock:=true", "real_time_factor:=2.0")
    made = [simulator(start, *given, arguments=("-r", f"__ns:=/{name}")) for name in listeners]
    any_ends(made)
    pairs = zip(listeners, made, strict=True)
    ((left, stays),) = ((name, one) for name, one in pairs if one.running)
    (ended,) = (one for one in made if not one.running)
    assert ended.wait() == 2
    refused = "publish_clock: got True, allowed: false: /clock has a"
    assert ended.complaints[-1].startswith(f"simulator: {refused}")
    peer = listeners[left]
    peer.spin_until(lambda: peer.node.count_publishers("/clock") == 1)
    clocks = peer.heard["/clock"]
    clocks.clear()
    for _ in range(2):
        assert peer.call(Trigger, "reset").success
        with pytest.raises(InputError, match=refused):
            SimulatorNode(
                "third",
                context=peer.context,
                use_global_arguments=False,
                parameter_overrides=[Parameter("publish_clock", value=True)],
            )
    peer.spin_until(lambda: len(clocks) > 50)
    times = [time_to_ns(msg.clock) for msg in clocks]
    assert times == sorted(times)
    assert stays.end() == 0
    warned = "another node publishes /clock"  # while the others are there
    assert not [one for one in stays.complaints_but_late if warned not in one]


def test_help_shows_every_parameter_topic_and_service(capfd: pytest.CaptureFixture[str]) -> None:
    from bouncing_disk_ros.parameters import TABLE
    from bouncing_disk_ros.topics import SERVICES, TOPICS

    code, out, _ = ends(capfd, "simulator", "--help")
    assert code == 0
    for name in (*TABLE, *TOPICS, *SERVICES):
        assert name in out
