"""Make docs/figures/workbench.gif: the workbench's page in headless Chromium, over a real run.

    .venv/bin/python tools/workbench_animation.py [FILE]

Needs Debian's chromium and chromium-driver, and selenium (the extra `interop`). The run is the
scene of the first toss: from rest, one helical toss, then period 1.
"""

from __future__ import annotations

import base64
import io
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from PIL import Image

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "test"))
WIDTH, HEIGHT, SHOWN_HEIGHT = 1500, 1000, 785
SHOWN_WIDTH = 960
SECONDS, FRAMES_A_SECOND = 6.5, 10.0
"""Of simulated time: the animation runs in real time."""
SLOWER = 0.1
"""The run is slower while it is recorded: a picture takes some tenths of a second."""
COLOURS = 128
_START = """
from bouncing_disk_ros.workbench import run_pane
run_pane.PATH_SECONDS, run_pane.SPEED_SECONDS = 40.0, 300.0  # as long as in real time
from bouncing_disk_ros.workbench.workbench import main
raise SystemExit(main())
"""


def main() -> None:
    """Record the page and write the animation."""
    file = Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "docs/figures/workbench.gif"
    command = [sys.executable, "-c", _START, "--ros-args"]
    options = ["-p", "port:=0", "-p", "open_browser:=false"]
    process = subprocess.Popen([*command, *options], stdout=subprocess.PIPE, text=True, cwd=ROOT)
    try:
        assert process.stdout is not None
        found = re.search(r"http://\S+", process.stdout.readline())
        assert found is not None, "the workbench has not begun"
        with tempfile.TemporaryDirectory() as profile:
            pictures = recorded(found[0], Path(profile))
    finally:
        process.terminate()
        process.wait()
    write(pictures, file)
    print(f"written: {file}, {file.stat().st_size / 1e6:.2f} MB, {len(pictures)} frames")


def recorded(url: str, profile: Path) -> list[Image.Image]:
    """Pictures of the page, evenly in simulated time."""
    from support.browser import button, new_browser, page_text, seconds_shown
    from support.processes import wait_until

    browser = new_browser(profile, WIDTH, HEIGHT)
    try:
        browser.get(url)
        wait_until(lambda: re.search(r"[1-9]\d* impacts", page_text(browser)))
        button(browser, "First toss").click()
        wait_until(lambda: seconds_shown(browser) > 1.0 and "sticking" in page_text(browser))
        button(browser, f"×{SLOWER:g}").click()
        pictures: list[Image.Image] = []
        wait_until(lambda: "· flight ·" in page_text(browser))
        begun = time.monotonic()
        while (passed := time.monotonic() - begun) < SECONDS / SLOWER:
            wanted = len(pictures) / (FRAMES_A_SECOND * SLOWER)
            if passed < wanted:
                time.sleep(wanted - passed)
            pictures.append(picture(browser))
        return pictures
    finally:
        browser.quit()


def picture(browser: Any) -> Image.Image:
    """What the page looks like now, in the size of the animation."""
    shot = browser.execute_cdp_cmd("Page.captureScreenshot", {"format": "png"})
    whole = Image.open(io.BytesIO(base64.b64decode(shot["data"]))).convert("RGB")
    image = whole.crop((0, 0, whole.width - 15, SHOWN_HEIGHT))  # no scroll bar
    size = (SHOWN_WIDTH, round(image.height * SHOWN_WIDTH / image.width))
    return image.resize(size, Image.Resampling.LANCZOS)


def write(pictures: list[Image.Image], file: Path) -> None:
    """Write the pictures with one palette, so that what stands still costs nothing."""
    palette = pictures[-1].quantize(COLOURS, dither=Image.Dither.NONE)
    frames = [one.quantize(palette=palette, dither=Image.Dither.NONE) for one in pictures]
    frames[0].save(
        file, save_all=True, append_images=frames[1:], duration=round(1e3 / FRAMES_A_SECOND),
        loop=0, optimize=True, disposal=1,
    )  # fmt: skip


if __name__ == "__main__":
    main()
