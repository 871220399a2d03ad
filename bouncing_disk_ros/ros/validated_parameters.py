"""Parameters of the table on a node: presets, overrides, descriptors and live changes."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from copy import deepcopy
from typing import Any

from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    SetParametersResult,
)
from rclpy.node import Node
from rclpy.parameter import Parameter

from bouncing_disk_ros import parameters
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.parameters import TABLE, Spec, Value, is_rclpy_parameter
from bouncing_disk_ros.run.presets import load_preset
from bouncing_disk_ros.sliders import slider_of


def start_values(node: Node) -> dict[str, Value]:
    """The whole set of parameters of a node: defaults, then its preset, then its overrides.

    Everything is checked; unknown names are InputErrors. `use_sim_time` is set to false: a launch
    file that sets it for all nodes may start the simulator too.
    """
    overrides = {name: override.value for name, override in node._parameter_overrides.items()}
    if node.get_parameter("use_sim_time").value:
        warn_of_sim_time(node)
        node.set_parameters([Parameter("use_sim_time", value=False)])
    own = {name: value for name, value in overrides.items() if not is_rclpy_parameter(name)}
    given = parameters.checked(own)
    name = str(given.get("preset", ""))
    preset = load_preset(name) if name else {}
    return parameters.complete({**preset, **given})


def warn_of_sim_time(node: Node) -> None:
    """Say, once, that the simulator does not follow /clock."""
    node.get_logger().warning(
        "use_sim_time is ignored: the simulator is the source of time; publish_clock:=true "
        "publishes it",
        once=True,
    )


def descriptor_of(spec: Spec) -> ParameterDescriptor:
    """The ROS descriptor of a row of the table."""
    kinds = {bool: Parameter.Type.BOOL, int: Parameter.Type.INTEGER, float: Parameter.Type.DOUBLE,
             str: Parameter.Type.STRING}  # fmt: skip
    unit = f" [{spec.shown_unit}]" if spec.shown_unit else ""
    descriptor = ParameterDescriptor(
        name=spec.name,
        type=(Parameter.Type.STRING_ARRAY if spec.listed else kinds[spec.type]).value,
        description=f"{spec.description}{unit}",
        additional_constraints=spec.allowed,
        read_only=spec.read_only,
    )
    if spec.low is not None and spec.high is not None:
        if spec.type is int:
            bounds = IntegerRange(from_value=int(spec.low), to_value=int(spec.high), step=1)
            descriptor.integer_range = [bounds]
        else:
            limits = FloatingPointRange(from_value=spec.low, to_value=spec.high, step=0.0)
            descriptor.floating_point_range = [limits]
    return descriptor


def with_slider(descriptor: ParameterDescriptor, value: Value) -> ParameterDescriptor:
    """A descriptor whose range suits a slider at a value; what is allowed stays in its text."""
    slider = slider_of(descriptor.name, value)
    if slider is None:
        return descriptor
    low, high = slider
    shown = deepcopy(descriptor)
    for bounds in (*shown.floating_point_range, *shown.integer_range):
        bounds.from_value, bounds.to_value = low, high
    return shown


class ValidatedParameters:
    """Declares the table on a node and stands before every later change.

    `apply` receives the checked values of an accepted change, `refuse` each InputError. The node
    calls `refusal` from its `set_parameters_atomically`, so that every refusal is one clear line.
    """

    def __init__(
        self,
        node: Node,
        values: Mapping[str, Value],
        apply: Callable[[dict[str, Value]], None],
        refuse: Callable[[InputError], None],
        is_configured: Callable[[], bool],
    ) -> None:
        self.values: dict[str, Value] = dict(values)
        self._node, self._apply, self._refuse = node, apply, refuse
        self._is_configured = is_configured
        for name, spec in TABLE.items():
            node.declare_parameter(name, self.values[name], descriptor_of(spec), True)
        node.add_pre_set_parameters_callback(self._cast)
        node.add_on_set_parameters_callback(self._validate)
        node.add_post_set_parameters_callback(self._applied)

    def changed(self, changes: Sequence[Parameter]) -> list[Parameter]:
        """The changes without fixed parameters that stay as they are (as in a loaded dump)."""
        return [change for change in self._cast(changes) if not self._stays(change)]

    def notice(self, changes: Sequence[Parameter]) -> str:
        """What the answer to an accepted change says besides; empty when it acts at once."""
        own = [change.name for change in changes if change.name in TABLE]
        return parameters.later_text(own) if self._is_configured() else ""

    def _cast(self, changes: Sequence[Parameter]) -> list[Parameter]:
        """As `cast`; and where use_sim_time is set it stays false."""
        return [self._without_sim_time(change) for change in cast(changes)]

    def _without_sim_time(self, change: Parameter) -> Parameter:
        if change.name != "use_sim_time" or change.value is not True:
            return change
        warn_of_sim_time(self._node)
        return Parameter("use_sim_time", value=False)

    def _stays(self, change: Parameter) -> bool:
        node, name = self._node, change.name
        if not node.has_parameter(name):
            return False
        configured = self._is_configured()
        is_fixed = name in TABLE and parameters.is_fixed(name, is_configured=configured)
        if not (is_fixed or node.describe_parameter(name).read_only):
            return False
        present = node.get_parameter(name)
        return bool(present.type_ is change.type_ and present.value == change.value)

    def refusal(self, changes: Sequence[Parameter]) -> SetParametersResult | None:
        """Why a change cannot be made (counted), or None."""
        try:
            self._check(changes)
        except InputError as error:
            self._refuse(error)
            return SetParametersResult(successful=False, reason=error.line)
        return None

    def _check(self, changes: Sequence[Parameter]) -> None:
        for change in changes:
            if change.type_ is Parameter.Type.NOT_SET and change.name in TABLE:
                allowed = TABLE[change.name].allowed
                raise InputError(change.name, None, allowed, "It cannot be deleted.")
            if change.name == "use_sim_time" and change.value is not False:
                raise InputError("use_sim_time", change.value, "true or false")
        own = [
            (change.name, change.value)
            for change in changes
            if not (is_rclpy_parameter(change.name) and self._node.has_parameter(change.name))
        ]
        parameters.checked_change(own, self.values, is_configured=self._is_configured())

    def _validate(self, changes: Sequence[Parameter]) -> SetParametersResult:
        return self.refusal(changes) or SetParametersResult(successful=True)

    def _applied(self, changes: Sequence[Parameter]) -> None:
        values = own_values(changes)
        if values:
            self.values.update(values)
            self._apply(values)


def own_values(changes: Sequence[Parameter]) -> dict[str, Value]:
    """The values of the parameters of the table among changes, cast."""
    own: dict[str, Any] = {c.name: c.value for c in changes if c.name in TABLE}
    return parameters.checked(own)


def cast(changes: Sequence[Parameter]) -> list[Parameter]:
    """What `Spec.cast` makes of each value, such as a double of an integer or a part of π."""
    return [
        _cast(change, TABLE[change.name]) if change.name in TABLE else change for change in changes
    ]


def _cast(change: Parameter, spec: Spec) -> Parameter:
    value = spec.cast(change.value)
    if value is change.value:
        return change
    return Parameter(change.name, value=value)
