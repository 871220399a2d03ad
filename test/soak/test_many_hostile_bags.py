"""Hostile bags at length: ten thousand damages, each field with each value, files of 100 MB.

make soak
BOUNCING_DISK_SOAK_DAMAGES=500 BOUNCING_DISK_SOAK_SEED=7 make soak
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import pytest

from support.fuzz import Fuzz
from support.hostile import content, forgeries, put
from support.hostile.floods import FLOODS, flood
from support.mcap_bytes import fields, forged
from support.tool_server import ToolServer

DAMAGES = int(os.environ.get("BOUNCING_DISK_SOAK_DAMAGES", "10000"))
SEED = int(os.environ.get("BOUNCING_DISK_SOAK_SEED", "20090501"))
LARGE = 100_000_000  # B
SECONDS, MEGABYTES = 10.0, 1000.0  # for files up to LARGE

pytestmark = [pytest.mark.soak, pytest.mark.timeout(7200)]


def test_damaged_bags_are_read_or_refused(tmp_path: Path) -> None:
    fuzz = Fuzz(SEED, tmp_path / "run")
    fuzz.run(DAMAGES)
    print(f"\n{fuzz}")
    assert fuzz.refused > DAMAGES / 10
    assert len(fuzz.seen) > fuzz.whole


@pytest.fixture(scope="module")
def server(ros_domain: int, tmp_path_factory: pytest.TempPathFactory) -> Iterator[ToolServer]:
    server = ToolServer(put(tmp_path_factory.mktemp("warm") / "run", forged({}, content())))
    yield server
    server.close()


def test_each_value_of_each_field_is_read_or_refused(server: ToolServer, tmp_path: Path) -> None:
    short = content(messages=content().messages[:12], per_chunk=5)
    rows = forgeries(fields(short))
    paths = [
        put(tmp_path / str(number), forged({row.field: row.value}, short))
        for number, row in enumerate(rows)
    ]
    for tool in ("read", "bag_recover"):
        done = server.run(tool, [[str(path)] for path in paths], tmp_path)
        for row, one in zip(rows, done, strict=True):
            told = f"{tool}: {row.field}: {row.what}: {one}"
            assert len(one.err.splitlines()) == {0: 0, 2: 1}.get(one.code, -1), told
            assert one.seconds < SECONDS, told
            assert one.megabytes < MEGABYTES, told


@pytest.mark.parametrize("name", FLOODS)
def test_large_files_of_one_thing_are_read_or_refused(
    server: ToolServer, tmp_path: Path, name: str
) -> None:
    path = put(tmp_path / "run", flood(name, LARGE))
    for tool in ("read", "bag_recover"):
        (one,) = server.run(tool, [[str(path)]], tmp_path)
        print(f"\n{tool}, {name}: code {one.code}, {one.seconds:.1f} s, {one.megabytes:.0f} MB")
        assert len(one.err.splitlines()) == {0: 0, 2: 1}.get(one.code, -1), one
        assert one.seconds < SECONDS
        assert one.megabytes < MEGABYTES
