"""Requests that fit and that do not, to every service of a simulator.

`make soak` asks ten thousand of them, of a recorder too.
"""

from __future__ import annotations

import ast
import random
import signal
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState, GetAvailableStates, GetAvailableTransitions, GetState
from rcl_interfaces.msg import Parameter, ParameterValue
from rcl_interfaces.srv import (
    DescribeParameters,
    GetParameters,
    GetParameterTypes,
    ListParameters,
    SetParameters,
    SetParametersAtomically,
)
from rclpy.lifecycle import LifecycleNode
from rclpy.node import Node
from std_srvs.srv import SetBool, Trigger
from type_description_interfaces.srv import GetTypeDescription

import bouncing_disk_ros
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.limits import REQUEST_ITEMS, REQUEST_TEXT
from bouncing_disk_ros.ros.requests import guard_services
from reference.cases import FIRST, examples, in_soak
from support.processes import PATIENCE, Process, Starter
from support.ros import Nodes
from support.ros_peer import Peer

SEED = FIRST or 20_240_607
COUNT = examples(100, 10_000)


# --- random requests ------------------------------------------------------------------------------
Service = tuple[type[Any], Callable[[random.Random], Any]]
Services = dict[str, Service]
NAMES = ["restitution", "friction", "mass", "preset", "use_sim_time", "axial_amplitude",
         "frequency", "state_rate", "step_periods", "start_type_description_service",
         "output", "queue_size",
         "", "none", "a" * 300, "ä\x01", "qos_overrides.x"]  # fmt: skip
TRANSITIONS = [*range(10), 50, 60, 61, 62, 97, 98, 99, 255, *[1, 3] * 6]
LABELS = ["configure", "activate", "deactivate", "cleanup", "transition_success", "nonsense"]
BYE = {Transition.TRANSITION_UNCONFIGURED_SHUTDOWN, Transition.TRANSITION_INACTIVE_SHUTDOWN,
       Transition.TRANSITION_ACTIVE_SHUTDOWN}  # fmt: skip
"""Transitions that end the node, in order: what is asked after them has no answer."""


def value(rng: random.Random) -> ParameterValue:
    """A value of any type, known or not, with any content."""
    return ParameterValue(
        type=rng.choice([*range(11), 99, 255]),
        bool_value=rng.random() < 0.5,
        integer_value=rng.choice([0, 1, -1, 2**63 - 1, -(2**63)]),
        double_value=rng.choice([0.0, 0.5, 1.0, -1.0, float("nan"), float("inf"), 1e308]),
        string_value=rng.choice(["", "x", "0.5pi", "nan", "x" * (REQUEST_TEXT + 1)]),
        byte_array_value=[b"a"] * rng.choice([0, 3]),
        double_array_value=[1.0] * rng.choice([0, 2, REQUEST_ITEMS + 1]),
        string_array_value=["a"] * rng.choice([0, 2]),
    )


def names(rng: random.Random) -> list[str]:
    return [rng.choice(NAMES) for _ in range(rng.choice([0, 1, 2, 10, REQUEST_ITEMS + 1]))]


def some_parameters(rng: random.Random) -> list[Parameter]:
    count = rng.choice([0, 1, 1, 2, 5, REQUEST_ITEMS + 1])
    return [Parameter(name=rng.choice(NAMES), value=value(rng)) for _ in range(count)]


def a_transition(rng: random.Random) -> Transition:
    number = rng.choice([one for one in TRANSITIONS if one not in BYE])
    return Transition(id=number, label=rng.choice(LABELS) if rng.random() < 0.3 else "")


def type_description(rng: random.Random) -> GetTypeDescription.Request:
    return GetTypeDescription.Request(
        type_name=rng.choice(["", "std_msgs/msg/String", "x" * (REQUEST_TEXT + 1)]),
        type_hash=rng.choice(["", "x", "RIHS01_" + "0" * 64]),
    )


OF_ANY_NODE: Services = {
    "describe_parameters": (
        DescribeParameters, lambda rng: DescribeParameters.Request(names=names(rng))),
    "get_parameters": (GetParameters, lambda rng: GetParameters.Request(names=names(rng))),
    "get_parameter_types": (
        GetParameterTypes, lambda rng: GetParameterTypes.Request(names=names(rng))),
    "list_parameters": (
        ListParameters,
        lambda rng: ListParameters.Request(
            prefixes=names(rng), depth=rng.choice([0, 1, 2**64 - 1])),
    ),
    "set_parameters": (
        SetParameters, lambda rng: SetParameters.Request(parameters=some_parameters(rng))),
    "set_parameters_atomically": (
        SetParametersAtomically,
        lambda rng: SetParametersAtomically.Request(parameters=some_parameters(rng)),
    ),
    "get_type_description": (GetTypeDescription, type_description),
}  # fmt: skip
OF_RECORDER: Services = OF_ANY_NODE | {
    name: (Trigger, lambda _: Trigger.Request()) for name in ("pause", "resume", "split")
}
OF_SIMULATOR: Services = OF_ANY_NODE | {
    "change_state": (ChangeState, lambda rng: ChangeState.Request(transition=a_transition(rng))),
    "get_state": (GetState, lambda _: GetState.Request()),
    "get_available_states": (GetAvailableStates, lambda _: GetAvailableStates.Request()),
    "get_available_transitions": (
        GetAvailableTransitions, lambda _: GetAvailableTransitions.Request()),
    "get_transition_graph": (
        GetAvailableTransitions, lambda _: GetAvailableTransitions.Request()),
    "pause": (SetBool, lambda rng: SetBool.Request(data=rng.random() < 0.5)),
    "step": (Trigger, lambda _: Trigger.Request()),
    "reset": (Trigger, lambda _: Trigger.Request()),
}  # fmt: skip


class Clients(Nodes):
    """Some clients of one node, each a node of its own; each waits for an answer before it asks."""

    def __init__(self, node: str, services: Services, count: int = 5) -> None:
        super().__init__()
        self._services, self._target = services, f"/{node}"
        for i in range(count):
            self.new_node(f"client_{i}")
        self._of_each = [
            {
                name: one.create_client(kind, f"{self._target}/{name}")
                for name, (kind, _) in services.items()
            }
            for one in self.nodes
        ]
        for one, clients in zip(self.nodes, self._of_each, strict=True):
            for name, client in clients.items():
                self.spin_until(client.service_is_ready, what=name)
            self.meet(one, self._target)

    def ask(self, seed: int, count: int) -> dict[str, list[tuple[Any, Any]]]:
        """Ask so often in all; requests with answers by service. AssertionError for a lost one."""
        rng = random.Random(seed)
        todo: Iterator[int] = iter(range(count))
        open_: list[tuple[str, Any, Any, float] | None] = [None] * len(self.nodes)
        answers: dict[str, list[tuple[Any, Any]]] = {name: [] for name in self._services}
        left = count
        while left:
            for place, one in enumerate(open_):
                if one is None and next(todo, None) is not None:
                    name = rng.choice(list(self._services))
                    request = self._services[name][1](rng)
                    future = self._of_each[place][name].call_async(request)
                    open_[place] = (name, request, future, time.monotonic())
                elif one is not None:
                    name, request, future, since = one
                    if future.done():
                        answers[name].append((request, future.result()))
                        open_[place] = None
                        left -= 1
                    late = time.monotonic() > since + PATIENCE
                    assert not late, f"seed {seed}: no answer to {name}: {str(request)[:500]}"
            self.executor.spin_once(timeout_sec=0.01)
        return answers


def check_answers(answers: dict[str, list[tuple[Any, Any]]]) -> None:
    """An answer has as many results as its request has parameters, and each refusal a reason."""
    for request, answer in answers["set_parameters"]:
        assert len(answer.results) == len(request.parameters)
        assert all(result.successful or result.reason for result in answer.results)
    for _, answer in answers["set_parameters_atomically"]:
        assert answer.result.successful or answer.result.reason


# --- the nodes ------------------------------------------------------------------------------------
@pytest.fixture
def clients(ros_domain: int) -> Iterator[Callable[..., Clients]]:
    """Make clients, closed at the end."""
    made: list[Clients] = []

    def make(*args: Any) -> Clients:
        made.append(Clients(*args))
        return made[-1]

    yield make
    for one in made:
        one.close()


def parameter(kind: int, name: str = "restitution", **content: Any) -> Parameter:
    return Parameter(name=name, value=ParameterValue(type=kind, **content))


def test_a_request_that_cannot_be_satisfied_is_answered_and_counted(
    peer: Peer, capfd: pytest.CaptureFixture[str]
) -> None:
    peer.simulator(crossfade_duration=0.1)
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
    start: Starter, clients: Callable[..., Clients], tmp_path: Path, node: str
) -> None:
    if node == "simulator":
        process = start(node, "--ros-args", "-p", "crossfade_duration:=0.1")
        asked = clients("bouncing_disk", OF_SIMULATOR)
    else:
        process = start(node, str(tmp_path / "run"))
        asked = clients(node, OF_RECORDER)
    answers = asked.ask(SEED, COUNT)
    assert sum(map(len, answers.values())) == COUNT
    check_answers(answers)
    ended_well(process)


def ended_well(process: Process) -> None:
    assert process.running, process.output
    assert process.end(signal.SIGINT) == 0
    assert "Traceback" not in process.output


def test_no_node_hides_what_rclpy_keeps_under_the_same_name(ros_domain: int) -> None:
    """A recorder that kept something in `_parameters` was ended by a request for a parameter."""
    nodes = Nodes()
    nodes.add(LifecycleNode("any", context=nodes.context))
    theirs = set(vars(nodes.nodes[0]))
    nodes.close()
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
