"""The executable `workbench` as a process: it starts a simulator, or takes the one that runs."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator

import psutil
import pytest

from support.page_client import PageClient
from support.processes import Process, Starter

ROS = ("--ros-args", "-p", "port:=0", "-p", "open_browser:=false")


@pytest.fixture
def visit() -> Iterator[Callable[[Process], PageClient]]:
    """Open the page that a process serves."""
    opened: list[PageClient] = []

    def open_page(process: Process) -> PageClient:
        found = process.wait_for(r"workbench: .*: (http://\S+)$", 60.0)
        opened.append(PageClient(found[1]))
        return opened[-1]

    yield open_page
    for page in opened:
        page.close()


def simulators_of(process: Process) -> list[psutil.Process]:
    """The simulators that a process has started."""
    children = psutil.Process(process.pid).children(recursive=True)
    return [child for child in children if "simulator" in child.cmdline()]


def path_end(page: PageClient) -> float:
    times = page.model("path").data["time"]
    return float(times[-1]) if len(times) else -1.0


def test_it_starts_a_simulator_and_ends_it(
    start: Starter, visit: Callable[[Process], PageClient]
) -> None:
    """Also where that dies in between: the page says so."""
    workbench = start("workbench", *ROS)
    page = visit(workbench)
    page.wait(lambda: path_end(page) > 0.5, 60.0)
    (simulator,) = simulators_of(workbench)
    page.change("restitution", "value_throttled", 0.4)
    page.wait(lambda: page.model("restitution").value == 0.4)
    assert "ros2 param set /bouncing_disk restitution 0.4" in page.model("command_lines").text
    page.click("pause")
    page.wait(lambda: page.model("pause").label == "Resume")
    simulator.kill()
    page.wait(lambda: "the simulator ended with code -9" in page.model("messages").text)
    assert workbench.end(signal.SIGINT) == 0
    assert workbench.complaints == []
    assert not simulator.is_running()


def test_a_simulator_of_ones_own_goes_and_comes_and_outlives_the_workbench(
    start: Starter, visit: Callable[[Process], PageClient]
) -> None:
    """With a name and a namespace of its own; two pages, one of which is closed."""
    named = ("--ros-args", "-r", "__ns:=/lab", "-r", "__node:=shaker")
    simulator = start("simulator", *named)
    workbench = start("workbench", *ROS, "-p", "start_simulator:=false", "-r", "__ns:=/lab")
    page, other = visit(workbench), visit(workbench)
    page.wait(lambda: path_end(page) > 2.0)
    other.close()
    page.wait(lambda: "/lab/shaker" in page.model("status").text)
    page.change("friction", "value_throttled", 0.5)
    page.wait(lambda: page.model("friction").value == 0.5)
    assert "ros2 param set /lab/shaker friction 0.5" in page.model("command_lines").text
    simulator.kill()
    page.wait(lambda: "no simulator is heard of" in page.model("status").text)
    # so slow that its time stays below that of the one before, however long this test waits
    again = start("simulator", *named, "-p", "real_time_factor:=0.01")
    page.wait(lambda: page.model("friction").value == 0.6, 60.0)
    page.wait(lambda: 0.0 < path_end(page) < 2.0, 60.0)
    assert workbench.end(signal.SIGTERM) == 0
    assert workbench.complaints == []
    assert again.running
