"""What the small executables share: a table of options, --help, start, waiting, exit codes."""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from typing import TypeVar

import rclpy
from rclpy.exceptions import InvalidNamespaceException, InvalidNodeNameException, ParameterException
from rclpy.node import Node

from bouncing_disk_ros.errors import ExitCode, InputError, closest
from bouncing_disk_ros.parameters import Spec, Value
from bouncing_disk_ros.ros.declare import descriptor_of, is_foreign
from bouncing_disk_ros.ros.spin import bad_input, init, spin_until
from bouncing_disk_ros.ros.stop import Stop
from bouncing_disk_ros.tables import spec_lines

AnyNode = TypeVar("AnyNode", bound=Node)


class FailedError(Exception):
    """One line for the user about what went wrong that is not the input; exit code 1."""


def options(node: Node, table: Mapping[str, Spec]) -> dict[str, Value]:
    """Declare the options of a table on a node; unknown names and wrong values are InputErrors."""
    given = {name: override.value for name, override in node._parameter_overrides.items()}
    for name in given:
        if name not in table and not is_foreign(name):
            hint = closest(name, table) or "--help lists them."
            raise InputError("parameter", name, ", ".join(table), hint)
    values = {name: spec.checked(given.get(name, spec.default)) for name, spec in table.items()}
    for name, spec in table.items():
        node.declare_parameter(name, values[name], descriptor_of(spec), True)
    return values


def run_tool(
    name: str, argv: Sequence[str], make: Callable[[], AnyNode], work: Callable[[AnyNode], int],
    stop: Stop,
) -> int:  # fmt: skip
    """Init, make the node, do the work, end in order; the exit code. Every error is one line."""
    try:
        init([name, *argv])
        node = make()
    except InputError as error:
        return bad_input(name, error.line)
    except (InvalidNamespaceException, InvalidNodeNameException, ParameterException) as error:
        return bad_input(name, str(error))
    stop.running = True
    try:
        return work(node)
    except InputError as error:
        return bad_input(name, error.line)
    except FailedError as error:
        print(f"{name}: {error}", file=sys.stderr, flush=True)
        return ExitCode.FAILED
    finally:
        node.destroy_node()
        rclpy.try_shutdown()


def wait_for(node: Node, stop: Stop, condition: Callable[[], object], timeout: float) -> bool:
    """Run callbacks until a condition holds, a signal came or `timeout` seconds passed.

    Returns whether the condition holds.
    """
    end = time.monotonic() + timeout
    spin_until(node, lambda: bool(condition()) or stop.asked or time.monotonic() > end)
    return bool(condition())


def own_arguments(argv: Sequence[str]) -> list[str]:
    """What stands before --ros-args."""
    return list(argv[: argv.index("--ros-args")] if "--ros-args" in argv else argv)


def parser_of(
    name: str, about: str, table: Mapping[str, Spec], example: str
) -> argparse.ArgumentParser:
    """The parser of an executable; --help shows its options from the table."""
    lines = ["parameters (--ros-args -p NAME:=VALUE):"]
    for spec in table.values():
        lines += spec_lines(spec)
    return argparse.ArgumentParser(
        prog=name,
        description=about,
        usage=f"{name} [--help] [--ros-args -p NAME:=VALUE ... -r __ns:=/NAMESPACE ...]",
        epilog="\n".join([*lines, "", "example:", f"  {example}"]),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
