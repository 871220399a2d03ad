"""rerun checks our bags and takes every message of them into a recording of its own."""

from __future__ import annotations

import shutil
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from support.bags import TYPES, Sent, make, messages
from support.processes import finished

pytestmark = pytest.mark.interop

Rerun = Callable[..., str]


@pytest.fixture
def rerun(tmp_path: Path) -> Rerun:
    """The command `rerun`, in a home of its own, where its reports on usage are switched off."""
    beside = Path(sys.executable).with_name("rerun")
    found = str(beside) if beside.exists() else shutil.which("rerun")
    if found is None:
        pytest.skip("no `rerun` here: pip install rerun-sdk")
    command, home = found, str(tmp_path / "home")
    env = {"HOME": home, "XDG_CONFIG_HOME": home, "XDG_DATA_HOME": home, "NO_COLOR": "1"}

    def run(*arguments: str) -> str:
        done = finished(command, *arguments, env=env)
        return done.stdout + done.stderr

    run("analytics", "disable")
    return run


@pytest.fixture
def sent() -> list[Sent]:
    return list(messages(200))


@pytest.mark.parametrize("compression", ["none", "lz4", "zstd"])
def test_rerun_finds_no_fault(
    rerun: Rerun, tmp_path: Path, sent: list[Sent], compression: str
) -> None:
    options = {"compression": compression, "chunk_size": 3000}
    folder = make(tmp_path / "run", sent, max_duration=0.05, **options)
    files = list(folder.glob("*.mcap"))
    assert len(files) > 1
    for file in files:
        rows = [line.split() for line in rerun("mcap", "check", str(file)).splitlines()]
        states = {row[3]: row[0] for row in rows if len(row) > 3 and row[3].startswith("/")}
        assert states
        assert set(states.values()) == {"ok"}, rows
        recording = str(tmp_path / f"{file.stem}.rrd")
        rerun("mcap", "convert", str(file), "-o", recording)
        assert "1 file verified without error" in rerun("rrd", "verify", recording)


def test_rerun_takes_every_message(rerun: Rerun, tmp_path: Path, sent: list[Sent]) -> None:
    file, recording = make(tmp_path / "run", sent) / "run_0.mcap", str(tmp_path / "run.rrd")
    told = rerun("mcap", "info", str(file)).split("Channels\nID")[1].splitlines()[2:]
    counts = {row[1]: int(row[2]) for row in (line.split() for line in told) if len(row) > 2}
    assert counts == {topic: sum(row.topic == topic for row in sent) for topic in TYPES}
    rerun("mcap", "convert", str(file), "-o", recording)
    printed = rerun("rrd", "stats", recording)
    assert all(topic in printed for topic in TYPES if topic != "/diagnostics")
