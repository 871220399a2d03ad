"""Bags of messages in MCAP: `Writer` writes one, `open` reads one, `recover` repairs one.

A bag is a rosbag2 folder of .mcap files; see docs/recording.md.
"""

from pathlib import Path

from bouncing_disk_ros.bag.metadata import OfferedQos
from bouncing_disk_ros.bag.notes import FORMAT_VERSION
from bouncing_disk_ros.bag.reader import Bag, Message, Topic
from bouncing_disk_ros.bag.records import Watch, nothing
from bouncing_disk_ros.bag.recover import Report, recover
from bouncing_disk_ros.bag.writer import Options, WriteError, Writer
from bouncing_disk_ros.errors import BagError

__all__ = [
    "FORMAT_VERSION", "Bag", "BagError", "Message", "OfferedQos", "Options", "Report", "Topic",
    "WriteError", "Writer", "open", "recover",
]  # fmt: skip


def open(path: str | Path, watch: Watch = nothing) -> Bag:  # noqa: A001 (as gzip.open)
    """Bag opened for reading: its folder, or one .mcap file.

    `watch` is called now and then with the bytes passed and the bytes of the file, while a file
    without an index is read through. Raises InputError, BagError when the bag cannot be read.

    >>> with bag.open("run_1") as run:
    ...     print(run.info())
    """
    return Bag(path, watch)
