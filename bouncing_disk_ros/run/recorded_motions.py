"""The motions of the platform in a run, from its record of inputs."""

from __future__ import annotations

from bouncing_disk_ros.core.model import Motion, MotionInForce
from bouncing_disk_ros.core.schedule import Fade, Impulse, plan_fades
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.run.input_records import Record


class RecordedMotions:
    """Appends the motions that checked records of disk/inputs bring into force to `entries`.

    Nothing is known before the first snapshot, nor from `forget` to the next one. Forcing phase and
    cycles of the entries are 0: a record does not have them.
    """

    def __init__(self, entries: list[MotionInForce]) -> None:
        self._entries = entries
        self._pending: list[Fade] = []
        self.is_known = False

    def forget(self) -> None:
        """A record is missing: what follows is not known."""
        self._pending, self.is_known = [], False

    def take_snapshot(self, record: Record) -> list[Impulse]:
        """Begin anew at a snapshot; the impulses that lie ahead. InputError: it shows no motion."""
        now = record["time_ns"]
        try:
            in_force, self._pending, impulses = _of_state(record["state"])
        except (KeyError, TypeError, ValueError) as error:
            given = f"of no motion ({error})"
            raise InputError("snapshot", given, "the platform's motion of a run") from None
        if not self._entries or self._entries[-1] != in_force:
            self._entries.append(in_force)
        self.is_known = True
        self.reach(now)
        return impulses

    def take_motion(self, record: Record) -> None:
        """Take an accepted programme: it replaces every cross-fade that has not begun."""
        now = record["time_ns"]
        self.reach(now)
        if self.is_known:
            last = self._entries[-1]
            points = [(int(at), Motion(*values)) for at, values in record["points"]]
            free = max(last.end_ns, now)
            self._pending = plan_fades(points, last.target, free, record["crossfade_ns"])
            self.reach(now)

    def take_reset(self, record: Record) -> None:
        """Take a reset: the initial motion, and nothing pending."""
        now = record["time_ns"]
        self.reach(now)
        if self.is_known:
            self._pending = []
            self._entries.append(_steady(now, Motion(**record["motion"])))

    def reach(self, now_ns: int) -> None:
        """Simulated time has come this far: put in force what has begun and ended by then."""
        while self.is_known:
            last = self._entries[-1]
            if last.begin_ns < last.end_ns <= now_ns:
                self._entries.append(_steady(last.end_ns, last.target))
            elif last.end_ns <= now_ns and self._pending and self._pending[0].begin_ns <= now_ns:
                begin, end, target = self._pending.pop(0)
                self._entries.append(MotionInForce(begin, end, last.target, target, 0, 0.0))
            else:
                return


def _steady(at_ns: int, motion: Motion) -> MotionInForce:
    return MotionInForce(at_ns, at_ns, motion, motion, 0, 0.0)


def _of_state(state: Record) -> tuple[MotionInForce, list[Fade], list[Impulse]]:
    """The motion in force in the state of a snapshot; fades and impulses that lie ahead."""
    from bouncing_disk_ros.core import checkpoint
    from bouncing_disk_ros.core.layout import FADE

    start, target = (checkpoint.motion(name, state[name]) for name in ("start", "target"))
    fades = checkpoint.made("pending", state["pending"], checkpoint.pending_fade)
    impulses = checkpoint.made("kicks", state["kicks"], checkpoint.queued_impulse)
    row = state["engine"]["motion"]
    begin = checkpoint.instant("begin_ns", row["begin_ns"])
    if row["kind"] != FADE:
        return _steady(begin, target), fades, impulses
    end = checkpoint.instant("end_ns", row["end_ns"])
    checkpoint.in_order("motion", [begin, end])
    return MotionInForce(begin, end, start, target, 0, 0.0), fades, impulses
