"""The services of simulation_interfaces on a stepped simulator, with stand-ins for its types.

The package is not on PyPI. Fields and constants are those of the published .msg, .srv and .action
files of 1.5.1 (of Jazzy) and 2.1.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Coroutine
from types import SimpleNamespace
from typing import Any

import pytest
from geometry_msgs.msg import Accel, Pose, Twist
from std_msgs.msg import Header

from bouncing_disk_ros.nodes.simulator.standard_services import (
    FEATURES,
    StandardServices,
    installed_types,
)
from bouncing_disk_ros.run import control
from bouncing_disk_ros.testing import SteppedSimulator


class Result:
    RESULT_FEATURE_UNSUPPORTED, RESULT_OK, RESULT_NOT_FOUND = 0, 1, 2
    RESULT_INCORRECT_STATE, RESULT_OPERATION_FAILED = 3, 4

    def __init__(self) -> None:
        self.result, self.error_message = 0, ""


class SimulationState:
    STATE_STOPPED, STATE_PLAYING, STATE_PAUSED, STATE_QUITTING = 0, 1, 2, 3
    STATE_NO_WORLD, STATE_LOADING_WORLD = 4, 5

    def __init__(self, state: int = 0) -> None:
        self.state = state


class SimulatorFeatures:
    SPAWNING, ENTITY_STATE_GETTING, ENTITY_STATE_SETTING = 0, 10, 11
    SIMULATION_RESET, SIMULATION_RESET_TIME, SIMULATION_RESET_STATE = 20, 21, 22
    SIMULATION_RESET_SPAWNED = 23
    SIMULATION_STATE_GETTING, SIMULATION_STATE_SETTING, SIMULATION_STATE_PAUSE = 24, 25, 26
    STEP_SIMULATION_SINGLE, STEP_SIMULATION_MULTIPLE, STEP_SIMULATION_ACTION = 31, 32, 33

    def __init__(self) -> None:
        self.features: list[int] = []
        self.spawn_formats: list[str] = []
        self.custom_info = ""


class EntityState:
    def __init__(self) -> None:
        self.header, self.pose, self.twist, self.acceleration = Header(), Pose(), Twist(), Accel()


class Answer(SimpleNamespace):
    """A response of any service, with the constants of SetSimulationState_Response."""

    ALREADY_IN_TARGET_STATE, STATE_TRANSITION_ERROR = 101, 102

    def __init__(self, **fields: Any) -> None:
        super().__init__(result=Result(), **fields)


class ResetRequest:
    """ResetSimulation_Request."""

    SCOPE_DEFAULT, SCOPE_TIME, SCOPE_STATE, SCOPE_SPAWNED, SCOPE_ALL = 0, 1, 2, 4, 255

    def __init__(self, scope: int = 0) -> None:
        self.scope = scope


class OldSetEntityRequest:
    """SetEntityState_Request of 1.5.1, which sets the whole state."""

    def __init__(self, entity: str) -> None:
        self.entity, self.state = entity, EntityState()


class SetEntityRequest(OldSetEntityRequest):
    """SetEntityState_Request."""

    def __init__(self, entity: str, **flags: bool) -> None:
        super().__init__(entity)
        self.set_pose = flags.get("set_pose", False)
        self.set_twist = flags.get("set_twist", False)
        self.set_acceleration = flags.get("set_acceleration", False)


def entities_request(name: str = "", **filters: Any) -> Any:
    """GetEntities_Request."""
    tags = SimpleNamespace(tags=filters.get("tags", []), filter_mode=0)
    bounds = SimpleNamespace(type=filters.get("bounds", 0), points=[])
    categories = filters.get("categories", [])
    return SimpleNamespace(
        filters=SimpleNamespace(filter=name, categories=categories, tags=tags, bounds=bounds)
    )


class Goal:
    """A goal handle of the action, as rclpy's ServerGoalHandle."""

    def __init__(self, steps: int) -> None:
        self.request = SimpleNamespace(steps=steps)
        self.is_cancel_requested = False
        self.feedback: list[tuple[int, int]] = []
        self.ends: list[str] = []
        self.succeed = lambda: self.ends.append("succeeded")
        self.canceled = lambda: self.ends.append("cancelled")
        self.abort = lambda: self.ends.append("aborted")

    def publish_feedback(self, feedback: Any) -> None:
        self.feedback.append((feedback.completed_steps, feedback.remaining_steps))


TYPES: Any = SimpleNamespace(
    msg=SimpleNamespace(
        Result=Result, SimulationState=SimulationState, SimulatorFeatures=SimulatorFeatures
    ),
    srv=SimpleNamespace(),  # requests and responses are made by the tests
    action=SimpleNamespace(SimulateSteps=SimpleNamespace(Result=Answer, Feedback=SimpleNamespace)),
)


# --- the services ---------------------------------------------------------------------------------
Make = Callable[..., tuple[SteppedSimulator, StandardServices]]


@pytest.fixture
def make(make: Callable[..., SteppedSimulator]) -> Make:
    """A stepped simulator and the services on it."""

    def one(**values: Any) -> tuple[SteppedSimulator, StandardServices]:
        simulator = make(**values)
        return simulator, StandardServices(simulator.node, TYPES)

    return one


def set_state(services: StandardServices, state: int) -> Result:
    request = SimpleNamespace(state=SimulationState(state))
    result: Result = services.set_state(request, Answer()).result
    return result


def state_of(services: StandardServices) -> int:
    return int(services.get_state(None, Answer(state=SimulationState())).state.state)


def entity_of(services: StandardServices, name: str) -> EntityState:
    """The state of the disk or the platform."""
    answer = Answer(state=EntityState())
    state: EntityState = services.get_entity_state(SimpleNamespace(entity=name), answer).state
    return state


def finish(services: StandardServices, work: Coroutine[Any, Any, Any], tick: Any) -> Any:
    """Run a coroutine; `tick` between its turns."""
    for _ in range(100_000):
        try:
            work.send(None)
        except StopIteration as end:
            return end.value
        tick()
        services.on_tick()
    raise AssertionError("it does not end")


def test_features_are_known_ones(make: Make) -> None:
    _, services = make()
    features = services.get_features(None, Answer(features=SimulatorFeatures())).features
    assert features.features == [getattr(SimulatorFeatures, name) for name in FEATURES]
    assert SimulatorFeatures.SIMULATION_RESET_TIME in features.features
    assert "platform" in features.custom_info


def test_play_pause_and_stop(make: Make) -> None:
    simulator, services = make()
    assert state_of(services) == SimulationState.STATE_PAUSED
    simulator.advance(0.5)
    assert set_state(services, SimulationState.STATE_PLAYING).result == Result.RESULT_OK
    assert state_of(services) == SimulationState.STATE_PLAYING
    again = set_state(services, SimulationState.STATE_PLAYING)
    assert again.result == Answer.ALREADY_IN_TARGET_STATE
    assert set_state(services, SimulationState.STATE_PAUSED).result == Result.RESULT_OK
    simulator.command(frequency=5.0)
    assert set_state(services, SimulationState.STATE_STOPPED).result == Result.RESULT_OK
    assert state_of(services) == SimulationState.STATE_STOPPED
    assert simulator.motion.frequency == 3.0
    stopped = set_state(services, SimulationState.STATE_STOPPED)
    assert stopped.result == Answer.ALREADY_IN_TARGET_STATE
    assert set_state(services, SimulationState.STATE_PAUSED).result == Result.RESULT_OK
    assert state_of(services) == SimulationState.STATE_PAUSED


def test_what_cannot_be_set_or_reset_says_so(make: Make) -> None:
    simulator, services = make()
    unsupported = Result.RESULT_FEATURE_UNSUPPORTED
    assert set_state(services, SimulationState.STATE_NO_WORLD).result == unsupported
    reset = services.reset(ResetRequest(ResetRequest.SCOPE_SPAWNED), Answer())
    assert reset.result.result == unsupported
    for flag in ("set_pose", "set_acceleration"):
        request = SetEntityRequest("disk", **{flag: True})
        assert services.set_entity_state(request, Answer()).result.result == unsupported
    request = SetEntityRequest("platform", set_twist=True)
    assert services.set_entity_state(request, Answer()).result.result == unsupported
    unknown = SetEntityRequest("table", set_twist=True)
    for answer in (
        services.set_entity_state(unknown, Answer()),
        services.get_entity_state(unknown, Answer(state=EntityState())),
    ):
        assert answer.result.result == Result.RESULT_NOT_FOUND
        assert "disk and platform" in answer.result.error_message
    assert simulator.time == 0.0


def test_an_inactive_node_is_in_the_wrong_state(make: Make) -> None:
    _, services = make(autostart=False)
    assert state_of(services) == SimulationState.STATE_NO_WORLD
    wrong = Result.RESULT_INCORRECT_STATE
    assert set_state(services, SimulationState.STATE_PLAYING).result == wrong
    steps = SimpleNamespace(steps=1)
    assert services.step(steps, Answer()).result.result == wrong
    assert services.reset(ResetRequest(), Answer()).result.result == wrong
    disk = SimpleNamespace(entity="disk")
    assert services.get_entity_state(disk, Answer(state=EntityState())).result.result == wrong


def test_a_reset_of_everything_begins_a_new_run(make: Make) -> None:
    simulator, services = make()
    simulator.advance(1.0)
    reset = services.reset(ResetRequest(ResetRequest.SCOPE_STATE), Answer())
    assert (reset.result.result, simulator.time) == (Result.RESULT_OK, 1.0)
    for scope in (ResetRequest.SCOPE_DEFAULT, ResetRequest.SCOPE_TIME):
        assert services.reset(ResetRequest(scope), Answer()).result.result == Result.RESULT_OK
        assert simulator.time == 0.0
        simulator.advance(0.5)
    assert simulator.node.run is not None
    assert simulator.node.run.active


def test_steps_are_periods_and_long_ones_end_where_they_are(
    make: Make, monkeypatch: pytest.MonkeyPatch
) -> None:
    simulator, services = make(step_periods=2)
    with monkeypatch.context() as patch:  # a busy machine may need longer than the service waits
        patch.setattr(control, "STEP_NS", 10**11)
        answer = services.step(SimpleNamespace(steps=3), Answer())
    assert (answer.result.result, simulator.time) == (Result.RESULT_OK, 2.0)
    answer = services.step(SimpleNamespace(steps=2**64 - 1), Answer())
    assert answer.result.result == Result.RESULT_OPERATION_FAILED
    assert "simulate_steps" in answer.result.error_message
    assert simulator.node.run is not None
    assert not simulator.node.run.stepping
    set_state(services, SimulationState.STATE_PLAYING)
    answer = services.step(SimpleNamespace(steps=1), Answer())
    assert answer.result.result == Result.RESULT_OPERATION_FAILED
    assert "Pause first" in answer.result.error_message


def test_the_action_steps_with_feedback(make: Make) -> None:
    simulator, services = make()
    run = simulator.node.run
    assert run is not None
    goal = Goal(5)
    answer = finish(services, services.simulate_steps(goal), lambda: run.tick(0))
    assert answer.result.result == Result.RESULT_OK
    assert goal.feedback == [(k, 5 - k) for k in range(1, 6)]
    assert goal.ends == ["succeeded"]
    assert simulator.time == pytest.approx(5 / 3, abs=1e-9)


def test_a_long_action_goes_on_in_the_ticks_and_a_cancel_pauses_it(make: Make) -> None:
    simulator, services = make(frequency=1e-6)
    run = simulator.node.run
    assert run is not None
    goal, ticks = Goal(2), []

    def tick() -> None:
        ticks.append(run.session.time_ns)
        run.tick(0)
        goal.is_cancel_requested = len(ticks) == 3

    answer = finish(services, services.simulate_steps(goal), tick)
    assert goal.ends == ["cancelled"]
    assert goal.feedback == []
    assert answer.result.result == Result.RESULT_OK
    assert len(set(ticks)) == 3
    assert not run.stepping


def test_an_action_whose_step_another_ends_is_aborted(make: Make) -> None:
    simulator, services = make(frequency=1e-6)
    run = simulator.node.run
    assert run is not None
    goal = Goal(2)
    answer = finish(services, services.simulate_steps(goal), lambda: run.pause(True))
    assert goal.ends == ["aborted"]
    assert "another request has ended the step" in answer.result.error_message


def test_the_state_of_the_entities(make: Make) -> None:
    simulator, services = make(initial_height=0.5, initial_angle=1.0, initial_angular_velocity=2.0)
    simulator.advance(0.125)
    sample = simulator.state
    disk = entity_of(services, "disk")
    assert disk.pose.position.z == sample.axial_position
    assert 2 * math.atan2(disk.pose.orientation.z, disk.pose.orientation.w) == pytest.approx(1.25)
    assert (disk.twist.linear.z, disk.twist.angular.z) == (sample.axial_velocity, 2.0)
    assert disk.acceleration.linear.z == pytest.approx(-9.80665, rel=1e-12)
    assert disk.header.frame_id == "world"
    platform = entity_of(services, "platform")
    assert platform.pose.position.z == sample.platform_position
    assert platform.twist.angular.z == sample.platform_angular_velocity


def test_a_disk_at_rest_moves_as_the_platform_does(make: Make) -> None:
    simulator, services = make(axial_amplitude=0.001)
    simulator.advance(0.1)
    disk = entity_of(services, "disk")
    omega = 6 * math.pi
    assert disk.acceleration.linear.z == pytest.approx(
        -(omega**2) * simulator.state.platform_position, rel=1e-9
    )


def test_the_twist_of_the_disk_is_set_by_an_impulse_on_record(make: Make) -> None:
    simulator, services = make(initial_height=0.5)
    simulator.advance(0.125)
    request = SetEntityRequest("disk", set_twist=True)
    request.state.twist.linear.z, request.state.twist.angular.z = 1.5, -2.0
    assert services.set_entity_state(request, Answer()).result.result == Result.RESULT_OK
    assert simulator.state.axial_velocity == pytest.approx(1.5, rel=1e-14)
    assert simulator.state.angular_velocity == pytest.approx(-2.0, rel=1e-14)
    request.state.twist.linear.x = 1.0
    answer = services.set_entity_state(request, Answer())
    assert answer.result.result == Result.RESULT_OPERATION_FAILED
    assert "The disk moves along and about z only" in answer.result.error_message


def test_the_older_version_sets_the_twist_and_no_other_pose(make: Make) -> None:
    """Its request has no flags: a pose left out, or the present one, is not set."""
    simulator, services = make(initial_height=0.5)
    simulator.advance(0.125)
    present = entity_of(services, "disk")
    request = OldSetEntityRequest("disk")
    for pose in (request.state.pose, present.pose):
        request.state.pose = pose
        request.state.twist.linear.z += 1.0
        assert services.set_entity_state(request, Answer()).result.result == Result.RESULT_OK
        assert simulator.state.axial_velocity == pytest.approx(request.state.twist.linear.z)
    request.state.pose.position.z += 0.1
    answer = services.set_entity_state(request, Answer())
    assert answer.result.result == Result.RESULT_FEATURE_UNSUPPORTED
    assert "leave the pose out" in answer.result.error_message


@pytest.mark.parametrize("kind", [OldSetEntityRequest, SetEntityRequest])
def test_frames_have_their_prefix_and_others_are_refused(make: Make, kind: type[Any]) -> None:
    _, services = make(frame_prefix="left/", world_frame="map")
    for entity in ("disk", "platform"):
        state = entity_of(services, entity)
        assert state.header.frame_id == "left/map"
    request = kind("disk")
    request.set_twist = True
    for frame, code in (
        ("", Result.RESULT_OK),
        ("left/map", Result.RESULT_OK),
        ("left/disk", Result.RESULT_FEATURE_UNSUPPORTED),
        ("world", Result.RESULT_FEATURE_UNSUPPORTED),
    ):
        request.state.header.frame_id = frame
        answer = services.set_entity_state(request, Answer())
        assert answer.result.result == code, answer.result.error_message


def test_entities_are_listed_by_their_names(make: Make) -> None:
    _, services = make()

    def listed(name: str = "", **filters: Any) -> Answer:
        answer: Answer = services.get_entities(
            entities_request(name, **filters), Answer(entities=[])
        )
        return answer

    assert listed().entities == ["disk", "platform"]
    assert listed("^pla.*m$").entities == ["platform"]
    assert listed("table").entities == []
    failed, unsupported = Result.RESULT_OPERATION_FAILED, Result.RESULT_FEATURE_UNSUPPORTED
    assert listed("(").result.result == failed
    assert listed("(((((((((a+)+)+)+)+)+)+)+)+)$").entities == []
    for filters in ({"categories": [1]}, {"tags": ["round"]}, {"bounds": 3}):
        assert listed(**filters).result.result == unsupported


def test_quitting_ends_the_process(make: Make) -> None:
    simulator, services = make()
    assert set_state(services, SimulationState.STATE_QUITTING).result == Result.RESULT_OK
    assert simulator.node.finished


def test_without_the_package_nothing_changes(make: Make, monkeypatch: pytest.MonkeyPatch) -> None:
    for kind in ("", ".msg", ".srv", ".action"):
        monkeypatch.setitem(sys.modules, f"simulation_interfaces{kind}", None)
    assert installed_types() is None
    simulator, _ = make()
    names = {service.srv_name for service in simulator.node.services}
    assert not {name for name in names if "simulation" in name or "entity" in name}
