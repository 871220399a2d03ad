"""What goes into a bag beside the messages: parameters of the run, its preset, versions."""

from __future__ import annotations

import math
import platform
import time
from array import array
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple

import yaml
from rcl_interfaces.srv import GetParameters, ListParameters
from rclpy.client import Client
from rclpy.node import Node
from rclpy.parameter import parameter_value_to_python

from bouncing_disk_ros.errors import InputError, cut
from bouncing_disk_ros.field_checks import too_many
from bouncing_disk_ros.folders import PACKAGE, share_directory, user_path
from bouncing_disk_ros.limits import (
    ANSWER_BYTES,
    ASKED_NODES,
    PRESET_BYTES,
    REQUEST_ITEMS,
)
from bouncing_disk_ros.parameters import Value
from bouncing_disk_ros.regular_file import read_bytes
from bouncing_disk_ros.ros.node_tool import publishing_nodes
from bouncing_disk_ros.run.presets import load_preset, preset_names

YAML = "text/yaml"
ANSWER_SECONDS = 1.0
"""How long an answer is waited for before the node is asked again: rmw drops the answer of a node
that does not know the asking client yet."""
ASKED_TIMES = 5
Attach = Callable[[str, str, bytes], None]


def dumped(content: Any) -> bytes:
    """YAML as bytes."""
    return yaml.safe_dump(content, sort_keys=False, allow_unicode=True).encode()


def versions(package_version: str) -> bytes:
    """What made the bag."""
    names = ("mcap", "numpy")
    machine = {"python": platform.python_version(), "machine": platform.machine()}
    libraries = {name: version(name) for name in names}
    return dumped({PACKAGE: package_version, **machine, **libraries})


class _Asked(NamedTuple):
    """A node that is, or will be, asked for its parameters and has not answered."""

    names: Client
    values: Client
    since: float = -math.inf  # when it was asked last, monotonic clock, s
    times: int = 0


class RunParameters:
    """Asks the nodes that publish a topic for their parameters, and attaches them once each.

    The attachment `parameters/<node>.yaml` is a ROS parameter file. A preset that it names follows
    as `preset/<name>.yaml` if it is one of the package, or one of `presets`, the files that the
    user of the recorder has named: a node can name any file of this machine.
    """

    def __init__(
        self, node: Node, topic: str, attach: Attach, presets: Sequence[Path] = ()
    ) -> None:
        self._node, self._topic, self._attach = node, topic, attach
        self._presets = {user_path(path).resolve(): path for path in presets}
        self._known: set[str] = set()
        self._open: dict[str, _Asked] = {}
        self._told: set[str] = set()

    # --- asking -----------------------------------------------------------------------------------
    def look(self) -> None:
        """Ask those that are new, once their services are there; again where no answer comes."""
        for name in publishing_nodes(self._node, self._topic):
            if name not in self._known and len(self._known) < ASKED_NODES:
                self._known.add(name)
                self._prepare(name)
        for name, (names, values, since, times) in list(self._open.items()):
            is_due = time.monotonic() > since + ANSWER_SECONDS and times < ASKED_TIMES
            if is_due and names.service_is_ready() and values.service_is_ready():
                self._open[name] = _Asked(names, values, time.monotonic(), times + 1)
                self._ask(name, names, values)

    @property
    def is_answer_due(self) -> bool:
        """Whether a node that was asked, and is still there, has not answered."""
        return any(one.times and one.values.service_is_ready() for one in self._open.values())

    def warn_of_missing(self) -> None:
        """Name the nodes that gave no answer until now."""
        for name in self._open:
            self._warn_not_attached(name, "it gave no answer until the recording ended")

    def _prepare(self, name: str) -> None:
        def make() -> None:
            self._open[name] = _Asked(
                self._node.create_client(ListParameters, f"{name}/list_parameters"),
                self._node.create_client(GetParameters, f"{name}/get_parameters"),
            )

        self._attempt(name, make)

    def _ask(self, name: str, names: Client, values: Client) -> None:
        def on_names(answer: Any) -> None:
            found = sorted(answer.result().result.names)
            if len(found) > REQUEST_ITEMS:
                raise too_many("list_parameters", len(found), REQUEST_ITEMS)
            request = GetParameters.Request(names=found)
            values.call_async(request).add_done_callback(partial(on_values, found))

        def on_values(found: list[str], answer: Any) -> None:
            self._attempt(name, lambda: self._on_values(name, found, answer.result().values))

        asked = names.call_async(ListParameters.Request())
        asked.add_done_callback(lambda answer: self._attempt(name, lambda: on_names(answer)))

    def _on_values(self, name: str, names: list[str], values: Sequence[Any]) -> None:
        pairs = answered(names, values)
        if self._open.pop(name, None) is None:  # asked twice, answered twice
            return
        self._attach(f"parameters{name}.yaml", YAML, dumped({name: {"ros__parameters": pairs}}))
        preset = pairs.get("preset")
        if isinstance(preset, str) and preset:
            self._attach_preset(preset)

    def _attempt(self, name: str, action: Callable[[], object]) -> None:
        """Do something with another node's name or answer, which may be anything."""
        try:
            action()
        except Exception as error:  # noqa: BLE001 (reported, and the recording goes on)
            self._open.pop(name, None)
            self._warn_not_attached(name, cut(str(error), 300))

    def _warn_not_attached(self, name: str, why: str) -> None:
        self._warn_once(f"the parameters of {cut(name)} are not attached: {why}")

    # --- presets ----------------------------------------------------------------------------------
    def _attach_preset(self, name: str) -> None:
        try:
            path = self._allowed(name)
            self._attach(f"preset/{path.name}", YAML, preset_bytes(path))
        except InputError as error:
            why = error.hint or error.line
            self._warn_once(
                f"preset {cut(name)!r}: its values are attached, its file is not. {why}"
            )

    def _allowed(self, name: str) -> Path:
        """The file of a preset that a node has named, or InputError."""
        if name in preset_names():
            return share_directory() / "config" / f"{name}.yaml"
        path = user_path(name).resolve()
        if path in self._presets:
            return path
        hint = "Only presets of the package are, and files that this recorder's presets name."
        raise InputError("preset", name, "a preset of the package", hint)

    def _warn_once(self, line: str) -> None:
        """Log a line, once."""
        if line not in self._told and len(self._told) < ASKED_NODES:
            self._told.add(line)
            self._node.get_logger().warning(line)


def answered(names: Sequence[str], values: Sequence[Any]) -> dict[str, Any]:
    """The parameters in an answer of a node, as YAML takes them; InputError when it is none."""
    if len(values) != len(names):
        raise InputError("get_parameters", f"{len(values)} values", f"{len(names)}, as asked")
    size = sum(map(_size, names)) + sum(map(_size_of, values))
    if size > ANSWER_BYTES:
        raise InputError("get_parameters", f"{size} bytes", f"at most {ANSWER_BYTES} bytes")
    try:
        return {
            name: plain(parameter_value_to_python(value))
            for name, value in zip(names, values, strict=True)
        }
    except RuntimeError as error:  # a type that ROS does not know
        raise InputError("get_parameters", str(error), "types 0 to 9") from None


def _size_of(value: Any) -> int:
    """About the bytes of a parameter's value, whichever of its fields it is in."""
    return sum(_size(getattr(value, field)) for field in value.get_fields_and_field_types())


def _size(content: Any) -> int:
    if isinstance(content, str):
        return len(content)
    if isinstance(content, list):  # of texts, bytes or booleans
        return sum(8 + _size(one) for one in content)
    return 8 * len(content) if isinstance(content, array) else 8


def preset_bytes(path: Path) -> bytes:
    """The content of a preset's file; InputError when it cannot be read or is no preset."""
    path = user_path(path)
    content = read_bytes("preset", path, PRESET_BYTES)
    load_preset(str(path.absolute()))
    return content


def plain(value: Any) -> Any:
    """A parameter's value as YAML takes it."""
    return list(value) if isinstance(value, (array, tuple)) else value


def own_parameters(name: str, values: Mapping[str, Value]) -> bytes:
    """The recorder's own parameters as a parameter file."""
    return dumped({name: {"ros__parameters": dict(values)}})
