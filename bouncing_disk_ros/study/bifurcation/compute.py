"""The study `bifurcation`: attractors along one parameter (paper, Fig. 3).

One attractor is followed from value to value, or the same starts are followed at each value, which
shows all that coexist.
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Mapping
from functools import cached_property
from typing import ClassVar

import numpy as np
import xarray as xr

from bouncing_disk_ros.angles import angles_of
from bouncing_disk_ros.errors import InputError, one_of
from bouncing_disk_ros.maps.bifurcation_diagram import (
    STATE,
    Branch,
    begin,
    follow,
    from_starts,
)
from bouncing_disk_ros.maps.bifurcations import (
    ContactOnset,
    Doubling,
    contact_onset,
    feigenbaum_ratios,
    period_doublings,
)
from bouncing_disk_ros.maps.next_collision import (
    MapState,
    NextCollisionMap,
    spread_starts,
)
from bouncing_disk_ros.maps.period_one import existence_limit
from bouncing_disk_ros.maps.periodic_orbit import fixed_point
from bouncing_disk_ros.maps.scales import MAP_PARAMETERS
from bouncing_disk_ros.parameters import Value
from bouncing_disk_ros.study.computation import (
    CONTACTS_PER_IMPACT,
    Arrays,
    Axis,
    Field,
    Region,
    Row,
    Study,
    variables,
)

ONSET_IMPACTS = 100_000
"""Impacts in which contact is looked for at each value, where its onset is refined."""
VALUES_OF_A_REGION = 64
LEAST_OF_A_REGION, IMPACTS_OF_A_REGION, KEPT_OF_A_REGION = 256, 30_000_000, 1_000_000
"""From starts: at least so many trajectories, else about so many impacts, or so many to keep."""
_BESIDE_BIRTH = 1e-4
"""So far from the value where the period-1 orbit is born its continuation begins."""


class Bifurcation(Study):
    """Impacts on the attractor over a parameter, each value from where the one before ended.

    With `starts`: impacts on the attractors that these reach at each value.
    """

    name: ClassVar[str] = "bifurcation"
    title: ClassVar[str] = "Bifurcation diagram of the next-collision map"
    revision: ClassVar[int] = 2

    def __init__(self, parameters: Mapping[str, Value]) -> None:
        super().__init__(parameters)
        given = self.parameters
        self.axis = one_of("along", given["along"], MAP_PARAMETERS)
        if self._follows_period_one and self.axis == "axial_forcing" and given["begin"] == 0.0:
            given["begin"] = first = _first_forcing(float(given["restitution"]))
            if not float(given["end"]) > first:
                why = f"The period-1 orbit begins there at ε = {given['restitution']:g}."
                raise InputError("end", given["end"], f"> {first:g}", why)
        if int(given["kept"]) > int(given["measured"]):
            raise InputError("kept", given["kept"], f"at most measured = {given['measured']}")
        for end in ("begin", "end"):
            self._check_end(end)
        self.marks = self._marks()
        self._starts = self._spread()
        self.sequential = not self._starts
        if self.sequential:
            self._start()

    def _marks(self) -> list[float]:
        """The values to mark; the picture has those of its axis."""
        text = str(self.parameters["marks"])
        return angles_of("marks", text) if text.strip() else []

    @property
    def _follows_period_one(self) -> bool:
        """Whether the first value starts on the period-1 orbit."""
        return not int(self.parameters["starts"]) and self.parameters["initial_velocity"] == 0.0

    def _spread(self) -> list[MapState]:
        """The starts at each value, none to follow; what then plays no part is no parameter."""
        given, count = self.parameters, int(self.parameters["starts"])
        if count:
            for name in ("initial_phase", "initial_velocity"):
                value = given.pop(name)
                if value != 0.0:
                    hint = (
                        f"The {count} starts are spread over the window; with starts:=0 it is used."
                    )
                    raise InputError(name, value, "0 with starts", hint)
            return spread_starts(count, float(given["velocity_begin"]))
        del given["velocity_begin"], given["starts"]
        return []

    def _check_end(self, name: str) -> None:
        value = float(self.parameters[name])
        try:
            self.section(**{self.axis: value})
        except InputError as error:
            along = str(self.parameters["along"])
            raise InputError(name, value, error.allowed, f"It is a value of {along}.") from None

    def section(self, **changed: float) -> NextCollisionMap:
        """The map at the fixed parameters, some of them changed."""
        fixed = {name: float(self.parameters[name]) for name in MAP_PARAMETERS}
        return NextCollisionMap(**{**fixed, **changed})

    def _start(self) -> np.ndarray:
        """The state of the first value: that given, or the period-1 orbit there."""
        given = self.parameters
        section = self.section(**{self.axis: float(given["begin"])})
        velocity = float(given["initial_velocity"])
        if velocity == 0.0:
            try:
                return begin(section)
            except InputError as error:
                raise self._no_period_one(section, error) from None
        return begin(section, MapState(float(given["initial_phase"]) % math.tau, velocity))

    def _no_period_one(self, section: NextCollisionMap, error: InputError) -> InputError:
        """Why the first value cannot start on the period-1 orbit, in terms of what is given."""
        field = "begin" if self.axis in ("axial_forcing", "restitution") else "axial_forcing"
        hint = "The first value starts on the period-1 orbit, which needs that. "
        forcing, least = section.axial_forcing, existence_limit(section.restitution)
        if forcing >= least:
            allowed = error.allowed
        elif self.axis == "restitution":
            bound = existence_limit(forcing)  # (1 − ε)/(1 + ε) = Γ is its own inverse
            allowed = f"ε at least (1 − Γ)/(1 + Γ) = {bound:.6g} at Γ = {forcing:g}"
        else:
            allowed = f"Γ at least (1 − ε)/(1 + ε) = {least:.6g} at ε = {section.restitution:g}"
            hint += "With begin:=0 it is just above. " if field == "begin" else ""
        hint += "Or give a start of your own: initial_velocity < 0 and initial_phase."
        return InputError(field, self.parameters[field], allowed, hint)

    @property
    def axes(self) -> Mapping[str, Axis]:
        """The parameter, and the impacts kept at each value."""
        given = self.parameters
        symbol, unit = MAP_PARAMETERS[self.axis]
        values = np.linspace(float(given["begin"]), float(given["end"]), int(given["count"]))
        label = str(given["along"]).replace("_", " ")
        return {
            "value": Axis(values, unit, label, symbol),
            "impact": Axis(np.arange(int(given["kept"])), "1", "impacts, the last ones measured"),
            "number": Axis(np.arange(STATE), "1", "numbers of the state that the next begins with"),
            **({"start": self._start_axis()} if self._starts else {}),
        }

    def _start_axis(self) -> Axis:
        return Axis(np.arange(len(self._starts)), "1", "starts, in the order of spread_starts")

    @property
    def fields(self) -> Mapping[str, Field]:
        """As in `bifurcation_diagram.Branch`."""
        line = ("value", "start") if self._starts else ("value",)
        cloud, speed = (*line, "impact"), "omega Phi"
        known = "nan where roundings decide how contact goes on"
        return {
            "forcing_phase": Field(cloud, "float64", "rad", "forcing phase at impact", "τ_imp"),
            "axial_impact_velocity": Field(
                cloud, "float64", "pi g/omega", "relative velocity before impact", "w_A"
            ),
            "angular_velocity": Field(cloud, "float64", speed, "speed before impact", "α̇/(ωΦ)"),
            "contact": Field(cloud, "uint8", "1", "whether it was in contact before", fill=0),
            "mean_speed": Field(line, "float64", speed, f"mean speed in time, {known}"),
            "mean_speed_per_impact": Field(
                line, "float64", speed, f"mean speed of the impacts, {known}"
            ),
            "lyapunov_exponent": Field(line, "float64", "1", "Lyapunov exponent per impact", "λ"),
            "contacts": Field(line, "float64", "1", CONTACTS_PER_IMPACT),
            "state": Field((*line, "number"), "float64", "1", "state after the last impact"),
        }

    @property
    def chunks(self) -> Mapping[str, int]:
        """Values in a row."""
        if not self._starts:
            return {"value": VALUES_OF_A_REGION}
        settling, measured, kept = self._counts.values()
        together = min(IMPACTS_OF_A_REGION // (settling + measured), KEPT_OF_A_REGION // kept)
        together = max(LEAST_OF_A_REGION, together)
        return {"value": -(-together // len(self._starts))}

    @property
    def _counts(self) -> dict[str, int]:
        return {name: int(self.parameters[name]) for name in ("settling", "measured", "kept")}

    def compute(self, region: Region, context: Arrays, before: Arrays | None) -> Arrays:  # noqa: ARG002
        """Follow the starts, or go on from the state of the region before."""
        values = self.axes["value"].values[region.slices["value"]].astype(float)
        if self._starts:
            whole = from_starts(self.section(), self.axis, values, self._starts, **self._counts)
            return _fields_of(whole, slice(None))
        state = self._start() if before is None else before["state"][-1:].astype(float)
        return _fields_of(follow(self.section(), self.axis, values, state, **self._counts), 0)

    def finish(self, result: xr.Dataset, context: Arrays) -> xr.Dataset:  # noqa: ARG002
        """Add the period doublings along Γ or ε, and where what is followed comes to contact."""
        points = self.doublings
        values = [point.value for point in points]
        ratios = feigenbaum_ratios(values) if len(values) > 2 else np.empty(0)
        number = "doubling_number"
        doublings: dict[str, Row] = {
            "doubling": (number, np.array(values), "1",
                         "value of the parameter at a period doubling"),
            "doubling_impacts": (number, [point.impacts for point in points], "1",
                                 "impacts in one repetition below the doubling"),
            "feigenbaum_ratio": ("ratio_number", ratios, "1",
                                 "ratio of the distances of successive doublings"),
        }  # fmt: skip
        return result.assign(variables(doublings | self._onset(result)))

    def _onset(self, result: xr.Dataset) -> dict[str, Row]:
        """Where the attractor that is followed along Γ or ε first comes to contact, if it does."""
        if self._starts or self.axis not in ("axial_forcing", "restitution"):
            return {}
        contacts = result["contacts"].values
        first = np.flatnonzero((contacts[:-1] == 0.0) & (contacts[1:] > 0.0))
        if not len(first):
            return {}
        found, last = self._onset_before(result, int(first[0]))
        if found is None:
            return {}
        seen = f"in {ONSET_IMPACTS} impacts of the attractor followed"
        exponent = result["lyapunov_exponent"].values[last]
        return {
            "contact_onset": ((), found.value, "1", f"first contact {seen}"),
            "contact_onset_without": ((), found.without, "1", f"no contact {seen}"),
            "contact_onset_exponent": (
                (), exponent, "1", "Lyapunov exponent at the value before"
            ),
        }  # fmt: skip

    def _onset_before(self, result: xr.Dataset, last: int) -> tuple[ContactOnset | None, int]:
        """The onset after the last value without contact, and that value's number.

        Contact is rare at first: the fewer impacts that were measured may have held none at values
        where more of them do. So the search begins where those more hold none.
        """
        values, states = result["value"].values, result["state"].values
        after = float(values[last + 1])
        for i in range(last, -1, -1):
            section = self.section(**{self.axis: float(values[i]), "angular_forcing": math.inf})
            state = MapState(float(states[i, 0]), float(states[i, 1]))
            with contextlib.suppress(InputError):  # contact in more impacts
                return contact_onset(section, self.axis, after, state, impacts=ONSET_IMPACTS), i
        return None, 0

    @cached_property
    def doublings(self) -> list[Doubling]:
        """Period doublings of the period-1 orbit, by continuation, not read off the diagram."""
        count = int(self.parameters["doublings"])
        if self.axis not in ("axial_forcing", "restitution") or not count:
            return []
        low, high = sorted(float(self.parameters[name]) for name in ("begin", "end"))
        fixed = self.section(**{self.axis: low})
        # (1 − ε)/(1 + ε) = Γ where the orbit is born, the same with Γ and ε exchanged
        born = existence_limit(
            fixed.restitution if self.axis == "axial_forcing" else fixed.axial_forcing
        )
        section = self.section(**{self.axis: max(low, born + _BESIDE_BIRTH)})
        if not getattr(section, self.axis) < high:
            return []
        try:
            orbit = fixed_point(section.axial_forcing, section.restitution)
        except InputError:  # no period-1 orbit there
            return []
        if not orbit.stable:  # its doublings lie below the axis
            return []
        return list(period_doublings(orbit, self.axis, high, count))


def _fields_of(branch: Branch, start: int | slice) -> Arrays:
    """The arrays of a region: of one start, or with an axis of starts."""
    arrays = {name: getattr(branch, name)[:, start] for name in Branch._fields[1:-1]}
    arrays["contact"] = arrays["contact"].astype(np.uint8)
    return {**arrays, "state": branch.ends[:, start]}


def _first_forcing(restitution: float) -> float:
    """Γ half a percent above where the period-1 orbit begins, (1 − ε)/(1 + ε): 0.335 at ε = 0.5."""
    return round(1.005 * existence_limit(restitution), 6)


def branch_of(result: xr.Dataset) -> Branch:
    """A stored diagram as the analysis gives it."""
    one = slice(None) if "start" in result.dims else (slice(None), None)
    arrays = {name: result[name].values[one] for name in Branch._fields[1:-1]}
    arrays["contact"] = arrays["contact"].astype(bool)
    return Branch(values=result["value"].values, ends=result["state"].values[one], **arrays)
