"""A report as one HTML file with interactive plots; it opens without network."""

from __future__ import annotations

from html import escape
from importlib.metadata import version

import plotly.graph_objects as go
import plotly.io
from plotly.offline import get_plotlyjs

from bouncing_disk_ros.report.panel import Panel, Series, SeriesStyle, places
from bouncing_disk_ros.report.report_files import MARK
from bouncing_disk_ros.report.report_panels import panels
from bouncing_disk_ros.report.report_style import (
    COLOURS,
    INDEXED,
    PHASE_TEXTS,
    PHASE_TICKS,
    absent,
    headline,
    value_range,
)
from bouncing_disk_ros.report.report_tables import tables
from bouncing_disk_ros.report.report_text import segment_rows
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
    """The whole page, plotly.js included."""
    title, subtitle = headline(report)
    figures = "\n".join(
        _figure(panel, place, absent(report, panel))
        for place, panel in enumerate(panels(report, MOST_POINTS))
    )
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
<script>{get_plotlyjs()}</script>
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
from the bag alone, with plotly.js (MIT licence; plotly.py {escape(version("plotly"))}), which is
part of this file.</p>
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
    plot = plotly.io.to_html(
        _plot(panel), full_html=False, include_plotlyjs=False, default_width="100%",
        default_height="420px", div_id=f"plot_{place}",
        config={"responsive": True, "displaylogo": False},
    )  # fmt: skip
    return f"<figure>{heading}{plot}{caption}</figure>"


def _plot(panel: Panel) -> go.Figure:
    figure = go.Figure([_trace(part) for part in panel.series])
    for begin, end in panel.spans:
        figure.add_vrect(begin, end, fillcolor="#999999", opacity=0.25, line_width=0)
    for at in panel.lines:
        figure.add_vline(at, line_color="#999999", line_width=1)
    axis = {"gridcolor": "#dddddd", "zeroline": False, "linecolor": "#555555", "showline": True,
            "mirror": True, "ticks": "outside", "automargin": True}  # fmt: skip
    phase = {"range": [PHASE_TICKS[0], PHASE_TICKS[-1]], "tickvals": PHASE_TICKS,
             "ticktext": PHASE_TEXTS}  # fmt: skip
    figure.update_xaxes(title=_marked(panel.x_label), **axis, **(phase if panel.x_is_phase else {}))
    figure.update_yaxes(title=_marked(panel.y_label), **axis, **(phase if panel.y_is_phase else {}))
    if panel.y_is_log:
        figure.update_yaxes(type="log", dtick=1, exponentformat="power")
    if panel.x_range is not None:
        figure.update_xaxes(range=panel.x_range)
    if (limits := value_range(panel)) is not None:
        figure.update_yaxes(range=limits)
    figure.update_layout(
        template="none", margin={"l": 10, "r": 10, "t": 30, "b": 10}, hovermode="closest",
        showlegend=len(panel.series) > 1,
        legend={"orientation": "h", "y": 1.0, "yanchor": "bottom"},  # where it covers no ticks
    )  # fmt: skip
    return figure


def _trace(part: Series) -> go.Scatter:
    color = COLOURS[part.colour]
    look: dict[str, object]
    match part.look:
        case SeriesStyle.POINTS:
            at = places(part)
            size = 6 if at < 200 else 4 if at < 1000 else 2.5
            look = {"mode": "markers", "marker": {"color": color, "size": size}}
        case SeriesStyle.LINE | SeriesStyle.WIDE:
            width = 1.6 if part.look is SeriesStyle.LINE else 5.0
            look = {"mode": "lines", "line": {"color": color, "width": width}}
        case SeriesStyle.DASHED:
            look = {"mode": "lines", "line": {"color": color, "width": 1.6, "dash": "dash"}}
        case SeriesStyle.RINGS:
            ring = {"color": color, "size": 12, "symbol": "circle-open", "line": {"width": 2}}
            look = {"mode": "markers", "marker": ring}
        case SeriesStyle.CROSSES:
            line = {"color": color, "width": 2}
            cross = {"color": color, "size": 18, "symbol": "cross-thin", "line": line}
            look = {"mode": "markers", "marker": cross}
    return go.Scatter(x=part.x, y=part.y, name=_marked(part.name), **look)
