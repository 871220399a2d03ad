"""The workbench for ten minutes: a page that draws, one that hangs, pages that come and go."""

from __future__ import annotations

import os
import time

import psutil
import pytest

from support.page_client import PageClient
from support.processes import Starter

MINUTES = float(os.environ.get("WORKBENCH_MINUTES", "10"))
GROWTH_MB = 20.0
"""What the workbench's own process may grow by after its first minute."""


@pytest.mark.soak
@pytest.mark.timeout(3600)
def test_memory_stays(start: Starter, capsys: pytest.CaptureFixture[str]) -> None:
    workbench = start("workbench", "--ros-args", "-p", "port:=0", "-p", "open_browser:=false")
    url = workbench.wait_for(r"(http://\S+)$", 60.0)[1]
    process = psutil.Process(workbench.pid)
    page, hanging = PageClient(url), PageClient(url, acknowledges=False)  # one reads nothing
    page.wait(lambda: page.frames > 10, 60.0)

    def size() -> float:
        return float(process.memory_info().rss) / 1e6

    def wait(seconds: float) -> None:
        end = time.monotonic() + seconds
        page.wait(lambda: time.monotonic() > end, 2.0 * seconds + 10.0)

    for _ in range(20):  # what is built once
        PageClient(url).close()
    wait(60.0)
    begun, frames, sizes = time.monotonic(), page.frames, [size()]
    while time.monotonic() - begun < 60.0 * MINUTES:
        PageClient(url).close()
        wait(10.0)
        sizes.append(size())
    with capsys.disabled():
        rate = (page.frames - frames) / (time.monotonic() - begun)
        print(f"\nworkbench: {sizes[0]:.1f} → {sizes[-1]:.1f} MB in {MINUTES:g} min, "
              f"{rate:.1f} frames/s")  # fmt: skip
    assert sizes[-1] - sizes[0] <= GROWTH_MB
    hanging.close()
    page.close()
    assert workbench.end() == 0
