"""The loop of the node `juggle` on a run of this process: no message between them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from numpy.typing import NDArray

from bouncing_disk_ros.core.model import Disk, InitialState, Motion
from bouncing_disk_ros.core.simulation import Simulation
from bouncing_disk_ros.juggling.juggler import Juggler, OffsetTrajectory
from bouncing_disk_ros.juggling.live_loop import LiveLoop, LoopOptions, request_of
from bouncing_disk_ros.juggling.simulated_loop import run_loop
from bouncing_disk_ros.run.apply_request import apply_request
from bouncing_disk_ros.run.command_validation import Instant
from bouncing_disk_ros.run.session import Session
from bouncing_disk_ros.run.time_map import SIMULATED


class LocalJuggling(LiveLoop):
    """Hears motions and impacts of a session, and gives it offset trajectories.

    `options`: restitution and gravity (m/s², that of a preload included) as the controller believes
    them.
    """

    def __init__(self, strategy: str, options: Mapping[str, float]) -> None:
        believed = Disk(1.0, options["restitution"], 0.0, 1.0, 1.0, options["gravity"])
        super().__init__(LoopOptions(believed), strategy)
        _load()
        self._answers: list[OffsetTrajectory] = []

    def hear(self, rows: NDArray[Any]) -> None:
        """Take in rows of impacts; what they ask for is sent by `answer`."""
        self._answers += self.on_impacts(rows)

    def answer(self, session: Session) -> None:
        """Send what was answered; InputError where the session's limits forbid it."""
        answers, self._answers = self._answers, []
        for one in answers:
            request = request_of(one, one.begin_ns)
            apply_request(request, lambda: (session, Instant(session.input_ns, SIMULATED, 0)))


def _load() -> None:
    """Load what is compiled, or compile it, also for an offset, before an impact is answered."""
    motion, disk = Motion(0.039, 0.0, 3.0, 0.0), Disk(1.0, 0.5, 0.0, 1.0, 1.0, 9.81)
    simulation = Simulation(motion, disk, InitialState())
    run_loop(simulation, Juggler("deadbeat", motion, disk), periods=3.0)
