"""Random damages to bags: forged fields, changed bytes, a changed metadata.yaml, or all of these.

The lengths and checksums fit forged fields, so that they reach the code behind the checks. `make
soak` has fifty thousand damages.
"""

from __future__ import annotations

import itertools
import random
import shutil
import time
from pathlib import Path
from typing import Any

from bouncing_disk_ros import bag
from bouncing_disk_ros.errors import InputError
from reference.cases import FIRST, examples
from support.hostile import content, forgeries
from support.hostile.base import messages
from support.mcap_bytes import Content, fields, forged
from support.reading import read_all

DAMAGES = examples(60, 50_000)
SECONDS = 10.0  # of the processor, for one bag
NUMBERS = (0, 1, 0x7F, 0x80, 0xFF, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF, 1 << 62, (1 << 64) - 1)
METADATA = b"""rosbag2_bagfile_information:
  version: 9
  storage_identifier: mcap
  relative_file_paths: [run_0.mcap]
  compression_mode: ""
  custom_data: {format: "1", note: "a"}
  message_count: 3
"""


def wholes() -> list[Content]:
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


def edited(dice: random.Random, data: bytes, edits: int) -> bytes:
    """The bytes after some changes."""
    made = bytearray(data)
    for _ in range(edits if data else 0):
        at, length = dice.randrange(len(made) or 1), dice.randrange(1, 65)
        match dice.choice(("bit", "byte", "number", "drop", "double", "move", "end")):
            case "bit":
                made[at : at + 1] = bytes([made[at] ^ 1 << dice.randrange(8)]) if made else b""
            case "byte":
                made[at : at + 1] = dice.randbytes(1)
            case "number":
                size = dice.choice((2, 4, 8))
                number = dice.choice(NUMBERS) % (1 << 8 * size)
                made[at : at + size] = number.to_bytes(size, "little")
            case "drop":
                del made[at : at + length]
            case "double":
                made[at:at] = made[at : at + length]
            case "move":
                to = dice.randrange(len(made) or 1)
                made[to:to] = made[at : at + length]
            case "end":
                del made[at:]
    return bytes(made)


def read_and_recovered(folder: Path) -> list[str]:
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


def test_damaged_bags_are_read_or_refused(tmp_path: Path) -> None:
    whole = wholes()
    forgery = [forgeries(fields(one)) for one in whole]
    assert {one.field.partition(".")[0] for one in itertools.chain(*forgery)} >= {
        "magic", "header", "schema", "channel", "chunk", "message", "message_index", "attachment",
        "metadata", "data_end", "statistics", "chunk_index", "attachment_index", "metadata_index",
        "summary_offset", "footer", "end_magic",
    }  # fmt: skip
    refused = 0
    for seed in range(FIRST, FIRST + DAMAGES):
        dice, folder = random.Random(seed), tmp_path / "run"
        place = dice.randrange(len(whole))
        chosen = dice.sample(forgery[place], dice.choice((0, 1, 1, 2, 3)))
        data = forged({one.field: one.value for one in chosen}, whole[place])
        folder.mkdir()
        (folder / "run_0.mcap").write_bytes(edited(dice, data, dice.choice((0, 0, 1, 2))))
        if dice.random() < 0.3:
            (folder / "metadata.yaml").write_bytes(edited(dice, METADATA, dice.choice((0, 1, 2))))
        began = time.process_time()
        try:
            refused += bool(read_and_recovered(folder))
        except Exception as error:
            error.add_note(f"seed {seed}")
            raise
        assert time.process_time() - began < SECONDS, f"seed {seed}"
        shutil.rmtree(folder)
    assert 0 < refused < DAMAGES
