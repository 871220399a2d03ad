"""What goes into a bag beside the messages: parameters of the run, its preset, versions."""

from __future__ import annotations

import platform
from collections.abc import Callable, Mapping
from importlib.metadata import version
from pathlib import Path
from typing import Any

import yaml
from rcl_interfaces.srv import GetParameters, ListParameters
from rclpy.client import Client
from rclpy.node import Node
from rclpy.parameter import parameter_value_to_python

from bouncing_disk_ros.folders import PACKAGE, share_directory
from bouncing_disk_ros.parameters import Value

YAML = "text/yaml"
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


class RunParameters:
    """Asks the nodes that publish a topic for their parameters, once each, and attaches them.

    The attachment `parameters/<node>.yaml` is a ROS parameter file; a preset that it names follows
    as `preset/<name>.yaml`.
    """

    def __init__(self, node: Node, topic: str, attach: Attach) -> None:
        self._node, self._topic, self._attach = node, topic, attach
        self._asked: set[str] = set()
        self._waiting: dict[str, tuple[Client, Client]] = {}

    def look(self) -> None:
        """Ask those that are new, once their services are there."""
        for info in self._node.get_publishers_info_by_topic(self._topic):
            name = f"{info.node_namespace.rstrip('/')}/{info.node_name}"
            if name not in self._asked:
                self._asked.add(name)
                self._waiting[name] = (
                    self._node.create_client(ListParameters, f"{name}/list_parameters"),
                    self._node.create_client(GetParameters, f"{name}/get_parameters"),
                )
        for name, (names, values) in list(self._waiting.items()):
            if names.service_is_ready() and values.service_is_ready():
                del self._waiting[name]
                self._ask(name, names, values)

    def _ask(self, name: str, names: Client, values: Client) -> None:
        def on_names(future: Any) -> None:
            found = sorted(future.result().result.names)
            request = GetParameters.Request(names=found)
            values.call_async(request).add_done_callback(
                lambda answer: self._on_values(name, found, answer.result().values)
            )

        names.call_async(ListParameters.Request()).add_done_callback(on_names)

    def _on_values(self, name: str, names: list[str], values: Any) -> None:
        pairs = {
            key: plain(parameter_value_to_python(value))
            for key, value in zip(names, values, strict=False)
        }
        file = f"parameters{name}.yaml"
        self._attach(file, YAML, dumped({name: {"ros__parameters": pairs}}))
        if preset := pairs.get("preset"):
            self._attach_preset(str(preset))

    def _attach_preset(self, name: str) -> None:
        path = Path(name).expanduser()
        if "/" not in name and path.suffix not in (".yaml", ".yml"):
            path = share_directory() / "config" / f"{name}.yaml"
        try:
            self._attach(f"preset/{path.name}", YAML, path.read_bytes())
        except OSError as error:
            self._node.get_logger().warning(f"preset {name} is not attached: {error}")


def plain(value: Any) -> Any:
    """A parameter's value as YAML takes it."""
    return (
        list(value) if hasattr(value, "__iter__") and not isinstance(value, (str, bytes)) else value
    )


def own_parameters(name: str, values: Mapping[str, Value]) -> bytes:
    """The recorder's own parameters as a parameter file."""
    return dumped({name: {"ros__parameters": dict(values)}})
