"""Everything that the library can read of a bag, and the refusals it gives."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path

from bouncing_disk_ros import bag
from bouncing_disk_ros.bag.rows import CLOUD
from bouncing_disk_ros.errors import InputError


def read_all(path: str | Path) -> list[str]:
    """Read a bag in every way; the refusals (BagError, InputError), one line each.

    Topics are decoded one by one only if they cannot be decoded together: one that is refused hides
    what comes after it.
    """
    refused: list[str] = []

    def attempt(work: Callable[[], object]) -> bool:
        try:
            work()
        except (bag.BagError, InputError) as error:
            refused.append(str(error))
            return False
        return True

    def everything() -> None:
        with bag.open(path) as run:
            run.info()
            attempt(lambda: run.attachments)
            if not attempt(partial(_decoded, run)):
                attempt(lambda: sum(1 for _ in run.messages()))
                for name in run.topics:
                    attempt(partial(_decoded, run, name))
            for name, topic in run.topics.items():
                attempt(partial(run.columns, name))
                if topic.type == CLOUD:
                    attempt(partial(run.rows, name, 0, 2**62))

    attempt(everything)
    assert not any(len(line.splitlines()) != 1 for line in refused), refused
    return refused


def _decoded(run: bag.Bag, topic: str | None = None) -> int:
    return sum(1 for _ in run.decoded(topic))
