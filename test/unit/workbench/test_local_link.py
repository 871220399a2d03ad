"""A run of the page's own process, without ROS: every action does what the node would do."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from bouncing_disk_ros.core.offset_extremes import newest_extremes
from bouncing_disk_ros.run.presets import load_preset
from bouncing_disk_ros.workbench.actions import (
    Call,
    Impulse,
    Juggle,
    Lifecycle,
    Move,
    Perform,
    Set,
    StopJuggling,
)
from bouncing_disk_ros.workbench.local_link import LocalLink
from bouncing_disk_ros.workbench.scene_table import SCENES
from support.checks import there
from support.processes import wait_until


def step(link: LocalLink) -> None:
    """Simulate a period of a run that is paused, to its end."""
    history = link.history
    before = max((notice.number for notice in history.notices_after(0)), default=0)
    link.send(Call("step"))
    wait_until(
        lambda: any("step: 1 period" in notice.text for notice in history.notices_after(before))
    )


@pytest.fixture
def link(warm_kernels: None) -> Iterator[LocalLink]:
    made = LocalLink(load_preset("pizza_multiple_toss"))
    yield made
    made.close()


def test_it_runs_and_takes_every_action(link: LocalLink) -> None:
    history = link.history
    wait_until(lambda: history.latest > 0.1)
    link.send(Move({"axial_amplitude": 0.042, "phase_lag": 0.1}))
    wait_until(lambda: history.values_at()["axial_amplitude"] == 0.042)
    link.send(Set({"restitution": 0.4, "real_time_factor": 5.0}))
    wait_until(lambda: history.values_at()["restitution"] == 0.4)
    wait_until(lambda: history.impacts_seen >= 3)
    with history.lock:
        assert len(history.points) == history.impacts_seen
    wait_until(lambda: len(history.speeds) > 2)
    link.send(Call("pause", True), Impulse(0.0, 0.05))
    wait_until(lambda: history.phase == "paused")
    session = there(link._run).session
    before = session.time_ns
    step(link)
    frequency = session.simulation.motion_in_force.target.frequency
    assert session.time_ns - before == round(1e9 / frequency)
    assert session.accepted == 5, "that it moves, the motion, parameters, the pause, the impulse"
    link.send(Call("reset"))
    wait_until(lambda: "reset" in history.changes.items)
    begun = pytest.approx(0.0397887, rel=1e-6)  # the motion comes after the word of the reset
    wait_until(lambda: history.values_at()["axial_amplitude"] == begun)


def test_a_long_step_is_ended_by_a_pause(link: LocalLink) -> None:
    """It goes on between other actions, as in the node; it kept the page until its end."""
    history = link.history
    link.send(Call("pause", True), Set({"step_periods": 1_000_000}), Call("step"))
    wait_until(lambda: any("under way" in notice.text for notice in history.notices_after(0)))
    link.send(Call("pause", True))
    wait_until(lambda: history.notices_after(0)[-1].text.startswith("pause: paused"))


def test_what_is_wrong_is_refused_in_one_line(link: LocalLink) -> None:
    link.history.note("")
    for action, line in (
        (Set({"restitution": 1.5}), "restitution: got 1.5, allowed: a finite number >= 0 and <= 1"),
        (Set({"mass": 1.0}), "mass: got 1.0, allowed: no change while it runs"),
        (Impulse(1e300), "allowed: a finite impulse up to"),
        (Move({"frequency": -1.0}), "platform/command"),
        (Call("step"), "Pause first."),
        (Perform("none such"), "programme"),
    ):
        link.send(action)
        wait_until(lambda: line in link.history.notices_after(0)[-1].text)  # noqa: B023 (called at once)
        assert link.history.notices_after(0)[-1].is_refusal


def test_a_programme_moves_the_platform_and_its_offset(link: LocalLink, tmp_path: Path) -> None:
    """The offsets of a programme were left out here; `perform` and `simulate` had them."""
    file = tmp_path / "mine.yaml"
    file.write_text(
        "description: one motion and an offset\n"
        "points:\n  - {time: 0.1, axial_amplitude: 0.01}\n"
        "trajectory:\n  - {time: 0.2, platform_axial: [0.01, 0.0]}\n"
    )
    wait_until(lambda: link.history.latest > 0.0)
    session = there(link._run).session
    link.send(Perform(str(file)))
    wait_until(lambda: session.latest_target.axial_amplitude == 0.01)
    wait_until(lambda: session.latest_offset.axial.plans[-1].segments[-1].start.position == 0.01)


def test_it_juggles_until_it_is_stopped_or_another_run_begins(
    link: LocalLink, warm_juggling: None
) -> None:
    """From an impulse that ends the open loop the disk comes back; a step is juggled too."""
    history, juggle = link.history, Juggle("deadbeat", {"restitution": 0.5, "gravity": 10.0})
    link.send(Set({"real_time_factor": 20.0}))
    link.send(juggle)
    wait_until(lambda: history.juggling.startswith("deadbeat: captured"))
    link.send(Call("pause", True), Impulse(0.3))
    for _ in range(10):  # one by one: in real time it may be captured again before anyone looks
        step(link)
        if history.juggling.startswith("deadbeat: lost: "):
            break
    assert history.juggling.startswith("deadbeat: lost: ")
    link.send(Call("pause", False))
    wait_until(lambda: history.juggling.startswith("deadbeat: captured"))
    session = there(link._run).session
    assert newest_extremes(session.latest_offset.axial).position > 0.0
    link.send(Call("pause", True))
    wait_until(lambda: history.phase == "paused")
    before = session.time_ns
    step(link)
    assert session.time_ns - before == round(1e9 / session.latest_target.frequency)
    link.send(StopJuggling())
    wait_until(lambda: history.juggling == "")
    link.send(juggle)
    wait_until(lambda: history.juggling)
    link.send(*map(Lifecycle, ("deactivate", "cleanup", "configure", "activate")))
    wait_until(lambda: history.juggling == "")
    link.send(Juggle("mirror", juggle.options))
    wait_until(lambda: "strategy: got 'mirror'" in history.notices_after(0)[-1].text)
    assert history.juggling == ""


def test_a_scene_is_a_run_from_time_0(link: LocalLink) -> None:
    wait_until(lambda: link.history.latest > 0.05)
    epoch = link.history.epoch
    link.send(*SCENES["first_toss"].actions(link.history.own_values()))
    wait_until(lambda: link.history.epoch > epoch)
    wait_until(lambda: link.history.latest > 0.0)
    with link.history.lock:
        assert link.history.samples.rows["time"][0] == 0.0
    link.send(Set({"real_time_factor": 20.0}))
    wait_until(lambda: float(link.history.values_at()["axial_amplitude"]) > 0.0)
    wait_until(lambda: link.history.latest > 8.0)
    assert link.history.values_at()["phase_lag"] == pytest.approx(-0.7366240020191286)
