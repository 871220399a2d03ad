"""A pytest fixture with a stepped simulator, for rclpy tests of one's own.

It is a pytest plugin of the installed package; a test only names it:

    def test_my_node_answers_an_impact(stepped_simulator):
        simulator = stepped_simulator(preset="pizza_multiple_toss")
        node = MyNode(context=simulator.context)
        simulator.add_node(node)
        simulator.run(10.0)                      # each callback before time moves on
        assert node.answers == 10

Time stands but for `run`, `run_to_impact`, `step` and `advance`: nothing depends on the speed of
the machine. What the simulator refuses is raised as its InputError. Set ROS_DOMAIN_ID and
ROS_AUTOMATIC_DISCOVERY_RANGE before, if strangers may be around. docs/testing.md begins with a
first test.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING, Any, SupportsFloat

import pytest

from bouncing_disk_ros.errors import InputError, closest
from bouncing_disk_ros.field_checks import plain
from bouncing_disk_ros.units import NS

if TYPE_CHECKING:
    from rclpy.context import Context
    from rclpy.node import Node

    from bouncing_disk_ros.core.model import Motion, Sample
    from bouncing_disk_ros.testing.counted_node import CountedSimulator

PATIENCE = 30.0
"""Longest wait for a condition, s."""
_LOGGED: set[str] = set()
"""Simulators that have a publisher of /rosout: ROS has one for each name in a process."""


class SteppedSimulator:
    """A simulator node, paused at time 0, in a context and executor of its own.

    Attributes: `node`, the SimulatorNode; `context`, for nodes of the test.
    """

    def __init__(
        self, node_name: str = "bouncing_disk", namespace: str = "", **values: Any
    ) -> None:
        """`values` are parameters of the simulator by name (docs/parameters.md)."""
        import rclpy
        from rclpy.executors import SingleThreadedExecutor
        from rclpy.parameter import Parameter
        from rclpy.signals import SignalHandlerOptions

        from bouncing_disk_ros.command_line import environment
        from bouncing_disk_ros.testing.counted_node import CountedSimulator, Deliveries

        values = {name: plain(value) for name, value in values.items()}
        environment.prepare(uses_ros=True)
        self.context: Context = rclpy.Context()
        rclpy.init(context=self.context, args=[], signal_handler_options=SignalHandlerOptions.NO)
        overrides = [
            Parameter(name, value=v) for name, v in {"start_paused": True, **values}.items()
        ]
        self._deliveries = Deliveries()
        try:
            self._executor = SingleThreadedExecutor(context=self.context)
            self.node: CountedSimulator = CountedSimulator(
                self._deliveries,
                node_name,
                namespace=namespace,
                context=self.context,
                parameter_overrides=overrides,
                use_global_arguments=False,
                enable_rosout=not self._is_second(namespace, node_name),
            )
        except BaseException:
            rclpy.shutdown(context=self.context)
            raise
        self._nodes: list[Node] = []
        self.add_node(self.node)

    def _is_second(self, namespace: str, node_name: str) -> bool:
        """Whether another simulator of this name is alive: its publisher of /rosout serves both."""
        self._name = f"{namespace.strip('/')}/{node_name}"
        second = self._name in _LOGGED
        self._logs = not second
        _LOGGED.add(self._name)
        return second

    def close(self) -> None:
        """Destroy the nodes and the context."""
        import rclpy

        if self._logs:
            _LOGGED.discard(self._name)
        for node in self._nodes:
            self._executor.remove_node(node)
        self.node.destroy_node()
        self._executor.shutdown()
        rclpy.shutdown(context=self.context)

    def add_node(self, node: Node) -> None:
        """Let the executor run the callbacks of another node too (made with `context`)."""
        self._nodes.append(node)
        self._executor.add_node(node)
        self._deliveries.add(node)

    def close_node(self, node: Node) -> None:
        """Take a node out of the executor and destroy it."""
        self._nodes.remove(node)
        self._executor.remove_node(node)
        self._deliveries.remove(node)
        node.destroy_node()

    def spin_until(self, condition: Callable[[], bool], timeout: float = PATIENCE) -> None:
        """Run callbacks until a condition holds; AssertionError after `timeout` seconds."""
        end = time.monotonic() + timeout
        while not condition():
            if time.monotonic() > end:
                raise AssertionError(f"the condition did not hold within {timeout} s")
            self._executor.spin_once(timeout_sec=0.02)

    def wait_for_subscriber(self, topic: str, count: int = 1) -> None:
        """Wait until a topic has so many subscriptions: no message is sent too early.

        Raises InputError for a topic that the simulator does not publish, AssertionError when the
        subscriptions do not come.
        """
        name = self.node.resolve_topic_name(topic)
        publishers = {publisher.topic_name: publisher for publisher in self.node.publishers}
        if name not in publishers:
            allowed = "a topic of the simulator: " + ", ".join(sorted(publishers))
            raise InputError("topic", name, allowed, closest(name, publishers))
        publisher = publishers[name]
        end = time.monotonic() + PATIENCE
        while publisher.get_subscription_count() < count:
            if time.monotonic() > end:
                found = publisher.get_subscription_count()
                raise AssertionError(f"{name} has {found} of {count} subscriptions")
            self._executor.spin_once(timeout_sec=0.02)

    def step(self, periods: int = 1) -> None:
        """Simulate whole periods of the platform's motion, at once."""
        run = self._run
        motion = run.session.simulation.motion_in_force.target
        self.advance(periods / motion.frequency)

    def advance(self, seconds: float) -> None:
        """Simulate for a time, at once."""
        self._run.advance_to(self._run.session.time_ns + round(seconds * NS))

    # --- closed loops -----------------------------------------------------------------------------
    def run(self, seconds: float) -> None:
        """Simulate for a time; every message reaches its callbacks before time moves on.

        Time stands at each sample, speed and impact until the nodes of the test have got what was
        published, and their inputs have acted, by topic and order of publication: the same nodes
        give the same bits whatever the machine does. AssertionError where a message does not come.
        """
        self._go(self._run.session.time_ns + round(seconds * NS))

    def run_to_impact(self, within: float = 3600.0) -> None:
        """The same until the next row of disk/impacts has reached all nodes.

        AssertionError where there is no impact within so many simulated seconds.
        """
        if not self._go(self._run.session.time_ns + round(within * NS), to_impact=True):
            raise AssertionError(f"no impact within {within:g} s of simulated time")

    def _go(self, end_ns: int, *, to_impact: bool = False) -> bool:
        """Run to an instant, or an impact; whether that has been reached."""
        self._settle()
        while self._run.session.time_ns < end_ns:
            goal = min(end_ns, self._run.loop.next_output_ns)
            has_impact = self._run.advance_to_impact(goal)
            self._settle()
            if self._run.session.fault:
                raise AssertionError(self._run.session.fault)
            if has_impact and to_impact:
                return True
        return not to_impact

    def _settle(self) -> None:
        """Deliver all that has been published, let the inputs act, and again until it is quiet."""
        deliveries = self._deliveries
        deliveries.look()
        self._wait_for_none(lambda: deliveries.unmatched, "subscriptions are not found")
        with self.node.kept_inputs() as kept:
            while True:
                self._wait_for_none(lambda: deliveries.missing, "messages do not arrive")
                inputs = kept.drop()
                if not inputs:
                    return
                for one in inputs:
                    one.act()

    def _wait_for_none(self, left: Callable[[], Sequence[str]], what: str) -> None:
        end = time.monotonic() + PATIENCE
        while left():
            if time.monotonic() > end:
                raise AssertionError(f"{what} within {PATIENCE:g} s: {', '.join(left())}")
            self._executor.spin_once(timeout_sec=0.02)

    def command(self, after: float = 0.0, **values: SupportsFloat) -> bool:
        """Command the platform: `values` reached `after` seconds from now.

        Returns True; raises InputError where the simulator refuses it.
        """
        from bouncing_disk_ros.run.command_validation import PointRequest, ProgrammeRequest

        numbers: tuple[Any, ...] = tuple(map(plain, values.values()))
        point = PointRequest(numbers, round(after * NS))
        return self._accepted(self.node.commands.accept(ProgrammeRequest(tuple(values), (point,))))

    def apply_impulse(self, axial_impulse: float = 0.0, angular_impulse: float = 0.0) -> bool:
        """Apply an impulse to the disk now (N·s, N·m·s); True, or InputError if refused."""
        from bouncing_disk_ros.run.command_validation import ImpulseRequest

        axial, angular = float(axial_impulse), float(angular_impulse)
        request = ImpulseRequest((0.0, 0.0, axial), (0.0, 0.0, angular))
        return self._accepted(self.node.commands.accept(request))

    def _accepted(self, accepted: bool) -> bool:
        if not accepted:
            assert self.node.last_refusal is not None
            raise self.node.last_refusal
        return True

    def reset(self) -> None:
        """Back to the initial state."""
        self._run.reset()

    @property
    def time(self) -> float:
        """Simulated time, s."""
        return self._run.session.time_ns / NS

    @property
    def state(self) -> Sample:
        """The state at this instant."""
        return self._run.session.simulation.sample()

    @property
    def motion(self) -> Motion:
        """The newest accepted motion of the platform."""
        return self._run.session.latest_target

    @property
    def _run(self) -> Any:
        if self.node.run is None:
            raise AssertionError("the simulator is not configured")
        return self.node.run


@pytest.fixture
def stepped_simulator() -> Iterator[Callable[..., SteppedSimulator]]:
    """Make stepped simulators: parameters by name; they are closed when the test ends."""
    from bouncing_disk_ros.command_line.environment import ros_is_here

    if not ros_is_here():
        pytest.fail("stepped_simulator needs ROS 2, which is not installed here", pytrace=False)
    made: list[SteppedSimulator] = []

    def make(**values: Any) -> SteppedSimulator:
        made.append(SteppedSimulator(**values))
        return made[-1]

    yield make
    for simulator in reversed(made):
        simulator.close()
