"""Writers that are killed at random moments, each leaving a bag: a process of its own, to fork.

    python killed_writer.py FOLDER COUNT SEED

Bag i is FOLDER/i; FOLDER/i.told holds how many of its messages stood in finished chunks, as the
writer itself noted before it was killed.
"""

from __future__ import annotations

import itertools
import mmap
import os
import random
import signal
import struct
import sys
import time
from pathlib import Path

from bouncing_disk_ros import bag

TOPIC = "/text"
KIND = "std_msgs/msg/String"
LONGEST = 0.06  # s from the fork to the kill
QOS = bag.OfferedQos(durability="transient_local")


def content(number: int) -> bytes:
    """CDR of message `number`: its length goes up and down, so that chunks end anywhere."""
    text = f"{number} ".encode() * (1 + number % 37)
    return b"\0\1\0\0" + struct.pack("<I", len(text) + 1) + text + b"\0"


def write(folder: Path, dice: random.Random, told: mmap.mmap) -> None:
    """Write until killed, and tell how many messages are in finished chunks."""
    options = bag.Options(
        compression=dice.choice(("zstd", "lz4", "none")),
        chunk_size=dice.choice((200, 3000, 60_000)),
        chunk_period=dice.choice((0.001, 1.0)),
        max_size=dice.choice((0, 20_000, 200_000)),
    )
    writer = bag.Writer(folder, options)
    writer.attach("a.yaml", "text/yaml", b"a: 1\n" * 20)
    writer.add_topic(TOPIC, KIND, [QOS])
    writer.repeat(TOPIC, dice.choice((0, 1, 5)))
    size = writer.size
    for number in itertools.count():
        writer.write(TOPIC, content(number), number + 1, number + 1, number)
        if writer.size != size:
            size = writer.size
            # that this very message is in the chunk, a split or the age of the chunk decides
            told[:8] = struct.pack("<Q", number)


def main(folder: Path, count: int, seed: int) -> None:
    """Fork the writers one after the other and kill each."""
    dice = random.Random(seed)
    for place in range(count):
        told, choice = mmap.mmap(-1, 8), random.Random(dice.random())
        pid = os.fork()
        if not pid:
            write(folder / str(place), choice, told)
        time.sleep(dice.uniform(0.0, LONGEST))
        os.kill(pid, signal.SIGKILL)
        status = os.waitpid(pid, 0)[1]
        if not os.WIFSIGNALED(status):
            sys.exit(f"writer {place} ended by itself (status {status})")
        (folder / f"{place}.told").write_bytes(told[:8])
        print(place, flush=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3]))
