"""Damaged and hostile bags given to every tool that reads bags: one line and exit code 2, or data.

The corpus is that of support/hostile; its bags are made byte by byte. Time and memory of each call
are measured (support/tool_server.py). Forged fields: test_fuzz.py.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path

import pytest

from bouncing_disk_ros.bag.notes import signed
from reference.cases import in_soak
from support.hostile import CORPUS, content, put
from support.hostile.base import NOTES
from support.hostile.floods import FLOODS, flood
from support.mcap_bytes import forged
from support.tool_server import Done, ToolServer

SECONDS = 10.0  # of the processor, for one bag
MEGABYTES = 1000.0
IDENTICAL, FAILED, REFUSED, DIFFERS = 0, 1, 2, 3
SLOW = ("bomb", "metadata.yaml: many")
"""Bags (by the beginnings of their names) over which the tools spend seconds in the same code."""
FALSE_RUNS = ("snapshot", "record", "times")
"""Bags whose files are whole, but not the run in them."""
FALSE_MESSAGES = (*FALSE_RUNS, "definition", "cloud", "impact", "note", "/")
"""Bags whose files are whole, but not their messages or notes; `bag_recover` looks into neither."""
FEW = 8
"""Of the other bags, one in so many goes to the tools that read a bag by the library."""
PART = 1 if in_soak("all") else 3
"""One in so many bags is reported on or changed; `read` and `replay` have all. `make soak`: all."""
LARGE = 100_000_000  # B

pytestmark = pytest.mark.timeout(600)


@pytest.fixture(scope="module")
def server(ros_domain: int, tmp_path_factory: pytest.TempPathFactory) -> Iterator[ToolServer]:
    warm = put(tmp_path_factory.mktemp("warm") / "run", forged({}, content()))
    server = ToolServer(warm)
    yield server
    server.close()


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


def test_every_tool_gives_data_or_one_line(server: ToolServer, tmp_path: Path) -> None:
    """All bags to the library and, but for false messages, to recovery; some to the others."""
    bags = {name: make(tmp_path / str(n)) for n, (name, make) in enumerate(CORPUS.items())}

    def given(command: Sequence[str], names: Iterable[str], *codes: int) -> dict[str, Done]:
        folder = tmp_path / "_".join(command[:2])
        folder.mkdir()
        some = {name: bags[name] for name in names}
        return check(server, some, command, folder, (IDENTICAL, REFUSED, *codes))

    whole = [name for name in bags if not name.startswith(FALSE_MESSAGES)]
    few = [name for name in whole if not name.startswith(SLOW)][::FEW]
    quick = [*few, *(name for name in bags if name.startswith(FALSE_MESSAGES))]
    runs = [name for name in quick if name.startswith(FALSE_RUNS)]
    given(["read"], bags)
    cut = [name for name in whole if not name.startswith("metadata.yaml: many")]
    for number, (name, done) in enumerate(given(["bag_recover", "saved_{number}"], cut).items()):
        saved = tmp_path / "bag_recover_saved_{number}" / f"saved_{number}"
        assert saved.exists() or done.code == REFUSED, name
    given(["bag_report", "--text-only"], quick[::PART])
    found = given(["replay"], quick, DIFFERS)
    assert any(done.code == DIFFERS for done in found.values())
    # what is more work on a run: on those that are replayed, and some of those that are refused
    refused = [name for name in runs if found[name].code == REFUSED]
    some = [*(name for name in runs if found[name].code != REFUSED), *refused[::FEW]]
    given(["bag_report", "--prove", "--every", "5"], some)
    given(["replay", "--what-if", "friction:=0.5"], some[::PART], DIFFERS)
    given(["study"], some)
    markup = "<script>alert(1)</script>"
    data = forged({}, content(notes=signed({**NOTES, "version": markup})))
    folder = put(tmp_path / "run", data)
    (done,) = server.run("bag_report", [[str(folder), "report", "--figures", "none"]], tmp_path)
    assert [*faults(done, [IDENTICAL])] == []
    page = (tmp_path / "report.html").read_text()
    assert "&lt;script&gt;alert(1)" in page
    assert markup not in page


@pytest.mark.soak
@pytest.mark.parametrize("name", FLOODS)
def test_large_files_of_one_thing_are_read_or_refused(
    server: ToolServer, tmp_path: Path, name: str
) -> None:
    path = put(tmp_path / "run", flood(name, LARGE))
    for tool in ("read", "bag_recover"):
        (done,) = server.run(tool, [[str(path)]], tmp_path)
        print(f"\n{tool}, {name}: code {done.code}, {done.seconds:.1f} s, {done.megabytes:.0f} MB")
        assert [*faults(done, [IDENTICAL, REFUSED])] == []
