"""A report as one HTML file with interactive plots: its panels drawn by BokehJS in the browser.

The file opens without network. Its numbers are the bytes of the panels' arrays. Bokeh's models in
Python would make the same plots under names that change from run to run, in 2 s instead of 0.07 s:
1.1 s to import them, 0.4 s to make them, 0.5 s to write them. A whole report takes 2.4 s.
"""

from __future__ import annotations

import json
from base64 import b64encode
from collections.abc import Sequence
from html import escape
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from bouncing_disk_ros.report.panel import (
    PHASE_TEXTS,
    PHASE_TICKS,
    Column,
    Panel,
    Series,
    SeriesStyle,
    Table,
)
from bouncing_disk_ros.report.report_files import mark_of
from bouncing_disk_ros.report.report_panels import absent, headline, panels
from bouncing_disk_ros.report.report_text import segment_rows, tables
from bouncing_disk_ros.report.run_report import Report
from bouncing_disk_ros.units import INDEXED

MOST_POINTS = 5000
"""Points of a series: browsers stay quick."""
MOST_SEGMENTS = 500
_STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; color: #222; margin: 0 auto; max-width: 1300px;
       padding: 0 12px 40px; }
h1 { font-size: 1.4em; margin: .8em 0 0; overflow-wrap: anywhere; }
h2 { font-size: 1.1em; margin: 1.6em 0 .3em; }
.grid { display: grid; grid-template-columns: minmax(0, 1fr); gap: 12px 24px; }
@media (min-width: 900px) { .grid { grid-template-columns: repeat(2, minmax(0, 1fr)); } }
figure { margin: 0; min-width: 0; }
figcaption, .about { color: #555; font-size: .85em; }
.absent { color: #555; border: 1px dashed #bbb; padding: 3em 1em; text-align: center; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; font-size: .92em; width: 100%; }
td, th { text-align: left; vertical-align: top; padding: 2px 12px 2px 0;
         border-bottom: 1px solid #eee; font-variant-numeric: tabular-nums; }
td:first-child { color: #555; }
dl { display: grid; grid-template-columns: minmax(9em, 15em) 1fr; margin: 0; font-size: .92em; }
dt, dd { margin: 0; padding: 2px 12px 2px 0; border-bottom: 1px solid #eee;
         overflow-wrap: anywhere; }
dt { color: #555; }
"""


def report_html(report: Report) -> str:
    """The whole page of `bag_report`, BokehJS included."""
    title, subtitle = headline(report)
    about = (
        "Shaded: the platform changes its motion. Made by bag_report of bouncing_disk_ros\n"
        "from the bag alone"
    )
    drawn = [(panel, absent(report, panel)) for panel in panels(report, MOST_POINTS)]
    segments = f"""<h2>Segments of steady motion</h2>
<div class="wide">{_segments(report)}</div>
"""
    return html_page(title, subtitle, drawn, tables(report), "bag_report", about, segments)


def html_page(
    title: str,
    subtitle: str,
    drawn: Sequence[tuple[Panel, str]],
    words: Sequence[Table],
    maker: str,
    about: str,
    between: str = "",
) -> str:
    """A page of panels (with the reason why one is empty) and tables, BokehJS included.

    `maker`: the executable; `about`: the same in words; `between`: HTML before the tables.
    """
    figures = "\n".join(
        _figure(panel, place, absence) for place, (panel, absence) in enumerate(drawn)
    )
    sections = "\n".join(
        f"<section><h2>{_marked(table.title)}</h2><dl>"
        + "".join(f"<dt>{_marked(name)}</dt><dd>{_marked(text)}</dd>" for name, text in table.rows)
        + "</dl></section>"
        for table in words
    )
    return f"""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="generator" content="{mark_of(maker)}">
<title>{escape(title)}: report</title>
<style>{_STYLE}</style>
<script>{_bokeh()}</script>
<script>{_DRAW}</script>
</head>
<body>
<h1>{escape(title)}</h1>
<p>{_marked(subtitle)}</p>
<div class="grid">
{figures}
</div>
{between}<div class="grid">
{sections}
</div>
<p class="about">{about}, with BokehJS (BSD licence; version
{escape(version("bokeh"))}), which is part of this file.</p>
</body>
</html>
"""


def _marked(text: str) -> str:
    """Escaped, with indices marked by _ as HTML sets them: w_A, τ_(n+1)."""
    return INDEXED.sub(lambda m: f"{m[1]}<sub>{m[2] or m[3]}</sub>", escape(text))


def _segments(report: Report) -> str:
    head, *rows = segment_rows(report, MOST_SEGMENTS)
    heading = "".join(f"<th>{_marked(cell)}</th>" for cell in head)
    lines = ("".join(f"<td>{_marked(cell)}</td>" for cell in row) for row in rows)
    return f"<table><tr>{heading}</tr>{''.join(f'<tr>{line}</tr>' for line in lines)}</table>"


# --- plots ----------------------------------------------------------------------------------------
_DRAW = """
const numbers = text =>
  new Float64Array(Uint8Array.from(atob(text), one => one.charCodeAt(0)).buffer);
function draw(name, panel) {
  const range = ends => ends && new Bokeh.Range1d({start: ends[0], end: ends[1]});
  const given = {x_range: range(panel.limits[0]), y_range: range(panel.limits[1])};
  const known = Object.fromEntries(Object.entries(given).filter(([_, ends]) => ends));
  const plot = Bokeh.Plotting.figure({
    height: 420, sizing_mode: "stretch_width", toolbar_location: "right",
    tools: "pan,wheel_zoom,box_zoom,reset,save", x_axis_label: panel.labels[0],
    y_axis_label: panel.labels[1], y_axis_type: panel.y_is_log ? "log" : "linear", ...known});
  plot.toolbar.logo = null;
  plot.add_tools(new Bokeh.HoverTool({
    tooltips: "@x{%.9g}, @y{%.9g}", formatters: {"@x": "printf", "@y": "printf"}}));
  [plot.xaxis, plot.yaxis].forEach((axis, place) => {
    if (!panel.is_phase[place]) return;
    axis.ticker = new Bokeh.FixedTicker({ticks: panel.ticks.map(([at, _]) => at)});
    axis.major_label_overrides = new Map(panel.ticks);
  });
  for (const [left, right] of panel.spans)
    plot.add_layout(new Bokeh.BoxAnnotation(
      {left, right, fill_color: "#999999", fill_alpha: 0.25, line_width: 0}));
  for (const location of panel.lines)
    plot.add_layout(new Bokeh.Span({location, dimension: "height", line_color: "#999999"}));
  const items = panel.series.map(one => {
    const data = {x: numbers(one.x), y: numbers(one.y)};
    const source = new Bokeh.ColumnDataSource({data});
    const drawn = plot[one.glyph]({field: "x"}, {field: "y"}, {source, ...one.style});
    return new Bokeh.LegendItem({label: {value: one.name}, renderers: [drawn]});
  });
  if (items.length > 1)  // above the axes, where it covers no curve
    plot.add_layout(new Bokeh.Legend({
      items, ncols: 2, click_policy: "hide", border_line_width: 0, padding: 0, margin: 4
    }), "above");
  Bokeh.Plotting.show(plot, document.getElementById(name));
}
"""
_WIDTHS = {SeriesStyle.LINE: 1.6, SeriesStyle.DASHED: 1.6, SeriesStyle.WIDE: 5.0}


def _bokeh() -> str:
    """BokehJS with its functions for plots, as it is installed; bokeh itself is not imported."""
    found = find_spec("bokeh")
    assert found is not None
    assert found.origin is not None
    folder = Path(found.origin).parent / "server" / "static" / "js"
    return "\n".join(
        (folder / f"{name}.min.js").read_text("utf-8") for name in ("bokeh", "bokeh-api")
    )


def _figure(panel: Panel, place: int, absence: str) -> str:
    heading = f"<h2>{_marked(panel.title)}</h2>"
    caption = f"<figcaption>{_marked(panel.note)}</figcaption>"
    if panel.is_empty:
        return f'<figure>{heading}<div class="absent">{absence}</div></figure>'
    name = f"plot_{place}"
    data = json.dumps(_data(panel)).replace("</", "<\\/")
    plot = f'<div id="{name}" class="plot"></div><script>draw("{name}", {data})</script>'
    return f"<figure>{heading}{plot}{caption}</figure>"


def _data(panel: Panel) -> dict[str, Any]:
    """A panel as `draw` takes it."""
    return {
        "labels": (panel.x_label, panel.y_label),
        "limits": panel.limits,
        "is_phase": (panel.x_is_phase, panel.y_is_phase),
        "ticks": list(zip(PHASE_TICKS, PHASE_TEXTS, strict=True)),
        "y_is_log": panel.y_is_log,
        "spans": panel.spans,
        "lines": panel.lines,
        "series": [
            {"name": part.name, "x": _packed(part.x), "y": _packed(part.y)} | _style(part)
            for part in panel.series
        ],
    }


def _packed(values: Column) -> str:
    """Numbers as base64 of their bytes, low bytes first."""
    return b64encode(values.astype("<f8").tobytes()).decode()


def _style(part: Series) -> dict[str, Any]:
    """How BokehJS draws a series: which glyph, and its properties."""
    match part.look:
        case SeriesStyle.POINTS:
            size = (6, 4, 2.5)[part.crowding]
            style: dict[str, Any] = {"color": part.colour, "size": size}
        case SeriesStyle.RINGS:
            ring = {"line_color": part.colour, "fill_color": None, "line_width": 2}
            style = {"size": 12, **ring}
        case SeriesStyle.CROSSES:
            style = {"marker": "cross", "size": 18, "color": part.colour, "line_width": 2}
        case _:
            dash = "dashed" if part.look is SeriesStyle.DASHED else "solid"
            line = {"color": part.colour, "line_width": _WIDTHS[part.look], "line_dash": dash}
            return {"glyph": "line", "style": line}
    return {"glyph": "scatter", "style": style}
