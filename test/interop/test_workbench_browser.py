"""The workbench's page in a real browser: Debian's Chromium, headless, driven by a script."""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Iterator
from itertools import combinations
from pathlib import Path
from typing import Any

import psutil
import pytest

from bouncing_disk_ros.workbench.scene_table import SCENES
from support import browser as chromium
from support import without_ros as ros_hidden
from support.npm import install
from support.processes import Process, Starter, wait_until

pytestmark = pytest.mark.interop
SHOTS = os.environ.get("SCREENSHOTS", "")
"""A folder for pictures of the page, to be looked at; empty: none are kept."""
OPTIONS = ("--ros-args", "-p", "port:=0", "-p", "open_browser:=false")
WITHOUT_ROS = Path(ros_hidden.__file__)
CONTROLS = (
    "Rest and chatter", "First toss", "Resume", "Step", "Reset", "Strobe", "×0.5", "forcing Γ", "Γ",
    "f (Hz)", "Φ", "θ", "axial N·s", "angular N·m·s", "Give impulse", "deadbeat", "Juggle", "ε",
    "μ", "P preload", "load torque", "brake torque", "load inertia", "any parameter", "value",
    "Set", "The run", "Basins", "Bifurcation",
)  # fmt: skip
"""How texts and titles of what must be reached by Tab begin."""
SEEN = {
    "The run": r"side view to scale", "Basins": r"512 × 512 starts in",
    "Bifurcation": r"values of Γ.* in \d",
}  # fmt: skip
"""The tabs, with what they say once all is there."""
CAPTURED = r"captured after \d+ impacts?"


@pytest.fixture
def browser(tmp_path: Path, start: Starter) -> Iterator[Any]:
    """A browser, which ends before servers do; the test fails for an error in its console."""
    del start
    if why := chromium.missing():
        pytest.skip(why)
    pytest.importorskip("selenium")
    made = chromium.new_browser(tmp_path / "profile")
    yield made
    complaints = chromium.complaints(made)
    made.quit()
    assert complaints == []


@pytest.fixture
def workbench(start: Starter) -> Process:
    return start("workbench", *OPTIONS)


def hidden_ros(start: Starter) -> Process:
    """A page whose process finds no ROS."""
    tests = WITHOUT_ROS.parents[1]
    path = {"PYTHONPATH": f"{tests.parent}:{tests}"}
    return start.command([sys.executable, str(WITHOUT_ROS), "workbench", *OPTIONS], env=path)


@pytest.fixture
def without_ros(start: Starter) -> Process:
    return hidden_ros(start)


def wait_for_text(browser: Any, pattern: str) -> None:
    wait_until(lambda: re.search(pattern, chromium.page_text(browser)))


def look(browser: Any, name: str) -> None:
    """Keep a picture, where asked for."""
    if SHOTS:
        Path(SHOTS).mkdir(parents=True, exist_ok=True)
        browser.save_screenshot(str(Path(SHOTS, f"{name}.png")))


def test_the_page_fits_the_screen(browser: Any, without_ros: Process) -> None:
    """Nothing lies beside it or on another control; on a screen all controls are seen at once.

    Also in a scene, whose text goes above them: in the one with the longest text.
    """
    scene = max(SCENES.values(), key=lambda one: len(one.text + one.find))
    width = 0

    def fits() -> bool:
        return chromium.widest(browser) <= width

    browser.get(without_ros.wait_for(r"(http://\S+)$", 60.0)[1])
    wait_until(lambda: chromium.seconds_shown(browser) > 1.0)
    chromium.button(browser, scene.title).click()
    wait_until(lambda: scene.find in chromium.page_text(browser))
    for tab, done in SEEN.items():
        chromium.button(browser, tab).click()
        wait_for_text(browser, done)
        for width, height in ((390, 844), (1366, 768), (1920, 1080)):
            screen = {"width": width, "height": height, "deviceScaleFactor": 1}
            mobile = {"mobile": width < 700}
            browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", {**screen, **mobile})
            wait_until(fits, timeout=10.0)
            boxes = chromium.boxes(browser)
            assert len(boxes) > len(CONTROLS)
            for (name, *one), (other, *two) in combinations(boxes, 2):
                across, down = (min(one[k + 2], two[k + 2]) - max(one[k], two[k]) for k in (0, 1))
                assert min(across, down) <= 1.5, f"{name} and {other} on {width} pixels, {tab}"
            lowest = max(box[4] for box in boxes)
            assert width < 700 or lowest <= height, f"{tab} on {width} × {height}"
            look(browser, f"{tab}_{width}")


def test_the_page_takes_keys_and_can_be_read(browser: Any, without_ros: Process) -> None:
    """By Tab, arrows and Enter, with the focus seen. Contrast as of WCAG 2 AA: 4.5 : 1."""
    from selenium.webdriver.common.action_chains import ActionChains
    from selenium.webdriver.common.keys import Keys

    def press(key: str) -> tuple[str, float]:
        ActionChains(browser).send_keys(key).perform()
        return chromium.focused(browser)

    def is_readable() -> bool:
        faint = []
        for mode in ("dark", "light"):
            chromium.prefer(browser, mode)
            faint += [(mode, one) for one in chromium.contrasts(browser) if one[0] < 4.5]
        assert faint == []
        return len(chromium.contrasts(browser)) > 50

    browser.get(without_ros.wait_for(r"(http://\S+)$", 60.0)[1])
    wait_until(lambda: chromium.seconds_shown(browser) > 1.0)
    chromium.button(browser, "Pause").send_keys(Keys.SPACE)
    wait_until(lambda: chromium.button(browser, "Resume"))
    stops = [press(Keys.TAB)]
    while (stop := press(Keys.TAB)) != stops[0]:
        stops.append(stop)
    controls = dict(stop for stop in stops if any(map(stop[0].startswith, CONTROLS)))
    assert len(controls) == len(CONTROLS)
    assert min(controls.values()) >= 2.0, "the line around what has the focus, pixels"

    chromium.button(browser, "Resume").send_keys(Keys.ENTER)
    chromium.field(browser, "value").send_keys("much")
    chromium.button(browser, "Set").send_keys(Keys.ENTER)
    wait_for_text(browser, r"gravity: got 'much'")
    chromium.button(browser, "Juggle").send_keys(Keys.SPACE)
    wait_for_text(browser, CAPTURED)
    assert is_readable()
    chromium.button(browser, "The run").send_keys(Keys.ARROW_RIGHT)
    wait_for_text(browser, r"512 × 512 starts in")
    assert is_readable()
    assert press(Keys.ARROW_RIGHT)[0] == "Bifurcation"
    wait_for_text(browser, r"values of Γ.* in \d")
    assert is_readable()


@pytest.mark.timeout(600)
def test_axe_finds_nothing_serious_on_the_page(
    browser: Any, without_ros: Process, tmp_path: Path
) -> None:
    """By its rules for names, roles, contrast and keys: each tab, light and dark."""
    install(Path(__file__).with_name("package.json"), tmp_path)
    axe = tmp_path / "node_modules" / "axe-core" / "axe.min.js"
    browser.get(without_ros.wait_for(r"(http://\S+)$", 60.0)[1])
    wait_until(lambda: chromium.button(browser, "Pause"))
    chromium.button(browser, "Pause").click()
    wait_until(lambda: chromium.button(browser, "Resume"))
    for tab, done in SEEN.items():
        chromium.button(browser, tab).click()
        wait_for_text(browser, done)
        for mode in ("light", "dark"):
            chromium.prefer(browser, mode)
            assert chromium.violations(browser, axe) == [], f"{tab}, {mode}"


def test_the_page_lives_and_commands(browser: Any, workbench: Process) -> None:
    from selenium.webdriver.common.keys import Keys

    url = workbench.wait_for(r"(http://\S+)$", 60.0)[1]
    browser.get(url)
    assert browser.title == "Bouncing disk workbench"
    wait_until(lambda: chromium.seconds_shown(browser) > 1.0)
    look(browser, "run")

    chromium.slider_handle(browser, "ε restitution").send_keys(Keys.ARROW_LEFT)
    wait_until(lambda: "ros2 param set /bouncing_disk restitution" in chromium.page_text(browser))
    chromium.slider_handle(browser, "Φ").send_keys(Keys.HOME)
    wait_until(lambda: "platform/angular_amplitude" in chromium.page_text(browser))
    chromium.field(browser, "axial N·s").send_keys(Keys.CONTROL, "a", Keys.DELETE, Keys.TAB)
    chromium.button(browser, "Give impulse").click()
    wait_for_text(browser, r"\d\d:\d\d:\d\d impulse: got 'no number'")

    for name, says in (
        ("Chaos", r"Γ:\s+0\.560"),
        ("Motor under load", "strobed slow motion: 400 periods of 40 kHz"),
    ):
        chromium.button(browser, name).click()
        wait_for_text(browser, says)
        look(browser, name.replace(" ", "_"))
    chromium.button(browser, "Show the number").click()
    wait_until(lambda: "It is 11.15 mN·m." in chromium.page_text(browser))
    chromium.button(browser, "Pause").click()
    wait_until(lambda: chromium.button(browser, "Resume") is not None)
    look(browser, "paused")

    chromium.button(browser, "Period 1").click()
    wait_for_text(browser, r"Γ:\s+0\.450")
    for name, done in SEEN.items():
        chromium.button(browser, name).click()
        wait_for_text(browser, done)
        look(browser, name)

    wait_until(lambda: "tab=Bifurcation" in browser.current_url)
    assert "token" not in browser.current_url
    before = chromium.seconds_shown(browser)
    browser.refresh()
    wait_for_text(browser, r"values of Γ.* in \d")
    assert chromium.seconds_shown(browser) > before, "the run goes on"
    assert "Traceback" not in workbench.output


@pytest.mark.parametrize("ros", [True, False], ids=["with ROS", "without ROS"])
def test_a_loop_is_started_disturbed_and_stopped(browser: Any, start: Starter, ros: bool) -> None:
    """It brings the disk back from an impulse, and from rest; the process ends with Stop."""
    workbench = start("workbench", *OPTIONS) if ros else hidden_ros(start)
    browser.get(workbench.wait_for(r"(http://\S+)$", 60.0)[1])
    wait_until(lambda: chromium.seconds_shown(browser) > 1.0)
    chromium.button(browser, "Juggle").click()
    wait_for_text(browser, CAPTURED)
    chromium.button(browser, "Give impulse").click()
    wait_for_text(browser, r"\blost\b")
    look(browser, "juggling_lost")
    wait_for_text(browser, CAPTURED)
    look(browser, "juggling")
    chromium.button(browser, "Rest and chatter").click()
    wait_until(lambda: not re.search(CAPTURED, chromium.page_text(browser)))
    assert children(workbench, "juggle") == 0, "a scene is another run"
    chromium.button(browser, "Period 1").click()
    wait_for_text(browser, r"Γ:\s+0\.450")
    chromium.button(browser, "Juggle").click()
    wait_for_text(browser, CAPTURED)
    chromium.button(browser, "impact times").click()
    wait_until(lambda: "-p strategy:=impact_time -p" in chromium.page_text(browser))
    wait_for_text(browser, CAPTURED)
    assert children(workbench, "juggle") == (1 if ros else 0)
    chromium.button(browser, "Stop").click()
    wait_until(lambda: chromium.button(browser, "Juggle") is not None)
    assert children(workbench, "juggle") == 0


def children(process: Process, name: str) -> int:
    """How many processes a process has started with this name of an executable."""
    found = psutil.Process(process.pid).children(recursive=True)
    return sum(name in child.cmdline() for child in found)


def test_a_browser_acknowledges_what_it_draws(browser: Any, workbench: Process) -> None:
    """Frames go on for as long as the page is seen: without that the flow would stop at once."""
    url = workbench.wait_for(r"(http://\S+)$", 60.0)[1]
    browser.get(url)
    wait_until(lambda: "tab=The+run" in browser.current_url)  # nothing has changed since it opened
    assert "token" not in browser.current_url
    wait_until(lambda: chromium.seconds_shown(browser) > 1.0)
    script = "return Bokeh.documents[0].get_model_by_name('path').data.time.at(-1)"
    first = float(browser.execute_script(script))
    wait_until(lambda: float(browser.execute_script(script)) > first + 3.0)
    assert abs(float(browser.execute_script(script)) - chromium.seconds_shown(browser)) < 1.0


def test_pages_from_elsewhere_get_nothing(tmp_path: Path, workbench: Process) -> None:
    """A foreign name that is pointed to this machine, a frame, the address without its token."""
    if why := chromium.missing():
        pytest.skip(why)
    url = workbench.wait_for(r"(http://\S+)$", 60.0)[1]
    base, _, token = url.partition("?")
    browser = chromium.new_browser(
        tmp_path / "profile", flags=("--host-resolver-rules=MAP elsewhere.example 127.0.0.1",)
    )
    try:
        for address in (base, url.replace("localhost", "elsewhere.example")):
            browser.get(address)
            assert browser.title != "Bouncing disk workbench"
            assert "bokeh" not in browser.page_source.lower()
        frame = tmp_path / "frame.html"
        frame.write_text(f"<title>a frame</title><iframe id='inner' src='{base}?{token}'></iframe>")
        browser.get(frame.as_uri())
        browser.switch_to.frame("inner")
        assert "bokeh" not in browser.page_source.lower()
        browser.switch_to.default_content()
        browser.get(url)
        assert browser.title == "Bouncing disk workbench"
        wait_until(lambda: chromium.seconds_shown(browser) > 0.0)
    finally:
        browser.quit()
