"""Random damages to bags, guided by coverage: what reaches new code is damaged further.

    fuzz = Fuzz(seed=1, folder=tmp_path)
    fuzz.run(10_000)             # AssertionError: an exception that is no refusal, and its input

An input is a whole bag with forged fields (lengths and checksums fit them, so that they reach the
code behind the checks), then changes of its bytes, then changes of its metadata.yaml. Coverage is
counted in pairs of lines that follow each other, in this package's `bag`.
"""

from __future__ import annotations

import random
import shutil
import sys
import time
import traceback
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import CodeType, FrameType, TracebackType
from typing import Any, NamedTuple

from bouncing_disk_ros import bag
from bouncing_disk_ros.errors import InputError
from support.hostile import content, forgeries
from support.hostile.base import messages
from support.mcap_bytes import Content, fields, forged
from support.reading import read_all

SECONDS = 10.0  # of the processor, for one input
_FOLDER = str(Path(bag.__file__ or "").parent)
_NUMBERS = (0, 1, 0x7F, 0x80, 0xFF, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF, 1 << 62, (1 << 64) - 1)
_METADATA = """rosbag2_bagfile_information:
  version: 9
  storage_identifier: mcap
  relative_file_paths: [run_0.mcap]
  compression_mode: ""
  custom_data: {format: "1", note: "a"}
  message_count: 3
"""
Arc = tuple[CodeType, int, int]


class Damaged(NamedTuple):
    """One input."""

    base: int  # number of the whole bag
    forge: tuple[tuple[str, Any], ...] = ()
    edits: tuple[tuple[str, int, int], ...] = ()  # what, where and with what: see `edited`
    metadata: tuple[tuple[str, int, int], ...] | None = None  # None: no metadata.yaml


def bases() -> list[Content]:
    """Small whole bags of each compression, with and without an index."""
    seen: dict[str, Any] = {}
    for row in messages():
        seen.setdefault(row.topic, row)
    rows = sorted(seen.values(), key=lambda row: len(row.data))[:4]
    kinds = [("", True), ("zstd", True), ("lz4", True), ("", False)]
    return [
        content(messages=rows, per_chunk=2, compression=name, summary=is_indexed)
        for name, is_indexed in kinds
    ]


def edited(data: bytes, edits: Sequence[tuple[str, int, int]]) -> bytes:
    """The bytes after some changes; places are taken modulo the length."""
    made = bytearray(data)
    for what, place, value in edits:
        if not made:
            break
        at = place % len(made)
        match what:
            case "bit":
                made[at] ^= 1 << value % 8
            case "byte":
                made[at] = value % 256
            case "number":
                size = (2, 4, 8)[value % 3]
                number = _NUMBERS[value // 3 % len(_NUMBERS)] % (1 << 8 * size)
                made[at : at + size] = number.to_bytes(size, "little")
            case "drop":
                del made[at : at + 1 + value % 64]
            case "double":
                made[at:at] = made[at : at + 1 + value % 64]
            case "move":
                part = made[at : at + 1 + value % 64]
                made[value % len(made) : value % len(made)] = part
            case "end":
                del made[at:]
    return bytes(made)


_EDITS = ("bit", "byte", "number", "drop", "double", "move", "end")


class Coverage:
    """While entered: the pairs of lines that follow each other in a call, within a folder."""

    def __init__(self, folder: str) -> None:
        self.found: set[Arc] = set()
        self._folder = folder
        self._inside: dict[CodeType, bool] = {}
        self._before: Any = None

    def __enter__(self) -> Coverage:
        self.found = set()
        self._before = sys.gettrace()
        sys.settrace(self._call)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:  # fmt: skip
        sys.settrace(self._before)

    def _call(self, frame: FrameType, _event: str, _argument: Any) -> Any:
        code, found, last = frame.f_code, self.found, 0
        if code not in self._inside:
            self._inside[code] = code.co_filename.startswith(self._folder)
        if not self._inside[code]:
            return None

        def line(frame: FrameType, event: str, _argument: Any) -> Any:
            nonlocal last
            if event == "line":
                found.add((code, last, frame.f_lineno))
                last = frame.f_lineno
            return line

        return line


class Fuzz:
    """A run of random damages."""

    def __init__(self, seed: int, folder: Path) -> None:
        self.seed, self.tried, self.refused = seed, 0, 0
        self.seen: set[Arc] = set()
        self.kept: list[Damaged] = []
        self._dice, self._folder = random.Random(seed), folder
        self._coverage = Coverage(_FOLDER)
        self._bases = bases()
        self._kinds: list[Mapping[str, str]] = [fields(base) for base in self._bases]
        for base in range(len(self._bases)):
            self._try(Damaged(base))
            self._try(Damaged(base, metadata=()))
        self.whole = len(self.seen)
        """Pairs of lines that whole bags reach."""

    def run(self, count: int) -> None:
        """Try so many inputs. AssertionError names the one that is neither read nor refused."""
        for _ in range(count):
            self._try(self._changed(self._dice.choice(self.kept)))

    # --- inputs -----------------------------------------------------------------------------------
    def _changed(self, one: Damaged) -> Damaged:
        """An input with one to three more damages."""
        for _ in range(self._dice.choice((1, 1, 2, 3))):
            kind = self._dice.random()
            if kind < 0.5:
                chosen = self._dice.choice(forgeries(self._kinds[one.base]))
                one = one._replace(forge=(*one.forge, (chosen.field, chosen.value)))
            elif kind < 0.9 or one.metadata is None:
                one = one._replace(edits=(*one.edits, self._edit()))
            else:
                one = one._replace(metadata=(*one.metadata, self._edit()))
        return one

    def _edit(self) -> tuple[str, int, int]:
        dice = self._dice
        return dice.choice(_EDITS), dice.getrandbits(32), dice.getrandbits(16)

    def put(self, one: Damaged) -> Path:
        """The folder of an input."""
        shutil.rmtree(self._folder, ignore_errors=True)
        self._folder.mkdir(parents=True)
        data = forged(dict(one.forge), self._bases[one.base])
        (self._folder / "run_0.mcap").write_bytes(edited(data, one.edits))
        if one.metadata is not None:
            text = edited(_METADATA.encode(), one.metadata)
            (self._folder / "metadata.yaml").write_bytes(text)
        return self._folder

    # --- one input --------------------------------------------------------------------------------
    def _try(self, one: Damaged) -> None:
        folder = self.put(one)
        began = time.process_time()
        try:
            with self._coverage as coverage:
                self.refused += bool(_read_and_recovered(folder))
        except Exception:  # noqa: BLE001 (whatever it is, it is told)
            raise AssertionError(self._told(one, traceback.format_exc())) from None
        seconds = time.process_time() - began
        assert seconds < SECONDS, self._told(one, f"took {seconds:.1f} s")
        self.tried += 1
        if coverage.found - self.seen:
            self.seen |= coverage.found
            self.kept.append(one)

    def _told(self, one: Damaged, what: str) -> str:
        return f"seed {self.seed}, input {self.tried}, {one}\n{what}"

    def __str__(self) -> str:
        return (
            f"seed {self.seed}: {self.tried} damages, {self.refused} with a refusal, "
            f"{len(self.kept)} kept, {len(self.seen)} pairs of lines ({self.whole} by whole bags)"
        )


def _read_and_recovered(folder: Path) -> list[str]:
    """Read all of a bag, recover it and read that; the refusals."""
    refused = read_all(folder)
    target = folder / "recovered"
    try:
        report = bag.recover(folder, target)
    except (bag.BagError, InputError) as error:
        return [*refused, str(error)]
    with bag.open(target) as run:
        has_types = all(topic.type for topic in run.topics.values())
        assert run.complete or not has_types, run.remarks
        assert sum(1 for _ in run.messages()) == report.saved
    return refused
