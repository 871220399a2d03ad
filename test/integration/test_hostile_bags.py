"""Damaged and hostile bags given to every tool that reads bags: one line and exit code 2, or data.

The corpus is that of support/hostile; its bags are made byte by byte. Time and memory of each call
are measured (support/tool_server.py).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import pytest

from bouncing_disk_ros.bag.metadata import signed
from support.hostile import CORPUS, content, forgeries, put
from support.hostile.base import NOTES
from support.mcap_bytes import fields, forged
from support.tool_server import Done, ToolServer

SECONDS = 10.0  # of the processor, for one bag
MEGABYTES = 1000.0
IDENTICAL, FAILED, REFUSED, DIFFERS = 0, 1, 2, 3
SLOW = ("bomb", "metadata.yaml: many")
"""Bags (by the beginnings of their names) over which the tools spend seconds in the same code."""
FALSE_RUNS = ("snapshot", "record", "times", "definition")
"""Bags whose files are whole, but not the run in them."""
FALSE_MESSAGES = (*FALSE_RUNS, "cloud", "impact", "note", "/")
"""Bags whose files are whole, but not their messages or notes; `bag_recover` looks into neither."""
FEW = 8
"""Of the other bags, one in so many goes to the tools that read a bag by the library."""
SOME = 4
"""One in so many values of the fields is tried; each field has five or six. `make soak`: all."""

pytestmark = pytest.mark.timeout(600)


@pytest.fixture(scope="module")
def server(ros_domain: int, tmp_path_factory: pytest.TempPathFactory) -> Iterator[ToolServer]:
    warm = put(tmp_path_factory.mktemp("warm") / "run", forged({}, content()))
    server = ToolServer(warm)
    yield server
    server.close()


@pytest.fixture(scope="module")
def corpus(ros_domain: int, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """The path of each bag of the corpus."""
    folder = tmp_path_factory.mktemp("corpus")
    return {name: make(folder / str(n)) for n, (name, make) in enumerate(CORPUS.items())}


@pytest.fixture(scope="module")
def quick(corpus: dict[str, Path]) -> dict[str, Path]:
    """FALSE_MESSAGES, and a few bags of the other kinds; none of SLOW."""
    others = [name for name in corpus if not name.startswith((*FALSE_MESSAGES, *SLOW))]
    chosen = {*others[::FEW]} | {name for name in corpus if name.startswith(FALSE_MESSAGES)}
    return {name: path for name, path in corpus.items() if name in chosen}


def faults(done: Done, codes: Sequence[int]) -> Iterator[str]:
    """What is wrong with the end of one call."""
    lines = done.err.splitlines()
    if done.code not in codes:
        yield f"exit code {done.code}: {done.err[-1000:]}"
    elif len(lines) != (done.code in (FAILED, REFUSED)):
        yield f"{len(lines)} lines: {done.err[:1000]}"
    if not all(letter.isprintable() or letter == "\n" for letter in done.out + done.err):
        yield f"letters that a terminal obeys: {done.out + done.err!r}"
    if done.seconds > SECONDS:
        yield f"{done.seconds:.1f} s"
    if done.megabytes > MEGABYTES:
        yield f"{done.megabytes:.0f} MB, or an earlier one"


def check(
    server: ToolServer, bags: Mapping[str, Path], command: Sequence[str], folder: Path,
    codes: Sequence[int] = (IDENTICAL, REFUSED),
) -> dict[str, Done]:  # fmt: skip
    """Give each bag to a tool; {number} in the command is a number of its own for each bag."""
    tool, *options = command
    calls = [
        [str(path), *(option.format(number=number) for option in options)]
        for number, path in enumerate(bags.values())
    ]
    found = dict(zip(bags, server.run(tool, calls, folder), strict=True))
    wrong = {name: text for name, done in found.items() if (text := [*faults(done, codes)])}
    assert not wrong, "\n".join(f"{name}: {'; '.join(text)}" for name, text in wrong.items())
    assert not list(folder.rglob("H*")), "code of a bag was run"  # `touch HACKED`
    refused = sum(done.code == REFUSED for done in found.values())
    print(f"\n{' '.join(command)}: {len(found)} bags, {refused} refused, "
          f"at most {max(done.seconds for done in found.values()):.2f} s and "
          f"{max(done.megabytes for done in found.values()):.0f} MB")  # fmt: skip
    assert 0 < refused < len(found), "the corpus is to hold bags of both kinds"
    return found


# --- the corpus -----------------------------------------------------------------------------------
def test_the_library_gives_data_or_one_line(
    server: ToolServer, corpus: dict[str, Path], tmp_path: Path
) -> None:
    check(server, corpus, ["read"], tmp_path)


def test_bag_recover_saves_or_says_one_line(
    server: ToolServer, corpus: dict[str, Path], tmp_path: Path
) -> None:
    bags = {name: path for name, path in corpus.items() if not name.startswith(FALSE_MESSAGES)}
    found = check(server, bags, ["bag_recover", "saved_{number}"], tmp_path)
    left = {path.name for path in tmp_path.iterdir()}
    for number, (name, done) in enumerate(found.items()):
        assert f"saved_{number}" in left or done.code == REFUSED, name


def test_bag_report_gives_a_report_or_one_line(
    server: ToolServer, quick: dict[str, Path], tmp_path: Path
) -> None:
    check(server, quick, ["bag_report", "--text-only"], tmp_path)


def test_replay_compares_or_says_one_line(
    server: ToolServer, quick: dict[str, Path], tmp_path: Path
) -> None:
    found = check(server, quick, ["replay"], tmp_path, (IDENTICAL, REFUSED, DIFFERS))
    assert any(done.code == DIFFERS for done in found.values())


@pytest.mark.parametrize(
    "command",
    [
        ["bag_report", "--prove", "--every", "5"],
        ["replay", "--what-if", "friction:=0.5"],
        ["study"],
    ],
)
def test_false_runs_are_simulated_or_refused(
    server: ToolServer, quick: dict[str, Path], tmp_path: Path, command: list[str]
) -> None:
    bags = {name: path for name, path in quick.items() if name.startswith(FALSE_RUNS)}
    check(server, bags, command, tmp_path, (IDENTICAL, REFUSED, DIFFERS))


def test_a_page_of_a_report_shows_markup_as_text(server: ToolServer, tmp_path: Path) -> None:
    markup = "<script>alert(1)</script>"
    data = forged({}, content(notes=signed({**NOTES, "version": markup})))
    folder = put(tmp_path / "run", data)
    (done,) = server.run("bag_report", [[str(folder), "report", "--figures", "none"]], tmp_path)
    assert [*faults(done, [IDENTICAL])] == []
    page = (tmp_path / "report.html").read_text()
    assert "&lt;script&gt;alert(1)" in page
    assert markup not in page


# --- each field of the format ---------------------------------------------------------------------
@pytest.mark.parametrize("command", [["read"], ["bag_recover", "saved_{number}"]])
def test_each_field_of_the_format_is_checked(
    server: ToolServer, tmp_path: Path, command: list[str]
) -> None:
    whole = content()
    short = content(messages=whole.messages[:12], per_chunk=5)
    kinds, bags = fields(short), {}
    assert {name.partition(".")[0] for name in kinds} >= {
        "magic", "header", "schema", "channel", "chunk", "message", "message_index", "attachment",
        "metadata", "data_end", "statistics", "chunk_index", "attachment_index", "metadata_index",
        "summary_offset", "footer", "end_magic",
    }  # fmt: skip
    for number, row in enumerate(forgeries(kinds)[::SOME]):
        data = forged({row.field: row.value}, short)
        bags[f"{row.field}: {row.what}"] = put(tmp_path / str(number), data)
    assert {name.partition(": ")[0] for name in bags} == set(kinds)
    check(server, bags, command, tmp_path)
