"""Commands of the simulator: subscriptions, validation of what arrives, and the session."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from geometry_msgs.msg import WrenchStamped
from rclpy.node import Node
from std_msgs.msg import Float64
from trajectory_msgs.msg import JointTrajectory

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.limits import INPUTS_AHEAD
from bouncing_disk_ros.ros.numbered import NumberedSubscription
from bouncing_disk_ros.ros.serialized import (
    impulse_from_bytes,
    programme_from_bytes,
    value_from_bytes,
)
from bouncing_disk_ros.run.command_validation import (
    ImpulseRequest,
    Instant,
    ProgrammeRequest,
    describe,
    schedule_impulse,
    schedule_programme,
    validate_impulse,
    validate_programme,
)
from bouncing_disk_ros.run.session import Session
from bouncing_disk_ros.topics import MOTION_NAMES, TOPICS


class Commands:
    """Listens on the command topics from the start, so that an inactive node can say why not.

    `open_session` gives the session that accepts inputs now and the instant of arrival, or raises
    InputError; it is asked only when everything else about a command is right. `applied` is called
    after each accepted input, `refuse` with each InputError.
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
        self.subscriptions: list[NumberedSubscription] = []
        self._subscribe(JointTrajectory, "platform/command", self.take_programme)
        self._subscribe(WrenchStamped, "disk/impulse", self.take_impulse)
        for name in MOTION_NAMES:
            self._subscribe(Float64, f"platform/{name}", partial(self.take_value, name))

    def _subscribe(self, kind: type, topic: str, take: Callable[[bytes], object]) -> None:
        qos = TOPICS[topic].qos
        self.subscriptions.append(NumberedSubscription(self._node, kind, topic, qos, take))

    # --- serialized messages: False when refused --------------------------------------------------
    def take_programme(self, data: bytes) -> bool:
        """A message of platform/command."""
        try:
            request = programme_from_bytes("platform/command", data)
        except InputError as error:
            self._refuse(error)
            return False
        return self.programme(request)

    def take_value(self, name: str, data: bytes) -> bool:
        """A message of platform/<name>."""
        try:
            request = value_from_bytes(f"platform/{name}", name, data)
        except InputError as error:
            self._refuse(error)
            return False
        return self.programme(request)

    def take_impulse(self, data: bytes) -> bool:
        """A message of disk/impulse."""
        try:
            request = impulse_from_bytes("disk/impulse", data)
        except InputError as error:
            self._refuse(error)
            return False
        return self.apply_impulse(request)

    # --- requests: False when refused -------------------------------------------------------------
    def programme(self, request: ProgrammeRequest) -> bool:
        """Validate a programme and apply it."""
        try:
            changes = validate_programme(request)
            session, instant = self._opened(request.field)
            points = schedule_programme(request, changes, instant, session.latest_target)
        except InputError as error:
            self._refuse(error)
            return False
        session.command(points)
        self._node.get_logger().debug(f"{request.field}: {describe(points)}")
        self._applied()
        return True

    def apply_impulse(self, request: ImpulseRequest) -> bool:
        """Validate an impulse and apply it."""
        try:
            validate_impulse(request)
            session, instant = self._opened(request.field)
            at_ns, axial, angular = schedule_impulse(request, instant)
        except InputError as error:
            self._refuse(error)
            return False
        session.apply_impulse(at_ns, axial, angular)
        self._applied()
        return True

    def _opened(self, field: str) -> tuple[Session, Instant]:
        """The session and the instant, unless too many inputs have not acted yet."""
        session, instant = self._open(field)
        ahead = max(session.waiting, session.simulation.queued_impulses)
        if ahead >= INPUTS_AHEAD:
            given = f"a command behind {ahead} that have not acted yet"
            raise InputError(field, given, f"at most {INPUTS_AHEAD} of them", "Wait, or reset.")
        return session, instant

    # --- what did not arrive ----------------------------------------------------------------------
    def look_for_publishers(self) -> None:
        """Look again, once a second, where several publishers made counting impossible."""
        for subscription in self.subscriptions:
            subscription.lost.look()

    @property
    def lost(self) -> tuple[int, list[str]]:
        """Messages lost on the way, and the topics of which there may be more."""
        uncertain = [one.topic for one in self.subscriptions if one.lost.lower_bound]
        return sum(one.lost.lost for one in self.subscriptions), uncertain
