"""The runs of one simulator in a bag, one after the other: records of inputs and rows of impacts.

Which message belongs to which run is decided by `BagRun`, from all topics of the simulator, as for
reports.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence, Sized
from typing import Generic, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.bag import Bag
from bouncing_disk_ros.bag.rows import CloudRows
from bouncing_disk_ros.report.message_order import REPEAT
from bouncing_disk_ros.report.read_run import BagRun, ReadOptions, names_of
from bouncing_disk_ros.run.input_records import Record, from_json

Rows = NDArray[np.void]
Heard = Callable[[int], object]
"""Called with the time of reception of each message read, in ns since 1970."""
INPUTS, IMPACTS = "disk/inputs", "disk/impacts"
_T = TypeVar("_T", bound=Sized)


class Run(NamedTuple):
    """One run; both iterators are to be used before the next run is asked for."""

    records: Iterator[Record]
    rows: Iterator[Rows]
    end_ns: int  # the last instant (simulated) that its other topics show


class RecordedRuns:
    """Iterates over the runs; `left_over` are rows that may belong to either of two runs."""

    def __init__(self, bag: Bag, inputs: str, impacts: str, heard: Heard = lambda _: None) -> None:
        """Read the bag once for what belongs to which run; `inputs`, `impacts`: its topics.

        BagError where it cannot be read to its end.
        """
        names = {inputs: INPUTS, impacts: IMPACTS}
        namespace = inputs.removesuffix(INPUTS)
        if namespace != inputs:  # not remapped: its other topics are beside it
            beside = names_of(namespace)
            names = {name: short for name, short in beside.items() if short != IMPACTS} | names
        reader = BagRun(bag, ReadOptions(namespace, most_rows=0), names)
        for _ in reader.read():
            pass
        if reader.damage is not None:
            raise reader.damage
        self._ends = reader.ends
        self.left_over = 0
        records, rows = (reader.parts.get(topic, ()) for topic in (inputs, impacts))
        self._records = _ByRun(_records(bag, inputs, heard), records)
        self._rows = _ByRun(_rows(bag, impacts, heard) if rows else (), rows)

    def __len__(self) -> int:
        """How many runs there are."""
        return len(self._ends)

    def __iter__(self) -> Iterator[Run]:
        """Give the runs, in the order of the bag."""
        for number, end_ns in enumerate(self._ends, start=1):
            run = Run(self._records.of(number), self._rows.of(number), end_ns)
            yield run
            for _ in run.records:  # what was not used
                pass
            for _ in run.rows:
                pass
            self.left_over = self._rows.left_over


class _ByRun(Generic[_T]):
    """The messages of one topic, run by run; `left_over`: what those hold that belong to none."""

    def __init__(self, messages: Iterable[_T], parts: Sequence[tuple[int, int]]) -> None:
        """`parts`: so many messages each are of the run of this number; 0: nobody knows which."""
        numbers = (number for number, count in parts for _ in range(count))
        self._messages = zip(numbers, messages, strict=False)
        self._next = next(self._messages, None)
        self.left_over = 0

    def of(self, number: int) -> Iterator[_T]:
        """Those of a run, and of none before its end."""
        while self._next is not None and self._next[0] in (REPEAT, 0, number):
            belongs_to, message = self._next
            self._next = next(self._messages, None)
            if belongs_to > 0:
                yield message
            elif belongs_to == 0:
                self.left_over += len(message)


def _records(bag: Bag, topic: str, heard: Heard) -> Iterator[Record]:
    """Each record of inputs."""
    read = bag.decoder(topic)
    for message in bag.messages(topic):
        heard(message.log_time_ns)
        yield from_json(read(message.data).data)


def _rows(bag: Bag, topic: str, heard: Heard) -> Iterator[Rows]:
    """The rows of each message."""
    clouds = CloudRows(bag.decoder(topic))
    for message in bag.messages(topic):
        heard(message.log_time_ns)
        clouds.add(message.data)
        yield clouds.take()
