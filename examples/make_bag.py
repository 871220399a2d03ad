"""A bag of a simulated run, written without ROS: its inputs and its impacts.

    python examples/make_bag.py [FOLDER]      (default: run_1)

The recorder (`bouncing_disk_ros recorder`) writes such a bag of a live run. This one can be opened
by every ROS 2 tool, and by `bag_report` and `replay` of this package.
"""

import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

if "--help" in sys.argv:  # before the imports, which take seconds
    print(__doc__)
    sys.exit()

import numpy as np
from rosbags.typesys import Stores, get_typestore

from bouncing_disk_ros import bag, simulate
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.ros.from_messages import impact_fields
from bouncing_disk_ros.run.input_records import to_json

STORE = get_typestore(Stores.ROS2_JAZZY)
String, Cloud, Field, Header, Time = (
    STORE.types[name]
    for name in ("std_msgs/msg/String", "sensor_msgs/msg/PointCloud2", "sensor_msgs/msg/PointField",
                 "std_msgs/msg/Header", "builtin_interfaces/msg/Time")
)  # fmt: skip
FIELDS = [Field(*field) for field in impact_fields()]


def make_bag(folder: str, seconds: float = 20.0) -> None:
    """Simulate a run, with an angular impulse each second that makes the disk slip; write it."""
    turns = [(second + 0.5, 0.0, 0.15) for second in range(int(seconds))]  # s, N·s, N·m·s
    run = simulate(seconds, preset="pizza_multiple_toss", impulses=turns)
    with bag.Writer(folder) as writer:

        def write(topic: str, message: Any, time_ns: int, number: int) -> None:
            kind = message.__msgtype__
            writer.add_topic(topic, kind)
            writer.write(topic, bytes(STORE.serialize_cdr(message, kind)), time_ns, sequence=number)

        for number, record in enumerate(run.inputs, 1):
            write("/disk/inputs", String(to_json(record)), record["time_ns"], number)
        for number, row in enumerate(run.impacts, 1):
            time_ns = round(1e9 * row["time"])
            header = Header(Time(*divmod(time_ns, 10**9)), "next_collision")
            data, size = np.frombuffer(row.tobytes(), np.uint8), row.nbytes
            cloud = Cloud(header, 1, 1, FIELDS, False, size, size, data, True)
            write("/disk/impacts", cloud, time_ns, number)


@contextmanager
def given_or_made() -> Iterator[str]:
    """The bag that the command line names; without one a bag of a simulated run, for now."""
    if len(sys.argv) > 1:
        yield sys.argv[1]
    else:
        with tempfile.TemporaryDirectory() as place:
            make_bag(str(Path(place, "run_1")))
            yield str(Path(place, "run_1"))


if __name__ == "__main__":
    try:
        make_bag(sys.argv[1] if len(sys.argv) > 1 else "run_1")
    except InputError as error:
        sys.exit(f"make_bag: {error}")
