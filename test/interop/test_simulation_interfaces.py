"""The real types of simulation_interfaces: the standard services and the action over DDS.

Runs where that package is installed (`apt install ros-jazzy-simulation-interfaces`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import pytest

from support.processes import Starter
from support.ros_peer import Peer

pytestmark = pytest.mark.interop
OK = 1


class _Types:
    """A module of types, imported when the first of them is used: the tests skip without it."""

    def __init__(self, name: str) -> None:
        self._name = name

    def __getattr__(self, name: str) -> Any:
        if not name[0].isupper():  # pytest looks at what it collects
            raise AttributeError(name)
        return getattr(pytest.importorskip(self._name), name)


srv, actions = _Types("simulation_interfaces.srv"), _Types("simulation_interfaces.action")


@pytest.fixture
def call(start: Starter, ros_domain: int) -> Iterator[Callable[[str, Any], Any]]:
    """Call a service of a paused simulator by its name and a request."""
    pytest.importorskip("simulation_interfaces")
    start("simulator", "--ros-args", "-p", "start_paused:=true")
    peer = Peer()
    peer.settle()

    def one(name: str, request: Any) -> Any:
        kind = getattr(srv, type(request).__name__.removesuffix("_Request"))
        return peer.call(kind, name, request)

    one.peer = peer  # type: ignore[attr-defined]
    yield one
    peer.close()


def test_every_service_answers(call: Callable[[str, Any], Any]) -> None:
    features = call("get_simulator_features", srv.GetSimulatorFeatures.Request())
    assert list(features.features.features)
    state = call("get_simulation_state", srv.GetSimulationState.Request())
    assert (state.result.result, state.state.state) == (OK, 2)
    assert call("step_simulation", srv.StepSimulation.Request(steps=3)).result.result == OK
    disk = call("get_entity_state", srv.GetEntityState.Request(entity="disk"))
    assert (disk.result.result, disk.state.header.frame_id) == (OK, "world")
    request = srv.SetEntityState.Request(entity="disk", set_twist=True)
    request.state.twist.angular.z = 3.0
    assert call("set_entity_state", request).result.result == OK
    reset = srv.ResetSimulation.Request(scope=srv.ResetSimulation.Request.SCOPE_ALL)
    assert call("reset_simulation", reset).result.result == OK
    playing = srv.SetSimulationState.Request()
    playing.state.state = 1
    assert call("set_simulation_state", playing).result.result == OK


def test_the_action_steps_and_is_cancelled(call: Callable[[str, Any], Any]) -> None:
    from rclpy.action import ActionClient

    peer = call.peer  # type: ignore[attr-defined]
    client = ActionClient(peer.node, actions.SimulateSteps, "/bouncing_disk/simulate_steps")
    peer.spin_until(client.server_is_ready)
    heard: list[int] = []
    for steps, is_cancelled in ((5, False), (10**9, True)):
        heard.clear()
        sent = client.send_goal_async(
            actions.SimulateSteps.Goal(steps=steps),
            feedback_callback=lambda msg: heard.append(msg.feedback.completed_steps),
        )
        peer.spin_until(sent.done)
        goal = sent.result()
        if is_cancelled:
            peer.spin_until(lambda: heard)
            goal.cancel_goal_async()
        ended = goal.get_result_async()
        peer.spin_until(ended.done)
        assert ended.result().result.result.result == OK
        assert heard
    client.destroy()
