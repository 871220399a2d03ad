"""Headless Chromium of Debian, driven by selenium: no browser is downloaded."""

from __future__ import annotations

import re
import shutil
from importlib.util import find_spec
from pathlib import Path
from typing import Any

FLAGS = (
    "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
    "--disable-background-networking", "--disable-component-update", "--disable-sync",
)  # fmt: skip
_FIND = """
function all(root, out) {
  for (const e of root.querySelectorAll('*')) {
    out.push(e);
    if (e.shadowRoot) all(e.shadowRoot, out)
  }
  return out
}
const found = all(document, []).filter(e => %s);
return found.length ? found[0] : null
"""


def missing() -> str:
    """What is not installed of browser, driver and library; empty: all is there."""
    programs = [name for name in ("chromium", "chromedriver") if shutil.which(name) is None]
    if programs:
        return f"no {' and no '.join(programs)} (apt install chromium chromium-driver)"
    return "" if find_spec("selenium") else "no selenium (pip install selenium)"


def new_browser(
    profile: Path, width: int = 1500, height: int = 1120, flags: tuple[str, ...] = ()
) -> Any:
    """A browser with a profile and further flags of its own; `quit` ends it."""
    from selenium import webdriver
    from selenium.webdriver.chrome.service import Service

    options = webdriver.ChromeOptions()
    options.binary_location = str(shutil.which("chromium"))
    for flag in (*FLAGS, f"--user-data-dir={profile}", f"--window-size={width},{height}", *flags):
        options.add_argument(flag)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    made = webdriver.Chrome(options=options, service=Service(str(shutil.which("chromedriver"))))
    made.set_script_timeout(300.0)
    return made


def button(browser: Any, label: str) -> Any:
    """The button or tab with a label, within the shadow trees that Bokeh makes; None: no such."""
    test = (
        "(e.tagName == 'BUTTON' || ['bk-tab', 'bk-btn'].some(c => e.classList.contains(c)))"
        " && e.textContent.trim() == arguments[0]"
    )
    return browser.execute_script(_FIND % test, label)


def slider_handle(browser: Any, title: str) -> Any:
    """The handle of the slider whose title begins so."""
    test = (
        "e.classList.contains('noUi-handle') && e.getRootNode().querySelector('.bk-slider-title')"
        "?.textContent.startsWith(arguments[0])"
    )
    return browser.execute_script(_FIND % test, title)


def field(browser: Any, title: str) -> Any:
    """The field for a number or a text whose title begins so."""
    test = (
        "e.tagName == 'INPUT' && e.getRootNode().querySelector('label')"
        "?.textContent.startsWith(arguments[0])"
    )
    return browser.execute_script(_FIND % test, title)


def page_text(browser: Any) -> str:
    """All text that is seen on the page."""
    script = """
    function text(root) {
      let out = '';
      root.childNodes.forEach(n => {
        if (n.nodeType == 3) out += n.textContent + ' ';
        else if (n.nodeType == 1 && !['STYLE', 'SCRIPT'].includes(n.tagName)) {
          if (n.shadowRoot) out += text(n.shadowRoot); out += text(n) }
      });
      return out
    }
    return text(document.body)"""
    return str(browser.execute_script(script))


def seconds_shown(browser: Any) -> float:
    """The simulated time that the page shows, s."""
    found = re.search(r"· ([\d.]+) s ·", page_text(browser))
    return float(found[1]) if found else 0.0


def complaints(browser: Any) -> list[str]:
    """The errors in the browser's console."""
    return [
        row["message"]
        for row in browser.get_log("browser")
        if row["level"] == "SEVERE" and "favicon" not in row["message"]
    ]


_CONTRASTS = r"""
const canvas = document.createElement('canvas'), out = [];
canvas.width = canvas.height = 1;
const pen = canvas.getContext('2d', { willReadFrequently: true });
function luminance(colours) {  // as seen: one over the other, then through the page's filter
  pen.filter = 'none';
  for (const colour of ['white', ...colours]) { pen.fillStyle = colour; pen.fillRect(0, 0, 1, 1) }
  pen.filter = getComputedStyle(document.documentElement).filter;
  pen.drawImage(canvas, 0, 0);
  const [r, g, b] = [...pen.getImageData(0, 0, 1, 1).data].map(
    v => v / 255 <= 0.04045 ? v / 3294.6 : ((v / 255 + 0.055) / 1.055) ** 2.4);
  return 0.2126 * r + 0.7152 * g + 0.0722 * b
}
function look(node, under) {
  if (node.nodeType == 3) {
    const at = node.parentElement, style = at && getComputedStyle(at);
    if (!at || !/[\p{L}\p{N}]/u.test(node.textContent) || !at.getClientRects().length) return;
    if (style.visibility == 'hidden' || at.closest('[disabled]')) return;
    const [a, b] = [luminance([...under, style.color]), luminance(under)];
    out.push([(Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05), node.textContent.trim()])
  } else if (node.nodeType == 1 && !['STYLE', 'SCRIPT', 'OPTION'].includes(node.tagName)) {
    under = [...under, getComputedStyle(node).backgroundColor];
    (node.shadowRoot?.childNodes ?? []).forEach(n => look(n, under));
    node.childNodes.forEach(n => look(n, under))
  }
}
look(document.body, []);
return out
"""


def contrasts(browser: Any) -> list[tuple[float, str]]:
    """Contrast with what is below it, by WCAG 2, of each text that is seen and not disabled."""
    return [(ratio, text) for ratio, text in browser.execute_script(_CONTRASTS)]


def prefer(browser: Any, mode: str) -> None:
    """Let the browser wish light or dark pages."""
    wish = {"features": [{"name": "prefers-color-scheme", "value": mode}]}
    browser.execute_cdp_cmd("Emulation.setEmulatedMedia", wish)


_AXE = """
const done = arguments[0], grave = ['serious', 'critical'];
axe.run(document, { resultTypes: ['violations'] }).then(found => done(
  found.violations.filter(one => grave.includes(one.impact)).flatMap(
    one => one.nodes.map(node => [one.id, node.html.slice(0, 200), node.failureSummary]))))
"""


def violations(browser: Any, axe: Path) -> list[tuple[str, str, str]]:
    """What axe-core, a file, calls serious or critical on the page: rule, element, what to do."""
    browser.execute_script(axe.read_text("utf-8"))
    return [tuple(row) for row in browser.execute_async_script(_AXE)]


def focused(browser: Any) -> tuple[str, float]:
    """What has the focus, and the width of the line around it in pixels.

    The text of a button or tab, the title of a slider or field; empty: something else.
    """
    script = """
    let e = document.activeElement;
    while (e.shadowRoot?.activeElement) e = e.shadowRoot.activeElement;
    const title = e.getRootNode().querySelector?.('.bk-slider-title, label');
    const style = getComputedStyle(e);
    const width = style.outlineStyle == 'none' ? 0 : parseFloat(style.outlineWidth);
    return [(title ?? e).textContent.trim(), width]"""
    text, width = browser.execute_script(script)
    return text, width


_BOXES = """
const out = [], kinds = '.bk-btn, .bk-tab, .bk-input, .bk-slider-title';
function look(root) {
  for (const e of root.querySelectorAll('*')) {
    const box = e.getBoundingClientRect();
    if (box.width && getComputedStyle(e).visibility != 'hidden' && %s)
      out.push([e.textContent, box.left, box.top, box.right, box.bottom]);
    if (e.shadowRoot) look(e.shadowRoot)
  }
}
look(document);
return out
"""


def boxes(browser: Any) -> list[tuple[str, float, float, float, float]]:
    """Text, left, top, right and bottom of each control that is seen, pixels."""
    return [tuple(row) for row in browser.execute_script(_BOXES % "e.matches(kinds)")]


def widest(browser: Any) -> float:
    """How far to the right the page goes, pixels; what a figure cuts at its frame is left out."""
    drawn = "!e.closest('.bk-GlyphRenderer')"
    return max(row[3] for row in browser.execute_script(_BOXES % drawn))
