"""Requests to the services of a node: none ends the node, and every one is answered.

rclpy lets an exception of a service's callback through to the executor, and its own callbacks for
parameters and lifecycle raise on a value of unknown type or a transition that does not fit. Here
such a request is answered as refused, with the reason where the answer has room for it.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from typing import Any

from lifecycle_msgs.srv import ChangeState
from rcl_interfaces.msg import ParameterType, SetParametersResult
from rcl_interfaces.srv import SetParameters, SetParametersAtomically
from rclpy.lifecycle import LifecycleNode
from rclpy.node import Node
from rclpy.service import Service
from type_description_interfaces.srv import GetTypeDescription

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.field_checks import too_many
from bouncing_disk_ros.limits import REQUEST_ITEMS, REQUEST_TEXT

Refuse = Callable[[InputError], None]
"""What becomes of the reason: a line on the log, a count."""
_KNOWN_TYPES = frozenset(
    value for name, value in vars(ParameterType).items() if name.startswith("PARAMETER_")
)
_TYPE_HASH = re.compile(r"RIHS01_[0-9a-f]{64}")
_ARRAYS = ("byte_array", "bool_array", "integer_array", "double_array", "string_array")


def guard_services(node: Node, refuse: Refuse) -> None:
    """Guard every service that a node has by now; those that are guarded already stay as they are.

    `refuse` is given the reason of each request that is refused here.
    """
    for service in node.services:
        if not isinstance(service.callback, _Guard):
            service.callback = _Guard(node, service, refuse)
            service.send_response = _Answer(service, refuse)


class _Guard:
    """The callback of a service: checks a request, and answers where the real callback fails."""

    def __init__(self, node: Node, service: Service, refuse: Refuse) -> None:
        self._node, self._refuse = node, refuse
        self._callback = service.callback
        self._type = service.srv_type
        self._field = f"~/{service.srv_name.rpartition('/')[2]}"

    def __call__(self, request: Any, response: Any) -> Any:
        if error := _too_large(self._field, request):
            return self._refused(request, error)
        if self._type is SetParameters:
            return self._each(request, response)
        return self._answered(request, response)

    def _answered(self, request: Any, response: Any) -> Any:
        """The answer of the real callback, or that of a refusal."""
        try:
            if error := self._unfit(request):
                return self._refused(request, error)
            return self._callback(request, response)
        except Exception as error:  # noqa: BLE001 (whatever it is: logged, counted, answered)
            why = str(error).partition(", at /")[0]
            given = f"a request that ended in {type(error).__name__}"
            wrong = InputError(self._field, given, "one that can be carried out", why)
            return self._refused(request, wrong)

    def _each(self, request: SetParameters.Request, response: Any) -> Any:
        """Set parameters one by one: a wrong one hides none of the others."""
        for parameter in request.parameters:
            one = SetParameters.Request(parameters=[parameter])
            response.results.extend(self._answered(one, SetParameters.Response()).results)
        return response

    def _unfit(self, request: Any) -> InputError | None:
        """Why a request cannot be carried out, where that is seen before."""
        if self._type is ChangeState and isinstance(self._node, LifecycleNode):
            return _wrong_transition(self._field, self._node, request.transition)
        if self._type is GetTypeDescription and not _TYPE_HASH.fullmatch(request.type_hash):
            hint = "A hash is RIHS01_ and 64 hexadecimal digits."  # else rcl writes ten lines
            return InputError(f"{self._field} type_hash", request.type_hash, "a hash", hint)
        if self._type in (SetParameters, SetParametersAtomically):
            wrong = (_wrong_value(self._node, parameter) for parameter in request.parameters)
            return next(filter(None, wrong), None)
        return None

    def _refused(self, request: Any, error: InputError) -> Any:
        self._refuse(error)
        response = self._type.Response()
        reason = SetParametersResult(successful=False, reason=error.line)
        if self._type is SetParameters:
            response.results = [reason] * len(request.parameters)
        elif self._type is SetParametersAtomically:
            response.result = reason
        else:  # success is false already
            room = {"message", "failure_reason"} & response.get_fields_and_field_types().keys()
            for name in room:
                setattr(response, name, error.line)
        return response


class _Answer:
    """Sends an answer; one that cannot be sent (its client is gone) is logged and counted."""

    def __init__(self, service: Service, refuse: Refuse) -> None:
        self._send, self._refuse = service.send_response, refuse
        self._field = f"~/{service.srv_name.rpartition('/')[2]}"

    def __call__(self, response: Any, header: Any) -> None:
        try:
            self._send(response, header)
        except Exception as error:  # noqa: BLE001 (rclpy has several private types here)
            why = str(error).partition(", at /")[0]
            self._refuse(InputError(self._field, "a client", "one that takes its answer", why))


# --- what is wrong with a request -----------------------------------------------------------------
def _too_large(field: str, request: Any) -> InputError | None:
    """A list in the request that is longer than the limit."""
    for name in request.get_fields_and_field_types():
        value = getattr(request, name)
        if isinstance(value, list) and len(value) > REQUEST_ITEMS:
            return InputError(
                f"{field} {name}", f"{len(value)} of them", f"at most {REQUEST_ITEMS}"
            )
        if isinstance(value, str) and len(value) > REQUEST_TEXT:
            return _too_long(f"{field} {name}", value)
    return None


def _too_long(field: str, text: Sequence[Any]) -> InputError:
    return InputError(field, f"{len(text)} characters", f"at most {REQUEST_TEXT}")


def _wrong_value(node: Node, parameter: Any) -> InputError | None:
    """A parameter whose type ROS does not know, or which is larger than the limits."""
    value, name = parameter.value, parameter.name
    if len(name) > REQUEST_TEXT:
        return _too_long("parameter", name)
    if not name:  # rclpy would make one of it
        return InputError("parameter", name, "a name")
    field = name if node.has_parameter(name) else "parameter"  # others' names are no reasons
    if value.type not in _KNOWN_TYPES:
        return InputError(field, f"a value of type {value.type}", "types 0 to 9",
                          "rcl_interfaces/msg/ParameterType lists the types.")  # fmt: skip
    if len(value.string_value) > REQUEST_TEXT:
        return _too_long(field, value.string_value)
    longest = max(len(getattr(value, f"{kind}_value")) for kind in _ARRAYS)
    return too_many(field, longest, REQUEST_ITEMS) if longest > REQUEST_ITEMS else None


def _wrong_transition(field: str, node: LifecycleNode, transition: Any) -> InputError | None:
    """A transition that the state of a lifecycle node does not have.

    rcl would find it too, and write three lines of its own for each.
    """
    machine = node._state_machine
    known = {row[1]: row[0] for row in machine.available_transitions}
    label, number = transition.label, transition.id
    if label in known if label else number in known.values():
        return None
    names = ", ".join(f"{name} ({value})" for name, value in known.items())
    given = label or f"transition {number}"
    return InputError(field, given, f"from the state {machine.current_state[1]}: {names or 'none'}")
