"""The link to a simulator's node: what it publishes, what it is sent, and a process of `juggle`."""

from __future__ import annotations

import queue
import threading
import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from rcl_interfaces.msg import Log
from rcl_interfaces.srv import SetParametersAtomically
from rclpy.node import Node
from rclpy.parameter import Parameter
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64, String
from std_srvs.srv import SetBool, Trigger

from bouncing_disk_ros.command_line.child import Child
from bouncing_disk_ros.errors import one_line
from bouncing_disk_ros.ros.from_messages import time_to_ns
from bouncing_disk_ros.ros.node_tool import publishing_nodes
from bouncing_disk_ros.ros.numbered_subscription import WithInfo
from bouncing_disk_ros.ros.qos import profile_of, publisher_of, subscription_to
from bouncing_disk_ros.ros.to_messages import impulse_to_msg, trajectory_to_msg
from bouncing_disk_ros.topics import JUGGLE_STATUS, MOTION_NAMES, Qos
from bouncing_disk_ros.workbench.actions import (
    Action,
    Call,
    Impulse,
    Juggle,
    Lifecycle,
    Move,
    Names,
    Perform,
    Set,
    StopJuggling,
    juggle_arguments,
    lines,
)
from bouncing_disk_ros.workbench.history_reader import HistoryReader
from bouncing_disk_ros.workbench.run_history import RunHistory
from bouncing_disk_ros.workbench.run_link import RunLink

TOPIC = "juggle/status"
FACTOR = "real_time_factor"


class JugglerProcess:
    """Keeps at most one process. What `juggle/status` says, whoever runs it, is in the history.

    All methods are for the thread that starts processes, whose end is theirs.
    """

    def __init__(self, node: Node, history: RunHistory) -> None:
        self._node, self._history = node, history
        self._child: Child | None = None
        self._action = Juggle("none")
        subscription_to(node, JUGGLE_STATUS, self._on_status, TOPIC)

    def _on_status(self, msg: String) -> None:
        self._history.juggling = str(msg.data)

    def start(self, action: Juggle) -> None:
        """Start it in place of the one before."""
        self.end()
        self._action = action
        self._history.juggling = f"{action.strategy}: juggle starts …"
        space = ("-r", f"__ns:={self._node.get_namespace()}")
        self._child = Child("juggle", "--ros-args", *space, *juggle_arguments(action))

    def stop(self) -> None:
        """End it; say so where there is none of this workbench."""
        if self._child is None and self._history.juggling:
            self._history.note(
                "juggle was not started by this workbench: end it where it runs", is_refusal=True
            )
        self.end()

    def end(self) -> None:
        """End it if it runs: the platform ends the trajectory that it was given."""
        if self._child is not None:
            self._child.end()
            self._child, self._history.juggling = None, ""

    def tick(self, names: Names) -> None:
        """See whether it ended, and whether it knows how fast simulated time goes."""
        child, history = self._child, self._history
        if child is None:
            if history.juggling and not self._node.count_publishers(TOPIC):
                history.juggling = ""  # somebody's own one has ended
        elif child.code is not None:
            history.note(f"juggle ended: {child.last_line}", is_refusal=True)
            self._child, history.juggling = None, ""
        else:
            self._follow_factor(names)

    def _follow_factor(self, names: Names) -> None:
        """Start it again where the real-time factor is another one: its stamps depend on that."""
        given, factor = self._action.options, float(self._history.own_values()[FACTOR])
        if factor != given.get(FACTOR, 1.0):
            action = replace(self._action, options={**given, FACTOR: factor})
            self._history.note(
                f"juggle begins anew, for another {FACTOR}: {lines(action, names)[0]}"
            )
            self.start(action)


# ------------------------------------------------------------------------------------------------
# The link of the workbench to a simulator over ROS: hears its topics, sends commands.


ANSWER_SECONDS = 5.0
"""Patience with the answer of a service."""
SILENT_SECONDS = 3.0
"""Without a message of disk/run_state, which comes every second, the simulator counts as gone."""
_TRANSITIONS = {
    "configure": Transition.TRANSITION_CONFIGURE,
    "activate": Transition.TRANSITION_ACTIVATE,
    "deactivate": Transition.TRANSITION_DEACTIVATE,
    "cleanup": Transition.TRANSITION_CLEANUP,
}
_WARNING = 30
"""Levels of rcl_interfaces/msg/Log from here on are refusals and faults."""


class RosLink(RunLink):
    """A node with a thread that hears the simulator and one that sends actions, in their order."""

    def __init__(self, node: Node, default_name: str) -> None:
        self.history = RunHistory()
        self._node = node
        self._call_it(f"{node.get_namespace().rstrip('/')}/{default_name}")
        self._heard = -float("inf")  # steady clock at the newest sign of life
        self._found = False
        reader = HistoryReader(self.history)
        for topic, handler in reader.handlers.items():
            subscription_to(node, topic, WithInfo(partial(_hear, handler)))
        subscription_to(node, "disk/run_state", self._on_run_state)
        log_qos = profile_of(Qos(100, latched=True))
        node.create_subscription(Log, "/rosout", self._on_log, log_qos)
        self._started = time.time_ns()  # /rosout has wall time, also with use_sim_time
        self._publishers = {name: publisher_of(node, f"platform/{name}") for name in MOTION_NAMES}
        self._command = publisher_of(node, "platform/command")
        self._impulse = publisher_of(node, "disk/impulse")
        self._clients: dict[tuple[type, str], Any] = {}
        self._performer: Child | None = None
        self._juggler = JugglerProcess(node, self.history)
        self._queue: queue.SimpleQueue[Action | None] = queue.SimpleQueue()
        self._closing = threading.Event()
        self._worker = threading.Thread(target=self._work, name="workbench actions", daemon=True)
        self._worker.start()

    # --- what there is
    def _call_it(self, name: str) -> None:
        self.names = Names(name, self._node.get_namespace())
        self.source = f"simulator {name}"

    @property
    def is_alive(self) -> bool:
        """Whether the simulator was heard of within SILENT_SECONDS."""
        return time.monotonic() - self._heard < SILENT_SECONDS

    def _on_run_state(self, _msg: JointState) -> None:
        self._heard = time.monotonic()
        self.history.state = ""

    def _on_log(self, msg: Log) -> None:
        """Refusals and faults of the simulator, in its own words; only those of now."""
        named = self.names.node.strip("/").replace("/", ".")
        if msg.name != named or time_to_ns(msg.stamp) < self._started:
            return
        text = one_line(msg.msg).removeprefix("refused: ")  # an answer says the rest alone
        if msg.level >= _WARNING:
            self.history.note(text, is_refusal=True)
        elif ": " in text:  # a task whose warnings were heard may be well again
            self.history.settle(text.partition(": ")[0] + ": ")

    def tick(self) -> None:
        """Look who is there; say on the page when nobody is."""
        for name in publishing_nodes(self._node, "platform/motion")[:1]:
            self._call_it(name)
        if not self.is_alive:
            self.history.state = f"no simulator is heard of ({self.names.node})"
        performer = self._performer
        if performer is not None and performer.code is not None:
            self._performer = None
            self.history.note(f"perform: {performer.last_line}", is_refusal=performer.code != 0)
        self._juggler.tick(self.names)

    def close(self) -> None:
        """End the thread of actions."""
        self._closing.set()
        self._queue.put(None)
        self._worker.join(ANSWER_SECONDS + 1.0)
        if self._performer is not None:
            self._performer.end()
        self._juggler.end()

    # --- actions
    def send(self, *actions: Action) -> None:
        """Send actions after those before; processes are started by this thread."""
        for action in actions:
            match action:
                case Perform(programme):
                    self._perform(programme)
                case Juggle():
                    self._juggler.start(action)
                case StopJuggling():
                    self._juggler.stop()
                case _:
                    if action == Lifecycle("cleanup"):  # what comes is another run
                        self._juggler.end()
                    self._queue.put(action)

    def _perform(self, programme: str) -> None:
        if self._performer is not None:
            self._performer.end()
        arguments = ["-r", f"__ns:={self._node.get_namespace()}"]
        self._performer = Child("perform", programme, "--ros-args", *arguments)

    def _work(self) -> None:
        while (action := self._queue.get()) is not None:
            try:
                self._do(action)
            except Exception as error:  # noqa: BLE001 (of rclpy while it shuts down)
                if self._closing.is_set():
                    return
                self.history.note(one_line(str(error)), is_refusal=True)

    def _do(self, action: Action) -> None:
        match action:
            case Move(values) if len(values) == 1:
                ((name, value),) = values.items()
                self._publishers[name].publish(Float64(data=float(value)))
            case Move():
                self._command.publish(trajectory_to_msg(action.request()))
            case Impulse():
                self._impulse.publish(impulse_to_msg(action.request()))
            case Set(values):
                self._set(values)
            case Call("pause", paused):
                self._call(SetBool, "pause", SetBool.Request(data=bool(paused)), _said)
            case Call(service):
                self._call(Trigger, service, Trigger.Request(), _said)
            case Lifecycle(transition):
                request = ChangeState.Request()
                request.transition.id = _TRANSITIONS[transition]
                self._call(ChangeState, "change_state", request, lambda a: ("", not a.success))

    def _set(self, values: Any) -> None:
        request = SetParametersAtomically.Request(
            parameters=[
                Parameter(name, value=value).to_parameter_msg() for name, value in values.items()
            ]
        )

        def said(answer: Any) -> tuple[str, bool]:
            return answer.result.reason, not answer.result.successful

        self._call(SetParametersAtomically, "set_parameters_atomically", request, said)

    def _call(
        self, kind: type, service: str, request: Any, said: Callable[[Any], tuple[str, bool]]
    ) -> None:
        """Call a service of the node and note its line; say so when there is no answer."""
        name = f"{self.names.node}/{service}"
        key = (kind, name)
        if key not in self._clients:
            self._clients[key] = self._node.create_client(kind, name)
        client = self._clients[key]
        if not client.wait_for_service(ANSWER_SECONDS):
            self.history.note(
                f"{name}: nobody offers it: is the simulator running?", is_refusal=True
            )
            return
        done = threading.Event()
        future = client.call_async(request)
        future.add_done_callback(lambda _: done.set())
        if not done.wait(ANSWER_SECONDS):
            client.remove_pending_request(future)
            self.history.note(f"{name}: no answer in {ANSWER_SECONDS:g} s", is_refusal=True)
            return
        text, refused = said(future.result())
        if refused and not text:
            text = f"{name}: refused"
        if text:
            self.history.note(f"{service}: {text}" if not refused else text, is_refusal=refused)


def _hear(handler: Callable[..., None], msg: Any, info: dict[str, Any]) -> None:
    """Hand a message over with the time at which it was sent."""
    handler(msg, int(info["source_timestamp"] or 0))


def _said(answer: Any) -> tuple[str, bool]:
    return str(answer.message), not answer.success
