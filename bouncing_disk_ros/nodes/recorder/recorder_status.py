"""Status of a recorder: losses as notes of the bag, a line, /diagnostics, a summary."""

from __future__ import annotations

import json
import time
from collections.abc import Mapping

from bouncing_disk_ros.bag.recording import Recording
from bouncing_disk_ros.nodes.recorder.recorded_topic import RecordedTopic
from bouncing_disk_ros.nodes.recorder.recorder_options import MB
from bouncing_disk_ros.run.health import Level, Status


class RecorderStatus:
    """Reads off a recording and its topics; times are those of the steady clock."""

    def __init__(self, recording: Recording, topics: Mapping[str, RecordedTopic]) -> None:
        self._recording, self._topics = recording, topics
        self._began = time.monotonic()
        self._missed = 0
        self.refused = 0

    def _registered(self) -> list[RecordedTopic]:
        return [topic for topic in self._topics.values() if topic.registered]

    @property
    def _lost(self) -> int:
        """Messages that are known to be lost on the way."""
        losses = (topic.loss for topic in self._registered())
        return sum(loss.lost for loss in losses if not loss.why_not)

    def losses(self) -> dict[str, str]:
        """What is known to be lost, as notes of the bag; topics that lost nothing are left out."""
        lost = {topic.name: str(topic.loss) for topic in self._registered()}
        notes = {"lost": json.dumps({name: text for name, text in lost.items() if text != "0"})}
        rows = [topic.rows.lost for topic in self._topics.values() if topic.rows is not None]
        notes["lost_impact_rows"] = str(sum(rows))
        notes["received_but_not_recorded"] = json.dumps(dict(self._recording.unrecorded))
        return notes

    def line(self, state: str) -> str:
        """One line for the log."""
        recording = self._recording
        return (
            f"{state}: "
            f"{time.monotonic() - self._began:.0f} s, {recording.accepted.total()} messages, "
            f"{recording.writer.size / MB:.1f} MB written, {recording.queued / MB:.1f} MB waiting, "
            f"{self._lost} lost on the way, {recording.dropped.total()} dropped"
        )

    def report(self, state: str) -> list[Status]:
        """The row of /diagnostics: ERROR once nothing is recorded any more, WARN while it loses."""
        recording = self._recording
        missed = self._lost + recording.dropped.total()
        level, message = Level.OK, state
        if recording.error is not None:
            level, message = Level.ERROR, str(recording.error)
        elif missed > self._missed:
            level, message = Level.WARN, f"{state}; {missed - self._missed} messages more are lost"
        self._missed = missed
        values = {
            "bag": str(recording.writer.folder),
            "messages": str(recording.accepted.total()),
            "written (MB)": f"{recording.writer.size / MB:.3f}",
            "waiting (MB)": f"{recording.queued / MB:.3f}",
            "lost on the way": str(self._lost),
            "dropped": str(recording.dropped.total()),
            "refused requests": str(self.refused),
        }
        return [Status("recording", level, message, values)]

    def summary(self) -> str:
        """What is in the bag and what is not, topic by topic (after the end)."""
        recorded, missing = self._recording.recorded, self._recording.unrecorded
        lines = [f"{self._recording.writer.folder}: {recorded.total()} messages"]
        rows = sorted(self._registered(), key=lambda topic: topic.name)
        width = max((len(topic.name) for topic in rows), default=0)
        for topic in rows:
            name = topic.name
            line = f"  {name:{width}}  {recorded[name]} recorded, lost on the way: {topic.loss}"
            if topic.rows is not None:
                line += f", impacts missing by their index: {topic.rows.lost}"
            if missing[name]:
                line += f", received but not recorded: {missing[name]}"
            lines.append(line)
        return "\n".join(lines)
