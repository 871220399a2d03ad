"""Which topics the recorder's parameters choose."""

from __future__ import annotations

from pathlib import Path

import pytest

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.nodes.recorder.recorder_options import (
    OPTIONS,
    Selection,
    preset_files,
    writer_options,
)
from bouncing_disk_ros.parameters import Value


def values(**given: Value) -> dict[str, Value]:
    return {name: spec.checked(given.get(name, spec.default)) for name, spec in OPTIONS.items()}


def selection(**given: Value) -> Selection:
    return Selection(values(**given), lambda name: name if name[0] == "/" else f"/one/{name}")


def test_the_package_s_own_topics_by_default_and_commands_when_asked_for() -> None:
    """A sender that waits for one listener must not find the recorder instead of the simulator."""
    chosen = selection()
    wanted = {"/one/disk/impacts": True, "/diagnostics": True, "/disk/impacts": False,
              "/one/platform/command": False, "/one/disk/impulse": False}  # fmt: skip
    assert {name: chosen.wants(name) for name in wanted} == wanted
    assert chosen.known["/one/disk/inputs"].name == "disk/inputs"
    for asked in (selection(topics="platform/command"), selection(all=True)):
        assert asked.wants("/one/platform/command")


def test_names_regular_expressions_and_exclusions() -> None:
    chosen = selection(topics="joint_states, /scan  camera", regex="/arm/.*", exclude=".*/raw")
    assert [name for name in ("/one/joint_states", "/scan", "/one/camera", "/arm/x", "/arm/x/raw",
                              "/one/disk/impacts", "/my/arm/x") if chosen.wants(name)] == [
        "/one/joint_states", "/scan", "/one/camera", "/arm/x"]  # fmt: skip


def test_lists_are_arrays_or_one_text(tmp_path: Path) -> None:
    for given in (["/a", "/b"], ("/a", "/b"), "/a /b", "/a,/b"):
        values_ = {name: spec.checked(spec.default) for name, spec in OPTIONS.items()}
        values_["topics"] = OPTIONS["topics"].checked(given)
        assert Selection(values_, str).named == ["/a", "/b"]
    with_blanks = str(tmp_path / "my preset.yaml")
    values_["presets"] = OPTIONS["presets"].checked([with_blanks])
    assert preset_files(values_) == [Path(with_blanks)]
    assert OPTIONS["topics"].checked([""]) == ""  # as an empty list is declared
    with pytest.raises(InputError, match="It is a string array, not a list"):
        OPTIONS["topics"].checked([1, 2])


def test_all_but_hidden_ones() -> None:
    chosen = selection(all=True, exclude="/rosout")
    assert chosen.wants("/anything/at/all")
    assert not chosen.wants("/rosout")
    assert chosen.wants("/rosout_agg")  # the whole name must match
    assert not chosen.wants("/fibonacci/_action/status")
    assert selection(all=True, topics="/a/_b").wants("/a/_b")


def test_sizes_are_in_megabytes() -> None:
    options = writer_options(values(max_size=1.5, compression="lz4"))
    assert (options.max_size, options.compression) == (1_500_000, "lz4")
