"""Options of `fit_impacts`, as a command and as a function, and which of them suit each other."""

from __future__ import annotations

from collections.abc import Mapping

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.parameters import Spec

_SPECS = (
    Spec("frequency", 0.0, "Hz", "frequency of the platform; 0: it is at rest", "f", low=0.0,
         high=1e7),
    Spec("frequency_error", 0.0, "Hz", "how well the frequency is known; above 0 it is fitted",
         low=0.0, high=1e7),
    Spec("axial_amplitude", 0.0, "m", "amplitude of the platform, if it is known; 0: fitted", "A",
         low=0.0, high=1e6),
    Spec("forcing_phase", 0.0, "rad", "of the platform at time 0, by a reference", "φ", low=-1e6,
         high=1e6, angle=True),
    Spec("forcing_phase_error", 0.0, "rad", "standard deviation of that phase; 0: there is no "
         "reference", low=0.0, high=1e3),
    Spec("delay", 0.0, "s", "of the measured times behind the impacts, such as that of sound, with "
         "a phase reference", low=-1e3, high=1e3),
    Spec("delay_error", 0.0, "s", "standard deviation of the delay", low=0.0, high=1e3),
    Spec("dead_time", 0.0, "s", "of the detector: after a hit it hears nothing for so long; 0: not "
         "known", low=0.0, high=1e3),
    Spec("gravity", 0.0, "m/s²", "acceleration of gravity; 0: standard gravity", "g", low=0.0,
         high=1e9),
    Spec("height", 0.0, "m", "height of the release at rest, if no impact is missed: then gravity "
         "is found", low=0.0, high=1e6),
    Spec("fall_time", 0.0, "s", "from that release to the first impact; 0: not known", low=0.0,
         high=1e6),
    Spec("time_error", 0.0, "s", "standard deviation of the times; 0: fitted", low=0.0, high=1e6),
    Spec("scatter", -1.0, "1", "standard deviation of the restitution from impact to impact; "
         "below 0: fitted", "σ_ε", low=-1.0, high=1.0),
    Spec("column", "", "", "of a text with several: a name, or a number from 1 on; default: time, "
         "t, or the first"),
    Spec("namespace", "", "", "of a bag with several simulators"),
    Spec("figures", "png", "", "kinds of figure files: any of png, pdf, svg, or none"),
)  # fmt: skip
OPTIONS = {spec.name: spec for spec in _SPECS}
"""All options of the command; the function has them too, but for the figures."""
_SMALL = ("axial_amplitude", "forcing_phase_error", "gravity", "height", "fall_time")
_LEAST = {"frequency": 1e-6, **dict.fromkeys(_SMALL, 1e-9)}
"""The least values above 0: with smaller ones nothing can be computed."""


def checked_options(given: Mapping[str, object]) -> dict[str, float]:
    """The numbers among the options, in their ranges, that have an effect beside each other.

    Raises InputError.
    """
    values = {name: float(OPTIONS[name].checked(value)) for name, value in given.items()}
    for name, least in _LEAST.items():
        if 0.0 < values[name] < least:
            allowed = f"0, or a finite number >= {least:g} {OPTIONS[name].shown_unit}"
            raise InputError(name, values[name], allowed)
    if values["scatter"] > 0.0 and values["time_error"] == 0.0:
        hint = "Give time_error too, or leave the scatter to the fit."
        allowed = "0, or below 0, without time_error"
        raise InputError("scatter", values["scatter"], allowed, hint)
    for name, allowed, hint in _idle(values):
        if values[name]:
            raise InputError(name, values[name], allowed, hint)
    if 0.0 < values["frequency"] <= values["frequency_error"]:
        allowed = f"less than the frequency, {values['frequency']:g} Hz"
        raise InputError("frequency_error", values["frequency_error"], allowed)
    return values


def _idle(values: Mapping[str, float]) -> list[tuple[str, str, str]]:
    """The options that do nothing beside the others: name, what is allowed, why."""
    found = []
    if values["frequency"]:
        found += [(name, "0 with a frequency", "") for name in ("height", "fall_time")]
    else:
        names = ("frequency_error", "axial_amplitude", "forcing_phase_error")
        found += [(name, "0 without a frequency", "") for name in names]
    if values["height"]:
        found.append(("gravity", "0 with a height", "The height tells gravity."))
    if not values["forcing_phase_error"]:
        why = "A phase reference has an error above 0."
        names = ("forcing_phase", "delay", "delay_error")
        found += [(name, "0 without forcing_phase_error", why) for name in names]
    return found
