"""The pages that lead users to a goal, as sessions: what they print is typed, in that order."""

from __future__ import annotations

import re
import shlex
import shutil
import signal
import sys
import time
from pathlib import Path
from urllib.request import urlopen

import pytest

from support.processes import Process, Starter

pytestmark = [pytest.mark.interop, pytest.mark.timeout(1200)]

ROOT = Path(__file__).resolve().parents[2]
STAYS = {
    "simulator": r"running at", "recorder": r"recording to", "workbench": r"(http://\S+)$",
    "juggle": r"captured after \d+ impacts",
}  # fmt: skip
"""What runs until Ctrl-C, with what it says when the next command may be typed."""
WAIT = 300.0
TOLD = {
    "for_dynamicists": ("−0.718", "−0.125", "67.0", "33.0", "1.017"),
    "for_motor_designers": (
        "20.68", "30.15", "46.5", "67.8", "75.3", "−0.785", "1.455", "2.165", "993.5", "1.488",
    ),
    "for_roboticists": ("27.390382", "replay identical"),
    "for_teachers": (),
}  # fmt: skip
"""Numbers and words of each page that its commands print, rounded to what the page says."""
WORKBENCH = "ros2 run bouncing_disk_ros workbench --ros-args"
RECORDED = 20.0
"""s, by the clock: how long the page for robotics engineers records the closed loop."""


class Session:
    """A user with one folder, who types what a page prints."""

    def __init__(self, start: Starter, folder: Path) -> None:
        self._start, self._folder = start, folder
        self._running: dict[str, Process] = {}
        self.said = ""

    def type(self, line: str, before: str) -> None:
        """Type one command, after the words `before` of the page."""
        words = shlex.split(line)
        if words == ["make", "workbench"]:
            words = shlex.split(f"{WORKBENCH} -p port:=0 -p open_browser:=false")
        assert words[:3] == ["ros2", "run", "bouncing_disk_ros"], line
        name, arguments = words[3], words[4:]
        if "controller:=own_controller.py" in arguments:
            self._begin_anew(before)
        if name == "bag_report":
            if "juggle" in self._running:
                time.sleep(RECORDED)
            self._end("recorder")
        command = [sys.executable, "-m", "bouncing_disk_ros", name, *arguments]
        process = self._start.command(command, cwd=str(self._folder))
        if name in STAYS:
            self._running[name] = process
            found = process.wait_for(STAYS[name], WAIT)
            if name == "workbench":
                assert b"Bouncing disk workbench" in urlopen(found[1]).read()
            return
        assert process.wait(WAIT) == 0, process.output
        assert "Traceback" not in process.output
        self.said += process.output

    def _begin_anew(self, before: str) -> None:
        """Copy the controller, and start the simulator with the amplitude that the page names."""
        shutil.copy(ROOT / "examples" / "own_controller.py", self._folder)
        self._end("juggle")
        self._end("simulator")
        (amplitude,) = re.findall(r"`(axial_amplitude:=[\d.]+)`", before)
        preset = "-p preset:=pizza_multiple_toss"
        line = f"ros2 run bouncing_disk_ros simulator --ros-args {preset} -p {amplitude}"
        self.type(line, "")

    def _end(self, name: str) -> None:
        """Press Ctrl-C."""
        assert self._running.pop(name).end(signal.SIGINT, WAIT) in (0, 130)

    def python(self, block: str) -> None:
        """Run a script."""
        process = self._start.command([sys.executable, "-c", block], cwd=str(self._folder))
        assert process.wait(WAIT) == 0, process.output
        self.said += process.output


def is_printed(told: str, said: str) -> bool:
    """Whether words are printed, or a number that rounds to the one told."""
    text = told.replace("−", "-")
    if not re.fullmatch(r"-?[\d.]+", text):
        return text in said
    digits = len(text.partition(".")[2])
    numbers = re.findall(r"-?\d+\.\d+(?:e[+-]\d+)?", said.replace("−", "-"))
    return any(f"{float(number):.{digits}f}" == text for number in numbers)


@pytest.mark.parametrize("page", TOLD)
def test_a_page_leads_to_its_goal(
    page: str, start: Starter, ros_domain: int, tmp_path: Path
) -> None:
    text = (ROOT / "docs" / f"{page}.md").read_text("utf-8")
    session = Session(start, tmp_path)
    parts = re.split(r"```(\w+)\n(.*?)```", text, flags=re.DOTALL)
    begin = time.monotonic()
    for before, kind, block in zip(parts[::3], parts[1::3], parts[2::3], strict=False):
        match kind:
            case "sh":
                for line in block.splitlines():
                    session.type(line, before)
            case "python":
                session.python(block)
            case "text":
                assert set(block.splitlines()) <= set(session.said.splitlines())
    print(f"{page}: {time.monotonic() - begin:.0f} s")
    for told in TOLD[page]:
        assert told in " ".join(text.split())
        assert is_printed(told, session.said), told


def test_each_page_for_users_is_typed() -> None:
    assert {path.stem for path in (ROOT / "docs").glob("for_*.md")} == set(TOLD)
