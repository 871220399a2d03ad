"""What the paper says of each figure, number by number, and how to find the same in our results."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import xarray as xr

from bouncing_disk_ros.core.model import Disk, Motion
from bouncing_disk_ros.maps.best_toss import extreme
from bouncing_disk_ros.maps.bifurcations import period_doublings
from bouncing_disk_ros.maps.motor_curves import friction_limit
from bouncing_disk_ros.maps.period_one import stability_limit
from bouncing_disk_ros.maps.periodic_orbit import fixed_point, periodic_orbit
from bouncing_disk_ros.maps.scales import axial_forcing_of
from bouncing_disk_ros.maps.tosses import toss
from bouncing_disk_ros.motor_study.motor_points import Run, measure
from bouncing_disk_ros.parameters import complete
from bouncing_disk_ros.run.presets import load_preset
from bouncing_disk_ros.study.basins.options import scales


class Number(NamedTuple):
    """One number of the paper beside ours."""

    what: str
    paper: str  # as printed; empty: the paper has none
    ours: float
    unit: str = ""
    reason: str = ""  # why it differs, where it does


class PaperFigure(NamedTuple):
    """One figure: the parameter file, the paper's statement, and its numbers from a result."""

    name: str
    heading: str
    statement: str
    numbers: Callable[[xr.Dataset], list[Number]]
    caption: str  # what the pictures show, line by line and colour by colour
    remark: str | Callable[[], str] = ""  # or what computes it


def agrees(number: Number) -> bool:
    """Whether ours rounds to what is printed: within half a unit of its last digit."""
    digits = len(number.paper.partition(".")[2])
    half = 0.5 * 10.0**-digits
    return abs(number.ours - float(number.paper)) <= half * (1.0 + 1e-9)


CHATTERS, PERIOD_ONE = (0.575, 0.9), (0.34, 0.486)
"""Γ of the motors that are measured: in the chattering regime, and in period 1 at ε = 0.5."""
_PRELOADS = 131
"""So many of each."""


def _motors(ends: tuple[float, float], lag: float | None, part: float) -> list[tuple[Motion, Disk]]:
    """The motor swum at preloads for Γ between the ends, under a part of the torque of friction."""
    values = complete(load_preset("swum"))
    motion, disk = Motion(*(float(values[name]) for name in Motion._fields)), Disk.of(values)
    motion = motion if lag is None else motion._replace(phase_lag=lag)
    pull = (disk.gravity + disk.preload / disk.mass) * axial_forcing_of(motion, disk)
    found = []
    for forcing in np.linspace(*ends, _PRELOADS).tolist():
        one = disk._replace(preload=(pull / forcing - disk.gravity) * disk.mass)
        found.append((motion, one._replace(load_torque=part * friction_limit(one))))
    return found


def _speed(ends: tuple[float, float], lag: float | None = None, part: float = 0.0) -> str:
    """Mean and spread (standard deviation over the preloads) of the mean speed, ωΦ."""
    motors = _motors(ends, lag, part)
    scale = math.tau * motors[0][0].frequency * motors[0][0].angular_amplitude
    speeds = measure(motors, Run())["mean_speed"] / scale
    return f"{np.nanmean(speeds):.2f} ± {np.nanstd(speeds):.2f}"


def _torques(ends: tuple[float, float]) -> str:
    torques = [1e3 * friction_limit(disk) for _, disk in _motors(ends, None, 0.0)]
    return f"{min(torques):.1f} to {max(torques):.1f} mN·m"


def _chattering_motor() -> str:
    """What a motor in the chattering regime gives: the paper's open question."""
    best = math.pi / 6.0  # of 24 phase lags
    return (
        "The paper asks whether a motor could run in the chattering regime. The study `motor` "
        f"computed `swum` at {_PRELOADS} preloads, at which Γ goes from {CHATTERS[0]} to "
        f"{CHATTERS[1]}. Speeds are the mean and the standard deviation over the preloads. Without "
        f"load, the mean speed in the chattering regime is {_speed(CHATTERS)} ωΦ at the phase lag "
        "that is best for period 1. At the phase lag that is best for the chattering regime, "
        f"θ = π/6, the mean speed is {_speed(CHATTERS, best)} ωΦ. In period 1, from "
        f"Γ = {PERIOD_ONE[0]} to {PERIOD_ONE[1]}, the mean speed is {_speed(PERIOD_ONE)} ωΦ. "
        "Under a load of half the torque that friction can balance, the speed is "
        f"{_speed(CHATTERS, best, 0.5)} ({_speed(PERIOD_ONE, None, 0.5)} in period 1), and the "
        f"rotor turns backwards at some preloads. Friction can balance {_torques(CHATTERS)} "
        f"in the chattering regime, and {_torques(PERIOD_ONE)} in period 1. The reason: a larger "
        "Γ needs less preload, and with less preload friction is weaker. In the chattering regime "
        "all starts lead to the same attractor (see Fig. 4, Γ = 0.60), so such a motor would start "
        "from any state. But it would be slower and weaker, and its speed would depend on the "
        "exact preload."
    )


def _none(_: xr.Dataset) -> list[Number]:
    return []


def _tosses(_: xr.Dataset) -> list[Number]:
    speed, efficiency = extreme("airborne_speed"), extreme("efficiency")
    straight = extreme("speed_ratio", phase_lag=0.0)
    best = extreme("speed_ratio")
    near = toss(0.0, 0.248 * math.pi)
    flat = "the maximum is at another value, close by"
    ledger = (
        "no way of counting the energies gives 0.519 with E_in = ∫(Nṡ + Mβ̇)dt from rest to "
        "separation; a wrong sign of gravity would give 0.5222 at φ_L = 0.248π, at most 0.5236"
    )
    return [
        Number("largest airborne speed", "27.1", abs(speed.airborne_speed), "rad/s",
               "the exact maximum; the paper gives the unit as rpm once and as rad/s later: rad/s "
               "is right"),
        Number("φ_L/π there", "0.248", speed.amplitude_angle / math.pi, "", flat),
        Number("θ there", "0", speed.phase_lag, "rad"),
        Number("speed ratio at φ_L = 0.248π, θ = 0", "0.983", float(near.speed_ratio), "",
               "computed exactly at these values"),
        Number("speed ratio at the fastest toss", "", abs(speed.speed_ratio)),
        Number("largest speed ratio along θ = 0", "0.995", straight.speed_ratio),
        Number("largest speed ratio of all, along θ = −τ_sep", "", best.speed_ratio),
        Number("largest efficiency", "0.519", efficiency.efficiency, "", ledger),
        Number("φ_L/π there", "0.248", efficiency.amplitude_angle / math.pi, "", flat),
    ]  # fmt: skip


def _diagram(result: xr.Dataset) -> list[Number]:
    points = [float(value) for value in result["doubling"].values]
    high = "the printed value is 1e-4 above the accurate one"
    rounded = "the paper's is from rounded values; ours from values with more than 8 digits"
    rows = [
        Number(f"Γ of the doubling {2**i} → {2 ** (i + 1)}", paper, value, "", why)
        for i, (paper, value, why) in enumerate(
            zip(("0.486", "0.531", "0.5402", "0.5421", ""), points, ("", "", high, "", ""),
                strict=True))
    ]  # fmt: skip
    ratios = result["feigenbaum_ratio"].values
    rows += [
        Number(f"ratio {i + 1} of their distances", paper, float(ratio), "", rounded)
        for i, (paper, ratio) in enumerate(zip(("4.891", "4.842", "4.75"), ratios, strict=True))
    ]
    first = stability_limit(0.5)
    phase = math.acos(1.0 / (3.0 * first))
    peak_place, peak = _largest_mean_speed()
    return [
        *rows,
        Number("τ_imp/2π of the period-1 orbit at Γ₁", "0.13", phase / math.tau),
        Number("best phase lag θ/π there", "-0.26", -phase / math.pi),
        Number("mean α̇/(ωΦ) at Γ₁, θ = 0: cos τ_imp", "0.69", math.cos(phase)),
        Number("largest mean α̇/(ωΦ) beyond Γ₁", "", peak),
        Number("Γ there, to 1e-6 (the paper: the period-4 bifurcation)", "0.531", peak_place),
        Number("Γ where the chaotic attractor first comes to contact (a crisis)", "",
               float(result["contact_onset"])),
    ]  # fmt: skip


def _largest_mean_speed() -> tuple[float, float]:
    """Γ and the mean speed at the cusp of Fig. 3, where the period-2 orbit becomes one of 4.

    Up to there the mean speed of the period-2 orbit grows; that of the period-4 orbit falls within
    1e-6 of it.
    """
    point = period_doublings(fixed_point(0.45, 0.5), "axial_forcing", 0.54, 2)[1]
    section = replace(point.orbit.map, phase_lag=0.0, angular_forcing=100.0)
    return point.value, periodic_orbit(section, point.orbit.state, point.impacts).mean_speed


def _interval(result: xr.Dataset, name: str) -> tuple[float, str]:
    """A number of a result and, as its unit, the half-width of its interval of 95 %."""
    return float(result[name]), f"± {float(result[f'{name}_error']):.2g}"


def _share(paper: str) -> Callable[[xr.Dataset], list[Number]]:
    def numbers(result: xr.Dataset) -> list[Number]:
        names = [str(name) for name in result["attractor_name"].values]
        share = 100.0 * result["fraction"].values
        rows = [
            Number(f"share of the basin: {name}", paper if name == "period-1" else "",
                   float(share[i]), "%")
            for i, name in enumerate(names)
        ]  # fmt: skip
        rows.append(Number("unresolved", "", 100.0 * float(result["unresolved_fraction"]), "%"))
        if not math.isnan(float(result["box_dimension"])):
            alpha, box = (
                _interval(result, name) for name in ("uncertainty_exponent", "box_dimension")
            )
            at = f", {scales(result)}"
            rows += [
                Number(f"uncertainty exponent α{at}", "", *alpha),
                Number("dimension of the boundary there, 2 − α", "", 2.0 - alpha[0], *alpha[1:]),
                Number("dimension of the boundary there, by boxes", "", *box),
                Number("boundary basin entropy (only above ln 2 a proof of fractality)", "",
                       float(result["boundary_basin_entropy"]), "nat"),
            ]  # fmt: skip
        return rows

    return numbers


def _widest(result: xr.Dataset) -> list[Number]:
    share = result["fraction"].values[:, 2]
    at = int(share.argmax())
    lag = float(result["best_phase_lag"].values[at])
    return [
        Number("largest share of the period-1 basin", "", 100.0 * float(share[at]), "%"),
        Number("Γ there", "0.486", float(result["value"].values[at]), "",
               "the value of the axis next below Γ₁ = 0.486003"),
        Number("best phase lag θ/π there", "-0.26", lag / math.pi, "", "at that Γ"),
    ]  # fmt: skip


BASINS = (
    "Left: each pixel is a start, the state just before a first impact, in the colour of the "
    "attractor that it reaches. The legend has the shares of the window with their standard "
    "errors. Dots: the impacts of the attractors, white, or orange where the attractor comes to "
    "contact. Right: the time after which the attractor of the start is known, in periods of the "
    "platform. Grey: there is no such time, because the attractor is chaotic."
)
SHARES = (
    "Top: the share of starts that come to contact (black), and the share that reaches each of "
    "the other attractors without contact on the way. Each attractor has one line, matched from "
    "value to value. All starts that come to contact continue as one orbit. If this orbit "
    "leaves contact for ever and reaches one of the coloured attractors, the black line has a dot "
    "in the colour of this attractor. Middle and bottom: the best phase lag, at which the disk "
    "turns fastest, and the mean speed at this lag, in ωΦ. Both are values of the largest "
    "attractor that is neither rest nor chattering. Both jump where another attractor becomes the "
    "largest. The lag also jumps where another maximum of the speed becomes the highest."
)
FIGURES = (
    PaperFigure("fig1", "Fig. 1: paths of the hand",
                "Trajectories traced by the hand as θ varies at φ_L = π/4 (a-c), and as φ_L varies "
                "at θ = −π/4 (d-f).", _none,
                "The closed curve on which a point of the platform moves in one period, arc a_e β "
                "to the right and height s upward. There are six pairs of phase lag θ and "
                "amplitude angle φ_L.",
                "For (b) the text gives only φ_L = π/4, and for (d-f) only θ = −π/4. The other "
                "angles are chosen."),
    PaperFigure("fig2", "Fig. 2: single tosses",
                "Airborne speed, speed ratio and efficiency over θ and φ_L, extremal points marked "
                "with crosses; (d) details of two motions.", _tosses,
                "Each point is one toss from rest on the platform at its lowest point, at fixed "
                "arc and frequency. Colours show three results over phase lag θ and amplitude "
                "angle φ_L. The airborne speed is α̇ at the first separation. The speed ratio is "
                "α̇/(ωΦ). The efficiency is the gain of rotational energy over the work of the "
                "platform. Crosses mark the largest values. Grey: the disk never leaves the "
                "platform. The second picture shows two of the tosses in time."),
    PaperFigure("fig3", "Fig. 3: period doubling",
                "τ_imp over Γ with a period-doubling route to chaos at ε = 0.5; angular speed at "
                "θ = 0, Γ_T = 100; relative collision speed.", _diagram,
                "(a): forcing phase of the impacts of the attractor followed upward in Γ. The "
                "darker a cell, the more impacts it has. Blue: an orbit without contact. Orange: "
                "an orbit that comes to contact in each repetition. Black dashes: the period-1 "
                "orbit. Beyond its first doubling Γ₁ this orbit still exists, but is unstable. "
                "Green lines: period doublings, by continuation. Purple line: the crisis, where "
                "the chaotic attractor comes to contact. Beyond the crisis the diagram follows "
                "another attractor, whose orbit returns to contact again and again. The letters "
                "a to d mark the four values of Γ of Fig. 4. (b): mean rotor speed, in ωΦ. The "
                "orbits with contact are long, and differ from each Γ to the next. So their mean "
                "speeds are scattered. If rounding errors decide an orbit, no speed is shown. "
                "(c): relative speed of the impacts. Pink: impacts earlier in the period than "
                "the impact of period 1, on the lower branch of (a). Green: later impacts. After "
                "the doubling the impacts of the lower branch become harder. Their friction "
                "brings the rotor closer to the platform's speed at these impacts. So the mean "
                "speed rises. Bottom, not in the paper: Lyapunov exponent of the axial motion "
                "for each impact, above 0 in chaos. Orange marks at the edge: −∞, because after "
                "contact all motions are the same.",
                _chattering_motor),
    PaperFigure("fig4a", "Fig. 4, Γ = 0.34",
                "The basin of the period-1 orbit covers 11.6 % of the shown phase space.",
                _share("11.6"), BASINS,
                "The text does not give the window. With τ_imp in [0, 2π) and w_A in (−5, 0) "
                "πg/ω, the computed shares agree with the paper's shares at Γ = 0.34 and 0.45."),
    PaperFigure("fig4b", "Fig. 4, Γ = 0.45",
                "The basin of the period-1 orbit widens to 34.7 %.", _share("34.7"), BASINS),
    PaperFigure("fig4c", "Fig. 4, Γ = 0.55",
                "The fractal nature of the basin boundary implies a sensitive dependence on the "
                "initial condition.", _share(""), BASINS,
                "α and the dimension are valid for the distances named: in this window α is 0.2 at "
                "1e-3, 0.1 at 1e-7 and 0.05 to 0.1 below 1e-9."),
    PaperFigure("fig4d", "Fig. 4, Γ = 0.60",
                "The whole region is in the basin of one attractor.", _share(""), BASINS,
                "Between two contacts rounding errors grow beyond the size of the attractor. So "
                "other arithmetic would give another number of cycles, and the table gives none."),
    PaperFigure("ease", "Beyond the paper: how easy a multiple toss is",
                "A wide basin implies a wider margin of variability: it would be easier to "
                "maintain a period-1 orbit for Γ ≈ 0.486, where the best phase lag is −0.26π.",
                _widest, SHARES),
    PaperFigure("ease_restitution", "Beyond the paper: the same over the restitution",
                "Named as further work.", _none, SHARES),
    PaperFigure("ease_angular_forcing", "Beyond the paper: best phase lag over Γ_T",
                "Named as further work. Shares do not depend on Γ_T; phase lag and speed of orbits "
                "beyond period 1 do.", _none, SHARES),
)  # fmt: skip


INTRODUCTION = (
    "This page has each figure of Liu, Friend, Yeo (EPL 2009) with the command that computes it, "
    "and compares each printed number with the computed number. *Agrees* means that the computed "
    "number rounds to the printed number. Where the two differ, the reason is given. Nothing is "
    "tuned to a printed number.\n\n"
    "`make figures` computes all figures. The parameter files are in config/ of the sources, and "
    "in share/bouncing_disk_ros/config where the package is installed. Without the command ros2, "
    "change two parts of a command: write `python -m bouncing_disk_ros NAME` in place of `ros2 "
    "run bouncing_disk_ros NAME`, and `config/` of the sources in place of `$(…)/config/`. For "
    "another restitution, add for "
    "example `-p restitution:=0.3` at the end."
)


def page(results: Mapping[str, xr.Dataset]) -> str:
    """docs/figures.md."""
    parts = [
        "# Figures of the paper, computed",
        "<!-- Written by `make figures` (tools/make_figures.py). -->",
        INTRODUCTION,
    ]
    for figure in FIGURES:
        result = results[figure.name]
        study = str(result.attrs["identity"]["study"])
        command = (
            f"ros2 run bouncing_disk_ros {study} --ros-args "
            f"--params-file $(ros2 pkg prefix --share bouncing_disk_ros)/config/{figure.name}.yaml"
        )
        parts += [f"## {figure.heading}", f"The paper: {figure.statement}"]
        remark = figure.remark if isinstance(figure.remark, str) else figure.remark()
        parts += [remark] if remark else []
        parts.append(f"```sh\n{command}\n```")
        parts += [f"![{figure.heading}](figures/{figure.name}_{picture}.png)"
                  for picture in PICTURES.get(study, (study,))]  # fmt: skip
        parts.append(f"*{figure.caption}*")
        numbers = figure.numbers(result)
        if numbers:
            rows = ["| quantity | paper | computed | |", "|---|---|---|---|"]
            parts.append("\n".join([*rows, *map(_row, numbers)]))
    return "\n\n".join(parts) + "\n"


PICTURES = {"toss_map": ("toss_map", "trajectories")}
"""Pictures of a study, where there is not just one of its own name."""


def _row(number: Number) -> str:
    ours = f"{number.ours:.10g}" if "doubling" in number.what else f"{number.ours:.5g}"
    unit = f" {number.unit}" if number.unit else ""
    verdict = ""
    if number.paper:
        verdict = "agrees" if agrees(number) else f"differs: {number.reason}"
    return f"| {number.what} | {number.paper or '-'} | {ours}{unit} | {verdict} |"
