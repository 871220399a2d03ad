"""A run in this process, without ROS: what the simulator's node does, for one's own pages."""

from __future__ import annotations

import queue
import threading
import time
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros import parameters
from bouncing_disk_ros.core.model import Sample
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.parameters import Value
from bouncing_disk_ros.run.command_validation import (
    ImpulseRequest,
    Instant,
    PointRequest,
    ProgrammeRequest,
    accept_impulse,
    accept_programme,
)
from bouncing_disk_ros.run.loop import BUDGET_NS, Loop, Steps
from bouncing_disk_ros.run.programmes import load_programme, start_of
from bouncing_disk_ros.run.session import Session
from bouncing_disk_ros.run.time_map import FAR_NS, TimeMap, nanoseconds
from bouncing_disk_ros.units import NS
from bouncing_disk_ros.workbench.actions import (
    Action,
    Call,
    Impulse,
    Juggle,
    Lifecycle,
    Move,
    Names,
    Perform,
    Sequel,
    Set,
    StopJuggling,
)
from bouncing_disk_ros.workbench.run_history import SAMPLE_DTYPE, RunHistory

if TYPE_CHECKING:
    from bouncing_disk_ros.workbench.local_juggling import LocalJuggling

TICK_SECONDS = 0.01
LEAD_NS = NS // 2
"""A programme starts so long after it is asked for, at least: as `perform` does."""


class LocalLink:
    """Simulates in a thread, in real time; the sink of its own loop.

    `values`: parameters of the start over the defaults, checked; InputError for wrong ones.
    """

    def __init__(self, values: Mapping[str, Value]) -> None:
        self.history = RunHistory()
        self._values = parameters.complete(values)
        self._actions: queue.SimpleQueue[Action] = queue.SimpleQueue()
        self._session: Session | None = None
        self._juggling: LocalJuggling | None = None
        self._shown_motion = -1
        self._ended = threading.Event()
        self._begin()
        self._thread = threading.Thread(target=self._run, name="workbench run", daemon=True)
        self._thread.start()

    # --- as a link
    @property
    def names(self) -> Names:
        """How the simulator would be called."""
        return Names()

    @property
    def source(self) -> str:
        """What is shown, in a few words."""
        return "simulated in this process, without ROS"

    @property
    def is_recorded(self) -> bool:
        """Whether the run is over: it is not."""
        return False

    def send(self, action: Action | Sequel) -> None:
        """Send an action after those before."""
        for one in action.actions if isinstance(action, Sequel) else (action,):
            self._actions.put(one)

    def tick(self) -> None:
        """Nothing to look after."""

    def close(self) -> None:
        """End the run."""
        self._ended.set()
        self._thread.join()

    # --- the sink of the loop
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
            self._juggling.on_impacts(rows)
            self.history.juggling = self._juggling.status

    # --- the run, in its thread
    def _begin(self) -> None:
        session = Session(self._values, self.history.add_record)
        session.paused = bool(self._values["start_paused"])
        self._shown_motion = -1
        self._session, self._loop, self._steps = session, Loop(session, self), Steps()
        self._anchor()

    def _anchor(self) -> None:
        assert self._session is not None
        factor = float(self._values["real_time_factor"])
        self._line = TimeMap(self._session.time_ns, time.monotonic_ns(), 0, factor)

    def _run(self) -> None:
        while not self._ended.wait(TICK_SECONDS):
            while not self._actions.empty():
                try:
                    self._do(self._actions.get())
                except InputError as error:
                    self.history.note(error.line, is_refusal=True)
            self._advance()

    def _advance(self) -> None:
        session = self._session
        if session is None:
            self.history.phase = ""
        elif session.fault:
            self.history.state = f"the run has ended: {session.fault}"
        elif session.paused:
            self._loop.resolve_waiting()
            self.history.phase = "paused"
            self._note_motion()
        elif self._loop.resolve_waiting():
            free = self._line.factor == 0.0
            due = FAR_NS if free else self._line.due(time.monotonic_ns())
            deadline = time.monotonic_ns() + BUDGET_NS
            while not self._slice(due) and self._loop.resolve_waiting():
                if session.fault or time.monotonic_ns() >= deadline:
                    break
            self._note_motion()

    def _slice(self, until_ns: int, *, to_impact: bool = False) -> bool:
        """Advance; where a loop juggles no further than an impact, which it answers at once."""
        juggling, session = self._juggling, self._session
        reached = self._loop.slice(until_ns, to_impact=to_impact or juggling is not None)
        if juggling is not None and session is not None:
            try:
                juggling.answer(session)
            except InputError as error:
                self.history.note(error.line, is_refusal=True)
        return reached

    def _note_motion(self) -> None:
        session = self._session
        if session is not None and session.simulation.motion_index != self._shown_motion:
            self._shown_motion = session.simulation.motion_index
            motion = session.simulation.motion_in_force
            self.history.add_motion(motion)
            if self._juggling is not None:
                self._juggling.on_motion(motion)
                self.history.juggling = self._juggling.status

    # --- actions, in that thread
    def _do(self, action: Action) -> None:
        if isinstance(action, Lifecycle):
            self._change(action.transition)
        elif isinstance(action, Set):
            self._set(dict(action.values))
        elif isinstance(action, StopJuggling):
            self._stop_juggling()
        elif self._session is None:
            raise InputError("an input", "while unconfigured", "inputs while there is a run")
        else:
            self._loop.finish_samples()
            self._command(action, self._session)
            self._loop.flush()

    def _change(self, transition: str) -> None:
        if transition == "cleanup":
            self._session = None
            self._stop_juggling()
        elif transition == "configure":
            self._begin()
        elif transition == "activate":
            self._anchor()

    def _command(self, action: Action, session: Session) -> None:
        now = Instant(session.input_ns, TimeMap(session.time_ns, 0, 0, 1.0), 0)
        match action:
            case Move(values):
                point = PointRequest(tuple(map(float, values.values())), 0)
                request = ProgrammeRequest(tuple(values), (point,))
                session.command(accept_programme(request, now, session.latest_target))
            case Impulse(axial, angular):
                impulse = ImpulseRequest((0.0, 0.0, float(axial)), (0.0, 0.0, float(angular)))
                session.apply_impulse(*accept_impulse(impulse, now))
            case Perform(name):
                programme = load_programme(name)
                motion = session.simulation.motion_in_force
                fade = nanoseconds(float(self._values["crossfade_duration"]))
                begin = start_of(programme, motion, session.time_ns + LEAD_NS, fade)
                targets = programme.targets(motion.target)
                session.command([(begin + after, target) for after, target in targets])
            case Juggle():
                self._juggle(action)
            case Call(service, paused):
                self._call(session, service, bool(paused))

    def _juggle(self, action: Juggle) -> None:
        """Start a loop; its kernels are loaded with the first one."""
        self.history.juggling = f"{action.strategy}: starts (the first time it compiles) …"
        try:
            from bouncing_disk_ros.workbench.local_juggling import LocalJuggling

            self._juggling = LocalJuggling(action.strategy, action.options)
        except InputError:
            self._stop_juggling()
            raise
        self._shown_motion = -1
        self._note_motion()
        self._anchor()  # what loading took is not made up for

    def _stop_juggling(self) -> None:
        self._juggling, self.history.juggling = None, ""

    def _call(self, session: Session, service: str, paused: bool) -> None:
        if service == "pause":
            session.set_paused(paused)
            said = "paused" if paused else "running"
        elif service == "reset":
            session.reset()
            self._loop.restart_speed()
            said = "reset"
        else:
            said = self._step(session)
        self._anchor()
        self.history.note(f"{service}: {said} at {session.time_ns / NS:.9f} s of simulated time")

    def _step(self, session: Session) -> str:
        end, what = self._steps.end(session, self._values)
        to_impact = self._values["step_until"] == "impact"
        before = session.simulation.rows_total
        while not (self._loop.resolve_waiting() and self._slice(end, to_impact=to_impact)) and not (
            session.fault or self._ended.is_set()
        ):
            if to_impact and session.simulation.rows_total > before:
                break
        return f"{what}, now"

    def _set(self, values: dict[str, Any]) -> None:
        found = parameters.checked(values)
        for name in found:
            spec = parameters.TABLE[name]
            fixed = spec.read_only or (spec.while_unconfigured and self._session is not None)
            if fixed and found[name] != self._values[name]:
                raise InputError(name, found[name], "no change while it runs")
        whole = {**self._values, **found}
        parameters.check_together(whole)
        self._values = whole
        if self._session is None:
            return
        self._loop.finish_samples()
        self._session.set_parameters(found)
        if "real_time_factor" in found:
            self._anchor()
        if {"state_rate", "rotor_speed_rate"} & found.keys():
            self._loop.set_rates()
        if later := parameters.later_text(found):
            self.history.note(later)
