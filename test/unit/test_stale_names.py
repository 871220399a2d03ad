"""What comments and pages name exists: files of the tree, the version in CITATION.cff."""

from __future__ import annotations

import re
from pathlib import Path
from xml.etree import ElementTree as ET

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


def test_files_that_are_named_exist() -> None:
    named = {(page, name) for page in PAGES for name in NAMED.findall(page.read_text("utf-8"))}
    assert len(named) > 30
    assert [(page.name, name) for page, name in named if not (ROOT / name).is_file()] == []


def test_commands_in_parameter_files_work_from_any_folder() -> None:
    for file in (ROOT / "config").glob("*.yaml"):
        for line in file.read_text("utf-8").splitlines():
            if "--params-file " in line:
                share = "$(ros2 pkg prefix --share bouncing_disk_ros)/config/"
                assert line.split("--params-file ")[1] == f"{share}{file.name}"


def test_the_citation_has_the_version_of_the_package() -> None:
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text("utf-8"))
    assert citation["version"] == ET.parse(ROOT / "package.xml").getroot().findtext("version")
    assert citation["date-released"].year >= 2026
    assert citation["authors"]
