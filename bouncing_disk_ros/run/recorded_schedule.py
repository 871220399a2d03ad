"""The motions and offset trajectories of the platform in a run, from its record of inputs."""

from __future__ import annotations

from bouncing_disk_ros.core.model import Motion, MotionInForce
from bouncing_disk_ros.core.offset import CONSTANT, Lane, Offset, Plan, hold
from bouncing_disk_ros.core.schedule import Fade, Impulse, plan_fades
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.run.input_records import Record
from bouncing_disk_ros.run.trajectory_validation import splice_of


class RecordedSchedule:
    """Appends what checked records of disk/inputs bring into force to `motions` and `offsets`.

    Motions are not known before the first snapshot, nor from `forget` to the next one; their
    forcing phase and cycles are 0: a record does not have them. An entry of `offsets` is the
    simulated instant (ns) and all that is accepted then; None: not known.
    """

    def __init__(
        self, motions: list[MotionInForce], offsets: list[tuple[int, Offset | None]]
    ) -> None:
        self._motions, self._offsets = motions, offsets
        self._pending: list[Fade] = []
        self._has_begun = False  # there was a snapshot
        self.is_known = False

    @property
    def _offset(self) -> Offset | None:
        return self._offsets[-1][1] if self._offsets else None

    def note_offset(self) -> None:
        """An offset is in force; without a snapshot of the inputs before it nobody knows which."""
        if not self._offsets:
            self._offsets.append((0, None))

    def forget(self, at_ns: int) -> None:
        """Records are missing: from the last one before on, nothing is known up to a snapshot."""
        self._pending, self.is_known = [], False
        if self._offset is not None:
            self._offsets.append((at_ns, None))

    def take_snapshot(self, record: Record) -> list[Impulse]:
        """Take what is not known already from a snapshot; of the impulses those that lie ahead.

        InputError: it shows no motion, or no offset.
        """
        self._take_offset(record)
        if self.is_known:
            return []
        if not self._has_begun:
            self._motions.clear()  # those of platform/motion, which may lack some
        try:
            in_force, self._pending, impulses = _of_state(record["state"])
        except (KeyError, TypeError, ValueError) as error:
            given = f"of no motion ({error})"
            raise InputError("snapshot", given, "the platform's motion of a run") from None
        if not self._motions or self._motions[-1] != in_force:
            self._motions.append(in_force)
        self.is_known = self._has_begun = True
        self.reach(record["time_ns"])
        return impulses

    def _take_offset(self, record: Record) -> None:
        now, plain = record["time_ns"], record["state"].get("offset")
        known = self._offset
        if plain is None:
            if known is None:
                self._offsets.append((now if self._offsets else 0, Offset()))
            return
        from bouncing_disk_ros.core import checkpoint

        try:
            found, _, _ = checkpoint.offset(plain)
        except ValueError as error:
            given = f"of no offset ({error})"
            raise InputError("snapshot", given, "offset trajectories of a run") from None
        if known is None or _held(known.trimmed(now)) != _held(found):
            self.note_offset()
            self._offsets.append((now, found))

    def take_motion(self, record: Record) -> None:
        """Take an accepted programme: it replaces every cross-fade that has not begun."""
        now = record["time_ns"]
        self.reach(now)
        if self.is_known:
            last = self._motions[-1]
            points = [(int(at), Motion(*values)) for at, values in record["points"]]
            free = max(last.end_ns, now)
            self._pending = plan_fades(points, last.target, free, record["crossfade_ns"])
            self.reach(now)

    def take_trajectory(self, record: Record) -> None:
        """Take an accepted offset trajectory."""
        self.note_offset()
        known, now = self._offset, record["time_ns"]
        if known is not None:
            splice = splice_of(record["begin_ns"], record["joints"])
            begin = max(splice.begin_ns, now)
            offset = known.spliced(begin, now, splice.axial, splice.angular)
            self._offsets.append((now, offset.since(now)))

    def take_reset(self, record: Record) -> None:
        """Take a reset: the initial motion without offsets, and nothing pending."""
        now = record["time_ns"]
        self.reach(now)
        if self.is_known:
            self._pending = []
            self._motions.append(_steady(now, Motion(**record["motion"])))
        if self._offsets and self._offset != Offset():
            self._offsets.append((now, Offset()))

    def reach(self, now_ns: int) -> None:
        """Simulated time has come this far: put in force what has begun and ended by then."""
        while self.is_known:
            last = self._motions[-1]
            if last.begin_ns < last.end_ns <= now_ns:
                self._motions.append(_steady(last.end_ns, last.target))
            elif last.end_ns <= now_ns and self._pending and self._pending[0].begin_ns <= now_ns:
                begin, end, target = self._pending.pop(0)
                self._motions.append(MotionInForce(begin, end, last.target, target, 0, 0.0))
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


def _held(offset: Offset) -> Offset:
    """The same offset, with a hold that it begins with from time 0 on: only a reset dates it."""
    lanes = []
    for first, *later in (lane.plans for lane in offset):
        head = first.segments[0]
        if head.degree == CONSTANT:
            first = Plan((hold(0, head.start.position),))
        lanes.append(Lane((first, *later)))
    return Offset(*lanes)
