"""The scripts in examples/ run, say what is true, and are listed."""

from __future__ import annotations

import ast
import inspect
import re
import runpy
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
import test_lifter_node
import test_own_controller

import bouncing_disk_ros
from bouncing_disk_ros.testing import SteppedSimulator
from support.processes import finished

ROOT = Path(__file__).resolve().parents[2]
EXAMPLES = ROOT / "examples"
SCRIPTS = sorted(EXAMPLES.glob("*.py"))
PERIOD_2 = r"period 1 → 2 at Γ = 0\.4860030783, 2 → 4 at Γ = 0\.5306641709"
#: script -> its arguments, what it prints, the files that it leaves
RUNS: dict[str, tuple[list[str], list[str], set[str]]] = {
    "figures_3_and_4": (
        ["0.3", "20"],
        [r"period 1 → 2 at Γ = 0\.67715134", r"Γ = 0\.6572: +3\d\.\d\d % .* go to period-1"],
        {"figures_3_and_4_bifurcation.pdf", "figures_3_and_4_basins.pdf"},
    ),
    "coexisting_orbits": (
        ["0.48"],
        [
            r"period-1 with multipliers -0\.919466\+0",
            r"period-2 in 1 cycle with multipliers -0\.606",
        ],
        set(),
    ),
    "case_by_solve_ivp": (["near_touch"], [r"missed: impact 1 at 0\.24223"], set()),
    "own_plot": (["20"], [r"5\d\.\d% of the window, 2\d impacts"], {"own_plot.svg", "output"}),
    "follow_period_2": ([], [PERIOD_2, r"(?m)^0\.530664 .* -1\.00000\+0\.00000j$"], set()),
    "make_bag": ([], [], {"run_1"}),
    "bag_to_pandas": ([], [r"(?m)^60\.0 +20\.0+ .* 38\.057049$", r"N·s"], set()),
    "restitution_and_friction": (
        [],
        [r"restitution 0\.500000, from 0\.5", r"friction 0\.600000, from 0\.[56]\d+ to 0\.600"],
        set(),
    ),
}
TESTS = (test_own_controller, test_lifter_node)
OWN = [own for module in TESTS for name, own in vars(module).items() if name.startswith("test_")]
FOREIGN = ("case_by_mujoco",)
"""Run by test/interop, with the tool that they need."""


@pytest.mark.parametrize("name", RUNS)
def test_a_script_runs_and_says_what_is_true(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments, patterns, files = RUNS[name]
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(EXAMPLES))
    monkeypatch.setattr(sys, "argv", [f"{name}.py", *arguments])
    runpy.run_path(str(EXAMPLES / f"{name}.py"), run_name="__main__")
    printed = capsys.readouterr().out
    for pattern in patterns:
        assert re.search(pattern, printed), printed
    assert {path.name for path in tmp_path.iterdir()} == files
    if name == "make_bag":
        run = bouncing_disk_ros.read_run("run_1")
        assert (len(run.rows), run.lost) == (61, 0)


@pytest.mark.parametrize(("name", "given"), [
    ("case_by_solve_ivp", "plastic_drop"), ("figures_3_and_4", "2.0"), ("make_bag", "."),
])  # fmt: skip
def test_a_script_refuses_what_it_cannot_use_in_one_line(
    name: str, given: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "metadata.yaml").write_text("")
    monkeypatch.setattr(sys, "argv", [f"{name}.py", given])
    with pytest.raises(SystemExit, match=r"got .*, allowed: "):
        runpy.run_path(str(EXAMPLES / f"{name}.py"), run_name="__main__")


def test_help_of_a_script_waits_for_no_slow_import() -> None:
    code = (
        "import runpy, sys\n"
        "for file in sys.argv[2:]:\n"
        "    try:\n"
        "        runpy.run_path(file, run_name='__main__')\n"
        "    except SystemExit as end:\n"
        "        assert not end.code\n"
        "    print({'numba', 'numpy', 'rosbags', 'matplotlib', 'pandas'} & set(sys.modules))\n"
    )
    files = [str(EXAMPLES / f"{name}.py") for name in (*RUNS, *FOREIGN)]
    done = finished(sys.executable, "-c", code, "--help", *files)
    assert done.stdout.count("set()") == done.stdout.count("python examples/") == len(files)


@pytest.mark.parametrize("own", OWN, ids=lambda own: own.__name__)
def test_controller_and_node_pass_their_own_tests(
    own: Callable[..., None], stepped_simulator: Callable[..., SteppedSimulator]
) -> None:
    own(*[stepped_simulator] * len(inspect.signature(own).parameters))


def test_every_script_is_run_by_a_test() -> None:
    assert len(OWN) == 3
    tested = {name for module in TESTS for name in (module.__name__[5:], module.__name__)}
    assert {path.stem for path in SCRIPTS} == RUNS.keys() | tested | {*FOREIGN}


@pytest.mark.parametrize("path", SCRIPTS, ids=lambda path: path.stem)
def test_a_script_says_what_it_shows_and_has_its_line_on_the_page(path: Path) -> None:
    text = path.read_text("utf-8")
    about = ast.get_docstring(ast.parse(text)) or ""
    assert f"{path.name}" in about
    page = (ROOT / "docs" / "examples.md").read_text("utf-8")
    assert f"[`{path.name}`](../examples/{path.name})" in page
