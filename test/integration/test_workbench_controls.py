"""Each control of the workbench's page changes the run of a simulator's node as asked: read back
from its topics. One simulator that stands still, one page, no browser."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import pytest
import rclpy
from bokeh.document import Document
from builtin_interfaces.msg import Time
from rosgraph_msgs.msg import Clock

from bouncing_disk_ros.run.presets import load_preset
from bouncing_disk_ros.run.session import Session
from bouncing_disk_ros.testing import SteppedSimulator
from bouncing_disk_ros.topics import MOTION_NAMES
from bouncing_disk_ros.workbench.actions import Lifecycle
from bouncing_disk_ros.workbench.control_pane import DISK_CONTROLS, MOTION_CONTROLS
from bouncing_disk_ros.workbench.page import Page
from bouncing_disk_ros.workbench.ros_link import RosLink
from support.bokeh_page import change, click, model
from support.processes import PATIENCE


class Bench(NamedTuple):
    """A simulator, the link to it, and a page."""

    simulator: SteppedSimulator
    link: RosLink
    page: Page
    document: Document

    def wait(self, condition: Any) -> None:
        """Let messages pass, and frames, until a condition holds."""

        def holds() -> bool:
            self.link.tick()  # as the server does
            self.page.update()
            return bool(condition())

        try:
            self.simulator.spin_until(holds, PATIENCE)
        except AssertionError as error:  # what the page says tells why
            text = model(self.document, "messages").text
            raise AssertionError(f"{error}; {self.link.history.juggling!r}; {text}") from error

    @property
    def session(self) -> Session:
        """The session of the simulator's run."""
        assert self.simulator.node.run is not None
        return self.simulator.node.run.session

    def values(self) -> dict[str, Any]:
        """What the topics say is in force."""
        return self.link.history.values_at()


NAME = "workbench_simulator"
"""Its own: rcl ends what /rosout has of a name when an earlier node of that name is freed."""


@pytest.fixture(scope="module")
def bench(ros_domain: int, warm_kernels: None) -> Iterator[Bench]:
    """The page's node has a clock that is ahead: use_sim_time, with a fast simulation."""
    simulator = SteppedSimulator(NAME, **dict[str, Any](load_preset("pizza_multiple_toss")))
    node = rclpy.create_node(
        "workbench", context=simulator.context, use_global_arguments=False,
        cli_args=["--ros-args", "-p", "use_sim_time:=true", "-r", "/clock:=/clock_ahead"],
    )  # fmt: skip
    simulator.add_node(node)
    clock = node.create_publisher(Clock, "/clock_ahead", 10)

    def is_ahead() -> bool:
        clock.publish(Clock(clock=Time(sec=2_000_000_000)))
        return bool(node.get_clock().now().nanoseconds)

    simulator.spin_until(is_ahead, PATIENCE)
    link = RosLink(node, NAME)
    document = Document()
    page = Page(document, link)
    made = Bench(simulator, link, page, document)
    made.wait(lambda: link.history.motion_at() is not None and link.is_alive)
    link.tick()
    made.wait(lambda: model(document, "restitution").value == 0.5)
    yield made
    link.close()
    node.destroy_node()
    simulator.close()


@pytest.mark.parametrize(
    "control", [MOTION_CONTROLS[0], DISK_CONTROLS[0]], ids=lambda one: one.name
)
def test_a_slider(bench: Bench, control: Any) -> None:
    before = control.value(bench.page.values())
    slider = model(bench.document, control.name)
    given = slider.start + 0.6 * (slider.end - slider.start)
    size = bench.page.controls._sizes[control.name]  # type: ignore[union-attr]
    change(bench.document, control.name, "value_throttled", given)
    bench.wait(lambda: control.value(bench.values()) != before)
    bench.simulator.advance(1.0)  # the cross-fade ends
    bench.wait(lambda: not bench.session.pending.motions)
    assert control.value(bench.values()) == pytest.approx(given * size, rel=1e-12)
    node = bench.simulator
    if control.name in MOTION_NAMES:
        assert getattr(node.motion, control.name) == control.value(bench.values())
    else:
        name = control.name
        assert node.node.get_parameter(name).value == bench.values()[name]
    bench.wait(lambda: slider.value * size == pytest.approx(given * size, rel=1e-9))


def test_an_impulse(bench: Bench) -> None:
    """In flight: what an impact at the same instant adds does not belong to it."""
    bench.simulator.apply_impulse(2.0 * bench.session.simulation.disk.mass)  # up, by 2 m/s
    bench.simulator.advance(0.01)
    before = bench.simulator.state
    change(bench.document, "axial", "value", 0.2)
    change(bench.document, "angular", "value", 0.003)
    click(bench.document, "impulse")
    accepted = bench.session.accepted
    bench.wait(lambda: bench.session.accepted > accepted)
    after = bench.simulator.state
    disk = bench.session.simulation.disk
    gained = after.angular_velocity - before.angular_velocity
    assert gained == pytest.approx(0.003 / disk.inertia, rel=1e-9)
    raised = after.axial_velocity - before.axial_velocity
    assert raised == pytest.approx(0.2 / disk.mass, rel=1e-9)


def test_pause_step_and_reset(bench: Bench) -> None:
    """The simulator stands paused: Resume, then Pause; a step is one period; a reset."""
    history, session = bench.link.history, bench.session
    run = bench.simulator.node.run
    assert run is not None
    bench.wait(lambda: model(bench.document, "pause").label == "Resume")
    click(bench.document, "pause")
    bench.wait(lambda: not session.paused)
    bench.wait(lambda: model(bench.document, "pause").label == "Pause")
    click(bench.document, "pause")
    bench.wait(lambda: session.paused)
    bench.wait(lambda: model(bench.document, "pause").label == "Resume")
    before, frequency = session.time_ns, bench.simulator.motion.frequency
    click(bench.document, "step")
    bench.wait(lambda: session.time_ns > before and not run.stepping)  # it may go on in the ticks
    assert session.time_ns - before == pytest.approx(1e9 / frequency, abs=1)
    cleared = history.changes.since(float("inf"))
    click(bench.document, "reset")
    bench.wait(lambda: history.changes.since(float("inf")) > cleared)
    bench.wait(lambda: "reset at" in model(bench.document, "messages").text)


def test_a_refusal_is_shown_in_the_nodes_own_words(bench: Bench) -> None:
    change(bench.document, "parameter", "value", "restitution")
    change(bench.document, "given", "value", "1.5")
    click(bench.document, "set")
    refusal = "restitution: got 1.5, allowed: a finite number &gt;= 0 and &lt;= 1"
    bench.wait(lambda: refusal in model(bench.document, "messages").text)
    refused = bench.simulator.node.last_refusal
    assert refused is not None
    assert refused.line == "restitution: got 1.5, allowed: a finite number >= 0 and <= 1"
    change(bench.document, "axial", "value", 1e300)
    click(bench.document, "impulse")
    bench.wait(lambda: "a finite impulse up to" in model(bench.document, "messages").text)


def test_juggling_is_a_process_that_ends_when_it_is_stopped(
    bench: Bench, warm_juggling: None
) -> None:
    """Another strategy, or another real-time factor, takes its place; a new run ends it."""
    keeper, history = bench.link._juggler, bench.link.history
    given, epoch = load_preset("pizza_multiple_toss"), history.epoch
    given.pop("phase_lag")  # the scene has another

    def is_begun() -> bool:
        values = bench.values()
        return history.epoch > epoch and all(values[name] == v for name, v in given.items())

    click(bench.document, "scene_period_1")
    bench.wait(is_begun)  # all of it: a slider before may have left no orbit to juggle
    bench.wait(lambda: bench.simulator.node.run is not None and bench.simulator.node.run.active)
    change(bench.document, "strategy", "active", 1)
    click(bench.document, "juggle")
    first = keeper._child
    assert first is not None
    bench.wait(lambda: model(bench.document, "juggle").label == "Stop")
    bench.wait(lambda: history.juggling.startswith("impact_time: not captured: "))
    change(bench.document, "slow", "active", 1)
    bench.wait(lambda: bench.values()["real_time_factor"] == 0.5)
    bench.link.tick()
    second = keeper._child
    assert second is not None
    assert (first.code, second.code) == (0, None)
    bench.wait(lambda: "real_time_factor:=0.5" in model(bench.document, "messages").text)
    click(bench.document, "juggle")
    bench.wait(lambda: history.juggling == "")
    assert second.code is not None
    bench.wait(lambda: model(bench.document, "juggle").label == "Juggle")
    change(bench.document, "slow", "active", 0)
    bench.wait(lambda: bench.values()["real_time_factor"] == 1.0)
    click(bench.document, "juggle")
    third = keeper._child
    assert third is not None
    bench.link.send(Lifecycle("cleanup"))  # refused by the simulator, for it is active
    assert third.code is not None
    assert history.juggling == ""
    bench.wait(lambda: "change_state: refused" in model(bench.document, "messages").text)


def test_juggle_that_ends_by_itself_is_told(bench: Bench, warm_juggling: None) -> None:
    keeper = bench.link._juggler
    change(bench.document, "restitution", "value_throttled", 1.0)
    bench.wait(lambda: bench.values()["restitution"] == 1.0)
    bench.wait(lambda: model(bench.document, "restitution").value == 1.0)

    def ended() -> bool:
        bench.link.tick()
        return keeper._child is None and bench.link.history.juggling == ""

    bench.wait(ended)  # a last status of the test before may be on its way: the button says Stop
    bench.wait(lambda: model(bench.document, "juggle").label == "Juggle")
    click(bench.document, "juggle")
    bench.wait(ended)
    bench.wait(lambda: "restitution: got 1.0, allowed" in model(bench.document, "messages").text)
    assert bench.link.history.juggling == ""
