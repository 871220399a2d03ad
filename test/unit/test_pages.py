"""The pages: short sentences that name their nouns; what they name exists, as it was measured."""

from __future__ import annotations

import json
import re
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest
import yaml

from bench.history import LAST
from bench.page import PAGE, with_table

ROOT = Path(__file__).resolve().parents[2]
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md"))]
LONGEST, MEAN, LONGEST_CELL, README = 35, 18, 45, 900
#: a noun that is not named, or a reason that reads like a purpose
HARD = re.compile(
    r"\b(that of|those of|ones? that|the one with|th(?:at|ose) with|but for|left to)\b"
    r"|, for (?!example)",
    re.IGNORECASE,
)
_BLOCK = re.compile(r"\n\s*\n|\n(?=\s*(?:[-*]|\d+\.) )|\n(?=#)|\n(?=\|)")
_END = re.compile(r"(?<=[.!?:;])\s+(?=[A-ZΓ0-9*(\"'`ετωμ])")


def plain(text: str) -> str:
    """Text on one line; a link is its words, a code span one word."""
    text = re.sub(r"!?\[([^\]]*)\]\([^)]*\)", r"\1", text)
    return " ".join(re.sub(r"`[^`]*`", "`x`", re.sub(r"^\s*(?:[-*]|\d+\.) ", "", text)).split())


def prose(page: Path) -> tuple[list[str], list[str]]:
    """Sentences of a page, and cells of its tables; without code, headings and pictures."""
    text = re.sub(r"```.*?```|<!--.*?-->", "\n\n", page.read_text("utf-8"), flags=re.DOTALL)
    sentences: list[str] = []
    cells: list[str] = []
    for block in map(str.strip, _BLOCK.split(text)):
        if block.startswith("|"):
            cells += map(plain, re.split(r"(?<!\\)\|", block))
        elif block and not block.startswith(("#", "![")):
            sentences += _END.split(plain(block))
    return sentences, cells


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_sentences_are_short_and_name_their_nouns(page: Path) -> None:
    sentences, cells = prose(page)
    assert len(sentences) > 3
    found = [f"{len(one.split())} words: {one}" for one in sentences if len(one.split()) > LONGEST]
    found += [f"in a cell: {one}" for one in cells if len(one.split()) > LONGEST_CELL]
    found += [f"{hard[0]!r}: {one}" for one in sentences + cells if (hard := HARD.search(one))]
    assert not found, f"{page.name}:\n" + "\n".join(found)
    mean = sum(len(one.split()) for one in sentences) / len(sentences)
    assert mean <= MEAN, f"{page.name}: {mean:.1f} words to a sentence"


def test_the_readme_has_two_screens() -> None:
    assert len((ROOT / "README.md").read_text("utf-8").split()) <= README


# --- what they name -------------------------------------------------------------------------------
NAMING = sorted(
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


def test_files_that_are_named_exist_and_commands_work_from_any_folder() -> None:
    named = {(page, name) for page in NAMING for name in NAMED.findall(page.read_text("utf-8"))}
    assert len(named) > 30
    assert [(page.name, name) for page, name in named if not (ROOT / name).is_file()] == []
    for file in (ROOT / "config").glob("*.yaml"):
        for line in file.read_text("utf-8").splitlines():
            if "--params-file " in line:
                share = "$(ros2 pkg prefix --share bouncing_disk_ros)/config/"
                assert line.split("--params-file ")[1] == f"{share}{file.name}"


def test_the_citation_has_the_version_of_the_package_and_the_page_the_stored_run() -> None:
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text("utf-8"))
    assert citation["version"] == ET.parse(ROOT / "package.xml").getroot().findtext("version")
    assert citation["date-released"].year >= 2026
    assert citation["authors"]
    page = PAGE.read_text("utf-8")
    assert with_table(page, json.loads(LAST.read_text("utf-8"))) == page
