"""Bags: bytes and messages, never physics. `Writer` makes one, `open` reads one, `recover` mends.

A bag is a rosbag2 folder of .mcap files; see docs/recording.md.
"""

from pathlib import Path

from bouncing_disk_ros.bag.formats import FORMAT_VERSION, BagError
from bouncing_disk_ros.bag.metadata import OfferedQos
from bouncing_disk_ros.bag.options import Options, WriteError
from bouncing_disk_ros.bag.reader import Bag
from bouncing_disk_ros.bag.recover import recover
from bouncing_disk_ros.bag.report import Report
from bouncing_disk_ros.bag.topic import Message, Topic
from bouncing_disk_ros.bag.writer import Writer

__all__ = [
    "FORMAT_VERSION", "Bag", "BagError", "Message", "OfferedQos", "Options", "Report", "Topic",
    "WriteError", "Writer", "open", "recover",
]  # fmt: skip


def open(path: str | Path) -> Bag:  # noqa: A001 (as gzip.open)
    """Open a bag to read: its folder, or one .mcap file. InputError when it cannot be read."""
    return Bag(path)
