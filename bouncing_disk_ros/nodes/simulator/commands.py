"""Commands of the simulator: subscriptions, the rulings on what arrives, and the session."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from geometry_msgs.msg import WrenchStamped
from rclpy.node import Node
from std_msgs.msg import Float64
from trajectory_msgs.msg import JointTrajectory

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.ros import conversions
from bouncing_disk_ros.ros.qos import profile_of
from bouncing_disk_ros.run.rulings import (
    Instant,
    KickRequest,
    ProgrammeRequest,
    describe,
    rule_kick,
    rule_programme,
)
from bouncing_disk_ros.run.session import Session
from bouncing_disk_ros.topics import MOTION_NAMES, TOPICS


class Commands:
    """Listens on the command topics from the start, so that an inactive node can say why not.

    `open_session` gives the session that accepts inputs now and the instant of arrival, or raises
    InputError; `applied` is called after each accepted input, `refuse` with each InputError.
    """

    def __init__(
        self,
        node: Node,
        open_session: Callable[[str], tuple[Session, Instant]],
        applied: Callable[[], None],
        refuse: Callable[[InputError], None],
    ) -> None:
        self._node, self._open = node, open_session
        self._applied, self._refuse = applied, refuse
        self._subscribe(JointTrajectory, "platform/command", self._on_command)
        self._subscribe(WrenchStamped, "disk/impulse", self._on_impulse)
        for name in MOTION_NAMES:
            self._subscribe(Float64, f"platform/{name}", partial(self._on_value, name))

    def _subscribe(self, kind: type, name: str, callback: Callable[..., None]) -> None:
        self._node.create_subscription(kind, name, callback, profile_of(TOPICS[name]))

    def _on_command(self, msg: JointTrajectory) -> None:
        self.programme(conversions.msg_to_programme(msg))

    def _on_value(self, name: str, msg: Float64) -> None:
        self.programme(conversions.value_to_programme(name, msg.data))

    def _on_impulse(self, msg: WrenchStamped) -> None:
        self.kick(conversions.msg_to_kick(msg))

    def programme(self, request: ProgrammeRequest) -> bool:
        """Judge a programme and apply it; False when it was refused."""
        try:
            session, instant = self._open(request.field)
            points = rule_programme(request, instant, session.latest_target)
        except InputError as error:
            self._refuse(error)
            return False
        session.command(points)
        self._node.get_logger().debug(f"{request.field}: {describe(points)}")
        self._applied()
        return True

    def kick(self, request: KickRequest) -> bool:
        """Judge a kick and apply it; False when it was refused."""
        try:
            session, instant = self._open(request.field)
            at_ns, axial, angular = rule_kick(request, instant)
        except InputError as error:
            self._refuse(error)
            return False
        session.kick(at_ns, axial, angular)
        self._applied()
        return True
