"""What comments and pages name exists: files of the tree, the version in CITATION.cff."""

from __future__ import annotations

import re
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest
import yaml

ROOT = Path(__file__).resolve().parents[2]
PAGES = sorted(
    path
    for pattern in (
        "config/**/*.yaml",
        "docs/*.md",
        "examples/*.py",
        "*.md",
        "launch/*.py",
        "urdf/*",
        "tools/*.py",
    )
    for path in ROOT.glob(pattern)
)
NAMED = re.compile(r"\b(?:bouncing_disk_ros|test|tools|config)/[A-Za-z0-9_/]+\.(?:py|yaml)\b")


@pytest.mark.parametrize("page", PAGES, ids=lambda path: str(path.relative_to(ROOT)))
def test_files_that_are_named_exist(page: Path) -> None:
    for name in NAMED.findall(page.read_text("utf-8")):
        assert (ROOT / name).is_file(), name


@pytest.mark.parametrize("file", sorted((ROOT / "config").glob("*.yaml")), ids=lambda p: p.stem)
def test_commands_in_parameter_files_work_from_any_folder(file: Path) -> None:
    for line in file.read_text("utf-8").splitlines():
        if "--params-file " in line:
            share = "$(ros2 pkg prefix --share bouncing_disk_ros)/config/"
            assert line.split("--params-file ")[1] == f"{share}{file.name}"


def test_the_citation_has_the_version_of_the_package() -> None:
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text("utf-8"))
    assert citation["version"] == ET.parse(ROOT / "package.xml").getroot().findtext("version")
    assert citation["date-released"].year >= 2026
    assert citation["authors"]
