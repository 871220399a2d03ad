"""The example with MuJoCo runs, and a contact of ten short steps is nearer to the law."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from bouncing_disk_ros import compare_with_case

pytestmark = pytest.mark.interop


def test_mujoco_comes_near_the_law_with_short_contacts(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("mujoco")
    examples = str(Path(__file__).resolve().parents[2] / "examples")
    monkeypatch.syspath_prepend(examples)
    monkeypatch.setattr(sys, "argv", ["case_by_mujoco.py"])
    import case_by_mujoco

    soft = compare_with_case("drop", case_by_mujoco.samples(2e-3, 0.0))
    hard = compare_with_case("drop", case_by_mujoco.samples(1e-5, 1e-4))
    assert not soft.is_within
    assert abs(hard.matches[0].errors["time"]) < abs(soft.matches[0].errors["time"])
    assert any(line.startswith("restitution: 0.7") for line in hard.lines), "\n".join(hard.lines)
