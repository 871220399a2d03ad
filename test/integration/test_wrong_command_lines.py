"""Wrong command lines of every executable: one line, exit code 2, and nothing is made.

Within the process of the test; test_fresh_machine.py has such ends of processes.
"""

from __future__ import annotations

import re
import socket
from collections.abc import Iterator
from pathlib import Path

import pytest

from bouncing_disk_ros import bag
from support.processes import ends
from support.recorded import RecordedRun, period_one_bag

GIVEN = "--ros-args -p"
CASES = [
    ("simulator", f"{GIVEN} restituton:=0.5", "parameter: got 'restituton'.*restitution"),
    ("simulator", f"{GIVEN} restitution:=1.5", "restitution: got 1.5, allowed"),
    ("simulator", f"{GIVEN} restitution:=high", "restitution: got 'high'.*not a string"),
    ("simulator", f"{GIVEN} use_sim_time:=1", "use_sim_time: got 1, allowed: true or false"),
    ("simulator", f"{GIVEN} preset:=pizza", "preset: got 'pizza', allowed: pizza_multiple"),
    ("simulator", f"{GIVEN} platform_radius:=010", "-p: got .*010 has several meanings"),
    ("simulator", f"{GIVEN} restitution", "-p: got 'restitution', allowed: name:=value"),
    ("simulator", "--ros-args --params-file none.yaml", "--params-file: got 'none.yaml'"),
    ("simulator", "--ros-args -r __ns:=wrong-name", "-r: got '__ns:=wrong-name'"),
    ("simulator", "--fast", "unrecognized arguments: --fast"),
    ("simulator", "friction:=3", ".*come after --ros-args: --ros-args -p NAME:=VALUE"),
    ("recorder", "/proc/none/run", "output: got '/proc/none/run', allowed: the name of a new fold"),
    ("recorder", f"{GIVEN} compression:=rar", "compression: got 'rar', allowed: zstd, lz4"),
    ("recorder", f"{GIVEN} topics:=/2nd", "topics: got '/2nd', allowed: names of topics"),
    ("recorder", f"{GIVEN} regex:='('", "regex: .*allowed: a regular expression"),
    ("recorder", f"{GIVEN} presets:=/none/none.yaml", "preset: got"),
    # below what the head of each file takes
    ("recorder", f"{GIVEN} max_size:=0.002", ".*got '0.002 MB', allowed: 0 for one file, or at"),
    ("perform", "spin_upp", "programme: got 'spin_upp', allowed: .*Did you mean spin_up"),
    ("perform", "", "programme: got '', allowed: first_toss_to_period_1, motor_start_and"),
    ("perform", f"spin_up {GIVEN} lead:=-1.0", "lead: got -1.0, allowed"),
    ("demo", f"{GIVEN} picture:=demo.txt", "picture: got 'demo.txt', allowed: a file ending in .p"),
    ("demo", f"{GIVEN} duration:=1.0", "duration: got 1.0, allowed: a finite number >= 3"),
    ("juggle", f"{GIVEN} missed:=2.0", "missed: got 2.0, allowed:"),
    (
        "juggle",
        f"{GIVEN} controller:=none.py",
        "controller: got 'none.py', .*There is no such file",
    ),
    ("workbench", f"{GIVEN} port:=PORT", r"port: got \d+, allowed: a free .*in use.*-p port:=0"),
    ("workbench", f"{GIVEN} address:=300.1.1.1", "address: got '300.1.1.1', allowed: localhost, "),
    ("workbench", f"{GIVEN} address:=203.0.113.1", "address: got '203.0.113.1', .*assign"),
    ("workbench", f"{GIVEN} preset:=piza_multiple_toss", "preset: .*pizza_multiple_toss"),
    ("workbench", f"{GIVEN} bag:=none", "bag: got"),
    ("workbench", f"{GIVEN} namespace:=/second", "namespace: got '/second', allowed: none without"),
    ("basins", f"{GIVEN} axial_forcin:=0.4", ".*got 'axial_forcin', .* Did you mean axial_forcing"),
    ("basins", f"{GIVEN} figures:=gif", "figures: got 'gif', allowed: any of png, pdf, svg"),
    (
        "basins",
        f"{GIVEN} width:=8 -p output:=BAGS/run/metadata.yaml/x",
        "output: got .*can be written",
    ),
    ("basins", f"{GIVEN} bag:=BAGS/two", ".*a bag of 2 simulators', allowed: /left, /right"),
    (
        "replay",
        "BAGS/run --what-if restitution=0.4",
        "--what-if: got 'restitution=0.4', allowed: N",
    ),
    ("replay", "BAGS/run --what-if restitution:=2", "restitution: got 2, allowed: a finite number"),
    ("replay", "BAGS/run --what-if mass:=1 --figure a.jpg", "--figure: got 'a.jpg', allowed: a fi"),
    ("replay", "BAGS/run --figure a.png", "--figure: got 'a.png', allowed: a figure of --what-if"),
    ("replay", "BAGS/run --what-if mass:=1 --run 2", "--run: got 2, allowed: one of 1"),
    ("reference_cases", "drop --write /proc/x", "output: got '/proc/x/.*can be written to"),
    ("bag_report", "none", ".*There is no file or folder of that name"),
    ("bag_report", "BAGS/empty", ".*got 'no messages'"),
    ("bag_report", "BAGS/two", ".*allowed: /left, /right. Choose one with the option namespace"),
    ("bag_report", "BAGS/run --segment 9", ".*allowed: longest, last, or a number from 1 to 1"),
    ("bag_report", "BAGS/run --run 2", "run: got 2, allowed: 1 to 1"),
    ("bag_report", "BAGS/run --figures pgn", ".*Did you mean png?"),
    ("bag_report", "BAGS/run /proc/x", "output: got '/proc/x.html', allowed: a file in a folder"),
]


@pytest.fixture(scope="module")
def bags(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Bags of one run, of two simulators, and of nothing."""
    folder = tmp_path_factory.mktemp("bags")
    period_one_bag(folder / "run", 1.0)
    with bag.Writer(folder / "two") as writer:
        for namespace in ("/left", "/right"):
            RecordedRun(writer, namespace, preset="pizza_multiple_toss").run(1.0)
    with bag.Writer(folder / "empty"):
        pass
    return folder


@pytest.fixture
def port() -> Iterator[int]:
    """A port at which somebody listens."""
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        yield other.getsockname()[1]


@pytest.mark.parametrize(("name", "arguments", "line"), CASES)
def test_a_wrong_command_line_is_one_line_and_code_2(
    ros_domain: int, capfd: pytest.CaptureFixture[str], tmp_path: Path, bags: Path, port: int,
    monkeypatch: pytest.MonkeyPatch, name: str, arguments: str, line: str,
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    before = sorted(bags.rglob("*"))
    given = arguments.replace("BAGS", str(bags)).replace("PORT", str(port)).split()
    code, _, lines = ends(capfd, name, *given)
    assert code == 2
    (told,) = (text for text in lines if not text.startswith("usage"))
    assert re.match(f"{name}: (error: )?{line}", told)
    assert not [*tmp_path.iterdir()]
    assert sorted(bags.rglob("*")) == before
