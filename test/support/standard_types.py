"""Stand-ins for the modules of simulation_interfaces 1.5.1 (of Jazzy) and 2.1: it is not on PyPI.

Fields and constants are those of the published .msg, .srv and .action files.
"""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

from geometry_msgs.msg import Accel, Pose, Twist
from std_msgs.msg import Header


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
