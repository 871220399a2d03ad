"""One recorded topic: a raw subscription whose quality of service follows the publishers."""

from __future__ import annotations

import contextlib
import re
import time
from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Any, Literal

from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.qos import (
    DurabilityPolicy,
    HistoryPolicy,
    LivelinessPolicy,
    ReliabilityPolicy,
)
from rclpy.serialization import deserialize_message
from rclpy.subscription import Subscription
from sensor_msgs.msg import PointCloud2

from bouncing_disk_ros.bag import OfferedQos
from bouncing_disk_ros.bag.schema import schema_of
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.ros.from_messages import impacts_from_msg
from bouncing_disk_ros.ros.qos import message_class, profile_of
from bouncing_disk_ros.run.input_records import from_json
from bouncing_disk_ros.running_numbers import UNKNOWN, Gaps, Gids, MessageLoss
from bouncing_disk_ros.topics import Qos
from bouncing_disk_ros.units import NS

BEST_EFFORT_DEPTH = 1000
BURST = 200
"""How many messages of one topic are taken before others have their turn."""
SET_BACK_NS = 10_000_000
"""A clock that is behind the steady clock by less was not set back: readings differ a little."""
MOST_WAITING = 100_000
"""How many are taken before a subscription is exchanged: a flood would have no end."""
Put = Callable[["RecordedTopic", bytes, int, int, int], bool | None]
"""Topic, CDR, time received, time sent, number; None: paused, False: dropped and counted."""


class ReceptionTimes:
    """Times of reception that do not go back where the clock of the machine is set back.

    They are those of the middleware. After the clock was set back, they go on by the steady clock,
    until the machine's clock has caught up. Both clocks: ns; tests give others.
    """

    def __init__(
        self, wall: Callable[[], int] = time.time_ns, steady: Callable[[], int] = time.monotonic_ns
    ) -> None:
        self._wall, self._steady = wall, steady
        now, passed = self._read()
        self._offset = now - passed

    def _read(self) -> tuple[int, int]:
        """Both clocks at about one instant: the process may have to wait between two readings."""
        while True:
            before, wall, after = self._steady(), self._wall(), self._steady()
            if after - before < SET_BACK_NS // 10:
                return wall, after

    def of(self, received: int) -> int:
        """The time of a message that is taken now; `received`: by the middleware, 0: unknown."""
        wall, passed = self._read()
        self._offset = max(self._offset, wall - passed)
        now = passed + self._offset
        if not received:
            return now
        if now - wall < SET_BACK_NS:
            return received
        return now - max(wall - received, 0)


class RecordedTopic:
    """Subscribes to one topic and counts the messages that did not arrive.

    `put` takes each message; `publishers` asks the graph who publishes. `qos` is what the topic is
    known to have before there is a publisher. `times`: of reception, those of all topics.
    """

    def __init__(
        self, node: Node, name: str, kind: str, put: Put, *, qos: Qos | None = None,
        has_index: bool = False, times: ReceptionTimes | None = None,
    ) -> None:  # fmt: skip
        self.name, self.type = name, kind
        self._times, self._latest_ns = times or ReceptionTimes(), 0
        self.loss = MessageLoss(self._gids)
        self.rows = Gaps() if has_index else None
        self.registered = False
        self.repeated = 0  # how many of its last messages a new file repeats
        self.own: Collection[bytes] | None = None  # what this recorder itself publishes there
        self._depth = 1 if qos is None else qos.depth
        self._node, self._put = node, put
        self._class = installed_class(kind)
        self._subscription: Subscription | None = None
        self._wanted = (True, False) if qos is None else (qos.reliable, qos.latched)
        infos = self.publishers()
        if infos:
            self._wanted = _weakest(infos)
        self._subscribe()

    # --- the graph --------------------------------------------------------------------------------
    def publishers(self) -> list[Any]:
        """Who publishes now; with two of them losses cannot be counted."""
        infos = list(self._node.get_publishers_info_by_topic(self.name))
        if self.own is not None:
            infos = _without_one_of(self._node, infos)
        if len(infos) > 1:
            self.loss.why_not = f"{len(infos)} publishers on the topic"
        return infos

    def _gids(self) -> Gids:
        return frozenset(bytes(info.endpoint_gid) for info in self.publishers())

    def follow(self) -> list[Any]:
        """Weaken the subscription where a new publisher would not match it; the publishers."""
        infos = self.publishers()
        self.loss.look()
        if infos:
            offered = _weakest(infos)
            wanted = (self._wanted[0] and offered[0], self._wanted[1] and offered[1])
            if wanted != self._wanted:
                self.take_waiting(MOST_WAITING)  # they would end with the subscription
                self._wanted = wanted
                self.loss.restart()
                self._subscribe()
        return infos

    def latched_depth(self, publishers: int) -> int:
        """How many messages a late joiner needs: of an unknown topic one of each publisher."""
        return max(self._depth, publishers) if self._wanted[1] else 0

    def _subscribe(self) -> None:
        reliable, latched = self._wanted
        # KEEP_ALL and reliable is the only pair that loses nothing in tight bursts
        qos = Qos(0 if reliable else BEST_EFFORT_DEPTH, reliable, latched)
        self.destroy()
        self._subscription = self._node.create_subscription(
            self._class,
            self.name,
            self._on_message,
            profile_of(qos),
            raw=True,
            event_callbacks=SubscriptionEventCallbacks(use_default_callbacks=False),
        )  # fmt: skip  (the default ones complain of a publisher that `follow` will match)

    def destroy(self) -> None:
        """End the subscription."""
        if self._subscription is not None:
            self._node.destroy_subscription(self._subscription)
            self._subscription = None

    # --- messages ---------------------------------------------------------------------------------
    def _on_message(self, data: bytes, info: Mapping[str, Any]) -> None:
        """Take this message, and what waits behind it without the executor's round for each."""
        self._take(data, info)
        self.take_waiting()

    def take_waiting(self, most: int = BURST) -> None:
        """Take messages that have arrived and wait for their callback."""
        for _ in range(most):
            if self._subscription is None:
                break
            more = self._subscription.handle.take_message(self._class, True)
            if more is None:
                break
            self._take(*more)

    def _take(self, data: bytes, info: Mapping[str, Any]) -> None:
        if self.own is not None and data in self.own:
            return
        now = max(self._latest_ns, self._times.of(_time(info["received_timestamp"])))
        self._latest_ns = now
        number = info["publication_sequence_number"]
        sent = _time(info["source_timestamp"]) or now
        taken = self._put(self, data, now, sent, UNKNOWN if number is None else number)
        if taken is not None:
            self.loss.note(number)
        if taken and self.rows is not None:
            self._count_rows(data)

    def _count_rows(self, data: bytes) -> None:
        """Follow the running index of the impacts; another cloud on this topic is none of ours."""
        assert self.rows is not None
        with contextlib.suppress(InputError, RuntimeError):  # RuntimeError: no such message
            index = impacts_from_msg(deserialize_message(data, PointCloud2))["index"]
            if len(index):
                self.rows.take(int(index[0]), int(index[-1]), len(index))

    def restart(self) -> None:
        """After a pause nothing that went by counts as lost."""
        self.loss.restart()
        if self.rows is not None:
            self.rows.restart()


def installed_class(kind: str) -> type[Any]:
    """The class of a type package/msg/Name; InputError when it is not installed.

    The name may come from anyone in the domain: a module is loaded only where the definition of
    the type is installed beside it.
    """
    schema_of(kind)
    try:
        return message_class(kind)
    except (ImportError, AttributeError):
        hint = f"Install the package {kind.partition('/')[0]}, or source its workspace."
        raise InputError("message type", kind, "an installed type", hint) from None


def _time(stamp: object) -> int:
    """A time of the middleware that a bag can hold, ns; 0 for any other."""
    return stamp if isinstance(stamp, int) and 0 < stamp < 1 << 63 else 0


def _without_one_of(node: Node, infos: list[Any]) -> list[Any]:
    """Publishers without that of a node itself (one of them, if several have its name)."""
    mine = (node.get_name(), node.get_namespace())
    for place, info in enumerate(infos):
        if (info.node_name, info.node_namespace) == mine:
            return infos[:place] + infos[place + 1 :]
    return infos


def _weakest(infos: Sequence[Any]) -> tuple[bool, bool]:
    """Reliable and latched as far as every publisher offers it."""
    profiles = [info.qos_profile for info in infos]
    return (
        all(profile.reliability == ReliabilityPolicy.RELIABLE for profile in profiles),
        all(profile.durability == DurabilityPolicy.TRANSIENT_LOCAL for profile in profiles),
    )


def offered(info: Any) -> OfferedQos:
    """The quality of service of a publisher, in the words of rosbag2."""
    profile = info.qos_profile

    def split(duration: Any) -> tuple[int, int]:
        return divmod(int(duration.nanoseconds), NS)

    return OfferedQos(
        history=HistoryPolicy(profile.history).name.lower(),
        depth=int(profile.depth),
        reliability=ReliabilityPolicy(profile.reliability).name.lower(),
        durability=DurabilityPolicy(profile.durability).name.lower(),
        deadline=split(profile.deadline),
        lifespan=split(profile.lifespan),
        liveliness=LivelinessPolicy(profile.liveliness).name.lower(),
        liveliness_lease_duration=split(profile.liveliness_lease_duration),
    )


_SNAPSHOT = re.compile(rb'\{"index":\d{1,18},"time_ns":\d{1,18},"kind":"snapshot",')
_TEXT_AT = 8
"""Where the text of a serialized std_msgs/String begins."""


def is_snapshot(data: bytes) -> bool:
    """Whether a message of disk/inputs holds a full state: replay needs none before it.

    The bytes may come from anyone: what does not begin as this package writes it is not read.
    """
    if _SNAPSHOT.match(data, _TEXT_AT) is None:
        return False
    order: Literal["little", "big"] = "little" if data[1] else "big"
    length = int.from_bytes(data[4:_TEXT_AT], order)  # with the zero at its end
    try:
        record = from_json(data[_TEXT_AT : _TEXT_AT + length - 1].decode())
    except (ValueError, OverflowError, RecursionError):  # InputError is a ValueError
        return False
    return all(isinstance(record.get(name), dict) for name in ("state", "parameters"))
