"""What a control does to a run: the command of ROS that a user would send, as data.

`lines(action, names)` are the command lines; a link to a run (`run_link.RunLink`) sends actions.
"""

from __future__ import annotations

import math
import shlex
from collections.abc import Mapping
from dataclasses import dataclass, field

from bouncing_disk_ros.parameters import TABLE, Value, spec_of
from bouncing_disk_ros.run.command_validation import (
    ImpulseRequest,
    PointRequest,
    ProgrammeRequest,
)
from bouncing_disk_ros.topics import SERVICES


@dataclass(frozen=True)
class Names:
    """How the simulator is called: full name of its node, namespace of its topics."""

    node: str = "/bouncing_disk"
    namespace: str = "/"

    def topic(self, name: str) -> str:
        """The full name of a topic of the table."""
        return name if name.startswith("/") else f"{self.namespace.rstrip('/')}/{name}"


@dataclass(frozen=True)
class Move:
    """Command the platform: values by the names of a motion, now."""

    values: Mapping[str, float]

    def request(self) -> ProgrammeRequest:
        """What is asked of the run."""
        point = PointRequest(tuple(map(float, self.values.values())), 0)
        return ProgrammeRequest(tuple(self.values), (point,))


@dataclass(frozen=True)
class Set:
    """Set parameters of the node, all or none."""

    values: Mapping[str, Value]


@dataclass(frozen=True)
class Impulse:
    """Give the disk an impulse now, N·s and N·m·s."""

    axial: float = 0.0
    angular: float = 0.0

    def request(self) -> ImpulseRequest:
        """What is asked of the run."""
        return ImpulseRequest((0.0, 0.0, float(self.axial)), (0.0, 0.0, float(self.angular)))


@dataclass(frozen=True)
class Call:
    """Call a service of the node: pause (with `paused`), step, reset."""

    service: str
    paused: bool | None = None


@dataclass(frozen=True)
class Lifecycle:
    """A transition of the node: deactivate, cleanup, configure, activate."""

    transition: str


@dataclass(frozen=True)
class Perform:
    """Perform a programme of platform motions by its name."""

    programme: str


@dataclass(frozen=True)
class Juggle:
    """Start a loop that keeps the toss going, instead of one that runs; options of `juggle`."""

    strategy: str
    options: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class StopJuggling:
    """End the loop that was started."""


Action = Move | Set | Impulse | Call | Lifecycle | Perform | Juggle | StopJuggling


def yaml_number(value: float) -> str:
    """A number as YAML reads it back: the shortest that is the same double."""
    if math.isinf(value) or math.isnan(value):
        return {math.inf: ".inf", -math.inf: "-.inf"}.get(value, ".nan")
    text = repr(float(value))
    mantissa, e, exponent = text.partition("e")
    return f"{mantissa}.0{e}{exponent}" if e and "." not in mantissa else text


def value_text(value: Value) -> str:
    """A value as a command line has it."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float):
        return yaml_number(value)
    return str(value)


def typed_value(name: str, text: str) -> Value:
    """The value of a parameter that somebody has typed; a text that is none stays a text."""
    kind = spec_of(name).type
    if kind is bool and text.lower() in ("true", "false"):
        return text.lower() == "true"
    if kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            return text
    return text


RUN_NAMES = tuple(
    name
    for name, spec in TABLE.items()
    if spec.group in ("motion", "disk", "start")
    or name in ("state_rate", "real_time_factor", "crossfade_duration")
)
"""The parameters that a run of its own sets: programmes are made of cross-fades."""


def new_run(wanted: Mapping[str, Value], own: Mapping[str, Value]) -> list[Action]:
    """What begins a run of its own with these parameters; `own`: those that the node has."""
    changed = {name: value for name, value in wanted.items() if own.get(name) != value}
    settings = [Set(changed)] if changed else []
    begin = Lifecycle("deactivate"), Lifecycle("cleanup")
    return [*begin, *settings, Lifecycle("configure"), Lifecycle("activate")]


def _published(names: Names, topic: str, kind: str, content: str) -> str:
    return f"ros2 topic pub --once {names.topic(topic)} {kind} {shlex.quote(content)}"


def _move_line(action: Move, names: Names) -> str:
    if len(action.values) == 1:
        ((name, value),) = action.values.items()
        content = f"{{data: {yaml_number(value)}}}"
        return _published(names, f"platform/{name}", "std_msgs/msg/Float64", content)
    joints = ", ".join(action.values)
    positions = ", ".join(map(yaml_number, action.values.values()))
    content = f"{{joint_names: [{joints}], points: [{{positions: [{positions}]}}]}}"
    kind = "trajectory_msgs/msg/JointTrajectory"
    return _published(names, "platform/command", kind, content)


def _impulse_line(action: Impulse, names: Names) -> str:
    parts = []
    if action.axial != 0.0 or action.angular == 0.0:
        parts.append(f"force: {{z: {yaml_number(action.axial)}}}")
    if action.angular != 0.0:
        parts.append(f"torque: {{z: {yaml_number(action.angular)}}}")
    content = f"{{wrench: {{{', '.join(parts)}}}}}"
    return _published(names, "disk/impulse", "geometry_msgs/msg/WrenchStamped", content)


def _call_line(action: Call, names: Names) -> str:
    kind = SERVICES[f"~/{action.service}"].type
    request = "" if action.paused is None else f" '{{data: {str(action.paused).lower()}}}'"
    return f"ros2 service call {names.node}/{action.service} {kind}{request}"


def lines(action: Action, names: Names) -> list[str]:
    """The command lines that do the same from a terminal."""
    match action:
        case Move():
            return [_move_line(action, names)]
        case Set(values):
            return [
                f"ros2 param set {names.node} {name} {shlex.quote(value_text(values[name]))}"
                for name in sorted(values, key=_set_order)
            ]
        case Impulse():
            return [_impulse_line(action, names)]
        case Call():
            return [_call_line(action, names)]
        case Lifecycle(transition):
            return [f"ros2 lifecycle set {names.node} {transition}"]
        case Perform(programme):
            space = "" if names.namespace == "/" else f" --ros-args -r __ns:={names.namespace}"
            return [f"ros2 run bouncing_disk_ros perform {programme}{space}"]
        case Juggle():
            space = "" if names.namespace == "/" else f" -r __ns:={names.namespace}"
            words = " ".join(juggle_arguments(action))
            return [f"ros2 run bouncing_disk_ros juggle --ros-args {words}{space}"]
        case StopJuggling():
            return ["# Ctrl-C in the terminal of juggle"]


def juggle_arguments(action: Juggle) -> list[str]:
    """What follows `--ros-args` on the command line of `juggle`, namespaces left out."""
    given = {"strategy": action.strategy} | {
        name: yaml_number(value) for name, value in action.options.items()
    }
    return [word for name, text in given.items() for word in ("-p", f"{name}:={text}")]


def _set_order(name: str) -> tuple[int, int]:
    """Switches before numbers: some numbers are refused until a switch is set."""
    place = list(TABLE).index(name) if name in TABLE else len(TABLE)
    return (0 if name in TABLE and TABLE[name].type is bool else 1, place)
