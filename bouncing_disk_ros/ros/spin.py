"""Start, spin and end of a node process: signals, exit codes, no traceback for bad input."""

from __future__ import annotations

import re
import time
import warnings
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, TypeVar

import rclpy
from rclpy.exceptions import InvalidNamespaceException, InvalidNodeNameException, ParameterException
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.logging import LoggingSeverity, set_logger_level
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

from bouncing_disk_ros.command_line.environment import security_is_on
from bouncing_disk_ros.command_line.start import Start
from bouncing_disk_ros.command_line.stop import Answer, Stop
from bouncing_disk_ros.errors import ExitCode, FailedError, InputError
from bouncing_disk_ros.ros.requests import guard_services
from bouncing_disk_ros.run.throttled_log import ThrottledLog

try:
    from rclpy.experimental import EventsExecutor as EventsExecutor  # exported
except ImportError:  # rclpy before 7.1.4
    EventsExecutor = None

AnyNode = TypeVar("AnyNode", bound=Node)
SPIN_SECONDS = 0.2
"""Longest wait before a signal is looked at (the executor cannot be interrupted while it waits)."""


def executor_of(node: Node) -> Any:
    """The executor for a node: rclpy's EventsExecutor, or the single-threaded where it is missing.

    The latter does the same at more work for each tick; the node's log says so, once.
    """
    if EventsExecutor is not None:
        return EventsExecutor(context=node.context)
    node.get_logger().info(
        "this rclpy has no EventsExecutor (it came with 7.1.4): the SingleThreadedExecutor is "
        "used, which takes more processor time for each tick",
        once=True,
    )
    return SingleThreadedExecutor(context=node.context)


def spin_until(node: Node, stop: Callable[[], bool]) -> None:
    """Run the callbacks of a node until `stop` says so."""
    executor = executor_of(node)
    executor.add_node(node)
    try:
        while not stop() and node.context.ok():
            executor.spin_once(timeout_sec=SPIN_SECONDS)
    except ExternalShutdownException:
        pass
    finally:
        executor.remove_node(node)
        executor.shutdown()


def spin(node: Node, stop: Stop) -> int:
    """Run the callbacks of a node until a signal, or until it is `finished`; the exit code.

    Raises the node's `failure`, if that is why it has finished.
    """
    spin_until(node, lambda: stop.asked or bool(getattr(node, "finished", False)))
    if not stop.asked:  # the answer to the request that ended it is on its way
        end = time.monotonic() + SPIN_SECONDS
        spin_until(node, lambda: stop.asked or time.monotonic() > end)
    if (failure := getattr(node, "failure", None)) is not None:
        raise failure
    return ExitCode.DONE


def run_node(
    start: Start, make: Callable[[], AnyNode], work: Callable[[AnyNode, Stop], int]
) -> int:
    """Init, make the node, do its work, end in order; the exit code. Every error is one line."""
    return start.run(partial(_run_node, start, make, work))


def _run_node(
    start: Start, make: Callable[[], AnyNode], work: Callable[[AnyNode, Stop], int]
) -> int:
    try:
        init([start.name, *start.ros])
        with warnings.catch_warnings():  # of what rclpy cannot undo where it could make no node
            warnings.filterwarnings("ignore", "Failed to fini", RuntimeWarning)
            node = _made(make, start.ros)
        guard_services(node, ThrottledLog(node.get_logger().warning).note_refusal)
        start.stop.answer = Answer.NOTE
        try:
            return work(node, start.stop)
        finally:
            node.destroy_node()
    finally:
        rclpy.try_shutdown()


def _made(make: Callable[[], AnyNode], ros: Sequence[str]) -> AnyNode:
    """The node; what ROS refuses is an InputError, what the middleware cannot do a FailedError."""
    try:
        return make()
    except (InvalidNamespaceException, InvalidNodeNameException, ParameterException) as error:
        raise _malformed(ros, str(error)) from None
    except rclpy_implementation.RCLError as error:
        why = _describe(error)
        if security_is_on():
            raise _no_security(why) from None
        raise FailedError(f"the middleware cannot make the node: {why}") from None


def init(argv: Sequence[str]) -> None:
    """rclpy.init with the signals left alone; malformed ROS arguments are an InputError."""
    set_logger_level("rcl", LoggingSeverity.FATAL)  # it would say the same again
    try:
        rclpy.init(args=list(argv), signal_handler_options=SignalHandlerOptions.NO)
    except Exception as error:  # noqa: BLE001 (rclpy raises several private types here)
        if security_is_on():
            raise _no_security(_describe(error)) from None
        raise _malformed(argv[1:], _describe(error)) from None
    set_logger_level("rcl", LoggingSeverity.UNSET)


def _malformed(ros: Sequence[str], why: str) -> InputError:
    """The error of ROS arguments that ROS refuses."""
    return InputError("arguments", " ".join(ros), "ROS 2 arguments after --ros-args", why)


def _describe(error: Exception) -> str:
    """What rcl says of an error, without the places in its sources."""
    return re.sub(r",? at /\S+", "", str(error)).removeprefix("failed to initialize rcl: ")


def _no_security(why: str) -> InputError:
    """The error of a middleware that cannot be secured as the environment asks."""
    if "security libraries" in why:
        why = "This Fast DDS is built without security (that of the pip wheels is); a ROS 2 "
        why += "installation has it"
    hint = f"{' '.join(why.split()).rstrip('.')}. See docs/security.md, or unset it."
    return InputError("ROS_SECURITY_ENABLE", "true", "an enclave that this process can use", hint)
