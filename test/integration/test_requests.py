"""Requests that fit and that do not, to every service of a simulator.

`make soak` asks ten thousand of them, of a recorder too.
"""

from __future__ import annotations

import ast
import signal
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState, GetState
from rcl_interfaces.msg import Parameter, ParameterValue
from rcl_interfaces.srv import DescribeParameters, SetParameters, SetParametersAtomically
from rclpy.lifecycle import LifecycleNode
from rclpy.node import Node
from std_srvs.srv import Trigger

import bouncing_disk_ros
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.limits import REQUEST_ITEMS
from bouncing_disk_ros.ros.requests import guard_services
from reference.cases import FIRST, examples
from support import requests
from support.coverage import in_soak
from support.live import LiveSimulators
from support.processes import Process, Starter
from support.ros_peer import Peer

SEED = FIRST or 20_240_607
COUNT = examples(100, 10_000)


@pytest.fixture
def clients(ros_domain: int) -> Iterator[Callable[..., requests.Clients]]:
    """Make clients, closed at the end."""
    made: list[requests.Clients] = []

    def make(*args: Any) -> requests.Clients:
        made.append(requests.Clients(*args))
        return made[-1]

    yield make
    for one in made:
        one.close()


def parameter(kind: int, name: str = "restitution", **content: Any) -> Parameter:
    return Parameter(name=name, value=ParameterValue(type=kind, **content))


def test_a_request_that_cannot_be_satisfied_is_answered_and_counted(
    live: LiveSimulators, peer: Peer, capfd: pytest.CaptureFixture[str]
) -> None:
    live(peer, crossfade_duration=0.1)
    peer.settle()
    for transition in (
        Transition(id=Transition.TRANSITION_ACTIVATE),  # it is active
        Transition(id=Transition.TRANSITION_CONFIGURE),
        Transition(id=77),
        Transition(label="cleanup"),
        Transition(label="nonsense"),
    ):
        answer = peer.call(ChangeState, "change_state", ChangeState.Request(transition=transition))
        assert not answer.success
    said = "refused: ~/change_state: got 'transition 3', allowed: from the state active: deactivate"
    assert said in capfd.readouterr().err
    assert peer.call(GetState, "get_state").current_state.label == "active"

    unknown, wrong = parameter(99), parameter(3, double_value=1.5)
    right = parameter(3, double_value=0.25)
    request = SetParameters.Request(parameters=[unknown, right, wrong])
    results = peer.call(SetParameters, "set_parameters", request).results
    assert [result.successful for result in results] == [False, True, False]
    assert results[0].reason.startswith("restitution: got 'a value of type 99', allowed: types")
    assert results[2].reason.startswith("restitution: got 1.5, allowed: a finite number")
    assert peer.wait_for_record("parameters")["values"] == {"restitution": 0.25}
    both = SetParametersAtomically.Request(parameters=[parameter(3, double_value=0.5), unknown])
    result = peer.call(SetParametersAtomically, "set_parameters_atomically", both).result
    assert not result.successful
    assert "type 99" in result.reason

    many = DescribeParameters.Request(names=["restitution"] * (REQUEST_ITEMS + 1))
    assert peer.call(DescribeParameters, "describe_parameters", many).descriptors == []
    peer.next_diagnostics()
    assert peer.diagnostic("inputs")[2]["refused"] == "9"
    assert [record["kind"] for record in peer.records].count("parameters") == 1


def test_no_error_of_a_callback_or_of_its_answer_reaches_the_executor() -> None:
    """It would end the node: rclpy raises it where the node spins."""

    def fails(*_: Any) -> Any:
        raise ZeroDivisionError("by hand")

    service = SimpleNamespace(
        callback=fails, send_response=fails, srv_type=Trigger, srv_name="/disk/boom"
    )
    refused: list[InputError] = []
    guard_services(cast("Node", SimpleNamespace(services=[service])), refused.append)
    answer = service.callback(Trigger.Request(), Trigger.Response())
    service.send_response(answer, None)
    assert not answer.success
    assert "~/boom: got 'a request that ended in ZeroDivisionError'" in answer.message
    assert [error.given for error in refused] == [
        "a request that ended in ZeroDivisionError", "a client"
    ]  # fmt: skip


@pytest.mark.parametrize("node", ["simulator", *in_soak("recorder")])
def test_every_request_is_answered(
    start: Starter, clients: Callable[..., requests.Clients], tmp_path: Path, node: str
) -> None:
    if node == "simulator":
        process = start(node, "--ros-args", "-p", "crossfade_duration:=0.1")
        asked = clients("bouncing_disk", requests.OF_SIMULATOR)
    else:
        process = start(node, str(tmp_path / "run"))
        asked = clients(node, requests.OF_RECORDER)
    answers = asked.ask(SEED, COUNT)
    assert sum(map(len, answers.values())) == COUNT
    requests.check_answers(answers)
    ended_well(process)


def ended_well(process: Process) -> None:
    assert process.running, process.output
    assert process.end(signal.SIGINT) == 0
    assert "Traceback" not in process.output


def test_no_node_hides_what_rclpy_keeps_under_the_same_name(ros_domain: int) -> None:
    """A recorder that kept something in `_parameters` was ended by a request for a parameter."""
    import rclpy

    context = rclpy.Context()
    rclpy.init(context=context)
    node = LifecycleNode("any", context=context)
    theirs = set(vars(node))
    node.destroy_node()
    rclpy.shutdown(context=context)
    for file in (Path(bouncing_disk_ros.__file__).parent / "nodes").rglob("*.py"):
        for made in ast.walk(ast.parse(file.read_text("utf-8"))):
            if isinstance(made, ast.ClassDef) and any("Node" in ast.unparse(b) for b in made.bases):
                ours = {
                    one.attr
                    for one in ast.walk(made)
                    if isinstance(one, ast.Attribute)
                    and isinstance(one.ctx, ast.Store)
                    and ast.unparse(one.value) == "self"
                }
                assert not ours & theirs, made.name
