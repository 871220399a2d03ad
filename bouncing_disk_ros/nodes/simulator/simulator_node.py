"""The simulator as a lifecycle node: parameters, services and timers around one run."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from typing import Any

from rcl_interfaces.msg import ParameterDescriptor, SetParametersResult
from rclpy.action import ActionServer, CancelResponse
from rclpy.clock import Clock, ClockType
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn
from rclpy.parameter import Parameter
from std_srvs.srv import SetBool, Trigger

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.nodes.simulator.clocks import TickTimer
from bouncing_disk_ros.nodes.simulator.commands import Commands
from bouncing_disk_ros.nodes.simulator.diagnostics import Diagnostics
from bouncing_disk_ros.nodes.simulator.gate_topics import GateTopics
from bouncing_disk_ros.nodes.simulator.outputs import Outputs, second_clock
from bouncing_disk_ros.nodes.simulator.standard_services import StandardServices, installed_types
from bouncing_disk_ros.parameters import Value, items_of
from bouncing_disk_ros.ros.requests import guard_services
from bouncing_disk_ros.ros.transforms import tf_message
from bouncing_disk_ros.ros.validated_parameters import (
    ValidatedParameters,
    start_values,
    with_slider,
)
from bouncing_disk_ros.run.command_validation import ImpulseRequest, Instant
from bouncing_disk_ros.run.control import RunControl, inactive
from bouncing_disk_ros.run.gates import Gates, Lockstep
from bouncing_disk_ros.run.health import Reading, Ticks
from bouncing_disk_ros.run.session import Session
from bouncing_disk_ros.run.time_map import TickPlan

SUCCESS, FAILURE = TransitionCallbackReturn.SUCCESS, TransitionCallbackReturn.FAILURE
TICK_NS = (1_000_000, 10_000_000)
"""Bounds of the period of the loop; within them it is that of the samples."""
CLOCK_WATCH_SECONDS = 0.1
"""How often a node that publishes /clock looks for another publisher of it."""


class SimulatorNode(LifecycleNode):
    """The simulator of one disk as a node; further keyword arguments are those of rclpy's Node.

    Raises InputError when a parameter, the preset or the ROS graph does not allow a start.
    `finished` turns true on a lifecycle shutdown, which `failure` may have caused; `ticks` is the
    timer of the loop. A long `~/step` ends early when `stopping` says so.
    """

    def __init__(
        self,
        node_name: str = "bouncing_disk",
        *,
        stopping: Callable[[], bool] = lambda: False,
        **kwargs: Any,
    ) -> None:
        super().__init__(node_name, **kwargs)
        self.finished = False
        self.failure: InputError | None = None
        self._stopping = stopping
        self.run: RunControl | None = None
        self.outputs: Outputs | None = None
        self._gate_topics: GateTopics | None = None
        self._error: InputError | None = None
        self.last_refusal: InputError | None = None
        self._starting = False
        try:
            self._set_up()
            if self._values["autostart"]:
                self._autostart()
        except BaseException:
            self.destroy_node()
            raise

    def _set_up(self) -> None:
        self._diagnostics = Diagnostics(self)
        self._door: ValidatedParameters | None = None
        start = start_values(self)
        self._door = ValidatedParameters(
            self, start, self._on_parameters, self.refuse, lambda: self.run is not None
        )
        self._values: dict[str, Value] = self._door.values
        self.commands = Commands(self, self, keep_all=self._in_lockstep)
        self.create_service(SetBool, "~/pause", self._on_pause)
        self.create_service(Trigger, "~/step", self._on_step)
        self.create_service(Trigger, "~/reset", self._on_reset)
        self._steady = Clock(clock_type=ClockType.STEADY_TIME)
        self._lateness = Ticks()
        self.ticks = TickTimer(self, self._steady, self._on_tick, self._tick_plan)
        self._standard = self._standard_services()
        guard_services(self, self.refuse)
        self.create_timer(1.0, self._on_second, clock=self._steady)
        self.create_timer(CLOCK_WATCH_SECONDS, self._watch_clock, clock=self._steady)

    def _standard_services(self) -> StandardServices | None:
        """The services and the action of simulation_interfaces, where that is installed."""
        types = installed_types()
        if types is None:
            return None
        standard = StandardServices(self, types)
        for name, (kind, callback) in standard.callbacks.items():
            if hasattr(types.srv, kind):
                self.create_service(getattr(types.srv, kind), name, callback)
        self._steps = ActionServer(
            self, types.action.SimulateSteps, "~/simulate_steps", standard.simulate_steps,
            cancel_callback=lambda _goal: CancelResponse.ACCEPT,
        )  # fmt: skip
        return standard

    def _autostart(self) -> None:
        self._starting = True
        for transition in (self.trigger_configure, self.trigger_activate):
            if transition() != SUCCESS:
                raise self._error or RuntimeError("the simulator could not be started")
        self._starting = False

    # --- lifecycle --------------------------------------------------------------------------------
    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Create a run at simulated time 0 and its topics; it does not move yet."""
        try:
            self._refuse_second_clock()
            if self._values["publish_tf"]:
                tf_message()
        except InputError as error:
            self._error = error
            if not self._starting:  # else the caller gets the error
                self.get_logger().error(error.line)
            return FAILURE
        return self._transition(self._make_run, state)

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Move, or stay paused when that was asked."""
        return self._transition(lambda: self._set_active(True), state)

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Hold the state; inputs are refused until the node is active again."""
        return self._transition(lambda: self._set_active(False), state)

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Discard the run and its topics."""
        return self._transition(self._discard, state)

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Discard the run; the process ends."""
        self.finished = True
        return self._transition(self._discard, state)

    def on_error(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Discard the run after a failed transition; the node can be configured again."""
        return self._transition(self._discard, state)

    def _transition(
        self, action: Callable[[], object], state: LifecycleState
    ) -> TransitionCallbackReturn:
        """Do it, and log what rclpy would swallow."""
        del state
        try:
            action()
        except Exception as error:
            self.get_logger().error(f"transition failed: {type(error).__name__}: {error}")
            raise
        return SUCCESS

    @property
    def _in_lockstep(self) -> bool:
        return self._values["lockstep"] != Lockstep.OFF

    def _make_run(self) -> None:
        self.commands.keep_all(self._in_lockstep)
        self.outputs, self._gate_topics, gates = Outputs(self, self._values), None, None
        if self._in_lockstep:
            topics = self._gate_topics = GateTopics(self, self._on_answer)
            numbers = [int(item) for item in items_of(str(self._values["lockstep_controllers"]))]
            warn = self.get_logger().error
            gates = Gates(numbers, 0, topics.publishers, topics.announce, warn)
            gates.set_timeout(self._values)
        self.run = RunControl(
            self.get_fully_qualified_name(), self._values, self.outputs, gates=gates,
            refuse=self.refuse, stopping=self._stopping,
            ros_now=lambda: int(self.get_clock().now().nanoseconds),
        )  # fmt: skip

    def _on_answer(self, values: Iterable[int], number: int) -> None:
        if self.run is None or self.run.gates is None:
            return
        try:
            self.run.gates.answer(values, number)
        except InputError as error:
            self.refuse(error)
            return
        self.run.go_on()

    def _set_active(self, active: bool) -> None:
        assert self.run is not None
        self.run.set_active(active)
        self._set_ticking(active)
        self.get_logger().info(self.run.summary)

    def _discard(self) -> None:
        self._set_ticking(False)
        topics, self.run = (self.outputs, self._gate_topics), None
        self.outputs = self._gate_topics = None
        for one in topics:
            if one is not None:
                one.destroy()

    def destroy_node(self) -> None:
        """As rclpy's, once subscribers have what was published."""
        if self.outputs is not None:
            self.outputs.deliver()
        super().destroy_node()

    def _refuse_second_clock(self) -> None:
        """With publish_clock: refuse to start where /clock is seen to have a publisher already."""
        if self._values["publish_clock"] and self.count_publishers("/clock"):
            raise second_clock()

    def _watch_clock(self) -> None:
        """End where another publisher of /clock was there first, or is to stay."""
        if self.outputs is not None and self.outputs.clock_is_lost():
            self.failure = second_clock()
            self.get_logger().error(self.failure.line)
            self.trigger_shutdown()

    # --- timers -----------------------------------------------------------------------------------
    def _set_ticking(self, ticking: bool) -> None:
        """Start or stop the ticks, which begin just after samples are due."""
        self.ticks.stop()
        if ticking and self.run is not None:
            self.ticks.start()

    def _tick_plan(self) -> TickPlan:
        return TickPlan(TICK_NS[1]) if self.run is None else self.run.tick_plan(*TICK_NS)

    def _on_tick(self, now: int, late: int) -> None:
        self._lateness.note(late)
        if self.run is not None:
            self.run.tick(now)
        if self._standard is not None:
            self._standard.on_tick()

    def _on_second(self) -> None:
        self.commands.recount_publishers()
        stamp_ns = None if self.run is None else self.run.simulated_stamp_ns
        self._diagnostics.publish(self._read(), self._lateness.take(), stamp_ns)

    def _read(self) -> Reading:
        lost, uncertain = self.commands.lost
        if self.run is not None:
            reading = self.run.read()
        else:
            factor, now = float(self._values["real_time_factor"]), time.monotonic_ns()
            reading = Reading(now, 0, 0, 0, 0, 0, None, "unconfigured", factor, 0)
        reading = replace(reading, lost=lost, uncertain=uncertain)
        if self.outputs is None:
            return reading
        others, owner = self.outputs.other_publishers, self.outputs.clock_ownership
        is_shared = owner is not None and owner.is_shared
        return replace(reading, other_publishers=others, other_clock=is_shared)

    # --- inputs -----------------------------------------------------------------------------------
    def arrival(self, field: str) -> tuple[Session, Instant]:
        """The session that accepts inputs now, and the instant of arrival; else InputError."""
        return self._current(field).arrival(field)

    def _current(self, field: str) -> RunControl:
        if self.run is None:
            raise inactive(self.get_fully_qualified_name(), field, "unconfigured")
        return self.run

    # --- for simulation_interfaces
    def apply_impulse(self, request: ImpulseRequest) -> str:
        """Apply an impulse; why it was refused, or nothing."""
        before = self.last_refusal
        if self.commands.accept(request):
            return ""
        refusal = self.last_refusal
        return refusal.line if refusal is not None and refusal is not before else "refused"

    def restart(self) -> bool:
        """Discard the run and start a new one at time 0; False when that failed."""
        ways = (
            self.trigger_deactivate, self.trigger_cleanup, self.trigger_configure,
            self.trigger_activate,
        )  # fmt: skip
        return all(way() == SUCCESS for way in ways)

    def quit(self) -> None:
        """End the process in order, once the answer is sent."""
        self.trigger_shutdown()

    def hold(self, topic: str, number: int | None, data: bytes, act: Callable[[], object]) -> bool:
        """Keep an input for a gate of a lockstep; False: it is to act at once."""
        if self.run is None or self.run.gates is None:
            return False
        try:
            self.run.gates.hold(topic, number, data, act)
        except InputError as error:
            self.refuse(error)
        self.run.go_on()
        return True

    def publish_consequences(self) -> None:
        """Publish what an accepted input has brought about."""
        if self.run is not None:
            self.run.publish_consequences()

    def refuse(self, error: InputError) -> None:
        """Count and log a refused input."""
        self.last_refusal = error
        self._diagnostics.note_refusal(error)

    def log_accepted(self, field: str, line: str, remark: str = "") -> None:
        """Log an accepted input; a remark makes it a warning."""
        self._diagnostics.log_accepted(field, line, remark)

    def set_parameters_atomically(self, parameter_list: Sequence[Parameter]) -> SetParametersResult:
        """As rclpy's, but that every refusal is one clear line, and counted."""
        if self._door is None:
            return super().set_parameters_atomically(list(parameter_list))
        changes = self._door.changed(parameter_list)
        if not changes:  # rclpy would refuse an empty list
            return SetParametersResult(successful=True)
        refusal = self._door.refusal(changes)
        if refusal is not None:
            return refusal
        result = super().set_parameters_atomically(changes)
        if result.successful and (notice := self._door.notice(changes)):
            self.get_logger().info(notice)
            result.reason = notice
        return result

    def describe_parameter(self, name: str) -> ParameterDescriptor:
        """As rclpy's, with a range for sliders: a wider one would be of no use there."""
        descriptor = super().describe_parameter(name)
        values = {} if self._door is None else self._door.values
        return with_slider(descriptor, values[name]) if name in values else descriptor

    def _on_parameters(self, values: dict[str, Value]) -> None:
        if self.run is not None:
            self.run.set_parameters(values)

    # --- services ---------------------------------------------------------------------------------
    def _on_pause(self, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        return self._answer(
            "~/pause", response, lambda: self._current("~/pause").pause(request.data)
        )

    def _on_step(self, _request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        return self._answer("~/step", response, lambda: self._current("~/step").step())

    def _on_reset(self, _request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        def reset() -> str:
            answer = self._current("~/reset").reset()
            self.commands.drop_waiting()
            return answer

        return self._answer("~/reset", response, reset)

    def _answer(self, field: str, response: Any, action: Callable[[], str]) -> Any:
        try:
            response.message = action()
            response.success = True
            self.log_accepted(field, response.message)
        except InputError as error:
            self.refuse(error)
            response.message = error.line
        return response
