"""Where the files of a report go, and that nothing of others is overwritten."""

from __future__ import annotations

from pathlib import Path

import pytest

from bouncing_disk_ros.errors import FailedError, InputError
from bouncing_disk_ros.regular_file import replaced
from bouncing_disk_ros.report.report_files import targets


def test_names(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    kinds = ["html", "png", "png"]
    (tmp_path / "folder").mkdir()
    for bag, output, stem in (
        ("runs/run.1", None, tmp_path / "runs" / "run.1_report"),
        ("runs/run_1/", None, tmp_path / "runs" / "run_1_report"),
        (".", None, tmp_path.parent / f"{tmp_path.name}_report"),
        ("runs/run_1_0.mcap", None, tmp_path / "runs" / "run_1_0_report"),
        ("run_1", "folder", Path("folder/run_1_report")),
        ("run_1", "new/", Path("new/run_1_report")),
        ("run_1", "first", Path("first")),
        ("run_1", "first.html", Path("first")),
        ("run_1", "v1.2", Path("v1.2")),
    ):
        expected = [stem.with_name(f"{stem.name}.{kind}") for kind in ("html", "png")]
        assert targets(bag, "report", output, kinds) == expected
    (tmp_path / "drop.wav").touch()
    table, figure = targets("drop.wav", "times", None, ["csv", "png"])
    assert (table, figure.name) == (tmp_path / "drop_times.csv", "drop_times.png")
    assert targets("drop.wav", "times", "hits.csv", ["csv", "png"])[1] == Path("hits.png")


def test_a_file_is_whole_or_stays_as_it_was(tmp_path: Path) -> None:
    file = tmp_path / "new" / "a.html"
    replaced(file, lambda path: path.write_text("first"))

    def fail(path: Path) -> None:
        path.write_text("half")
        raise OSError("the disk is full")

    with pytest.raises(FailedError, match=r"a\.html cannot be written: the disk is full"):
        replaced(file, fail)
    assert file.read_text() == "first"
    assert list(file.parent.iterdir()) == [file]


def test_a_place_where_no_file_can_be_is_named_as_it_was_given(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match=r"^output: got '/proc/x\.html', allowed: .*No such file"):
        replaced(Path("/proc/x.html"), lambda path: path.write_text("never"))
    with pytest.raises(InputError, match=r"^--figure: got '.*/file/x\.png'"):
        replaced(tmp_path / "file" / "x.png", lambda path: path.write_text("never"), "--figure")
