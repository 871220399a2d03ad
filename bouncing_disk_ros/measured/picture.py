"""Figures of a fit, and its numbers in words: for the terminal, the page and the picture."""

from __future__ import annotations

import math

import numpy as np

from bouncing_disk_ros.errors import counted
from bouncing_disk_ros.measured.kernels.rest_laws import AMPLITUDE, FREQUENCY, PHASE
from bouncing_disk_ros.measured.laws import Law, other_law
from bouncing_disk_ros.measured.profiles import Array, Interval, interval_text
from bouncing_disk_ros.measured.result import ImpactFit
from bouncing_disk_ros.report.panel import Panel, SeriesStyle, Table, series

UNITS = {
    "restitution": ("ε", ""), "axial_forcing": ("Γ", ""), "axial_amplitude": ("A", "m"),
    "forcing_phase": ("φ at time 0", "rad"), "frequency": ("f", "Hz"), "gravity": ("g", "m/s²"),
    "first_flight": ("T₀", "s"), "first_height": ("height before impact 1", "m"),
    "end": ("end of the bounces", "s"), "time_error": ("error of times", "s"),
    "scatter": ("scatter of ε", ""), "slope": ("ε₁", "s/m"), "terminal_speed": ("v_t", "m/s"),
}  # fmt: skip
"""Parameter -> its symbol and unit."""
_POINTS = 60
"""Of a curve of one flight."""


def tables_of(fit: ImpactFit) -> list[Table]:
    """What the fit found, in words."""
    platform = f"vibrates at {fit.frequency:g} Hz" if fit.frequency > 0.0 else "is at rest"
    data = [
        ("recording", f"{fit.name}: {np.sum(~fit.missed)} impacts in {np.ptp(fit.times):.6g} s"),
        ("platform", platform),
    ]
    if fit.missed.any():
        text = _times_text("impact", "without a hit, near", fit.times[fit.missed])
        data.append(("missed", text))
    if len(fit.contacts):
        text = _times_text("place", "without a fitted flight, after", fit.times[fit.contacts])
        data.append(("contact or gap", text))
    if len(fit.rejected):
        why = "that no flight reaches or within the dead time, at"
        data.append(("rejected", _times_text("hit", why, fit.rejected)))
    if fit.sound:
        from bouncing_disk_ros.measured.sound_picture import sound_lines

        data.append(("sound", "; ".join(sound_lines(fit.sound))))
    data += [("alternative", one.text) for one in fit.alternatives]
    data.append(("goodness of fit", _goodness_text(fit)))
    rows = []
    for name, found in fit.parameters.items():
        symbol, unit = UNITS[name]
        text = interval_text(found, unit)
        if name in fit.untold:
            text = f"not told by these data: {found.low:.6g} to {found.high:.6g} {unit}".rstrip()
        rows.append((f"{name}, {symbol}", text))
    if fit.told:
        rows.append(("told", fit.told))
    laws = [(law.name, _law_text(law, fit)) for law in fit.laws]
    coming = fit.prediction
    ahead = [
        (f"impact {len(fit.times) + i + 1}", interval_text(Interval(*row), "s"))
        for i, row in enumerate(zip(coming.times, coming.low, coming.high, strict=True))
    ] or [("no impact", "its interval would be longer than a flight, or a contact comes")]
    return [
        Table("Data", data),
        Table("Parameters (95 % intervals)", rows),
        *([Table("Laws of the restitution", laws)] if laws else []),
        Table("Impacts to come (95 % intervals)", ahead),
    ]


def _law_text(law: Law, fit: ImpactFit) -> str:
    least = min(one.criterion for one in fit.laws)
    delta = "no AICc of so few impacts"
    if law.criterion < math.inf:
        delta = f"ΔAICc {law.criterion - least:.2f}"
    shown = [f"{UNITS[name][0]} = {interval_text(found, UNITS[name][1])}"
             for name, found in law.parameters.items() if name != "drag"]  # fmt: skip
    told = ", told by these data" if law is other_law(fit.laws) else ""
    return f"{delta}{told}: {', '.join(shown)}"


def _times_text(what: str, where: str, times: Array) -> str:
    shown = ", ".join(f"{t:.6g}" for t in times[:5])
    return f"{counted(len(times), what)} {where} {shown}{' ...' if len(times) > 5 else ''} s"


def lines_of(fit: ImpactFit) -> list[str]:
    """The tables as lines of a terminal."""
    tables = tables_of(fit)
    width = max(len(name) for table in tables for name, _ in table.rows)
    lines = []
    for table in tables:
        lines += [f"{table.title}:", *(f"  {name:{width}}  {text}" for name, text in table.rows)]
    return lines


def _goodness_text(fit: ImpactFit) -> str:
    verdict = fit.doubt or "the model is not refuted"
    if fit.doubt and "residuals" not in fit.doubt:
        return verdict
    if math.isnan(fit.probability):
        return "not told: residuals are rounding of the times"
    return f"such residuals have the probability {fit.probability:.2g}: {verdict}"


def headline_of(fit: ImpactFit) -> tuple[str, str]:
    """Title and a line under it."""
    shown = [name for name in ("restitution", "axial_forcing") if name in fit.parameters]
    words = [
        f"{UNITS[name][0]} not told" if name in fit.untold
        else f"{UNITS[name][0]} = {interval_text(fit[name])}"
        for name in shown
    ]  # fmt: skip
    if fit.doubt:
        words.append(fit.doubt.partition(":")[0])
    return fit.name, ", ".join(words)


def panels_of(fit: ImpactFit) -> list[tuple[Panel, str]]:
    """Sound, flights through the impacts, residuals over time and speed, restitution over speed."""
    p = fit.profiles.estimate
    grid = np.linspace(fit.times[0], fit.times[-1], 20 * _POINTS)
    platform = p[AMPLITUDE] * np.sin(p[FREQUENCY] * grid + p[PHASE])
    at_impacts = p[AMPLITUDE] * np.sin(p[FREQUENCY] * fit.times + p[PHASE])
    times, heights = _curves(fit, at_impacts)
    measured = ~fit.missed
    odd = [
        series(name, at, np.interp(at, grid, platform), SeriesStyle.POINTS, color)
        for name, at, color in (
            ("missed", fit.times[fit.missed], 2), ("rejected hits", fit.rejected, 3))
        if len(at)
    ]  # fmt: skip
    unflown = [(float(fit.times[i]), float(fit.times[i + 1])) for i in fit.contacts]
    flights = Panel("Flights through the measured impacts", "time, s", "height, m", [
        series("platform", grid, platform, SeriesStyle.LINE, 4),
        series("disk", times, heights, SeriesStyle.LINE),
        series("impacts", fit.times[measured], at_impacts[measured], SeriesStyle.POINTS, 1), *odd,
    ], "Grey: contact or gap, where no flight is fitted." if unflown else "", unflown)  # fmt: skip
    micro = 1e6 * fit.residuals
    over_time = Panel("Measured minus estimated times", "time, s", "residual, µs", [
        series("residuals", fit.times[measured], micro[measured])])  # fmt: skip
    inner = measured[1:-1] & np.isfinite(fit.speeds)
    over_speed = Panel("Measured minus estimated times", "impact speed, m/s", "residual, µs", [
        series("residuals", fit.speeds[inner], micro[1:-1][inner])])  # fmt: skip
    known = np.isfinite(fit.speeds)
    fastest = float(fit.speeds[known].max())
    curves = [(law.name, *law.curve(fastest, fit.gravity)) for law in fit.laws] or [
        ("fit", np.array([fit.speeds[known].min(), fastest]), np.full(2, fit["restitution"].value))
    ]
    law = Panel("Restitution of each impact", "impact speed, m/s", "restitution ε", [
        series("impacts", fit.speeds[known], fit.restitutions[known]),
        *(series(name, speeds, values, SeriesStyle.LINE, 1 + i)
          for i, (name, speeds, values) in enumerate(curves)),
    ])  # fmt: skip
    heard = []
    if fit.sound:
        from bouncing_disk_ros.measured.sound_picture import sound_panel

        heard = [sound_panel(fit.sound, fit.rejected)]
    return [(panel, "") for panel in (*heard, flights, law, over_time, over_speed)]


def _curves(fit: ImpactFit, starts: Array) -> tuple[Array, Array]:
    """Time and height along all flights."""
    part = np.linspace(0.0, 1.0, _POINTS)
    since = np.diff(fit.times)[:, None] * part
    rise = fit.flights[:, :1] * since - 0.5 * fit.gravity * since**2  # nan in contact: no line
    return (fit.times[:-1, None] + since).ravel(), (starts[:-1, None] + rise).ravel()
