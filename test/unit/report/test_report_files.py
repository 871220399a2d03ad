"""Where the files of a report go, and that nothing of others is overwritten."""

from __future__ import annotations

import errno
from pathlib import Path

import pytest

from bouncing_disk_ros.bag import Writer, recover
from bouncing_disk_ros.errors import FailedError, InputError
from bouncing_disk_ros.regular_file import replaced
from bouncing_disk_ros.report.report_files import (
    PRESET_MARK,
    TABLE_MARK,
    check_ours,
    mark_of,
    targets,
)
from bouncing_disk_ros.study import named, run


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
    assert targets("drop.wav", "times", "hits.csv", ["csv", "png"])[1] == Path("hits.png")
    (tmp_path / "drop.v2.csv").write_text("")
    assert targets("drop.v2.csv", "fit", ".", ["yaml"]) == [Path("drop.v2_fit.yaml")]


def test_files_of_others_are_left_alone(tmp_path: Path) -> None:
    """The preset of a fit replaced any file of its name, and so did a table of hits."""
    for content in (PRESET_MARK, TABLE_MARK, f"<meta {mark_of('fit_impacts')}>"):
        (tmp_path / "ours").write_text(content)
        check_ours([tmp_path / "ours"], "fit_impacts")
    page, figure = tmp_path / "drop_fit.html", tmp_path / "drop_fit.png"  # of version 0.3.0
    figure.write_text(mark_of("bag_report"))
    about = f"<meta {mark_of('bag_report')}> Made by {{}} of bouncing_disk_ros"
    page.write_text(about.format("bag_report"))
    with pytest.raises(InputError, match=r"drop_fit\.html"):
        check_ours([page, figure], "fit_impacts")
    page.write_text(about.format("fit_impacts"))
    check_ours([page, figure], "fit_impacts")
    (tmp_path / "theirs.yaml").write_text("/**: {ros__parameters: {mass: 1.0}}")
    with pytest.raises(InputError, match=r"theirs\.yaml.*one that fit_impacts has made"):
        check_ours([tmp_path / "theirs.yaml"], "fit_impacts")


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EDQUOT, errno.EFBIG])
def test_a_disk_that_is_full_from_the_first_byte_is_no_bad_input(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, number: int
) -> None:
    """The exit code was 2."""

    def full(*_: object, **__: object) -> None:
        raise OSError(number, "no room")

    monkeypatch.setattr(Path, "mkdir", full)
    study = named("basins", axial_forcing=0.34, width=24, height=24)
    (tmp_path / "cut.mcap").touch()
    for make in (
        lambda: replaced(tmp_path / "new" / "a.html", lambda path: path.write_text("never")),
        lambda: Writer(tmp_path / "run_1"),
        lambda: recover(tmp_path / "cut.mcap"),
        lambda: run(study, tmp_path / "result.zarr"),
    ):
        with pytest.raises(FailedError, match=r"cannot be written: no room"):
            make()


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
