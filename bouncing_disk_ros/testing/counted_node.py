"""The simulator's node of the fixture, which keeps inputs until all messages have been delivered.

Deliveries between nodes of one executor: whether each message has reached its callbacks.

Publishers and subscriptions of the nodes are counted, by wrapping them. What was published while
the middleware had not yet matched both sides is not counted: it may be lost.
"""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, ReliabilityPolicy
from rclpy.subscription import Subscription

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.nodes.simulator.simulator_node import SimulatorNode
from bouncing_disk_ros.run.command_validation import Instant
from bouncing_disk_ros.run.gates import Gates
from bouncing_disk_ros.run.session import Session

LATCHED = DurabilityPolicy.TRANSIENT_LOCAL


class _Reader:
    """A subscription, what it is to get and what it has got."""

    def __init__(self, subscription: Subscription) -> None:
        self.subscription, self.topic = subscription, subscription.topic_name
        self.expected = self.got = 0
        callback = subscription.callback
        if inspect.iscoroutinefunction(callback):

            @functools.wraps(callback)
            async def counted(*received: Any) -> Any:
                result = await callback(*received)
                self.got += 1
                return result
        else:

            @functools.wraps(callback)
            def counted(*received: Any) -> Any:
                result = callback(*received)
                self.got += 1
                return result

        subscription.callback = counted


class _Writer:
    """A publisher, and how many messages it has published since it is counted."""

    def __init__(self, publisher: Publisher, readers: Callable[[_Writer], list[_Reader]]) -> None:
        self.publisher, self.topic, self.published = publisher, publisher.topic_name, 0
        publish = publisher.publish

        def counted(msg: Any) -> None:
            ready = readers(self)
            matched = publisher.get_subscription_count() >= len(ready)
            publish(msg)
            self.published += 1
            if matched:
                for reader in ready:
                    reader.expected += 1

        publisher.publish = counted

    def latched_for(self, reader: _Reader) -> int:
        """How many of its messages a subscription that is new gets."""
        mine, other = self.publisher.qos_profile, reader.subscription.qos_profile
        if not self.reaches(reader) or other.durability != LATCHED:
            return 0
        return min(self.published, mine.depth or self.published, other.depth or self.published)

    def reaches(self, reader: _Reader) -> bool:
        """Whether messages go to a subscription: its topic, and a quality that fits."""
        if reader.topic != self.topic:
            return False
        mine, other = self.publisher.qos_profile, reader.subscription.qos_profile
        best = ReliabilityPolicy.BEST_EFFORT
        return bool(
            not (mine.reliability == best != other.reliability)
            and not (mine.durability != LATCHED == other.durability)
        )


class Deliveries:
    """Counts what nodes publish and what reaches their callbacks."""

    def __init__(self) -> None:
        self._nodes: list[Node] = []
        self._readers: dict[int, _Reader] = {}
        self._writers: dict[int, _Writer] = {}

    def add(self, node: Node) -> None:
        """Count for a node too."""
        self._nodes.append(node)
        self.look()

    def remove(self, node: Node) -> None:
        """Count no more for a node."""
        self._nodes.remove(node)
        self.look()

    def look(self) -> None:
        """Look for publishers and subscriptions that are new, or gone."""
        publishers = {id(one): one for node in self._nodes for one in node.publishers}
        subscriptions = {id(one): one for node in self._nodes for one in node.subscriptions}
        if self._nodes:
            for gone in self._writers.keys() - publishers.keys():
                del self._writers[gone]
        for gone in self._readers.keys() - subscriptions.keys():
            del self._readers[gone]
        for publisher in publishers.values():
            self.count(publisher)
        for key, subscription in subscriptions.items():
            if key not in self._readers:
                reader = self._readers[key] = _Reader(subscription)
                reader.expected = sum(one.latched_for(reader) for one in self._writers.values())

    def count(self, publisher: Publisher) -> None:
        """Count what a publisher publishes from now on."""
        if id(publisher) not in self._writers:
            self._writers[id(publisher)] = _Writer(publisher, self._readers_of)

    def _readers_of(self, writer: _Writer) -> list[_Reader]:
        return [one for one in self._readers.values() if writer.reaches(one)]

    @property
    def unmatched(self) -> list[str]:
        """Topics of which a publisher does not know all subscriptions yet."""
        return [
            writer.topic
            for writer in self._writers.values()
            if writer.publisher.get_subscription_count() < len(self._readers_of(writer))
        ]

    @property
    def missing(self) -> Sequence[str]:
        """Topics of which a message has not reached all callbacks yet."""
        return [
            one.subscription.topic_name for one in self._readers.values() if one.got < one.expected
        ]


class CountedSimulator(SimulatorNode):
    """A simulator of which all messages are counted, from the first one on."""

    def __init__(self, deliveries: Deliveries, *args: Any, **kwargs: Any) -> None:
        self._deliveries = deliveries
        self._kept: Gates | None = None
        super().__init__(*args, **kwargs)

    def create_publisher(self, *args: Any, **kwargs: Any) -> Any:
        """As rclpy's, and counted."""
        publisher = super().create_publisher(*args, **kwargs)
        self._deliveries.count(publisher)
        return publisher

    @contextmanager
    def kept_inputs(self) -> Iterator[Gates]:
        """Keep the inputs that come meanwhile; they act when they are taken and asked to."""
        self._kept = Gates((), 0)
        try:
            yield self._kept
        finally:
            self._kept = None

    def hold(self, topic: str, number: int | None, data: bytes, act: Callable[[], object]) -> bool:
        """Keep an input where `kept_inputs` says so; else as the simulator does."""
        if self._kept is None:
            return super().hold(topic, number, data, act)
        try:
            self._kept.hold(topic, number, data, act)
        except InputError as error:
            self.refuse(error)
        return True

    def arrival(self, field: str) -> tuple[Session, Instant]:
        """As the simulator does; stamps of kept inputs are on the line of those published."""
        session, instant = super().arrival(field)
        if self._kept is not None and self.run is not None:
            instant = instant._replace(times=self.run.times)
        return session, instant
