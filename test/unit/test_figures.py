"""The figures of the paper: parameter files fit their studies, the page shows what was computed."""

from __future__ import annotations

import re
import runpy
import sys
from pathlib import Path
from typing import Any

import pytest

from bouncing_disk_ros.colours import DISK, PLATFORM
from support.figure_boxes import flaws

ROOT = Path(__file__).resolve().parents[2]
TOOLS = ROOT / "tools"


@pytest.fixture(scope="module")
def tool() -> Any:
    """The names of tools/make_figures.py."""
    sys.path.insert(0, str(TOOLS))
    try:
        return runpy.run_path(str(TOOLS / "make_figures.py"))
    finally:
        sys.path.remove(str(TOOLS))


def names() -> list[str]:
    return sorted(path.stem for path in (ROOT / "config").glob("*.yaml")
                  if path.stem.startswith(("fig", "ease")))  # fmt: skip


@pytest.mark.parametrize("name", names())
def test_parameter_file_fits_its_study(tool: Any, name: str) -> None:
    definition, values = tool["tool_and_values"](name)
    assert definition.make(values).shape


def test_every_parameter_file_is_a_figure_and_on_the_page(tool: Any) -> None:
    assert sorted(figure.name for figure in tool["FIGURES"]) == names()
    page = (ROOT / "docs" / "figures.md").read_text("utf-8")
    for name in names():
        assert f"share bouncing_disk_ros)/config/{name}.yaml" in page
    for picture in re.findall(r"\]\((figures/[^)]+)\)", page):
        assert (ROOT / "docs" / picture).is_file(), picture
    for figure in tool["FIGURES"]:
        assert len(figure.caption) > 100
        assert f"*{figure.caption}*" in page, f"{figure.name}: make figures writes the page"


def test_the_figure_of_the_geometry_has_the_colours_of_all_others(tool: Any) -> None:
    figure = tool["geometry_figure"]()
    assert flaws(figure) == []
    words = {text.get_text(): text.get_color() for axes in figure.axes for text in axes.texts}
    assert words["disk, mass m"] == DISK
    assert words["platform"] == PLATFORM


@pytest.mark.parametrize(
    ("paper", "ours", "verdict"),
    [("0.486", 0.4860031, True), ("0.486", 0.48649, True), ("0.486", 0.4866, False),
     ("27.1", 27.18, False), ("0.5402", 0.5401021, False), ("0", 1e-13, True)],
)  # fmt: skip
def test_agrees_means_rounds_to_what_is_printed(
    tool: Any, paper: str, ours: float, verdict: bool
) -> None:
    module = sys.modules["paper_figures"]
    assert module.agrees(module.Number("", paper, ours)) is verdict
    row = module._row(module.Number("x", paper, ours, "m", "because"))
    assert ("agrees" in row) is verdict
    assert ("because" in row) is not verdict
