"""Start, spin and end of a node process: signals, exit codes, no traceback for bad input."""

from __future__ import annotations

import re
import sys
import time
import warnings
from collections.abc import Callable, Sequence
from typing import Any, TypeVar

import rclpy
from rclpy.exceptions import InvalidNamespaceException, InvalidNodeNameException, ParameterException
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.logging import LoggingSeverity, set_logger_level
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

from bouncing_disk_ros.environment import security_is_on
from bouncing_disk_ros.errors import ExitCode, FailedError, InputError, one_line
from bouncing_disk_ros.ros.requests import guard_services
from bouncing_disk_ros.ros.stop import Stop
from bouncing_disk_ros.run.throttled_log import RefusalLog

try:
    from rclpy.experimental import EventsExecutor
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
    name: str,
    ros: Sequence[str],
    make: Callable[[], AnyNode],
    work: Callable[[AnyNode, Stop], int],
    stop: Stop,
) -> int:
    """Init, make the node, do its work, end in order; the exit code. Every error is one line.

    `ros`: the command line from --ros-args on; `stop` as installed before the slow imports.
    """
    try:
        init([name, *ros])
        with warnings.catch_warnings():  # of what rclpy cannot undo where it could make no node
            warnings.filterwarnings("ignore", "Failed to fini", RuntimeWarning)
            node = make()
    except InputError as error:
        return bad_input(name, error.line)
    except FailedError as error:
        bad_input(name, str(error))
        return ExitCode.FAILED
    except (InvalidNamespaceException, InvalidNodeNameException, ParameterException) as error:
        return bad_input(name, str(error))
    except rclpy_implementation.RCLError as error:
        return _no_node(name, _describe(error))
    guard_services(node, RefusalLog(node.get_logger().warning).note)
    stop.running = True
    try:
        return work(node, stop)
    except InputError as error:
        return bad_input(name, error.line)
    except FailedError as error:
        print(f"{name}: {error}", file=sys.stderr, flush=True)
        return ExitCode.FAILED
    finally:
        node.destroy_node()
        rclpy.try_shutdown()


def init(argv: Sequence[str]) -> None:
    """rclpy.init with the signals left alone; malformed ROS arguments are an InputError."""
    set_logger_level("rcl", LoggingSeverity.FATAL)  # it would say the same again
    try:
        rclpy.init(args=list(argv), signal_handler_options=SignalHandlerOptions.NO)
    except Exception as error:  # noqa: BLE001 (rclpy raises several private types here)
        if security_is_on():
            raise _no_security(_describe(error)) from None
        given = " ".join(argv[1:])
        raise InputError(
            "arguments", given, "ROS 2 arguments after --ros-args", _describe(error)
        ) from None
    set_logger_level("rcl", LoggingSeverity.UNSET)


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


def _no_node(name: str, why: str) -> int:
    """Say on stderr why the middleware made no node; the exit code."""
    if security_is_on():
        return bad_input(name, _no_security(why).line)
    bad_input(name, f"the middleware cannot make the node: {why}")
    return ExitCode.FAILED


def bad_input(name: str, line: str) -> int:
    """Say on stderr what cannot be used; exit code 2."""
    if rclpy.ok():
        rclpy.try_shutdown()
    print(f"{name}: {one_line(line)}", file=sys.stderr, flush=True)
    return ExitCode.BAD_INPUT
