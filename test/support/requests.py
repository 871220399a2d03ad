"""Requests of every kind to the services of a node, right or wrong, from several clients."""

from __future__ import annotations

import random
import time
from collections.abc import Callable, Iterator
from typing import Any

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
from std_srvs.srv import SetBool, Trigger
from type_description_interfaces.srv import GetTypeDescription

from bouncing_disk_ros.limits import REQUEST_ITEMS, REQUEST_TEXT
from support.processes import PATIENCE
from support.ros import Nodes

Make = Callable[[random.Random], Any]
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


def parameters(rng: random.Random) -> list[Parameter]:
    count = rng.choice([0, 1, 1, 2, 5, REQUEST_ITEMS + 1])
    return [Parameter(name=rng.choice(NAMES), value=value(rng)) for _ in range(count)]


def transition(rng: random.Random) -> Transition:
    number = rng.choice([one for one in TRANSITIONS if one not in BYE])
    return Transition(id=number, label=rng.choice(LABELS) if rng.random() < 0.3 else "")


def type_description(rng: random.Random) -> GetTypeDescription.Request:
    return GetTypeDescription.Request(
        type_name=rng.choice(["", "std_msgs/msg/String", "x" * (REQUEST_TEXT + 1)]),
        type_hash=rng.choice(["", "x", "RIHS01_" + "0" * 64]),
    )


OF_ANY_NODE: dict[str, tuple[type[Any], Make]] = {
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
        SetParameters, lambda rng: SetParameters.Request(parameters=parameters(rng))),
    "set_parameters_atomically": (
        SetParametersAtomically,
        lambda rng: SetParametersAtomically.Request(parameters=parameters(rng)),
    ),
    "get_type_description": (GetTypeDescription, type_description),
}  # fmt: skip
OF_RECORDER: dict[str, tuple[type[Any], Make]] = OF_ANY_NODE | {
    name: (Trigger, lambda _: Trigger.Request()) for name in ("pause", "resume", "split")
}
OF_SIMULATOR: dict[str, tuple[type[Any], Make]] = OF_ANY_NODE | {
    "change_state": (ChangeState, lambda rng: ChangeState.Request(transition=transition(rng))),
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

    def __init__(
        self, node: str, services: dict[str, tuple[type[Any], Make]], count: int = 5
    ) -> None:
        super().__init__()
        self._services, self._target = services, f"/{node}"
        for i in range(count):
            self.new_node(f"client_{i}")
        self._clients = [
            {
                name: one.create_client(kind, f"{self._target}/{name}")
                for name, (kind, _) in services.items()
            }
            for one in self.nodes
        ]
        for one, clients in zip(self.nodes, self._clients, strict=True):
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
                    future = self._clients[place][name].call_async(request)
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
