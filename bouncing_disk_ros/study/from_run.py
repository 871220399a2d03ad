"""What a study takes from a recorded run or a preset: forcing, restitution, phase lag, the disk.

With P/m added to gravity: Γ = Aω²/(π g), Γ_T = a_g²Φω²/(a_e π g μ).
"""

from __future__ import annotations

import math
import sys
from collections.abc import Collection, Mapping, Sequence
from typing import NamedTuple

from tqdm import tqdm

from bouncing_disk_ros import bag, parameters
from bouncing_disk_ros.core.model import Disk, Motion
from bouncing_disk_ros.errors import FailedError, InputError
from bouncing_disk_ros.maps.scales import (
    MAP_PARAMETERS,
    acceleration,
    angular_forcing_of,
    axial_forcing_of,
)
from bouncing_disk_ros.parameters import Spec, Value
from bouncing_disk_ros.report.read_run import BagRun, ReadOptions
from bouncing_disk_ros.report.run_record import RunRecord
from bouncing_disk_ros.report.spans import Segment, known, segments_of, time_decimals
from bouncing_disk_ros.run.presets import load_preset
from bouncing_disk_ros.run.session import motion_of
from bouncing_disk_ros.study.definition import StudyDefinition
from bouncing_disk_ros.units import NS

NEEDED = ("disk/inputs", "platform/motion", "disk/impacts", "disk/rotor_speed")


_DECIDED_BY = {
    "axial_forcing": ("axial_amplitude",),
    "angular_forcing": ("angular_amplitude",),
    "gravity": ("gravity", "preload"),
}
"""What decides a number that follows from several: a preset must have one of these."""
RECORDED = (*MAP_PARAMETERS, *Motion._fields, *Disk._fields)
"""What a run has, by `numbers`."""


class FromBag(NamedTuple):
    """What was found in a bag."""

    values: Mapping[str, Value]
    text: str  # one line that says so
    warnings: tuple[str, ...]


def wanted(
    definition: StudyDefinition, values: Mapping[str, Value], given: Collection[str]
) -> dict[str, Spec]:
    """The options that a study takes from a run: all that it has, unless given or idle."""
    idle = {name for name, *_ in definition.all_idle(values)}
    return {
        name: spec
        for name, spec in definition.options.items()
        if name in RECORDED and name not in idle and name not in given
    }


def of_preset(
    name: str, wanted: Mapping[str, Spec], *, takes_loads: bool = False
) -> dict[str, Value]:
    """The options of a study that are `wanted` and that a preset decides.

    `takes_loads`: as in `numbers`. A platform at rest decides no angular forcing: the study has
    another motion.

    Raises InputError for a preset that cannot be read, whose values the study cannot use, or whose
    platform does not move up and down where such a motion is wanted.
    """
    preset = load_preset(name)
    whole = parameters.complete(preset)
    motion = motion_of(whole)
    values = numbers(motion, Disk.of(whole), takes_loads=takes_loads)
    is_at_rest = motion.axial_amplitude == motion.angular_amplitude == 0.0
    taken = {
        key: _checked(name, "preset", spec, float(values[key]))
        for key, spec in wanted.items()
        if not preset.keys().isdisjoint(_DECIDED_BY.get(key, (key,)))
        and not (is_at_rest and key == "angular_forcing")
    }
    for key in FORCING:
        if taken.get(key) == 0.0:
            allowed = "a preset in which the platform moves up and down"
            raise InputError("preset", name, allowed, f"Give {key}:=... too.")
    return taken


def read_bag(
    path: str, namespace: str | None, wanted: Mapping[str, Spec], *, takes_loads: bool = False
) -> FromBag:
    """The options of a study that are `wanted`, from the last steady motion up and down.

    It is that of the last run in the bag, with the disk in force then.

    `takes_loads`: as in `numbers`; nothing is left out then.

    Raises InputError for a bag that is damaged or without one, or whose values the study cannot
    use; FailedError when the disk fails.
    """
    try:
        steady = steady_segments(_record(path, namespace), path)
    except bag.BagError as error:
        raise InputError("bag", path, "a bag that can be read", str(error)) from None
    except OSError as error:
        raise FailedError(f"{path}: {error}") from None
    segment = _last_moving(steady, path, wanted)
    assert segment.motion is not None
    values = numbers(segment.motion, segment.disk, takes_loads=takes_loads)
    taken = {
        name: _checked(path, "bag", spec, float(values[name])) for name, spec in wanted.items()
    }
    shown = ", ".join(
        f"{_symbol(wanted[name])} = {value:.10g}{_unit(wanted[name])}"
        for name, value in taken.items()
    )
    decimals = time_decimals(steady[-1].end - steady[0].begin)
    begin, end = (f"{time:.{decimals}f}" for time in (segment.begin, segment.end))
    which = "" if segment is steady[-1] else ", the last in which the platform moves up and down"
    text = (
        f"from {path}, steady motion from {begin} to {end} s{which}: "
        f"{shown or 'nothing, all is given'}"
    )
    return FromBag(taken, text, () if takes_loads else tuple(_warnings(segment.disk)))


def _symbol(spec: Spec) -> str:
    return spec.symbol.split(" ")[0] or spec.name


def _unit(spec: Spec) -> str:
    return f" {spec.shown_unit}" if spec.shown_unit and spec.name not in MAP_PARAMETERS else ""


def _record(path: str, namespace: str | None) -> RunRecord:
    with bag.open(path) as opened:
        reader = BagRun(opened, ReadOptions(namespace, most_rows=1, topics=NEEDED))
        for _ in tqdm(reader.read(), "bag", reader.total, leave=False, disable=None,
                      file=sys.stderr, unit=" messages"):  # fmt: skip
            pass
        return reader.record


def steady_segments(record: RunRecord, path: str) -> list[Segment]:
    """The stretches with a known steady motion and a known disk, in order. Raises InputError."""
    rows = record.rows
    times = [float(rows["time"][-1])] if len(rows) else []
    times += [time for time, _ in record.speeds[-1:]] + [time for time, _ in record.disks[-1:]]
    times += [motion.begin_ns / NS for motion in record.motions]
    end = math.nextafter(max(times, default=0.0), math.inf)
    found = segments_of(record, 0.0, end)
    steady = [one for one in found if one.motion is not None and known(one.disk)]
    if not steady:
        allowed = "a bag with disk/inputs of a steady motion"
        raise InputError("bag", path, allowed, "Give the options themselves instead.")
    return steady


FORCING = ("axial_amplitude", "axial_forcing")
"""What a platform that does not move up and down has none of."""


def _last_moving(steady: Sequence[Segment], path: str, wanted: Collection[str]) -> Segment:
    """The last stretch with a motion up and down; the last one where no such motion is wanted."""
    moving = [one for one in steady if one.motion and one.motion.axial_amplitude > 0.0]
    if moving or not set(FORCING) & set(wanted):
        return (moving or steady)[-1]
    allowed = "a bag with a steady motion in which the platform moves up and down"
    raise InputError("bag", path, allowed, "Give the options themselves instead.")


def numbers(motion: Motion, disk: Disk, *, takes_loads: bool = False) -> dict[str, float]:
    """A motion and a disk, and what they amount to; nan and inf without gravity or friction.

    `takes_loads`: the study knows preload, load and brake torque. For another one the preload is
    part of gravity: g + P/m.
    """
    gravity = disk.gravity if takes_loads else acceleration(disk)
    return {
        "axial_forcing": axial_forcing_of(motion, disk),
        "restitution": disk.restitution,
        "phase_lag": motion.phase_lag,
        "angular_forcing": angular_forcing_of(motion, disk),
        **motion._asdict(),
        **disk._asdict(),
        "gravity": gravity,
    }


def _checked(path: str, source: str, spec: Spec, value: float) -> Value:
    try:
        return spec.checked(value)
    except InputError as error:
        hint = f"This value is computed from {path}; give another with {spec.name}:=..."
        raise InputError(f"{spec.name} from the {source}", value, error.allowed, hint) from None


def _warnings(disk: Disk) -> list[str]:
    loads = {"load torque": disk.load_torque, "brake torque": disk.brake_torque}
    return [
        f"the {name} of that run, {torque:g} N·m, is left out: this study has none, its speeds are "
        "those of a disk without it"
        for name, torque in loads.items()
        if torque
    ]
