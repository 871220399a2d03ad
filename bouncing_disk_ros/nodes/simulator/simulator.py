"""The executable `simulator`: one disk in real time. Heavy imports wait until they are needed."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

from bouncing_disk_ros.command_line.start import Start
from bouncing_disk_ros.help_text import parameter_lines, service_lines, topic_lines
from bouncing_disk_ros.kernel_cache import announce_compilation

_ABOUT = """Simulate a disk that bounces on a vibrating platform, in real time. It takes
commands for the platform and publishes the state of the disk, every impact and the rotor
speed. Ctrl-C ends it."""


def help_text() -> str:
    """What --help prints: parameters, topics and services from their tables, one example each."""
    parts = [
        ("Parameters (--ros-args -p NAME:=VALUE)", parameter_lines()),
        ("Topics", topic_lines()),
        ("Services", service_lines()),
    ]
    return "\n\n".join(f"{title}\n" + "\n".join(lines) for title, lines in parts)


def main(args: Sequence[str] | None = None) -> int:
    """Run the simulator until SIGINT, SIGTERM or a lifecycle shutdown; the exit code."""
    start = Start("simulator", _ABOUT, {}, "", args, node_name="bouncing_disk")
    start.parser.epilog = help_text()
    start.parse()
    with start.stop.loading():
        announce_compilation("simulator")
        from bouncing_disk_ros.nodes.simulator.simulator_node import SimulatorNode
        from bouncing_disk_ros.ros.spin import run_node, spin

    return run_node(start, partial(SimulatorNode, stopping=lambda: start.stop.asked), spin)
