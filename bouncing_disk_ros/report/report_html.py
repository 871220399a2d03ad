"""A report as one HTML file with interactive plots; it opens without network."""

from __future__ import annotations

import json
from html import escape
from importlib.metadata import version
from typing import Any

from bokeh.embed import json_item
from bokeh.models import BoxAnnotation, FixedTicker, HoverTool, Legend, Span
from bokeh.plotting import figure
from bokeh.resources import Resources

from bouncing_disk_ros.report.panel import Panel, Series, SeriesStyle, places
from bouncing_disk_ros.report.report_files import MARK
from bouncing_disk_ros.report.report_panels import (
    COLOURS,
    INDEXED,
    PHASE_TEXTS,
    PHASE_TICKS,
    absent,
    headline,
    panels,
    value_range,
)
from bouncing_disk_ros.report.report_text import segment_rows, tables
from bouncing_disk_ros.report.run_report import Report

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
    """The whole page, BokehJS included."""
    title, subtitle = headline(report)
    figures = "\n".join(
        _figure(panel, place, absent(report, panel))
        for place, panel in enumerate(panels(report, MOST_POINTS))
    )
    bokeh = Resources(mode="inline", components=["bokeh"]).js_raw
    words = "\n".join(
        f"<section><h2>{_marked(table.title)}</h2><dl>"
        + "".join(f"<dt>{_marked(name)}</dt><dd>{_marked(text)}</dd>" for name, text in table.rows)
        + "</dl></section>"
        for table in tables(report)
    )
    return f"""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="generator" content="{MARK}">
<title>{escape(title)}: report</title>
<style>{_STYLE}</style>
<script>{"".join(bokeh)}</script>
</head>
<body>
<h1>{escape(title)}</h1>
<p>{_marked(subtitle)}</p>
<div class="grid">
{figures}
</div>
<h2>Segments of steady motion</h2>
<div class="wide">{_segments(report)}</div>
<div class="grid">
{words}
</div>
<p class="about">Shaded: the platform changes its motion. Made by bag_report of bouncing_disk_ros
from the bag alone, with BokehJS (BSD licence; version {escape(version("bokeh"))}), which is part of
this file.</p>
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
def _figure(panel: Panel, place: int, absence: str) -> str:
    heading = f"<h2>{_marked(panel.title)}</h2>"
    caption = f"<figcaption>{_marked(panel.note)}</figcaption>"
    if panel.is_empty:
        return f'<figure>{heading}<div class="absent">{absence}</div></figure>'
    name = f"plot_{place}"
    item = json.dumps(json_item(_plot(panel), name)).replace("</", "<\\/")
    plot = f'<div id="{name}" class="plot"></div><script>Bokeh.embed.embed_item({item})</script>'
    return f"<figure>{heading}{plot}{caption}</figure>"


def _plot(panel: Panel) -> figure:
    """A panel with its tools: zoom, pan, numbers of the point under the mouse."""
    shown: dict[str, Any] = {"x_range": panel.x_range, "y_range": value_range(panel)}
    for axis, is_phase in (("x_range", panel.x_is_phase), ("y_range", panel.y_is_phase)):
        if is_phase:
            shown[axis] = (PHASE_TICKS[0], PHASE_TICKS[-1])
    plot = figure(
        height=420, sizing_mode="stretch_width", x_axis_label=panel.x_label,
        y_axis_label=panel.y_label, y_axis_type="log" if panel.y_is_log else "linear",
        tools="pan,wheel_zoom,box_zoom,reset,save", toolbar_location="right",
        **{axis: limits for axis, limits in shown.items() if limits is not None},
    )  # fmt: skip
    plot.toolbar.logo = None
    numbers = dict.fromkeys(("@x", "@y"), "printf")
    plot.add_tools(HoverTool(tooltips="@x{%.9g}, @y{%.9g}", formatters=numbers))
    for axis, is_phase in ((plot.xaxis, panel.x_is_phase), (plot.yaxis, panel.y_is_phase)):
        if is_phase:
            axis.ticker = FixedTicker(ticks=PHASE_TICKS)
            axis.major_label_overrides = dict(zip(PHASE_TICKS, PHASE_TEXTS, strict=True))
    for begin, end in panel.spans:
        shade = {"fill_color": "#999999", "fill_alpha": 0.25, "line_width": 0}
        plot.add_layout(BoxAnnotation(left=begin, right=end, **shade))
    for at in panel.lines:
        plot.add_layout(Span(location=at, dimension="height", line_color="#999999"))
    drawn = [(part.name, [_drawn(plot, part)]) for part in panel.series]
    if len(drawn) > 1:  # above the axes, where it covers no curve
        plot.add_layout(Legend(items=drawn, ncols=2, click_policy="hide", border_line_width=0,
                               padding=0, margin=4), "above")  # fmt: skip
    return plot


def _drawn(plot: figure, part: Series) -> Any:
    """A series drawn into a plot."""
    color = COLOURS[part.colour]
    match part.look:
        case SeriesStyle.POINTS:
            at = places(part)
            size = 6 if at < 200 else 4 if at < 1000 else 2.5
            return plot.scatter(part.x, part.y, color=color, size=size)
        case SeriesStyle.LINE | SeriesStyle.DASHED:
            dash = "solid" if part.look is SeriesStyle.LINE else "dashed"
            return plot.line(part.x, part.y, color=color, line_width=1.6, line_dash=dash)
        case SeriesStyle.WIDE:
            return plot.line(part.x, part.y, color=color, line_width=5.0)
        case SeriesStyle.RINGS:
            ring = {"line_color": color, "fill_color": None, "line_width": 2}
            return plot.scatter(part.x, part.y, size=12, **ring)
        case SeriesStyle.CROSSES:
            cross = {"marker": "cross", "color": color, "line_width": 2}
            return plot.scatter(part.x, part.y, size=18, **cross)
