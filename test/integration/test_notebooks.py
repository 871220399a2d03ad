"""The notebooks of docs/notebooks run, print what is true, and keep small outputs."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

FOLDER = Path(__file__).resolve().parents[2] / "docs" / "notebooks"
#: notebook -> what its cells print: of the stored outputs, and of those when it is run
PRINTED = {
    "from_drop_to_basins": [r"restitution 0\.8\d\d, 95 %: 0\.\d+ to 0\.\d+", r"(?m)^period-1: "],
}
LARGEST = 200_000
"""Bytes of a notebook with its outputs: one figure or two."""


def printed(cells: list[dict]) -> str:  # type: ignore[type-arg]
    """What the cells printed."""
    outputs = [one for cell in cells for one in cell.get("outputs", ())]
    return "".join(one.get("text", "") for one in outputs)


@pytest.mark.parametrize("name", PRINTED)
def test_a_notebook_runs_and_prints_what_is_true(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    nbformat, nbclient = pytest.importorskip("nbformat"), pytest.importorskip("nbclient")
    for variable in ("IPYTHONDIR", "JUPYTER_RUNTIME_DIR"):
        monkeypatch.setenv(variable, str(tmp_path / variable))
    file = FOLDER / f"{name}.ipynb"
    notebook = nbformat.read(file, as_version=4)
    stored = printed(notebook.cells)
    client = nbclient.NotebookClient(
        notebook, timeout=100, resources={"metadata": {"path": str(tmp_path)}}
    )
    client.execute()
    for pattern in PRINTED[name]:
        assert re.search(pattern, printed(notebook.cells))
        assert re.search(pattern, stored), "renew the outputs: see CONTRIBUTING.md"
    assert file.stat().st_size < LARGEST


def test_every_notebook_is_run() -> None:
    assert {path.stem for path in FOLDER.glob("*.ipynb")} == set(PRINTED)
