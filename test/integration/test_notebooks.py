"""The notebooks of docs/notebooks run, print what is true, and keep small outputs."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
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


def outputs(cells: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """What the cells put out."""
    return [one for cell in cells for one in cell.get("outputs", ())]


def shown(cells: list[dict[str, Any]]) -> int:
    """How many pictures the cells show."""
    return sum(any("image/" in kind for kind in one.get("data", ())) for one in outputs(cells))


@pytest.mark.parametrize("name", PRINTED)
def test_a_notebook_prints_what_is_true(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Its code as a script, for a kernel takes longer than the code; and what it keeps."""
    pytest.importorskip("IPython")
    figures, patterns = PRINTED[name]
    cells = json.loads((FOLDER / f"{name}.ipynb").read_text("utf-8"))["cells"]
    code = ["".join(cell["source"]) for cell in cells if cell["cell_type"] == "code"]
    monkeypatch.chdir(tmp_path)
    exec(compile("\n".join(code), name, "exec"), {"__name__": "__main__"})
    plt.close("all")
    stored = "".join("".join(one.get("text", "")) for one in outputs(cells))
    found = capsys.readouterr().out
    for pattern in patterns:
        assert re.search(pattern, found)
        assert re.search(pattern, stored), RENEW
    assert shown(cells) == figures, RENEW
    assert (FOLDER / f"{name}.ipynb").stat().st_size < LARGEST


@pytest.mark.interop  # 20 s
@pytest.mark.parametrize("name", PRINTED)
def test_a_notebook_runs_in_its_kernel(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    nbformat, nbclient = pytest.importorskip("nbformat"), pytest.importorskip("nbclient")
    for variable in ("IPYTHONDIR", "JUPYTER_RUNTIME_DIR"):
        monkeypatch.setenv(variable, str(tmp_path / variable))
    read = nbformat.read(FOLDER / f"{name}.ipynb", as_version=4)
    resources = {"metadata": {"path": str(tmp_path)}}
    nbclient.NotebookClient(read, timeout=250, resources=resources).execute()
    assert shown(read.cells) == PRINTED[name][0], "each figure once"


def test_every_notebook_is_run() -> None:
    assert {path.stem for path in FOLDER.glob("*.ipynb")} == set(PRINTED)
