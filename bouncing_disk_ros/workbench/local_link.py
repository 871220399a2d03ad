"""A run in this process, without ROS: what the simulator's node does, for one's own pages."""

from __future__ import annotations

import queue
import threading
import time
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros import parameters
from bouncing_disk_ros.core.model import Sample
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.parameters import Value
from bouncing_disk_ros.run.apply_request import Request, apply_request
from bouncing_disk_ros.run.control import RunControl, inactive
from bouncing_disk_ros.run.input_records import Record
from bouncing_disk_ros.run.loop import BUDGET_NS
from bouncing_disk_ros.run.programmes import load_programme, performed
from bouncing_disk_ros.run.session import Session
from bouncing_disk_ros.run.time_map import SIMULATED, TimeMap
from bouncing_disk_ros.units import NS
from bouncing_disk_ros.workbench.actions import (
    Action,
    Call,
    Impulse,
    Juggle,
    Lifecycle,
    Move,
    Perform,
    Set,
    StopJuggling,
)
from bouncing_disk_ros.workbench.run_history import SAMPLE_DTYPE, RunHistory
from bouncing_disk_ros.workbench.run_link import RunLink

if TYPE_CHECKING:
    from bouncing_disk_ros.workbench.local_juggling import LocalJuggling

TICK_SECONDS = 0.01
LEAD_NS = NS // 2
"""A programme starts so long after it is asked for, at least: as `perform` does."""


class LocalLink(RunLink):
    """Drives a run in a thread, in real time; its results go into a history.

    `values`: parameters of the start over the defaults, checked; InputError for wrong ones.
    """

    source = "simulated in this process, without ROS"

    def __init__(self, values: Mapping[str, Value]) -> None:
        self.history = RunHistory()
        self.times: TimeMap  # set by the run
        self._values = parameters.complete(values)
        self._actions: queue.SimpleQueue[Action] = queue.SimpleQueue()
        self._run: RunControl | None = None
        self._juggling: LocalJuggling | None = None
        self._shown_motion = -1
        self._ended = threading.Event()
        self._begin()
        self._thread = threading.Thread(target=self._work, name="workbench run", daemon=True)
        self._thread.start()

    # --- as a link
    def send(self, *actions: Action) -> None:
        """Send actions after those before."""
        for action in actions:
            self._actions.put(action)

    def close(self) -> None:
        """End the run."""
        self._ended.set()
        self._thread.join()

    # --- the outlet of the run
    def record(self, record: Record) -> None:
        """Keep what an input changes."""
        self.history.add_record(record)

    def sample(self, sample: Sample) -> None:
        """Keep a state, and the motion if it is a new one."""
        self._note_motion()
        row = (
            sample.time_ns / NS, sample.axial_position, sample.platform_position,
            sample.unwrapped_angle, sample.platform_angle, sample.angular_velocity,
        )  # fmt: skip
        self.history.phase = sample.phase.name.lower()
        self.history.add_samples(np.array([row], SAMPLE_DTYPE))

    def speed(self, first: Sample, second: Sample) -> None:
        """Keep the mean speed between two samples."""
        self.history.add_speed(second.time_ns / NS, first.mean_speeds(second)[1])

    def impacts(self, rows: NDArray[Any]) -> None:
        """Keep rows of impacts; a loop that juggles hears them."""
        self.history.add_impacts(rows)
        if self._juggling is not None:
            self._note_motion()
            self._juggling.hear(rows)
            self.history.juggling = self._juggling.status

    def state(self, session: Session, running: bool) -> None:
        """Keep the motion in force, and whether it moves."""
        del session
        self._note_motion()
        if not running:
            self.history.phase = "paused"

    def ended(self, fault: str) -> None:
        """Say why it cannot go on."""
        self.history.state = f"the run has ended: {fault}"

    def _note_motion(self) -> None:
        simulation = None if self._run is None else self._run.session.simulation
        if simulation is not None and simulation.motion_index != self._shown_motion:
            self._shown_motion = simulation.motion_index
            motion = simulation.motion_in_force
            self.history.add_motion(motion)
            if self._juggling is not None:
                self._juggling.on_motion(motion)
                self.history.juggling = self._juggling.status

    # --- the run, in its thread
    def _begin(self) -> None:
        self._shown_motion = -1
        self.history.state = ""
        name = self.names.node
        self._run = RunControl(name, self._values, self, stopping=self._ended.is_set)
        self._run.set_active(True)

    def _work(self) -> None:
        while not self._ended.wait(TICK_SECONDS):
            while not self._actions.empty():
                try:
                    self._do(self._actions.get())
                except InputError as error:
                    self.history.note(error.line, is_refusal=True)
            self._advance()

    def _advance(self) -> None:
        if self._run is None:
            self.history.phase = ""
            return
        now = time.monotonic_ns()
        while not self._run.tick(now) and time.monotonic_ns() < now + BUDGET_NS:
            pass

    def _answer(self, session: Session) -> None:
        """Let the loop that juggles answer an impact, before time goes on."""
        if self._juggling is not None:
            try:
                self._juggling.answer(session)
            except InputError as error:
                self.history.note(error.line, is_refusal=True)

    # --- actions, in that thread
    def _do(self, action: Action) -> None:
        if isinstance(action, Lifecycle):
            self._change(action.transition)
        elif isinstance(action, Set):
            self._set(dict(action.values))
        elif isinstance(action, StopJuggling):
            self._juggle_with(None)
        elif self._run is None:
            raise inactive(self.names.node, "an input", "unconfigured")
        elif isinstance(action, Juggle):
            self._juggle(action)
        elif isinstance(action, Call):
            self._call(self._run, action)
        else:
            self._command(self._run, action)

    def _change(self, transition: str) -> None:
        if transition == "cleanup":
            self._run = None
            self._juggle_with(None)
        elif transition == "configure":
            self._begin()
        elif self._run is not None:
            self._run.set_active(transition == "activate")

    def _command(self, run: RunControl, action: Move | Impulse | Perform) -> None:
        session, instant = run.arrival("an input")
        arrived = session, instant._replace(times=SIMULATED)
        for request in self._requests(action, session):
            apply_request(request, lambda: arrived)
        run.publish_consequences()

    def _requests(self, action: Move | Impulse | Perform, session: Session) -> Iterable[Request]:
        """What an action asks of the run; stamps are simulated time."""
        if not isinstance(action, Perform):
            return [action.request()]
        return performed(load_programme(action.programme), session, session.time_ns + LEAD_NS)

    def _juggle(self, action: Juggle) -> None:
        """Start a loop; its kernels are loaded with the first one."""
        self.history.juggling = f"{action.strategy}: starts (the first time it compiles) …"
        try:
            from bouncing_disk_ros.workbench.local_juggling import LocalJuggling

            self._juggle_with(LocalJuggling(action.strategy, action.options))
        except InputError:
            self._juggle_with(None)
            raise
        assert self._run is not None
        self._run.anchor()  # what loading took is not made up for

    def _juggle_with(self, loop: LocalJuggling | None) -> None:
        self._juggling = loop
        if self._run is not None:
            self._run.answers = self._answer if loop is not None else None
        if loop is None:
            self.history.juggling = ""
        else:
            self._shown_motion = -1
            self._note_motion()

    def _call(self, run: RunControl, action: Call) -> None:
        match action.service:
            case "pause":
                said = run.pause(bool(action.paused))
            case "reset":
                said = run.reset()
            case _:
                said = run.step()
        self.history.note(f"{action.service}: {said}")

    def _set(self, values: dict[str, Any]) -> None:
        configured = self._run is not None
        found = parameters.checked_change(values.items(), self._values, is_configured=configured)
        self._values |= found
        if self._run is None:
            return
        self._run.set_parameters(found)
        if later := parameters.later_text(found):
            self.history.note(later)
