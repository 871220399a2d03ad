"""Places on a disk as the package looks for them: a prefix, the private temporary folder."""

from __future__ import annotations

import os
from pathlib import Path

INDEX = Path("share/ament_index/resource_index")


def private(tmp_path: Path) -> Path:
    return tmp_path / "tmp" / f"bouncing_disk_ros-{os.getuid()}"


def installed(prefix: Path, *resources: str) -> Path:
    for resource in resources:
        file = prefix / INDEX / resource
        file.parent.mkdir(parents=True, exist_ok=True)
        file.touch()
    return prefix
