"""The workbench's page: time to it, frames a second, and what it costs the simulator beside it."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import psutil

from bench.table import Aim, Row, row
from support import browser as chromium
from support.page_client import PageClient
from support.processes import Process, Starter, wait_until
from support.ros_peer import Peer

STARTS, SECONDS = 3, 10.0
OPTIONS = ("--ros-args", "-p", "port:=0", "-p", "open_browser:=false")
_COUNT = """
const range = Bokeh.documents[0].get_model_by_name('shown_time');
window.drawn = 0;
range.change.connect(() => { window.drawn += 1 })"""
"""Counts in the browser how often the axis of time has moved: once for each frame drawn."""


def measure(start: Starter, folder: Path) -> list[Row]:
    """All rows; a browser's where there is one."""
    times = [_time_to_page(start) for _ in range(STARTS)]
    rows = [row("workbench", "start to the page", "s", times)]
    workbench = start("workbench", *OPTIONS)
    url = workbench.wait_for(r"(http://\S+)$", 60.0)[1]
    page, peer = PageClient(url), Peer()
    try:
        page.wait(lambda: page.frames > 10, 60.0)
        rows += _with_pages(workbench, page, peer)
        if not chromium.missing():
            rows.append(_drawn(url, folder))
    finally:
        page.close()
        peer.close()
        workbench.end()
    return rows


def _time_to_page(start: Starter) -> float:
    """Seconds from the start of the process to a page with its document."""
    begun = time.monotonic()
    process = start("workbench", *OPTIONS, "-p", "start_simulator:=false")
    page = PageClient(process.wait_for(r"(http://\S+)$", 60.0)[1])
    passed = time.monotonic() - begun
    page.close()
    process.end()
    return passed


def _with_pages(workbench: Process, page: PageClient, peer: Peer) -> list[Row]:
    """Frames acknowledged a second, processor time, lateness of the simulator's ticks."""
    process = psutil.Process(workbench.pid)
    late, rates, loads = [], [], []
    for _ in range(3):
        frames, used, begun = page.frames, process.cpu_times(), time.monotonic()
        end = begun + SECONDS
        page.wait(lambda: time.monotonic() > end, 2.0 * SECONDS)  # noqa: B023 (called at once)
        passed, now = time.monotonic() - begun, process.cpu_times()
        rates.append((page.frames - frames) / passed)
        loads.append(100.0 * (now.user + now.system - used.user - used.system) / passed)
        peer.next_diagnostics()
        late.append(1e3 * float(peer.diagnostic("real time")[2]["lateness p99 (s)"]))
    return [
        row("workbench", "frames sent to a page that acknowledges", "1/s", rates),
        row("workbench", "processor time with one page", "% of a core", loads),
        row("workbench", "simulator beside it: lateness p99", "ms", late),
    ]


def _drawn(url: str, folder: Path) -> Row:
    """Frames that Chromium has drawn a second, headless and without a graphics processor."""
    browser: Any = chromium.new_browser(folder / "profile")
    try:
        browser.get(url)
        wait_until(lambda: "impacts" in chromium.page_text(browser))
        browser.execute_script(_COUNT)
        rates = []
        for _ in range(3):
            before, begun = browser.execute_script("return window.drawn"), time.monotonic()
            while time.monotonic() - begun < SECONDS:
                time.sleep(0.1)
            passed = time.monotonic() - begun
            rates.append((browser.execute_script("return window.drawn") - before) / passed)
    finally:
        browser.quit()
    return row("workbench", "frames drawn by headless Chromium", "1/s", rates, Aim(at_least=15.0))
