"""The node of every study: its options are parameters; progress and result go on topics."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from sensor_msgs.msg import CompressedImage, Image
from std_msgs.msg import Float32

from bouncing_disk_ros.ros.node_tool import options, overrides_of, wait_for
from bouncing_disk_ros.ros.qos import profile_of
from bouncing_disk_ros.ros.stop import Stop
from bouncing_disk_ros.study.study_definition import StudyDefinition
from bouncing_disk_ros.study.study_work import REPORT_SECONDS, Outlet, StudyWork
from bouncing_disk_ros.topics import Qos

_LATCHED = Qos(1, latched=True)


class StudyNode(Node):
    """Runs one study; topics ~/progress, ~/figure/compressed and, for a map, ~/result."""

    def __init__(self, study: StudyDefinition) -> None:
        super().__init__(study.name)
        study.refuse_not_taken(overrides_of(self))
        values = options(self, study.table)
        self._work = StudyWork(study, values, set(overrides_of(self)))
        self._topics = _Topics(self, has_image=bool(study.image))

    def present(self, stop: Stop) -> int:
        """Compute, show, keep; the exit code."""
        self._topics.stop = stop
        return self._work.present(self._topics, stop)


class _Topics(Outlet):
    """The latched topics of a study; callbacks run while it waits."""

    takes_result = True

    def __init__(self, node: Node, *, has_image: bool) -> None:
        self._node = node
        profile = profile_of(_LATCHED)
        self._progress = node.create_publisher(Float32, "~/progress", profile)
        self._figure = node.create_publisher(CompressedImage, "~/figure/compressed", profile)
        self._result = node.create_publisher(Image, "~/result", profile) if has_image else None

    def wait(self, condition: Callable[[], bool], meanwhile: Callable[[], None]) -> bool:
        """Run callbacks until a condition holds or a signal came; whether it holds."""
        steady = Clock(clock_type=ClockType.STEADY_TIME)  # whatever becomes of /clock
        timer = self._node.create_timer(REPORT_SECONDS, meanwhile, clock=steady)
        try:
            return wait_for(self._node, self.stop, condition, math.inf)
        finally:
            self._node.destroy_timer(timer)

    def progress(self, share: float) -> None:
        """Publish how much is done, 0 to 1."""
        self._progress.publish(Float32(data=share))

    def result(self, png: bytes, field: NDArray[np.generic] | None) -> None:
        """Publish the first figure, and of a map its field."""
        stamp = self._node.get_clock().now().to_msg()
        message = CompressedImage(format="png", data=png)
        message.header.stamp = stamp
        self._figure.publish(message)
        if self._result is not None and field is not None:
            image = image_message(field)
            image.header.stamp = stamp
            self._result.publish(image)


def image_message(array: NDArray[np.generic]) -> Image:
    """A map as an image: row 0 of the array, the least value of its axis, is the lowest row."""
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
