"""Reports on /diagnostics that are none, or of others, leave a record as it is."""

from __future__ import annotations

from typing import Any

import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

from bouncing_disk_ros.report.run_record import UNKNOWN_DISK, RunRecord
from bouncing_disk_ros.report.run_record_builder import RunRecordBuilder

RIGHT = {
    "real time": {
        "simulated time (s)": "1.5", "lateness p50 (s)": "0.1", "lateness p99 (s)": "0.2",
        "lateness max (s)": "0.3", "behind (s)": "0.0", "samples skipped": "2",
    },
    "energy": {"residual / throughput": "1e-15", "residual (J)": "0.0"},
    "inputs": {"refused": "3"},
}  # fmt: skip


def heard(tasks: dict[str, dict[str, str]]) -> RunRecord:
    record = RunRecord(UNKNOWN_DISK)
    status = [
        DiagnosticStatus(
            name=f"bouncing_disk: {task}",
            values=[KeyValue(key=key, value=value) for key, value in values.items()],
        )
        for task, values in tasks.items()
    ]
    RunRecordBuilder(record).handlers["/diagnostics"](DiagnosticArray(status=status))
    return record


def test_a_report_is_kept() -> None:
    (health,) = heard(RIGHT).health
    assert (health.simulated, health.skipped, health.refused) == (1.5, 2, 3)


@pytest.mark.parametrize(
    ("task", "key", "value"),
    [
        ("real time", "simulated time (s)", "soon"),
        ("real time", "behind (s)", "a bit"),
        ("real time", "samples skipped", "many"),
        ("real time", "samples skipped", "9" * 5000),
        ("energy", "residual (J)", "none"),
        ("inputs", "refused", "1e400"),
    ],
)
def test_a_report_with_another_content_is_left_out(task: str, key: str, value: str) -> None:
    tasks: Any = {name: dict(values) for name, values in RIGHT.items()}
    tasks[task][key] = value
    assert heard(tasks).health == []
    del tasks["energy"]
    assert heard(tasks).health == []
