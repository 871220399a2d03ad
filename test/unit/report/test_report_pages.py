"""The pages of a report: all parts are there, the HTML needs no network, files know their own."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from base64 import b64decode
from html import unescape
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from bouncing_disk_ros.matplotlib_figures import new_figure
from bouncing_disk_ros.report.panel import Panel, series
from bouncing_disk_ros.report.panel_page import save_page
from bouncing_disk_ros.report.read_run import WANTED
from bouncing_disk_ros.report.report_files import mark_of
from bouncing_disk_ros.report.report_html import MOST_POINTS, report_html
from bouncing_disk_ros.report.report_panels import panels, report_page
from bouncing_disk_ros.report.run_record import UNKNOWN_DISK, RecordSource, RunRecord
from bouncing_disk_ros.report.run_report import Report, report_of
from support import pinned_results
from support.figure_boxes import flaws
from support.recorded import period_one_bag

PANELS = (
    "Rotor speed", "Forcing phase of the impacts", "Next-collision section", "Return map",
    "Energy ledger", "Real time: lateness of the simulator's ticks",
    "Height, last 6 periods",
)  # fmt: skip
TABLES = (
    "Segments of steady motion", "Recording", "Segment 1", "Orbit", "Rotor speed",
    "Estimates from the impacts (95 % intervals)", "Energy", "Real time and loss",
)  # fmt: skip
#: of each plot, so many dots of its canvas are coloured; written into the page when it is drawn
COUNT = """<script>
const all = e => [...e.querySelectorAll("*")].flatMap(
    one => [one, ...(one.shadowRoot ? all(one.shadowRoot) : [])]);
const coloured = canvas => {
  const data = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data;
  let count = 0;
  for (let i = 0; i < data.length; i += 4)
    count += data[i + 3] > 0 && Math.max(...data.slice(i, i + 3)) -
      Math.min(...data.slice(i, i + 3)) > 90;
  return count };
setTimeout(() => { document.body.dataset.drawn = JSON.stringify(
    [...document.querySelectorAll(".plot")].map(plot => all(plot)
      .filter(e => e.tagName == "CANVAS").reduce((sum, one) => sum + coloured(one), 0)))
  }, 10000);
</script></body>"""
MARK = mark_of("bag_report")
FETCHES = re.compile(
    r"<(script|link|iframe|object|embed|img)\b|@import|url\("
    r"|\s(src|href|srcset|data|poster|action|background)="
)
BROWSERS = ("chromium", "chromium-browser", "google-chrome")


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory) -> Report:
    folder = tmp_path_factory.mktemp("bags") / "run & <1> $5$"
    return pinned_results.report(period_one_bag(folder))


def outside(text: str) -> str:
    """A page without what its scripts hold: texts of every kind."""
    return re.sub("<script>.*?</script>", "", text, flags=re.DOTALL)


def test_the_page_has_every_part_with_its_numbers_and_fetches_nothing(report: Report) -> None:
    text = report_html(report)
    page = outside(text)
    headings = map(unescape, re.findall("<h[12]>(.*?)</h[12]>", page))
    assert list(headings) == ["run & <1> $5$", *PANELS, *TABLES]
    assert "<title>run &amp; &lt;1&gt; $5$: report</title>" in text
    assert FETCHES.search(page) is None
    assert 1_000_000 < len(text) < 2_000_000, "BokehJS is part of it, and little else"
    assert f'<meta name="generator" content="{MARK}">' in page
    places = [f"plot_{place}" for place in range(len(PANELS))]
    assert re.findall('<div id="(.*?)" class="plot">', page) == places
    assert "period-1" in page
    assert "in force 0.5" in page
    assert report_html(report) == text, "no dates, no random names"
    items = re.findall(r"draw\(\"plot_\d+\", (.*)\)</script>", text)
    for given, panel in zip(map(json.loads, items), panels(report, MOST_POINTS), strict=True):
        assert given["labels"] == [panel.x_label, panel.y_label]
        for one, part in zip(given["series"], panel.series, strict=True):
            for name, values in (("x", part.x), ("y", part.y)):
                stored = np.frombuffer(b64decode(one[name]))
                assert np.array_equal(stored, values, equal_nan=True)


def test_no_name_ends_a_script(report: Report, monkeypatch: pytest.MonkeyPatch) -> None:
    name = "</script><p>"
    drawn = Panel("one", "x", "y", [series(name, [1.0, 2.0], [3.0, 4.0])])
    monkeypatch.setattr("bouncing_disk_ros.report.report_html.panels", lambda *_: [drawn])
    text = report_html(report)
    assert name not in text
    assert name.replace("</", "<\\/") in text


def test_a_report_on_nothing_says_what_is_absent() -> None:
    source = RecordSource("empty", missing=(*WANTED, "/diagnostics"))
    nothing = report_of(RunRecord(UNKNOWN_DISK), source)
    page = outside(report_html(nothing))
    assert 'class="plot"' not in page
    assert page.count("not in this bag") >= len(PANELS)
    report_page(nothing).draw_without_rendering()


def test_figures_are_marked_as_ours(tmp_path: Path) -> None:
    for kind in ("png", "svg", "pdf"):
        save_page(new_figure(2.0, 1.0), tmp_path / f"page.{kind}", "fit_impacts")
        assert mark_of("fit_impacts").encode() in (tmp_path / f"page.{kind}").read_bytes(), kind


def test_axes_have_symbol_and_unit_and_no_legend_covers_a_curve(report: Report) -> None:
    figure = report_page(report)
    assert flaws(figure) == []
    labels = {label for axes in figure.axes for label in (axes.get_xlabel(), axes.get_ylabel())}
    assert labels == {
        "simulated time t (s)", "angular velocity α̇ (rad/s)",
        r"forcing phase at impact $τ_{\mathrm{imp}}$ (rad)",
        r"impact velocity $w_{\mathrm{A}}$/(πg/ω)",
        r"forcing phase $τ_{\mathrm{n}}$ (rad)", r"next forcing phase $τ_{\mathrm{n+1}}$ (rad)",
        "height x, s (mm)", "energy E (J)", "wall time since the first report (s)", "lateness (ms)",
    }  # fmt: skip
    assert [axes.get_title() for axes in figure.axes] == list(PANELS)
    assert figure.get_suptitle().startswith(r"run & <1> \$5\$" + "\n"), "as it is, no formula"
    legends = 0
    for axes in figure.axes:
        below = [axes.xaxis.label, *axes.texts]
        for upper, lower in pairwise(text.get_window_extent() for text in below):
            assert lower.y1 <= upper.y0
        if (legend := axes.get_legend()) is None:
            continue
        legends += 1
        box, data = legend.get_window_extent(), axes.get_window_extent()
        assert data.y1 <= box.y0
        assert box.y1 <= axes.title.get_window_extent().y0
        assert box.x1 <= data.x1
    assert legends == 6


def test_a_browser_without_network_draws_the_plots(report: Report, tmp_path: Path) -> None:
    browser = next(filter(None, map(shutil.which, BROWSERS)), None)
    if browser is None:
        pytest.skip("needs a Chromium (apt-get install chromium)")
    file = tmp_path / "report.html"
    file.write_text(report_html(report).replace("</body>", COUNT), "utf-8")
    done = subprocess.run(
        [
            browser, "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic",
            "--no-first-run", "--disable-background-networking", "--disable-component-update",
            "--disable-sync", f"--user-data-dir={tmp_path / 'profile'}",
            "--host-resolver-rules=MAP * ~NOTFOUND", "--enable-logging=stderr",
            "--window-size=1300,2600", "--virtual-time-budget=20000", "--dump-dom", file.as_uri(),
        ],
        capture_output=True, text=True, timeout=120,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    logged = [line for line in done.stderr.splitlines() if ":CONSOLE" in line]
    complaints = [
        line for line in logged if not re.search(r'"\[bokeh .*(log level|document idle)', line)
    ]
    assert complaints == []
    (drawn,) = re.findall(r'data-drawn="\[([\d,]+)\]"', done.stdout)
    dots = [int(number) for number in drawn.split(",")]
    assert len(dots) == len(PANELS)
    assert min(dots) > 50, dots
