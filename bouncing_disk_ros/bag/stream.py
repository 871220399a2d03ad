"""A file to write records to, which knows what stands whole in it."""

from __future__ import annotations

from pathlib import Path

from bouncing_disk_ros.bag.fields import ATTACHMENT_HEAD
from bouncing_disk_ros.bag.files import HEAD, RegularFile
from bouncing_disk_ros.bag.index import MAGIC, Index


class RecordStream:
    """What mcap's writer writes to: the file, unbuffered, and the index of what is whole in it."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.file = path.open("xb", buffering=0)
        self.position = 0
        self.index = Index()

    def write(self, data: bytes) -> None:
        """Write whole records, or raise OSError; then the index still tells what is whole."""
        self.write_ending(data)
        if data != MAGIC:
            self.index.add(data, self.position)
        self.position += len(data)

    def copy_attachment(self, file: RegularFile, offset: int, length: int) -> None:
        """Copy an attachment record of another file, however long it is."""
        for part in file.parts(offset, length):
            self.write_ending(part)
        beginning = file.read(offset + HEAD.size, min(length - HEAD.size, ATTACHMENT_HEAD))
        self.index.add_attachment(beginning, self.position, length)
        self.position += length

    def write_ending(self, data: bytes) -> None:
        """Write bytes that do not belong to the data section."""
        view = memoryview(data)
        while view:
            view = view[self.file.write(view) or 0 :]

    def cut(self, end: int) -> None:
        """Throw away what stands after `end` and go on there."""
        self.file.truncate(end)
        self.file.seek(end)
        self.position = end

    def tell(self) -> int:
        """Where the next record goes."""
        return self.position

    def flush(self) -> None:
        """Nothing is held back."""
