"""The files of the reference cases: how they are written, read again, and listed for a user.

A case has a JSON file (parameters, inputs, what its columns mean) and a CSV file of events. Bounds
are decimals, rounded outward; parameters are float64, in decimals and in hex.
"""

from __future__ import annotations

import csv
import functools
import importlib.util
import io
import json
import math
from collections.abc import Mapping
from fractions import Fraction
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.cases.definitions import CASES, Case
from bouncing_disk_ros.errors import InputError, MissingLibraryError, closest
from bouncing_disk_ros.folders import share_directory
from bouncing_disk_ros.parameters import TABLE, checked
from bouncing_disk_ros.regular_file import replaced

if TYPE_CHECKING:
    from flint import arb

    from bouncing_disk_ros.cases.enclosure import Enclosed

PLACES = 17
"""Decimals of a bound: 1e-17 s, m, rad, m/s or rad/s, below 1e-15 of every case's scales."""
_BITS = 256
"""Of an end of a ball; it is rounded outward to them."""
QUANTITIES = {
    "time": "s",
    "position": "m",
    "velocity_before": "m/s",
    "velocity_after": "m/s",
    "angle": "rad",
    "angular_velocity_before": "rad/s",
    "angular_velocity_after": "rad/s",
}
"""Columns with a lower and an upper bound, and their units."""
TIME_SCALE = 1.0 / (2.0 * math.pi)
"""s: 1/ω at 1 Hz. Scales of length and speed follow with g."""
FOLDER = "reference_cases"
_LAW = {
    "platform": "s(t) = A sin(2 pi f t) + path(t), beta(t) = Phi sin(2 pi f t + phase_lag)",
    "flight": "x'' = -(g + P/m), alpha'' = -T_L/I, I = m a_g^2",
    "impact": "at x = s, w = x' - s' < 0: x' becomes s' - e w; Coulomb friction at the radius a_e "
    "takes at most the angular impulse mu a_e m (1 + e)|w| and never more than the slip "
    "alpha' - beta'",
    "contact": "from the end of infinitely many impacts on, x = s until g + P/m + s'' falls "
    "through 0; friction sticks or slides with at most mu a_e (m g + P + m s'')",
}
_COLUMNS = {
    "event": "number of the event, from 1",
    "kind": "impact; contact (bounces have ended); separation; stick, slip (in contact); impulse "
    "(an input); end (of the case)",
    "..._lower, ..._upper": "certain bounds, rounded outward; SI units; speeds are absolute",
    "condition": "of an impact: how many times greater an error of the start (height over "
    "g/omega^2, velocity over g/omega) is in the time of the impact (over 1/omega), "
    "omega = 2 pi/s",
}


def _decimal(x: arb, *, up: bool) -> str:
    """A bound of a ball as a decimal, rounded outward."""
    from flint import ctx

    with ctx.workprec(_BITS):
        mantissa, exponent = (x.upper() if up else x.lower()).man_exp()
    scaled = Fraction(int(mantissa)) * Fraction(2) ** int(exponent) * 10**PLACES
    whole = math.ceil(scaled) if up else math.floor(scaled)
    digits = f"{abs(whole):0{PLACES + 1}d}"
    return f"{'-' if whole < 0 else ''}{digits[:-PLACES]}.{digits[-PLACES:]}"


def events_text(events: list[Enclosed]) -> str:
    """The CSV file of a case."""
    file = io.StringIO()
    rows = csv.writer(file, lineterminator="\n")
    bounds = [f"{name}_{end}" for name in QUANTITIES for end in ("lower", "upper")]
    rows.writerow(["event", "kind", *bounds, "condition"])
    for number, event in enumerate(events, start=1):
        balls = [getattr(event, name) for name in QUANTITIES]
        ends = [_decimal(ball, up=up) for ball in balls for up in (False, True)]
        condition = "" if math.isnan(event.condition) else f"{event.condition:.3g}"
        rows.writerow([number, event.kind.value, *ends, condition])
    return file.getvalue()


def _number(value: float) -> dict[str, object]:
    return {"value": value, "hex": value.hex()}


def case_text(case: Case) -> str:
    """The JSON file of a case."""
    stated = {}
    for name, value in case.parameters.items():
        spec = TABLE[name]
        shown = {"value": value} if isinstance(value, bool) else _number(value)
        stated[name] = {**shown, "unit": spec.unit, "meaning": spec.description}
    content = {
        "case": case.number,
        "name": case.name,
        "tests": case.tests,
        "duration": {**_number(case.duration), "unit": "s"},
        "law": _LAW,
        "parameters": stated,
        "inputs": _inputs(case),
        "events": {"file": f"{case.file_stem}.csv", "columns": _COLUMNS, "units": QUANTITIES},
        "scales": {
            "time": {**_number(TIME_SCALE), "unit": "s"},
            "position": {**_number(length_scale(case)), "unit": "m"},
        },
    }
    return json.dumps(content, indent=1) + "\n"


def length_scale(case: Case) -> float:
    """g/ω² at 1 Hz, m."""
    return float(case.parameters["gravity"]) * TIME_SCALE**2


def _inputs(case: Case) -> list[dict[str, object]]:
    found: list[dict[str, object]] = [
        {"kind": "impulse", "time_s": _number(t), "axial_N_s": _number(j),
         "angular_N_m_s": _number(twist)}
        for t, j, twist in case.impulses
    ]  # fmt: skip
    for time, values in case.programme:
        begin = time - 1.0 / min(1.0, values.get("frequency", 1.0))
        found.append({
            "kind": "change of motion", "begin_s": _number(begin), "end_s": _number(time),
            "to": {name: _number(value) for name, value in values.items()},
            "blend": "each value goes from old to new by y^3 (10 - 15 y + 6 y^2), "
                     "y = (t - begin)/(end - begin); the phase is the integral of 2 pi f",
        })  # fmt: skip
    for time, values in case.trajectory:
        for joint, given in values.items():
            end = given if isinstance(given, tuple) else (given,)
            text = "straight line" if len(end) == 1 else "cubic polynomial"
            found.append({
                "kind": "path of the platform", "joint": joint, "is": f"{text} from 0 at rest",
                "end_s": _number(time), "position_at_end": _number(end[0]),
                **({"velocity_at_end": _number(end[1])} if len(end) > 1 else {}),
            })  # fmt: skip
    return found


def write(target: Path, case: Case) -> list[Path]:
    """Enclose a case and write its files into a folder; the paths written."""
    from bouncing_disk_ros.cases.enclosure import enclose

    texts = {"json": case_text(case), "csv": events_text(enclose(case))}
    paths = [target / f"{case.file_stem}.{ending}" for ending in texts]
    for path, text in zip(paths, texts.values(), strict=True):
        replaced(path, partial(Path.write_text, data=text, encoding="utf-8"))
    return paths


def folder() -> Path:
    """Where the files of the cases are installed."""
    return share_directory() / "config" / FOLDER


# ------------------------------------------------------------------------------------------------
# The cases as a user has them.


class ReferenceCase:
    """A reference case: how it is simulated, and its events with certain bounds.

    `events` has a row for each event: `kind`, `condition`, and for each of `time`, `position`,
    `velocity_before`, `velocity_after`, `angle`, `angular_velocity_before` and
    `angular_velocity_after` the fields `..._lower` and `..._upper` (SI units; a float64 each, the
    nearest one at or outside of the bound).
    """

    def __init__(self, case: Case, events: NDArray[np.void]) -> None:
        """From a definition and its events as rows."""
        self.number, self.name, self.tests, self.duration = case[:4]
        self.case, self.events = case, events

    def keywords(self) -> dict[str, Any]:
        """What `simulate(case.duration, ...)` takes to run it."""
        return self.case.keywords()

    @property
    def impacts(self) -> NDArray[np.void]:
        """The events that are impacts."""
        return self.events[self.events["kind"] == "impact"]

    def __repr__(self) -> str:
        """Number, name, and how many events."""
        return f"<reference case {self.number}, {self.name}: {len(self.events)} events>"


def reference_cases() -> tuple[ReferenceCase, ...]:
    """The reference cases: events of the rigid-impact law with certain bounds, to compare with.

    >>> case = reference_cases()[8]
    >>> case.impacts["time_upper"]
    """
    return tuple(_loaded(case.number) for case in CASES)


def reference_case(wanted: object, **changes: float) -> ReferenceCase:
    """The reference case of a number or a name; InputError for another.

    `changes` are parameters of the case with other values: its events are then enclosed anew, which
    needs python-flint and takes up to a minute.

    >>> reference_case("drop").impacts["time_lower"]
    """
    names = [case.name for case in CASES]
    for case in CASES:
        if str(wanted).lstrip("0") == str(case.number) or wanted in (case.name, case.file_stem):
            return _changed(case, changes) if changes else _loaded(case.number)
    allowed = f"1 to {len(CASES)}, or a name: {', '.join(names)}"
    raise InputError("case", wanted, allowed, closest(str(wanted), names))


def _changed(case: Case, changes: Mapping[str, object]) -> ReferenceCase:
    """A case with other parameters, enclosed now."""
    if importlib.util.find_spec("flint") is None:
        raise MissingLibraryError("a changed parameter of a case", "python-flint")
    from bouncing_disk_ros.cases.enclosure import UndecidedError, enclose

    kept = {"frequency", "initial_forcing_phase", "initial_with_platform"}
    known = [name for name in case.parameters if name not in kept]
    for name in changes:
        if name not in known:
            raise InputError("parameter", name, ", ".join(known), closest(name, known))
    values = {name: float(value) for name, value in checked(changes).items()}
    other = case._replace(parameters={**case.parameters, **values})
    try:
        return ReferenceCase(other, _events(events_text(enclose(other))))
    except UndecidedError as error:
        raise InputError("parameters", changes, f"a case that can be enclosed: {error}") from None


@functools.cache
def _loaded(number: int) -> ReferenceCase:
    case = CASES[number - 1]
    return ReferenceCase(case, _events((folder() / f"{case.file_stem}.csv").read_text("utf-8")))


def _events(text: str) -> NDArray[np.void]:
    """The events of a CSV file as rows."""
    header, *rows = csv.reader(io.StringIO(text))
    bounds = header[2:-1]
    dtype = [("event", "<i8"), ("kind", "U10"), *((b, "<f8") for b in bounds), ("condition", "<f8")]
    table = [
        (int(row[0]), row[1], *map(_outward, row[2:-1], bounds), float(row[-1] or "nan"))
        for row in rows
    ]
    events = np.array(table, dtype)
    events.setflags(write=False)
    return events


def _outward(text: str, column: str) -> float:
    """A decimal bound as a float64 that is no tighter."""
    from decimal import Decimal

    value, exact = float(text), Decimal(text)
    if column.endswith("_lower"):
        return value if Decimal(value) <= exact else math.nextafter(value, -math.inf)
    return value if Decimal(value) >= exact else math.nextafter(value, math.inf)
