"""Where a study tells how it goes: nowhere, or on latched topics of its node.

What is slow to load, and ROS, is imported within functions.
"""

from __future__ import annotations

import io
import math
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from bouncing_disk_ros.command_line.stop import Stop
from bouncing_disk_ros.topics import STUDY_TOPICS

if TYPE_CHECKING:
    import numpy as np
    import xarray as xr
    from matplotlib.figure import Figure
    from numpy.typing import NDArray
    from rclpy.node import Node
    from sensor_msgs.msg import Image


FIGURE_DPI = 160
REPORT_SECONDS = 0.2
"""How often progress is looked at."""
MOST_SENT = 2048
"""Pixels along a side of the published map, or less than twice as many: some 64 MB."""


class StudyOutlet:
    """Where a study tells how it goes, beside the terminal; this one, without ROS: nowhere."""

    def __init__(self, stop: Stop) -> None:
        self.stop = stop

    def wait(self, condition: Callable[[], bool], meanwhile: Callable[[], None]) -> bool:
        """Wait until a condition holds or a signal came; whether it holds."""
        while not condition() and not self.stop.asked:
            time.sleep(REPORT_SECONDS / 4)
            meanwhile()
        return condition()

    def progress(self, share: float) -> None:
        """Take how much is done, 0 to 1."""

    def is_heard(self) -> bool:
        """Whether somebody would get a figure."""
        return False

    def result(self, figure: Figure | None, file: Path | None, result: xr.Dataset) -> None:
        """Take the first figure, if it is drawn, its PNG file if there is one, and the result."""


class StudyTopics(StudyOutlet):
    """`STUDY_TOPICS`; ~/result of a map alone.

    Callbacks run while it waits. `image`: the field of a map, or "".
    """

    def __init__(self, node: Node, stop: Stop, image: str) -> None:
        from bouncing_disk_ros.ros.qos import publisher_of

        super().__init__(stop)
        self._node, self._image = node, image
        self._progress = publisher_of(node, STUDY_TOPICS["~/progress"])
        self._figure = publisher_of(node, STUDY_TOPICS["~/figure/compressed"])
        self._result = publisher_of(node, STUDY_TOPICS["~/result"]) if image else None

    def wait(self, condition: Callable[[], bool], meanwhile: Callable[[], None]) -> bool:
        """Run callbacks until a condition holds or a signal came; whether it holds."""
        from rclpy.clock import Clock, ClockType

        from bouncing_disk_ros.ros.node_tool import wait_for

        steady = Clock(clock_type=ClockType.STEADY_TIME)  # whatever becomes of /clock
        timer = self._node.create_timer(REPORT_SECONDS, meanwhile, clock=steady)
        try:
            return wait_for(self._node, self.stop, condition, math.inf)
        finally:
            self._node.destroy_timer(timer)

    def progress(self, share: float) -> None:
        """Publish how much is done, 0 to 1."""
        from std_msgs.msg import Float32

        self._progress.publish(Float32(data=share))

    def is_heard(self) -> bool:
        """Whether a subscriber would get a figure."""
        return bool(self._figure.get_subscription_count())

    def result(self, figure: Figure | None, file: Path | None, result: xr.Dataset) -> None:
        """Publish the first figure, and of a map its field."""
        from sensor_msgs.msg import CompressedImage

        from bouncing_disk_ros.maps.basin_measures import downsample

        stamp = self._node.get_clock().now().to_msg()
        if figure is not None:
            data = file.read_bytes() if file else _png(figure)
            message = CompressedImage(format="png", data=data)
            message.header.stamp = stamp
            self._figure.publish(message)
        if self._result is not None:
            image = image_message(downsample(result[self._image], MOST_SENT))
            image.header.stamp = stamp
            self._result.publish(image)


def _png(figure: Figure) -> bytes:
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=FIGURE_DPI)
    return buffer.getvalue()


def image_message(array: NDArray[np.generic]) -> Image:
    """A map as an image: row 0 of the array, the least value of its axis, is the lowest row."""
    import numpy as np
    from sensor_msgs.msg import Image

    integer = array.dtype.kind in "iu"
    upright = np.ascontiguousarray(array[::-1], np.int32 if integer else np.float32)
    return Image(
        height=upright.shape[0],
        width=upright.shape[1],
        encoding="32SC1" if integer else "32FC1",
        is_bigendian=0,
        step=4 * upright.shape[1],
        data=upright.tobytes(),
    )
