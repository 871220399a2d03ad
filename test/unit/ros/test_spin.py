"""run_node: however a node ends, an exit code and one line."""

from __future__ import annotations

import pytest
from rclpy.node import Node

from bouncing_disk_ros.errors import FailedError, InputError
from bouncing_disk_ros.ros.spin import run_node
from bouncing_disk_ros.ros.stop import Stop


@pytest.mark.parametrize(
    ("error", "code"), [(FailedError("the disk is full"), 1), (InputError("a", 1, "2"), 2)]
)
def test_an_error_while_the_node_is_made_is_one_line(
    error: Exception, code: int, capsys: pytest.CaptureFixture[str]
) -> None:
    def make() -> Node:
        raise error

    def work(_node: Node, _stop: Stop) -> int:
        raise AssertionError("there is no node")

    assert run_node("it", [], make, work, Stop()) == code
    assert capsys.readouterr().err == f"it: {error}\n"
