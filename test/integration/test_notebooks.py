"""The notebooks of docs/notebooks run, print what is true, and keep small outputs."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

FOLDER = Path(__file__).resolve().parents[2] / "docs" / "notebooks"
#: notebook -> its figures, and what its cells print: stored, and when it is run
PRINTED = {
    "closed_loop": (
        4,
        [
            "open loop: never, 0 commands",
            "(?m)^deadbeat: captured",
            "second impact: captured",
            "deadbeat: captures 100 %, with a delay 100 %",
        ],
    ),
    "figures_3_and_4": (
        2,
        [r"stable for 0\.5385 < Γ < 0\.6772", r"1 → 2 at Γ = 0\.67715134", r"(?m)^period-1: \d+"],
    ),
    "from_drop_to_basins": (
        1,
        [r"restitution 0\.8\d\d, 95 %: 0\.\d+ to 0\.\d+", r"(?m)^period-1: "],
    ),
    "motor_from_data_sheet": (
        3,
        [
            r"period 1 between 46\.5 and 67\.8 N",
            r"no-load speed up to 75\.3 rad/s",
            r"(?m)^rise_time 0\.\d+ ms",
            r"(?m)^stop_time 0\.\d+ ms",
        ],
    ),
}
pytestmark = pytest.mark.timeout(300)  # longer than any wait here

LARGEST = 400_000
"""Bytes of a notebook with its outputs: a few figures, a short animation."""

RENEW = "renew the outputs: see CONTRIBUTING.md"


def printed(cells: list[dict]) -> str:  # type: ignore[type-arg]
    """What the cells printed."""
    outputs = [one for cell in cells for one in cell.get("outputs", ())]
    return "".join(one.get("text", "") for one in outputs)


def shown(cells: list[dict]) -> int:  # type: ignore[type-arg]
    """How many pictures the cells show."""
    outputs = [one for cell in cells for one in cell.get("outputs", ())]
    return sum(any("image/" in kind for kind in one.get("data", ())) for one in outputs)


def test_notebooks_run_and_print_what_is_true(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """All in one kernel, whose imports take longest; none sees the names of another."""
    nbformat, nbclient = pytest.importorskip("nbformat"), pytest.importorskip("nbclient")
    for variable in ("IPYTHONDIR", "JUPYTER_RUNTIME_DIR"):
        monkeypatch.setenv(variable, str(tmp_path / variable))
    read = {name: nbformat.read(FOLDER / f"{name}.ipynb", as_version=4) for name in PRINTED}
    stored = {name: (shown(one.cells), printed(one.cells)) for name, one in read.items()}
    together = nbformat.v4.new_notebook()
    for one in read.values():
        together.cells += [nbformat.v4.new_code_cell("%reset -f"), *one.cells]
    resources = {"metadata": {"path": str(tmp_path)}}
    nbclient.NotebookClient(together, timeout=250, resources=resources).execute()
    for name, (figures, patterns) in PRINTED.items():
        cells = read[name].cells
        assert shown(cells) == figures, f"{name}: each figure once"
        assert stored[name][0] == figures, f"{name}: {RENEW}"
        for pattern in patterns:
            assert re.search(pattern, printed(cells)), name
            assert re.search(pattern, stored[name][1]), f"{name}: {RENEW}"
        assert (FOLDER / f"{name}.ipynb").stat().st_size < LARGEST


def test_every_notebook_is_run() -> None:
    assert {path.stem for path in FOLDER.glob("*.ipynb")} == set(PRINTED)
