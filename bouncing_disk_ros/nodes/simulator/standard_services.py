"""The services and the action of simulation_interfaces, where that package is installed.

They stand for what the simulator's own services do, with the names and results that tools of other
simulators know. What this simulator does not have is answered as not supported.
"""

from __future__ import annotations

import importlib
import math
import re
import time
from collections.abc import Callable
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, Protocol

from rclpy.task import Future

from bouncing_disk_ros.core.model import Disk, Phase, Sample
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.ros.to_messages import ns_to_time
from bouncing_disk_ros.ros.transforms import Frames
from bouncing_disk_ros.run.command_validation import ImpulseRequest

if TYPE_CHECKING:
    from bouncing_disk_ros.run.control import RunControl

ENTITIES = ("disk", "platform")
FEATURES = (
    "ENTITY_STATE_GETTING", "ENTITY_STATE_SETTING", "SIMULATION_RESET", "SIMULATION_RESET_TIME",
    "SIMULATION_RESET_STATE",
    "SIMULATION_STATE_GETTING", "SIMULATION_STATE_SETTING", "SIMULATION_STATE_PAUSE",
    "STEP_SIMULATION_SINGLE", "STEP_SIMULATION_MULTIPLE", "STEP_SIMULATION_ACTION",
)  # fmt: skip
INFORMATION = (
    "bouncing_disk_ros: the entities are disk and platform; a step is step_periods periods of the "
    "platform; of an entity's state only the twist of the disk along and about z can be set"
)
LONGEST_FILTER = 100
"""Characters of a regular expression that are read: there are two names to be matched."""
TURN_SECONDS = 0.02
"""Wall time of steps of an action between which the node does other work."""


class StandardNode(Protocol):
    """What these services need of the simulator's node."""

    run: RunControl | None

    def apply_impulse(self, request: ImpulseRequest) -> str:
        """Apply an impulse; why it was refused, or nothing."""

    def restart(self) -> bool:
        """Discard the run and start a new one at time 0; False when that failed."""

    def quit(self) -> None:
        """End the process in order, once the answer is sent."""


def installed_types() -> SimpleNamespace | None:
    """The modules of simulation_interfaces; None where the package is not installed."""
    try:
        modules = {
            kind: importlib.import_module(f"simulation_interfaces.{kind}")
            for kind in ("action", "msg", "srv")
        }
    except ImportError:
        return None
    return SimpleNamespace(**modules)


class StandardServices:
    """Answers the requests of simulation_interfaces; `types` as `installed_types` gives them.

    Versions 1.5.1 (of ROS 2 Jazzy) and 2.1 are known. They differ in SetEntityState: the older one
    has no flags that say what is to be set.
    """

    def __init__(self, node: StandardNode, types: Any) -> None:
        self._node, self._types = node, types
        self._result, self._state = types.msg.Result, types.msg.SimulationState
        self._stopped_ns = -1  # simulated time at which the run was stopped last
        self._next_tick: Future | None = None
        self.callbacks: dict[str, tuple[str, Callable[[Any, Any], Any]]] = {
            "~/get_simulator_features": ("GetSimulatorFeatures", self.get_features),
            "~/get_simulation_state": ("GetSimulationState", self.get_state),
            "~/set_simulation_state": ("SetSimulationState", self.set_state),
            "~/step_simulation": ("StepSimulation", self.step),
            "~/reset_simulation": ("ResetSimulation", self.reset),
            "~/get_entities": ("GetEntities", self.get_entities),
            "~/get_entity_state": ("GetEntityState", self.get_entity_state),
            "~/set_entity_state": ("SetEntityState", self.set_entity_state),
        }

    # --- results ----------------------------------------------------------------------------------
    def _answer(self, response: Any, code: int, message: str = "") -> Any:
        response.result.result, response.result.error_message = code, message
        return response

    def _carry_out(self, response: Any, action: Callable[[], object], failed: int) -> Any:
        """Do it: OK, or `failed` with the reason of the refusal."""
        try:
            action()
        except InputError as error:
            return self._answer(response, failed, error.line)
        return self._answer(response, self._result.RESULT_OK)

    # --- the simulator ----------------------------------------------------------------------------
    def get_features(self, _request: Any, response: Any) -> Any:
        """What is supported."""
        known = self._types.msg.SimulatorFeatures
        names = [name for name in FEATURES if hasattr(known, name)]
        response.features.features = [getattr(known, name) for name in names]
        response.features.custom_info = INFORMATION
        return response

    @property
    def state(self) -> int:
        """The state of the simulation, as a number of SimulationState."""
        run, states = self._node.run, self._state
        if run is None or not run.active:
            return int(states.STATE_NO_WORLD)
        if not run.session.paused:
            return int(states.STATE_PLAYING)
        is_stopped = run.session.time_ns == self._stopped_ns and not run.stepping
        return int(states.STATE_STOPPED if is_stopped else states.STATE_PAUSED)

    def get_state(self, _request: Any, response: Any) -> Any:
        """Whether it is playing, paused or stopped; no world: the node is not active."""
        response.state.state = self.state
        return self._answer(response, self._result.RESULT_OK)

    def set_state(self, request: Any, response: Any) -> Any:
        """Play, pause, stop (pause and reset) or quit."""
        states, asked, run = self._state, request.state.state, self._node.run
        if asked == states.STATE_QUITTING:
            self._node.quit()
            return self._answer(response, self._result.RESULT_OK)
        if asked not in (states.STATE_STOPPED, states.STATE_PLAYING, states.STATE_PAUSED):
            message = f"state {asked} cannot be set"
            return self._answer(response, self._result.RESULT_FEATURE_UNSUPPORTED, message)
        if run is None or not run.active:
            return self._inactive(response)
        if asked == self.state and not run.stepping:
            message = "it is in that state already"
            return self._answer(response, type(response).ALREADY_IN_TARGET_STATE, message)
        paused = asked != states.STATE_PLAYING

        def change() -> None:
            run.pause(paused)
            self._stopped_ns = -1
            if asked == states.STATE_STOPPED:
                run.reset()
                self._stopped_ns = run.session.time_ns

        return self._carry_out(response, change, type(response).STATE_TRANSITION_ERROR)

    def reset(self, request: Any, response: Any) -> Any:
        """The state alone, as ~/reset does; time or everything: a new run at time 0."""
        kind, run = type(request), self._node.run
        if run is None or not run.active:
            return self._inactive(response)
        scope = request.scope or kind.SCOPE_ALL
        if not scope & (kind.SCOPE_STATE | kind.SCOPE_TIME):
            message = "only SCOPE_STATE, SCOPE_TIME (with the state) and SCOPE_ALL can be reset"
            return self._answer(response, self._result.RESULT_FEATURE_UNSUPPORTED, message)
        if not scope & kind.SCOPE_TIME:
            return self._carry_out(response, run.reset, self._result.RESULT_OPERATION_FAILED)
        if self._node.restart():
            return self._answer(response, self._result.RESULT_OK)
        message = "no new run could be started: see the log"
        return self._answer(response, self._result.RESULT_OPERATION_FAILED, message)

    def _inactive(self, response: Any) -> Any:
        message = "the node is not active"
        return self._answer(response, self._result.RESULT_INCORRECT_STATE, message)

    # --- steps ------------------------------------------------------------------------------------
    def step(self, request: Any, response: Any) -> Any:
        """Steps that end within the time that an answer may take; a longer one is ended there."""
        run = self._node.run
        if run is None or not run.active:
            return self._inactive(response)
        if request.steps == 0:
            return self._answer(response, self._result.RESULT_OK)

        def advance() -> None:
            run.step(request.steps)
            if run.stepping:
                run.pause(True)
                at = run.session.time_ns / 1e9
                raise InputError(
                    "steps", request.steps, "what can be simulated in a tenth of a second",
                    f"Paused at {at:.9f} s of simulated time. The action ~/simulate_steps has no "
                    "such limit.",
                )  # fmt: skip

        return self._carry_out(response, advance, self._result.RESULT_OPERATION_FAILED)

    def on_tick(self) -> None:
        """Let an action that waits go on."""
        future, self._next_tick = self._next_tick, None
        if future is not None:
            future.set_result(None)

    async def simulate_steps(self, goal: Any) -> Any:
        """The action: step by step, with feedback after each; a cancel pauses where it is."""
        kind = self._types.action.SimulateSteps
        response, total, done = kind.Result(), goal.request.steps, 0
        turn_ends = time.monotonic() + TURN_SECONDS
        while done < total:
            if goal.is_cancel_requested:
                goal.canceled()
                return self._answer(response, self._result.RESULT_OK, f"cancelled after {done}")
            if why := await self._one_step(goal):
                goal.abort()
                return self._answer(response, self._result.RESULT_OPERATION_FAILED, why)
            if goal.is_cancel_requested:
                continue
            done += 1
            goal.publish_feedback(kind.Feedback(completed_steps=done, remaining_steps=total - done))
            if time.monotonic() > turn_ends:
                await self._tick()
                turn_ends = time.monotonic() + TURN_SECONDS
        goal.succeed()
        return self._answer(response, self._result.RESULT_OK)

    async def _one_step(self, goal: Any) -> str:
        """One step to its end, over ticks where it is long; why it did not reach it, or nothing."""
        run = self._node.run
        if run is None or not run.active:
            return "the node is not active"
        try:
            run.step()
        except InputError as error:
            return error.line
        end_ns = run.session.time_ns if run.step_until is None else run.step_until
        while run.stepping:
            if goal.is_cancel_requested:
                run.pause(True)
                return ""
            await self._tick()
        if run is not self._node.run or run.session.time_ns < end_ns:
            return "another request has ended the step"
        return ""

    async def _tick(self) -> None:
        self._next_tick = self._next_tick or Future()
        await self._next_tick

    # --- entities ---------------------------------------------------------------------------------
    def get_entities(self, request: Any, response: Any) -> Any:
        """The names that match a regular expression; other filters are not supported."""
        filters = request.filters
        if filters.categories or filters.tags.tags or filters.bounds.type:
            message = "entities can be filtered by their names only"
            return self._answer(response, self._result.RESULT_FEATURE_UNSUPPORTED, message)
        try:
            found = [one for one in ENTITIES if re.search(filters.filter[:LONGEST_FILTER], one)]
        except (re.error, OverflowError, RecursionError) as error:
            message = f"filter {filters.filter[:40]!r} is no regular expression: {error}"
            return self._answer(response, self._result.RESULT_OPERATION_FAILED, message)
        response.entities = found
        return self._answer(response, self._result.RESULT_OK)

    def get_entity_state(self, request: Any, response: Any) -> Any:
        """Pose, twist and acceleration (of the disk) along and about z, in the world's frame."""
        run = self._node.run
        if request.entity not in ENTITIES:
            return self._unknown(request, response)
        if run is None:
            return self._inactive(response)
        self._fill(response.state, request.entity, run)
        return self._answer(response, self._result.RESULT_OK)

    def _fill(self, state: Any, entity: str, run: RunControl) -> None:
        simulation = run.session.simulation
        fill_entity_state(state, entity, simulation.sample(), simulation.disk)
        state.header.frame_id = Frames.of(run.session.values).world
        state.header.stamp = ns_to_time(run.stamp_ns)

    def set_entity_state(self, request: Any, response: Any) -> Any:
        """The twist of the disk along and about z, by the impulse that brings it about."""
        run = self._node.run
        if request.entity not in ENTITIES:
            return self._unknown(request, response)
        if run is None or not run.active:
            return self._inactive(response)
        if why := self._cannot_be_set(request, run):
            return self._answer(response, self._result.RESULT_FEATURE_UNSUPPORTED, why)
        if not getattr(request, "set_twist", True):
            return self._answer(response, self._result.RESULT_OK)
        why = self._node.apply_impulse(impulse_to_twist(request.state.twist, run))
        code = self._result.RESULT_OPERATION_FAILED if why else self._result.RESULT_OK
        return self._answer(response, code, why)

    def _cannot_be_set(self, request: Any, run: RunControl) -> str:
        """Why such a state cannot be set; empty where it can.

        Without flags (version 1.5.1) a pose that is left out, or the present one, is not set, and
        the acceleration may be ignored.
        """
        if request.entity != "disk":
            return "command the platform: platform/command"
        frame, world = request.state.header.frame_id, Frames.of(run.session.values).world
        if frame not in ("", world):
            return f"a state in frame {frame[:40]!r}: only {world!r} or none is supported"
        if hasattr(request, "set_pose"):
            sets_more = request.set_pose or request.set_acceleration
        else:
            present = type(request.state)()
            self._fill(present, request.entity, run)
            pose = request.state.pose
            sets_more = pose not in (present.pose, type(pose)())
        if sets_more:
            return "only the twist of the disk can be set: leave the pose out, or as it is (paused)"
        return ""

    def _unknown(self, request: Any, response: Any) -> Any:
        message = f"no entity {request.entity[:40]!r}; there are {' and '.join(ENTITIES)}"
        return self._answer(response, self._result.RESULT_NOT_FOUND, message)


def fill_entity_state(state: Any, entity: str, sample: Sample, disk: Disk) -> None:
    """Write the state of the disk or the platform into an EntityState."""
    twist, acceleration = state.twist, state.acceleration
    if entity == "disk":
        angle = sample.angle
        state.pose.position.z = sample.axial_position
        twist.linear.z, twist.angular.z = sample.axial_velocity, sample.angular_velocity
        force = sample.axial_force - disk.mass * disk.gravity - disk.preload
        acceleration.linear.z = force / disk.mass
        if sample.phase is not Phase.HELD:
            turning = sample.angular_velocity
            brake = math.copysign(disk.brake_torque, turning) if turning else 0.0
            torque = sample.friction_torque - disk.load_torque - brake
            acceleration.angular.z = torque / disk.inertia
    else:
        angle = sample.platform_angle
        state.pose.position.z = sample.platform_position
        twist.linear.z = sample.platform_velocity
        twist.angular.z = sample.platform_angular_velocity
    state.pose.orientation.z, state.pose.orientation.w = math.sin(angle / 2), math.cos(angle / 2)


def impulse_to_twist(twist: Any, run: RunControl) -> ImpulseRequest:
    """The impulse now that gives the disk a twist; x and y are refused like those of an impulse."""
    sample, disk = run.session.simulation.sample(), run.session.simulation.disk
    linear, angular = twist.linear, twist.angular
    force = disk.mass * (linear.z - sample.axial_velocity)
    torque = disk.inertia * (angular.z - sample.angular_velocity)
    return ImpulseRequest(
        (linear.x, linear.y, force), (angular.x, angular.y, torque), field="~/set_entity_state"
    )
