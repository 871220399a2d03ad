"""`bag_report --prove`: a recorded run is replayed, and each event proved."""

from __future__ import annotations

import importlib.util
from argparse import ArgumentParser
from pathlib import Path

import pytest

from bouncing_disk_ros import bag
from bouncing_disk_ros.core.offset import QUINTIC, Knot, OffsetState
from bouncing_disk_ros.errors import ExitCode
from bouncing_disk_ros.proof import event_proof as proof
from bouncing_disk_ros.proof.bag_proof import prove_bag
from bouncing_disk_ros.proof.exact_records import Event
from bouncing_disk_ros.proof.verdicts import Outcome, Verdict
from bouncing_disk_ros.report.bag_report import with_options
from bouncing_disk_ros.run.session import Session
from bouncing_disk_ros.run.trajectory_validation import Splice
from support.checks import refused
from support.recorded import NS, START_NS, RecordedRun


def fade(session: Session) -> None:
    motion = session.simulation.latest_target
    target = motion._replace(axial_amplitude=1.3 * motion.axial_amplitude)
    session.command([(session.time_ns + NS, target)])


def strike(session: Session) -> None:
    session.apply_impulse(session.time_ns, 0.01, 0.001)


def soften(session: Session) -> None:
    session.set_parameters({"restitution": 0.2})


def again(session: Session) -> None:
    session.reset()


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run with inputs of every kind, then a second run."""
    made = tmp_path_factory.mktemp("bags") / "run"
    with bag.Writer(made) as writer:
        acts = {1.0: fade, 3.0: strike, 4.0: soften, 6.0: again}
        RecordedRun(writer, preset="pizza_multiple_toss").run(8.0, acts)
        RecordedRun(writer, start_ns=START_NS + 60 * NS, preset="pizza_single_toss").run(2.0)
    return made


def prove(folder: Path, *arguments: str) -> int:
    return prove_bag(
        with_options(ArgumentParser()).parse_args([str(folder), "--prove", *arguments])
    )


def rows_of(text: str) -> dict[str, list[int]]:
    """The numbers of the table, by event."""
    found = {}
    for line in text.splitlines():
        name, numbers = line[:26].strip(), line[26:].split()
        if len(numbers) == 4 and all(number.isdigit() for number in numbers):
            found[name] = [int(number) for number in numbers]
    return found


def test_every_event_of_a_run_is_proved(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert prove(folder) == ExitCode.DONE
    text = capsys.readouterr().out
    rows = rows_of(text)
    assert text.startswith(f"proof of {folder}, 0.000 s to ")
    assert rows["all"][1:] == [0, 0, 0]
    for name in ("impact", "separation", "slip ends", "chatter completed", "no event until"):
        assert rows[name][0] > 0
    one = rows
    assert prove(folder, "--run", "2") == ExitCode.DONE
    two = rows_of(capsys.readouterr().out)
    assert 0 < two["all"][0] < one["all"][0]


def test_offsets_are_proved_and_contact_under_a_brake_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    def lift(session: Session) -> None:
        knot = Knot(session.time_ns + NS, OffsetState(0.01), QUINTIC)
        session.trajectory(Splice(session.time_ns, (knot,), None))

    def brake(session: Session) -> None:
        session.set_parameters({"brake_torque": 0.01, "restitution": 0.0})

    with bag.Writer(tmp_path / "run") as writer:
        RecordedRun(writer, preset="pizza_multiple_toss").run(6.0, {2.0: lift, 4.0: brake})
    assert prove(tmp_path / "run", "--to", "4") == ExitCode.DONE
    text = capsys.readouterr().out
    assert rows_of(text)["all"][1:] == [0, 0, 0]
    assert "not covered:" not in text
    assert prove(tmp_path / "run") == ExitCode.DONE
    text = capsys.readouterr().out
    rows = rows_of(text)
    named = [line for line in text.splitlines() if line.startswith("not covered: ")]
    parts = [part.partition(" × ") for part in named[0].removeprefix("not covered: ").split(", ")]
    assert sum(int(count) for count, _, _ in parts) == rows["all"][3] > 0
    assert {what.partition(" (")[2] for _, _, what in parts} <= {
        "contact under a brake)", "a chatter under a brake)"
    }  # fmt: skip
    assert rows["impact"][1:] == [0, 0, 0]  # flights are covered


def test_a_part_can_be_proved(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert prove(folder) == ExitCode.DONE
    whole = rows_of(capsys.readouterr().out)["all"][0]
    assert prove(folder, "--every", "5") == ExitCode.DONE
    text = capsys.readouterr().out
    some = rows_of(text)["all"][0]
    assert some == -(-whole // 5)
    assert f"left out: {whole - some} events, as asked, every 5th only" in text
    assert prove(folder, "--from", "2", "--to", "3") == ExitCode.DONE
    assert 0 < rows_of(capsys.readouterr().out)["all"][0] < whole


def test_nothing_is_proved_from_a_missing_record_to_the_next_snapshot(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with bag.Writer(tmp_path / "run") as writer:
        run = RecordedRun(writer, preset="pizza_multiple_toss")

        def unrecorded(session: Session) -> None:
            strike(session)
            run._records.clear()

        acts = {1.0: fade, 3.0: unrecorded, 4.0: soften, 6.0: Session.snapshot}
        run.run(8.0, acts)
    times: list[float] = []

    def noted(event: Event) -> Verdict:
        times.append(event.before.ns / NS)
        return Verdict(Outcome.PROVED)

    monkeypatch.setattr(proof, "prove", noted)
    assert prove(tmp_path / "run") == ExitCode.DONE
    assert not [time for time in times if 1.5 < time < 5.5]
    assert min(times) < 1.0  # before the gap
    assert max(times) > 6.0  # after the snapshot


def test_a_refuted_event_is_told(
    folder: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    refuted = Verdict(Outcome.REFUTED, "it is not so", 1e-12)
    monkeypatch.setattr(proof, "prove", lambda _: refuted)
    assert prove(folder) == ExitCode.FAILED
    text = capsys.readouterr().out
    assert "s: it is not so (tolerance 1e-12)" in text
    assert text.splitlines()[-1] == f"refuted: {rows_of(text)['all'][2] - 10} more"


def test_without_the_library_one_line_says_what_to_do(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(importlib.util, "find_spec", lambda _: None)
    refused(r"^--prove needs python-flint, which is not", prove, folder)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--every", "0"), "every: got 0"),
        (("--run", "3"), "run: got 3, allowed: 1 to 2"),
        (("--namespace", "left"), "namespace: got 'left'"),
    ],
)
def test_what_cannot_be_used_is_refused(
    folder: Path, arguments: tuple[str, ...], said: str
) -> None:
    refused(said, prove, folder, *arguments)


def test_a_bag_without_inputs_is_refused(tmp_path: Path) -> None:
    with bag.Writer(tmp_path / "run") as writer:
        RecordedRun(writer, preset="pizza_multiple_toss", without=("disk/inputs",)).run(1.0)
    refused("no /disk/inputs", prove, tmp_path / "run")
