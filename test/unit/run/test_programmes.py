"""Programme files: what is read, when they start, and one clear line for what cannot be used."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bouncing_disk_ros.core.model import Disk, InitialState, Motion
from bouncing_disk_ros.core.simulation import Simulation
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.run.programmes import (
    load_programme,
    parse_programme,
    programme_names,
    start_of,
)
from bouncing_disk_ros.run.simulate import simulate
from support.checks import refused, there

LATEST = Motion(0.01, 0.5, 2.0, 0.1)


def content(**changes: Any) -> dict[str, Any]:
    return {
        "description": "two motions",
        "points": [
            {"time": 1, "axial_amplitude": 0.02},
            {"time": 2.5, "axial_amplitude": 0.03},
        ],
        **changes,
    }


def refusal(given: object) -> str:
    with pytest.raises(InputError) as caught:
        parse_programme("mine", given)
    assert "\n" not in caught.value.line
    return caught.value.line


def test_names_left_out_keep_their_value() -> None:
    programme = parse_programme("mine", content())
    assert programme.targets(LATEST) == (
        (1_000_000_000, LATEST._replace(axial_amplitude=0.02)),
        (2_500_000_000, LATEST._replace(axial_amplitude=0.03)),
    )


def test_every_programme_of_the_package_is_sound() -> None:
    assert programme_names() == [
        "first_toss_to_period_1",
        "motor_start_and_stop",
        "single_toss",
        "spin_up",
    ]
    for name in programme_names():
        programme = load_programme(name)
        assert programme.name == name
        last_ns, _ = programme.targets(LATEST)[-1]
        result = simulate(last_ns / 1e9, programme=name, **LATEST._asdict())
        assert [record["kind"] for record in result.inputs].count("motion") == 1


def test_a_programme_may_be_made_of_multiples_of_the_start() -> None:
    """Those of another motor are its own amplitudes and periods; of nothing there are none."""
    programme = load_programme("motor_start_and_stop")
    own = Motion(2.5e-7, 3e-5, 80_000.0, 0.4)
    (off_ns, off), (toss_ns, toss), (run_ns, running), (end_ns, _) = programme.targets(own)
    assert [off_ns, toss_ns, run_ns, end_ns] == [500_000, 5_000_000, 5_012_500, 15_000_000]
    assert off == own._replace(axial_amplitude=0.0, angular_amplitude=0.0)
    assert toss == own._replace(axial_amplitude=own.axial_amplitude * 1.734)
    assert running == own
    simulated = simulate(0.0051, programme="motor_start_and_stop", **own._asdict())
    assert simulated.inputs[-1]["kind"] == "motion"
    still = own._replace(axial_amplitude=0.0)
    refused(r"points\[1\].axial_amplitude: .*where that of the start", programme.targets, still)


@pytest.mark.parametrize(
    ("changes", "line"),
    [
        ({"points": [{"time": {"cycles": 1}, "frequency": 3.0}]}, "{periods: NUMBER}"),
        ({"points": [{"time": 1, "frequency": {"factor": 3.0}}]}, "{times: NUMBER}"),
        ({"description": 3}, "description: got 3, allowed: a line of text"),
        ({"points": []}, "points: got [], allowed: a list of at least one point"),
        ({"points": [4]}, "points[0]: got 4, allowed: time and any of axial_amplitude"),
        ({"points": [{"time": 1}]}, "no names"),
        ({"points": [{"axial_amplitude": 1.0}]}, "points[0].time: got None"),
        ({"points": [{"time": -1.0, "frequency": 3.0}]}, "points[0].time: got -1.0"),
        ({"points": [{"time": math.inf, "frequency": 3.0}]}, "points[0].time: got inf"),
        ({"points": [{"time": 1, "frequenzy": 3.0}]}, "Did you mean frequency?"),
        ({"points": [{"time": 1, "frequency": True}]}, "points[0].frequency: got True"),
        ({"points": [{"time": 1, "frequency": math.nan}]}, "points[0].frequency: got nan"),
        ({"points": [{"time": 1, "frequency": 0.0}]}, "To stop the platform, set the amplitudes"),
        ({"points": [{"time": 1, "axial_amplitude": -1}]}, "points[0] axial_amplitude (m)"),
        ({"align": 3}, "align: got 3, allowed: {time: seconds, forcing_phase: rad}"),
        ({"align": {"time": 1, "forcing_phase": "x"}}, "align.forcing_phase: got 'x'"),
        ({"aling": {}}, "Did you mean align?"),
        ({"points": [{"time": 1, "frequency": 3.0}, {"time": 2, "phase_lag": 3.0}]},
         "points[1]: got 'phase_lag', allowed: frequency as"),
        ({"points": [{"time": 1, "frequency": 3.0}, {"time": 1, "frequency": 2.0}]},
         "strictly increasing"),
        *[({"trajectory": wrong}, "trajectory") for wrong in (
            "up", [], [{"time": 1.0}], [{"time": 1.0, "axial": 1.0}],
            [{"time": -1.0, "platform_axial": 1.0}],
            [{"time": 1.0, "platform_axial": 1.0}, {"time": 1.0, "platform_axial": 1.0}],
        )],
    ],
)  # fmt: skip
def test_what_cannot_be_used_is_named(changes: dict[str, Any], line: str) -> None:
    assert line in refusal(content(**changes))


def test_files_and_contents_that_are_none_are_refused(tmp_path: Path) -> None:
    contents: list[object] = [None, 3, [], "text"]
    for none in contents:
        assert "allowed: the keys description, align, points" in refusal(none)
    refused(r"programme: got 'spinup', .*Did you mean spin_up", load_programme, "spinup")
    with pytest.raises(
        InputError, match="first_toss_to_period_1, motor_start_and_stop, single_toss, spin_up"
    ):
        load_programme("")
    refused("allowed: a readable YAML file", load_programme, str(tmp_path / "none.yaml"))
    broken = tmp_path / "broken.yaml"
    broken.write_text("points: [", encoding="utf-8")
    refused("allowed: valid YAML", load_programme, str(broken))
    wrong = tmp_path / "wrong.yaml"
    wrong.write_text("description: x\npoints: 4\n", encoding="utf-8")
    refused(r"programme wrong\.yaml, points: got 4", load_programme, str(wrong))


@given(
    wanted=st.floats(-10.0, 10.0),
    at=st.floats(0.0, 6.0),
    frequencies=st.tuples(*[st.floats(0.7, 9.0)] * 4),
    phase=st.floats(0.0, 6.28),
    earliest=st.integers(0, 3_000_000_000),
    crossfade=st.sampled_from([0, 300_000_000]),
)
def test_the_phase_is_the_wanted_one_at_the_aligned_time(
    wanted: float, at: float, frequencies: tuple[float, ...], phase: float, earliest: int,
    crossfade: int,
) -> None:  # fmt: skip
    """Whatever cross-fades of frequency lie between; the core itself is the judge."""
    now, later, *rest = frequencies
    disk = Disk(1.0, 0.0, 0.5, 0.1, 0.1, 10.0)
    simulation = Simulation(Motion(0.0, 0.0, now, 0.0), disk, InitialState(forcing_phase=phase))
    simulation.command([(1, Motion(0.0, 0.0, later, 0.0))])  # a cross-fade is in progress
    points = [{"time": 2.0 + i, "frequency": f} for i, f in enumerate(rest)]
    align = {"time": at, "forcing_phase": wanted}
    programme = parse_programme("mine", content(points=points, align=align))
    start = start_of(programme, simulation.motion_in_force, earliest, crossfade)
    assert start >= earliest
    simulation.advance(start)
    targets = programme.targets(simulation.latest_target)
    simulation.command([(start + after, motion) for after, motion in targets], crossfade)
    simulation.advance(start + there(programme.align).after_ns)
    error = math.remainder(simulation.sample().forcing_phase - wanted, math.tau)
    # instants are whole nanoseconds: 2π · 9 Hz · 1 ns = 6e-8 rad
    assert abs(error) < 2e-7


def test_a_simulated_programme_waits_for_its_phase(tmp_path: Path) -> None:
    file = tmp_path / "mine.yaml"
    file.write_text(
        "description: mine\n"
        "align: {time: 2.0, forcing_phase: 1.5}\n"
        "points: [{time: 2.0, axial_amplitude: 0.02, frequency: 2.5}]\n"
    )
    result = simulate(3.0, programme=str(file), frequency=4.0)
    ((effect_ns, _),) = next(r for r in result.inputs if r["kind"] == "motion")["points"]
    assert 2 * 10**9 < effect_ns < 225 * 10**7
    seconds = effect_ns / 1e9
    upto = simulate(seconds, programme=str(file), frequency=4.0, sample_rate=1.0 / seconds)
    assert upto.samples["forcing_phase"][-1] == pytest.approx(1.5, abs=2e-7)


# --- trajectories ---------------------------------------------------------------------------------
def test_a_trajectory_of_a_programme_is_simulated(tmp_path: Path) -> None:
    file = tmp_path / "up.yaml"
    file.write_text(
        "description: up\n"
        "points: [{time: 0.5, axial_amplitude: 0.0, angular_amplitude: 0.0}]\n"
        "trajectory:\n"
        "  - {time: 0.5, platform_axial: [0.01, 0.0], platform_rotation: [0.1, 0.0]}\n"
    )
    result = simulate(2.0, programme=str(file), sample_rate=10.0)
    last = result.samples[-1]
    assert (last["platform_position"], last["platform_angle"]) == (0.01, 0.1)
    with pytest.raises(InputError, match="trajectory: got '1 point', allowed: none with a progr"):
        simulate(2.0, programme=str(file), trajectory=[(1.0, {"platform_axial": 0.0})])
