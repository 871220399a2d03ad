"""Stand-ins for the modules of simulation_interfaces 1.5.1 (of Jazzy) and 2.1: it is not on PyPI.

Fields and constants are those of the published .msg, .srv and .action files.
"""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

from geometry_msgs.msg import Accel, Pose, Twist
from std_msgs.msg import Header


class Result:
    RESULT_FEATURE_UNSUPPORTED = 0
    RESULT_OK = 1
    RESULT_NOT_FOUND = 2
    RESULT_INCORRECT_STATE = 3
    RESULT_OPERATION_FAILED = 4

    def __init__(self) -> None:
        self.result, self.error_message = 0, ""


class SimulationState:
    STATE_STOPPED = 0
    STATE_PLAYING = 1
    STATE_PAUSED = 2
    STATE_QUITTING = 3
    STATE_NO_WORLD = 4
    STATE_LOADING_WORLD = 5

    def __init__(self, state: int = 0) -> None:
        self.state = state


class SimulatorFeatures:
    SPAWNING = 0
    ENTITY_STATE_GETTING = 10
    ENTITY_STATE_SETTING = 11
    SIMULATION_RESET = 20
    SIMULATION_RESET_TIME = 21
    SIMULATION_RESET_STATE = 22
    SIMULATION_RESET_SPAWNED = 23
    SIMULATION_STATE_GETTING = 24
    SIMULATION_STATE_SETTING = 25
    SIMULATION_STATE_PAUSE = 26
    STEP_SIMULATION_SINGLE = 31
    STEP_SIMULATION_MULTIPLE = 32
    STEP_SIMULATION_ACTION = 33

    def __init__(self) -> None:
        self.features: list[int] = []
        self.spawn_formats: list[str] = []
        self.custom_info = ""


class EntityState:
    def __init__(self) -> None:
        self.header, self.pose, self.twist, self.acceleration = Header(), Pose(), Twist(), Accel()


class Answer:
    """A response with a result and nothing else."""

    def __init__(self) -> None:
        self.result = Result()


class StateAnswer(Answer):
    """GetSimulationState_Response."""

    def __init__(self) -> None:
        super().__init__()
        self.state = SimulationState()


class SetStateAnswer(Answer):
    """SetSimulationState_Response."""

    ALREADY_IN_TARGET_STATE = 101
    STATE_TRANSITION_ERROR = 102
    INCORRECT_TRANSITION = 103


class EntityAnswer(Answer):
    """GetEntityState_Response."""

    def __init__(self) -> None:
        super().__init__()
        self.state = EntityState()


class FeaturesAnswer:
    """GetSimulatorFeatures_Response, which has no result."""

    def __init__(self) -> None:
        self.features = SimulatorFeatures()


class ResetRequest:
    """ResetSimulation_Request."""

    SCOPE_DEFAULT = 0
    SCOPE_TIME = 1
    SCOPE_STATE = 2
    SCOPE_SPAWNED = 4
    SCOPE_ALL = 255

    def __init__(self, scope: int = 0) -> None:
        self.scope = scope


class SetEntityRequest:
    """SetEntityState_Request."""

    def __init__(self, entity: str, **flags: bool) -> None:
        self.entity, self.state = entity, EntityState()
        self.set_pose = flags.get("set_pose", False)
        self.set_twist = flags.get("set_twist", False)
        self.set_acceleration = flags.get("set_acceleration", False)


class OldSetEntityRequest:
    """SetEntityState_Request of 1.5.1, which sets the whole state."""

    def __init__(self, entity: str) -> None:
        self.entity, self.state = entity, EntityState()


class EntitiesRequest:
    """GetEntities_Request."""

    def __init__(self, name: str = "", **filters: Any) -> None:
        self.filters = SimpleNamespace(
            filter=name,
            categories=filters.get("categories", []),
            tags=SimpleNamespace(tags=filters.get("tags", []), filter_mode=0),
            bounds=SimpleNamespace(type=filters.get("bounds", 0), points=[]),
        )


class EntitiesAnswer(Answer):
    """GetEntities_Response."""

    def __init__(self) -> None:
        super().__init__()
        self.entities: list[str] = []


class Feedback:
    """SimulateSteps_Feedback."""

    def __init__(self, completed_steps: int = 0, remaining_steps: int = 0) -> None:
        self.completed_steps, self.remaining_steps = completed_steps, remaining_steps


class Goal:
    """A goal handle of the action, as rclpy's ServerGoalHandle."""

    def __init__(self, steps: int) -> None:
        self.request = SimpleNamespace(steps=steps)
        self.is_cancel_requested = False
        self.feedback: list[tuple[int, int]] = []
        self.ends: list[str] = []

    def publish_feedback(self, feedback: Feedback) -> None:
        self.feedback.append((feedback.completed_steps, feedback.remaining_steps))

    def succeed(self) -> None:
        self.ends.append("succeeded")

    def canceled(self) -> None:
        self.ends.append("cancelled")

    def abort(self) -> None:
        self.ends.append("aborted")


TYPES: Any = SimpleNamespace(
    msg=SimpleNamespace(
        Result=Result, SimulationState=SimulationState, SimulatorFeatures=SimulatorFeatures
    ),
    srv=SimpleNamespace(),  # requests and responses are made by the tests
    action=SimpleNamespace(SimulateSteps=SimpleNamespace(Result=Answer, Feedback=Feedback)),
)
