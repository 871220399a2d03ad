"""What the tools that read bags share: however they end, the exit code is theirs."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

_INTERRUPTED = """
import sys
from bouncing_disk_ros.ros.bag_tool import run_bag_tool
sys.exit(run_bag_tool("it", "bag", lambda: exec("raise KeyboardInterrupt")))
"""


def test_an_interrupt_within_generated_code_ends_with_130(tmp_path: Path) -> None:
    """Not by SIGINT, as CPython would end a process of `python -m` after it."""
    (tmp_path / "interrupted_tool.py").write_text(_INTERRUPTED)
    paths = [str(tmp_path), os.environ.get("PYTHONPATH", "")]
    done = subprocess.run(
        [sys.executable, "-m", "interrupted_tool"], capture_output=True, text=True, timeout=60,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, paths))},
    )  # fmt: skip
    assert (done.returncode, done.stderr) == (130, "it: interrupted\n")
