"""Bags of messages in MCAP: `Writer` writes one, `open` reads one, `recover` repairs one.

A bag is a rosbag2 folder of .mcap files; see docs/recording.md.
"""

from pathlib import Path

from bouncing_disk_ros.bag.bag_topic import Message, Topic
from bouncing_disk_ros.bag.formats import FORMAT_VERSION, BagError
from bouncing_disk_ros.bag.metadata import OfferedQos
from bouncing_disk_ros.bag.reader import Bag
from bouncing_disk_ros.bag.recover import recover
from bouncing_disk_ros.bag.recovery_report import Report
from bouncing_disk_ros.bag.scan import nothing
from bouncing_disk_ros.bag.search import Watch
from bouncing_disk_ros.bag.writer import Writer
from bouncing_disk_ros.bag.writer_options import Options, WriteError

__all__ = [
    "FORMAT_VERSION", "Bag", "BagError", "Message", "OfferedQos", "Options", "Report", "Topic",
    "WriteError", "Writer", "open", "recover",
]  # fmt: skip


def open(path: str | Path, watch: Watch = nothing) -> Bag:  # noqa: A001 (as gzip.open)
    """Open a bag for reading: its folder, or one .mcap file.

    `watch` is called now and then with the bytes passed and the bytes of the file, while a file
    without an index is walked through. Raises InputError, BagError when the bag cannot be read.
    """
    return Bag(path, watch)
