"""The pages of a report: all parts are there, the HTML needs no network, files know their own."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from base64 import b64decode
from html.parser import HTMLParser
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

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
BROWSERS = ("chromium", "chromium-browser", "google-chrome")


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory) -> Report:
    folder = tmp_path_factory.mktemp("bags") / "run & <1> $5$"
    return pinned_results.report(period_one_bag(folder))


class Page(HTMLParser):
    """Headings, everything that a browser would fetch, and the text outside of scripts."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.headings: list[str] = []
        self.fetched: list[str] = []
        self.generator = ""
        self.plots: list[str] = []
        self.words = ""
        self._within = ""
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = dict(attrs)
        self._within = tag
        for name in ("src", "href", "srcset", "data", "poster", "action", "background"):
            if given.get(name):
                self.fetched.append(str(given[name]))
        if tag in ("link", "iframe", "object", "embed", "img"):
            self.fetched.append(tag)
        if given.get("name") == "generator":
            self.generator = str(given["content"])
        if given.get("class") == "plot":
            self.plots.append(str(given["id"]))

    def handle_endtag(self, tag: str) -> None:
        self._within = ""

    def handle_data(self, data: str) -> None:
        if self._within in ("h1", "h2"):
            self.headings.append(data)
        if self._within == "style":
            assert "@import" not in data
            assert "url(" not in data
        elif self._within != "script":
            self.words += data


def test_the_page_has_every_part_and_fetches_nothing(report: Report) -> None:
    text = report_html(report)
    page = Page(text)
    assert page.headings == ["run & <1> $5$", *PANELS, *TABLES]
    assert "<title>run &amp; &lt;1&gt; $5$: report</title>" in text
    assert page.fetched == []
    assert 1_000_000 < len(text) < 2_000_000, "BokehJS is part of it, and little else"
    assert page.generator == mark_of("bag_report")
    assert page.plots == [f"plot_{place}" for place in range(len(PANELS))]
    assert "period-1" in page.words
    assert "in force 0.5" in page.words
    assert report_html(report) == text, "no dates, no random names"


def test_the_plots_hold_the_numbers_of_their_panels(report: Report) -> None:
    items = re.findall(r"draw\(\"plot_\d+\", (.*)\)</script>", report_html(report))
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


ALL = (*WANTED, "/diagnostics")


def test_a_report_on_nothing_says_what_is_absent() -> None:
    page = Page(report_html(report_of(RunRecord(UNKNOWN_DISK), RecordSource("empty", missing=ALL))))
    assert page.plots == []
    assert page.words.count("not in this bag") >= len(PANELS)


@pytest.fixture(scope="module")
def figure(report: Report) -> Figure:
    return report_page(report)


def test_figures_are_marked_as_ours(tmp_path: Path) -> None:
    empty = report_page(report_of(RunRecord(UNKNOWN_DISK), RecordSource("empty")))
    for kind in ("png", "svg", "pdf"):
        save_page(empty, tmp_path / f"page.{kind}", "fit_impacts")
        data = (tmp_path / f"page.{kind}").read_bytes()
        assert mark_of("fit_impacts").encode() in data, kind
        assert len(data) > 5_000, kind


def test_axes_have_symbol_and_unit(figure: Figure) -> None:
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


def test_no_legend_covers_a_curve_and_no_text_another(figure: Figure) -> None:
    figure.draw_without_rendering()
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
