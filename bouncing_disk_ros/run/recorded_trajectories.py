"""The offset trajectories of a run, from its record of inputs."""

from __future__ import annotations

from bouncing_disk_ros.core.offset import CONSTANT, Lane, Offset, Plan, hold
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.run.input_records import Record
from bouncing_disk_ros.run.trajectory_validation import splice_of


class RecordedTrajectories:
    """Appends what each checked record of disk/inputs accepts to `entries`.

    An entry is the simulated instant (ns) and all that is accepted then; None: not known.
    """

    def __init__(self, entries: list[tuple[int, Offset | None]]) -> None:
        self._entries = entries

    @property
    def _newest(self) -> Offset | None:
        return self._entries[-1][1] if self._entries else None

    def note_offset(self) -> None:
        """An offset is in force; without a snapshot of the inputs before it nobody knows which."""
        if not self._entries:
            self._entries.append((0, None))

    def forget(self, at_ns: int) -> None:
        """Records are missing: from the last one before on, nothing is known up to a snapshot."""
        if self._newest is not None:
            self._entries.append((at_ns, None))

    def take_snapshot(self, record: Record) -> None:
        """Take the offset of a snapshot where it is not known already; InputError for none."""
        now, plain = record["time_ns"], record["state"].get("offset")
        known = self._newest
        if plain is None:
            if known is None:
                self._entries.append((now if self._entries else 0, Offset()))
            return
        from bouncing_disk_ros.core import checkpoint

        try:
            found, _, _ = checkpoint.offset(plain)
        except ValueError as error:
            given = f"of no offset ({error})"
            raise InputError("snapshot", given, "offset trajectories of a run") from None
        if known is None or _held(known.trimmed(now)) != _held(found):
            self.note_offset()
            self._entries.append((now, found))

    def take_trajectory(self, record: Record) -> None:
        """Take an accepted trajectory."""
        self.note_offset()
        known, now = self._newest, record["time_ns"]
        if known is not None:
            splice = splice_of(record["begin_ns"], record["joints"])
            begin = max(splice.begin_ns, now)
            offset = known.spliced(begin, now, splice.axial, splice.angular)
            self._entries.append((now, offset.since(now)))

    def take_reset(self, now_ns: int) -> None:
        """A reset ends all offsets."""
        if self._entries and self._newest != Offset():
            self._entries.append((now_ns, Offset()))


def _held(offset: Offset) -> Offset:
    """The same offset, with a hold that it begins with from time 0 on: only a reset dates it."""
    lanes = []
    for first, *later in (lane.plans for lane in offset):
        head = first.segments[0]
        if head.degree == CONSTANT:
            first = Plan((hold(0, head.start.position),))
        lanes.append(Lane((first, *later)))
    return Offset(*lanes)
