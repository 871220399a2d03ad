"""Which simulators a bag holds."""

from __future__ import annotations

from bouncing_disk_ros.bag import Bag
from bouncing_disk_ros.errors import InputError, closest
from bouncing_disk_ros.topics import TOPICS

WANTED = ("disk/impacts", "disk/inputs", "platform/motion", "disk/rotor_speed", "joint_states",
          "disk/phase")  # fmt: skip
"""Topics of a simulator, within its namespace."""
OPTIONAL = ("platform/offset",)
"""Topics that are there only where something was commanded."""


def simulators(bag: Bag) -> list[str]:
    """The namespaces of the simulators in a bag."""
    found = set()
    for name, topic in bag.topics.items():
        for wanted in WANTED:
            ours = wanted.startswith(("disk/", "platform/")) and topic.count > 0
            if ours and name.endswith(f"/{wanted}") and topic.type == TOPICS[wanted].type:
                found.add(name[: -len(wanted) - 1] or "/")
    return sorted(found)


def choose(bag: Bag, namespace: str | None) -> str:
    """The namespace asked for, or the only one; InputError names the candidates."""
    found = simulators(bag)
    if not found:
        given = ", ".join(sorted(n for n, t in bag.topics.items() if t.count)) or "no messages"
        allowed = "a bag with topics of a simulator (disk/impacts, disk/inputs ...)"
        raise InputError(f"bag {bag.path}", given, allowed)
    if namespace is None:
        if len(found) > 1:
            given = f"a bag of {len(found)} simulators"
            raise InputError(
                "namespace", given, ", ".join(found), "Choose one with the option namespace."
            )
        return found[0]
    wanted = "/" + namespace.strip("/")
    if wanted not in found:
        raise InputError("namespace", namespace, ", ".join(found), closest(wanted, found))
    return wanted


def is_there(bag: Bag, name: str, short: str) -> bool:
    """Whether a bag holds messages of topic `name` of the type of `short`."""
    topic = bag.topics.get(name)
    return topic is not None and topic.type == TOPICS[short].type and topic.count > 0
