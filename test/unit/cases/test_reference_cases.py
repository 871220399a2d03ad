"""The reference cases: bounds by two ways, files made again, and what a comparison finds."""

from __future__ import annotations

import csv
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf

from bouncing_disk_ros import InputError, compare_with_case, reference_case, simulate
from bouncing_disk_ros.cases import compare_with_case as comparing
from bouncing_disk_ros.cases import reference_cases as listing
from bouncing_disk_ros.cases.comparison import Comparison
from bouncing_disk_ros.cases.definitions import CASES, Case
from bouncing_disk_ros.cases.files import QUANTITIES, folder, write
from support import fifty_digits

pytest.importorskip("flint")

EACH = pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)


# --- the bounds -----------------------------------------------------------------------------------
@EACH
def test_the_files_are_made_again_byte_by_byte(case: Case, tmp_path: Path) -> None:
    for path in write(tmp_path, case):
        assert path.read_bytes() == (folder() / path.name).read_bytes()


@pytest.mark.soak
@EACH
def test_a_second_method_in_fifty_digits_is_within_the_bounds(case: Case) -> None:
    """Bounces below 1e-21 m/s, which it leaves out, last about as many seconds: 1e-20 is room."""
    rows = fifty_digits.run(case)
    at, room = 0, mpf(10) ** -20
    with mp.workdps(fifty_digits.DIGITS):
        for listed in _rows(case):
            while rows[at].kind != listed["kind"]:  # slow impacts are not listed
                at += 1
            for name in QUANTITIES:
                low, high = (mpf(listed[f"{name}_{end}"]) for end in ("lower", "upper"))
                assert low - room <= getattr(rows[at], name) <= high + room, (listed, name)
                assert high - low <= mpf("2.1e-17")
            at += 1
    assert at == len(rows)


def _rows(case: Case) -> list[dict[str, str]]:
    with (folder() / f"{case.file_stem}.csv").open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def test_bounds_of_a_drop_are_those_of_its_closed_form() -> None:
    """t_k = t₁ + (2v₁ε/g)(1 − ε^(k−1))/(1 − ε), and what ends in t₁ + 2v₁ε/(g(1 − ε))."""
    case = CASES[3]
    with mp.workdps(50):
        g, e = mpf(case.parameters["gravity"]), mpf(case.parameters["restitution"])
        first = mp.sqrt(2 * mpf(case.parameters["initial_height"]) / g)
        for k, row in enumerate(_rows(case)[:-1]):
            part = 1 - (e**k if row["kind"] == "impact" else 0)
            time = first + 2 * first * e * part / (1 - e)
            assert mpf(row["time_lower"]) <= time <= mpf(row["time_upper"])


def test_chaos_multiplies_an_error_of_the_start_as_the_condition_says() -> None:
    case = reference_case("chaos")
    step, scale = 1e-9, 9.81 / (2.0 * np.pi)  # of the velocity, m/s; g/ω
    runs = [
        simulate(case.duration, **{**case.keywords(), "initial_axial_velocity": -3.75 + off})
        for off in (-step, step)
    ]
    moved = (runs[1].impacts["time"] - runs[0].impacts["time"]) * 2.0 * np.pi
    by_speed = np.abs(moved) / (2.0 * step / scale)
    assert np.all(by_speed <= case.impacts["condition"] * 1.01)  # printed with three digits
    assert by_speed[14] > 0.5 * case.impacts["condition"][14]


# --- the package's own simulator ------------------------------------------------------------------
@EACH
def test_simulate_passes_each_case(case: Case) -> None:
    result = simulate(case.duration, **case.keywords(), sample_rate=2.0, chatter_report_speed=0.0)
    rows = result.impacts[result.impacts["kind"] == 0]
    columns = {"time": rows["time"], "position": rows["axial_position"],
               "velocity_after": rows["axial_velocity"],
               "angular_velocity_after": rows["angular_velocity"]}  # fmt: skip
    if len(rows):
        found = compare_with_case(case.number, columns, tolerance=1e-12)
        assert found.is_within, "\n".join(found.lines)
    last = result.samples[-1]
    end = {"kind": ["end"], "time": [last["time_ns"] * 1e-9], "position": [last["axial_position"]],
           "velocity_after": [last["axial_velocity"]],
           "angle": [result.unwrapped_angle[-1]],
           "angular_velocity_after": [last["angular_velocity"]]}  # fmt: skip
    found = compare_with_case(case.number, end, tolerance=1e-12)
    assert found.is_within, "\n".join(found.lines)


# --- what a comparison finds ----------------------------------------------------------------------
def _exact(name: str) -> dict[str, Any]:
    rows = reference_case(name).impacts
    return {q: 0.5 * (rows[f"{q}_lower"] + rows[f"{q}_upper"]) for q in QUANTITIES}


def _shifted(columns: dict[str, Any]) -> dict[str, Any]:
    columns["time"][4] += 1e-6
    return columns


def _lost(columns: dict[str, Any]) -> dict[str, Any]:
    return {name: np.delete(values, 4) for name, values in columns.items()}


def _doubled(columns: dict[str, Any]) -> dict[str, Any]:
    at = 0.3 * columns["time"][3] + 0.7 * columns["time"][4]
    return {name: np.insert(values, 4, at if name == "time" else values[4])
            for name, values in columns.items()}  # fmt: skip


def _drifting(columns: dict[str, Any]) -> dict[str, Any]:
    growth = (1.0 + 0.5e-6) ** np.arange(1, 1 + len(columns["time"]))
    for name in ("velocity_before", "velocity_after"):
        columns[name] = columns[name] * growth
    return columns


def _spun(columns: dict[str, Any]) -> dict[str, Any]:
    columns["angular_velocity_after"][4] *= -1.0
    return columns


def _bouncier(columns: dict[str, Any]) -> dict[str, Any]:
    columns["velocity_after"] = columns["velocity_after"] * 0.82 / 0.75
    return columns


@pytest.mark.parametrize(
    ("name", "fault", "line"),
    [
        ("chaos", _shifted, "time: first at impact 5: 1e-06 s late"),
        ("chaos", _lost, "missed: impact 5 at 4.0019812 s"),
        ("chaos", _doubled, "false: impact at 3.7"),
        ("elastic_drop", _drifting, "energy: drifts by +1e-06 of itself from impact to impact"),
        ("slipping_impacts", _spun, "spin: first at impact 5: angular_velocity_after"),
        ("drop", _bouncier, "restitution: 0.82 for 0.75 (median of 10 impacts)"),
    ],
)
def test_a_fault_is_found_and_named(name: str, fault: Any, line: str) -> None:
    assert compare_with_case(name, _exact(name)).is_within
    found = compare_with_case(name, fault(_exact(name)))
    assert not found.is_within
    assert any(one.startswith(line) for one in found.lines), "\n".join(found.lines)


def _samples(name: str, rate: float) -> dict[str, Any]:
    case = reference_case(name)
    rows = simulate(case.duration, **case.keywords(), sample_rate=rate).samples
    return {"time": rows["time_ns"] * 1e-9, "position": rows["axial_position"]}


@pytest.mark.parametrize("name", ["drop", "chaos", "preload"])
def test_impacts_are_found_between_samples(name: str) -> None:
    """Flights are parabolas: what is left is rounding, 1e-15 m over steps of 1 ms, as a speed."""
    found = compare_with_case(name, _samples(name, 1000.0), tolerance=1e-9)
    good = [match for match in found.matches if not found.is_off(match)]
    fast = [m for m in found.matches if m.event and not _is_short(found, m.event)]
    assert len(good) >= len(fast) > 3, "\n".join(found.lines)


def _is_short(found: Comparison, event: int) -> bool:
    """Whether a flight beside an impact is too short for samples: less than 8 ms."""
    times = found.case.events["time_lower"]
    around = times[max(event - 2, 0) : event + 1]
    return bool(np.any(np.diff(around) < 8e-3))


def test_one_flight_at_a_time_does_not_add_errors_up() -> None:
    case = reference_case("chaos")
    time = case.impacts["time_lower"].copy()
    time[9:] += 1e-3  # what an error in impact 10 may have become
    columns = {"flight": np.arange(len(time)), "time": time}
    columns["time"][10:] -= 1e-3  # restarted at the true impact
    found = compare_with_case("chaos", columns)
    assert [m.event for m in found.matches if found.is_off(m)] == [10]


def test_a_file_of_six_digits_that_ends_in_rest_gets_its_verdict_and_cells_in_quotes_are_read(
    tmp_path: Path,
) -> None:
    """Restitution 0.7, rest below 0.1 m/s, steps of 10 ms and both sides of each event."""
    g, e, t, v = 9.81, 0.7, math.sqrt(2.0 / 9.81), math.sqrt(2.0 * 9.81)
    rows, begin, up = [(0.0, 1.0)], 0.0, 0.0
    while v > 0.1:
        steps = np.arange(math.floor(begin * 100) + 1, math.floor(t * 100) + 1) / 100
        height = up * (steps - begin) - 0.5 * g * (steps - begin) ** 2 + (begin == 0.0)
        rows += [*zip(steps, height, strict=True), (t, 0.0), (t, 0.0)]
        begin, up, v = t, e * v, e * v
        t += 2.0 * v / g
    file = tmp_path / "ball.csv"
    file.write_text("time,h\n" + "\n".join(f"{a:.6g},{b:.6g}" for a, b in rows), "utf-8")
    found = compare_with_case(reference_case("drop", restitution=0.7), file, tolerance=1e-3)
    there = [match for match in found.matches if match.errors]
    assert [match.event for match in there][:6] == [1, 2, 3, 4, 5, 6]
    assert abs(there[0].errors["time"]) < 3e-6  # 1e-6 m over a jump of 7.5 m/s, and 5e-7 s
    assert not any(line.startswith("restitution") for line in found.lines)
    lines = compare_with_case("drop", file).lines
    assert any(line.startswith("restitution: 0.7") for line in lines), "\n".join(lines)
    quoted = tmp_path / "quoted.csv"
    times = map(float, reference_case("drop").impacts["time_lower"])
    cells = "\n".join(f'"{time!r}","impact"' for time in times)
    quoted.write_text(f'"time","kind"\n{cells}\n', "utf-8")
    assert compare_with_case("drop", quoted).is_within


@pytest.mark.parametrize(
    "nothing",
    [
        {"time": []},
        {"time": [], "kind": []},
        {"time": np.arange(9) * 0.1, "position": np.full(9, 0.02)},  # samples of rest
    ],
)
def test_who_finds_no_impact_has_missed_them_all(nothing: dict[str, Any]) -> None:
    found = compare_with_case("drop", nothing)
    assert not found.is_within
    assert found.verdict == "differs: 0 of 10 events within 1e-09, 10 missed"


# --- the commands ---------------------------------------------------------------------------------
def test_the_commands_list_compare_and_draw(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert listing.main([]) == 0
    assert len(capsys.readouterr().out.splitlines()) == len(CASES) + 1
    file, picture = tmp_path / "theirs.csv", tmp_path / "errors.png"
    times = reference_case("drop").impacts["time_lower"]
    file.write_text("time\n" + "\n".join(map(repr, map(float, times + 1e-7))), "utf-8")
    arguments = ["drop", str(file)]
    assert comparing.main([*arguments, "--tolerance", "1e-6", "--figure", str(picture)]) == 0
    assert picture.stat().st_size > 10_000
    assert comparing.main(arguments) == 1
    assert "differs: 0 of 10 events within 1e-09" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("case", "text", "line"),
    [
        ("dorp", "time\n1\n", "Did you mean drop?"),
        ("22", "time\n1\n", "case: got '22', allowed: 1 to 21"),
        ("drop", "", "a CSV file with rows"),
        ("drop", "s,x\n1,2\n", "time (s) among them"),
        ("drop", "time\n2\n1\n", "rows in the order of time"),
        ("drop", "time\nnan\n", "finite numbers"),
        ("drop", "time\n1_0\n", "time: got ['1_0'], allowed: numbers"),
        ("drop", "time,kind\n1,bounce\n", "kind: got 'bounce'"),
        ("drop", "time,t\n1,2\n", "columns: got 'time, t', allowed: one column of each quantity"),
        ("drop", "time,time\n1,2\n", "columns: got 'time, time', allowed: one column of each name"),
        ("drop", "1,2,3\n", "a first row with the names of the columns"),
        ("drop", "time\n1,2\n", "1 values in each row"),
        ("drop", "0,1\n1,1\n", "at least 4 instants"),
        ("drop", "time,position\n", "samples: got '0 rows', allowed: at least 4 instants"),
        ("drop", "flight,time\n99,1\n", "flight: got 99"),
        ("drop", "flight,time\n", "flight: got 'no rows'"),
        ("turning_table", "time\n", "events: got 'no rows'"),
    ],
)
def test_what_cannot_be_compared_is_refused_in_one_line(
    case: str, text: str, line: str, tmp_path: Path
) -> None:
    file = tmp_path / "theirs.csv"
    file.write_text(text, "utf-8")
    with pytest.raises(InputError) as caught:
        compare_with_case(case, file)
    assert line in caught.value.line
