"""The one table of parameters: it feeds ROS descriptors, validation, presets, `--help` and docs.

Every default has its home here. A value is checked by `Spec.checked` (one value) and by
`check_together` (rules that hold between values).
"""

from __future__ import annotations

import math
import re
from array import array
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

from bouncing_disk_ros.angles import angle_of
from bouncing_disk_ros.errors import InputError, closest
from bouncing_disk_ros.field_checks import plain

Value = bool | int | float | str
TYPE_NAMES = MappingProxyType({bool: "bool", int: "integer", float: "double", str: "string"})


_NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)[eE][-+]?\d+|\+?\.?inf")
"""Numbers that YAML 1.1 reads as texts, as Python writes them."""


@dataclass(frozen=True)
class Spec:
    """One parameter; `low` and `high` are inclusive bounds, None: no bound."""

    name: str
    default: Value
    unit: str
    description: str
    symbol: str = ""
    low: float | None = None
    high: float | None = None
    read_only: bool = False
    group: str = "run"
    source: str = ""
    while_unconfigured: bool = False
    """Whether it can be set only while the node is unconfigured: no run has begun."""
    listed: bool = False
    """Whether it is a list of texts: an array of strings on a node, here what `joined` makes."""
    angle: bool = False
    """Whether it can be an angle though its unit is not rad."""
    words: tuple[str, ...] = ()
    """The texts that are allowed, where only some are."""
    unlimited: bool = False
    """Whether inf stands for its highest value, which is no limit."""
    numbers: bool = False
    """Whether it is a text of numbers: one number or a sequence of them may come for it."""

    @property
    def spelled(self) -> str:
        """Its name in words, with its symbol."""
        return f"{self.name.replace('_', ' ')} {self.symbol}".rstrip()

    @property
    def type(self) -> type[Value]:
        """The Python type of the values: bool, int, float or str."""
        return type(self.default)

    @property
    def type_name(self) -> str:
        """The name ROS gives that type."""
        return "string array" if self.listed else TYPE_NAMES[self.type]

    @property
    def allowed(self) -> str:
        """What is accepted, in words."""
        if self.type is bool:
            return "true or false"
        if self.words:
            return ", ".join(self.words[:-1]) + " or " + self.words[-1]
        if self.listed:
            return "texts, or one text with blanks or commas between them"
        if self.type is str:
            return "a text"
        unit = f" {self.shown_unit}".rstrip()
        noun = "an integer" if self.type is int else "a finite number"
        low = "" if self.low is None else f">= {self.low:g}"
        high = "" if self.high is None else f"<= {self.high:g}"
        part = " (also 0.25pi)" if self.takes_angle else ""
        return f"{noun} {' and '.join(part for part in (low, high) if part)}".rstrip() + unit + part

    @property
    def bounds(self) -> tuple[float, float]:
        """`low` and `high`; infinite where there is none."""
        low, high = self.low, self.high
        return -math.inf if low is None else low, math.inf if high is None else high

    @property
    def acts_at_reset(self) -> bool:
        """Whether a change acts at the next reset only."""
        return self.group in ("motion", "start")

    @property
    def shown_unit(self) -> str:
        """The unit as people read it: nothing where it is dimensionless."""
        return "" if self.unit == "1" else self.unit

    @property
    def takes_angle(self) -> bool:
        """Whether a text such as 0.25pi is a value."""
        return self.type is float and (self.angle or self.unit == "rad")

    def cast(self, given: object) -> object:
        """An integer, or a text with a part of π, where a double is wanted; texts joined.

        Numbers of NumPy as Python's. Everything else as it is.
        """
        given = plain(given)
        if self.listed and isinstance(given, (list, tuple)):
            return joined(given) if all(isinstance(one, str) for one in given) else given
        if given is False and "off" in self.words:  # as YAML reads it
            return "off"
        if self.numbers:
            return listed_text(given)
        if self._is_castable(given):
            return float(given)  # type: ignore[arg-type]
        if self.type is float and isinstance(given, str) and _NUMBER.fullmatch(given):
            given = float(given)  # 1e-06 and inf: `ros2 param load` reads texts there
        if self.unlimited and given == math.inf:
            return self.high
        angle = angle_of(given) if isinstance(given, str) and self.takes_angle else None
        return given if angle is None else angle

    def checked(self, given: object, field: str = "") -> Value:
        """The value to use, cast, or InputError; `field` names it, else the parameter's name."""
        field = field or self.name
        value = self.cast(given)
        if type(value) is not self.type:
            hint = f"It is {_with_article(self.type_name)}, not {_with_article(_type_of(given))}."
            raise InputError(field, given, self.allowed, hint)
        assert isinstance(value, (bool, int, float, str))
        if isinstance(value, str) and self.words and value not in self.words:
            raise InputError(field, given, self.allowed, closest(value, self.words))
        if isinstance(value, (bool, str)):
            return value
        low, high = self.bounds
        if not math.isfinite(value) or not low <= value <= high:
            raise InputError(field, given, self.allowed)
        return value

    def _is_castable(self, given: object) -> bool:
        """Whether this is an integer where a double is wanted."""
        if self.type is not float or type(given) is not int:
            return False
        return abs(given) <= 2**1000  # float() overflows at 2**1024


_PAPER = "Liu, Friend, Yeo (EPL 2009)"
_DOUGH = "a dough of diameter 0.30 m"

_SPECS = (
    # --- platform motion at the start and after a reset; the command topics change it while running
    Spec("axial_amplitude", 0.039, "m", "axial amplitude of the platform at the start and after a "
         "reset; while it runs, command the platform", "A", low=0.0, high=1e6, group="motion",
         source="axial forcing about 0.45 at 3 Hz"),
    Spec("angular_amplitude", 0.5, "rad", "angular amplitude of the platform at the start and "
         "after a reset", "Φ", low=0.0, high=1e6, group="motion", source="chosen"),
    Spec("frequency", 3.0, "Hz", "frequency of the platform at the start and after a reset "
         "(to stop it, set the amplitudes to 0)", "f = ω/2π", low=1e-6, high=1e7,
         group="motion", source=f"{_PAPER}: ω = 6π rad/s"),
    Spec("phase_lag", 0.0, "rad", "phase of the angular relative to the axial motion at the start "
         "and after a reset; wraps", "θ", low=-1e6, high=1e6, group="motion",
         source=f"{_PAPER}, Fig. 3b"),
    # --- disk and contact
    Spec("mass", 0.25, "kg", "mass of the disk", "m", low=1e-12, high=1e12, while_unconfigured=True,
         group="disk", source=f"chosen, {_DOUGH}"),
    Spec("restitution", 0.5, "1", "coefficient of restitution: 0 no bounce, 1 no loss of energy",
         "ε", low=0.0, high=1.0, group="disk", source=_PAPER),
    Spec("friction", 0.6, "1", "coefficient of Coulomb friction, static and kinetic", "μ", low=0.0,
         high=1e9, group="disk", source=_PAPER),
    Spec("friction_radius", 0.12, "m", "effective radius at which friction acts", "a_e", low=1e-9,
         high=1e6, while_unconfigured=True, group="disk", source=f"{_PAPER}: 0.4 d, {_DOUGH}"),
    Spec("gyration_radius", 0.30 / (2.0 * math.sqrt(2.0)), "m", "radius of gyration of the disk",
         "a_g", low=1e-9, high=1e6, while_unconfigured=True, group="disk",
         source=f"{_PAPER}: d/(2√2), {_DOUGH}"),
    Spec("gravity", 9.80665, "m/s²", "acceleration of gravity", "g", low=0.0, high=1e9,
         group="disk", source="standard gravity"),
    Spec("preload", 0.0, "N", "force that presses the disk on the platform, in flight too; "
         "above −mass × gravity", "P", low=-1e12, high=1e12, group="disk",
         source=f"{_PAPER}: none"),
    Spec("load_torque", 0.0, "N·m", "constant torque on the disk, positive when it brakes positive "
         "rotation", "T_L", low=-1e12, high=1e12, group="disk", source=f"{_PAPER}: none"),
    Spec("brake_torque", 0.0, "N·m", "torque of a dry brake on the disk, against its rotation; it "
         "holds a disk at rest with up to this torque", "T_B", low=0.0, high=1e12, group="disk",
         source=f"{_PAPER}: none"),
    Spec("load_inertia", 0.0, "kg·m²", "moment of inertia of a load that turns with the disk", "J",
         low=0.0, high=1e12, group="disk", source=f"{_PAPER}: none"),
    # --- initial state of the disk
    Spec("initial_height", 0.0, "m", "height of the disk above the platform at the start and after "
         "a reset", "x − s", low=0.0, high=1e6, group="start", source="chosen"),
    Spec("initial_with_platform", True, "", "start with the platform's axial velocity; false: with "
         "initial_axial_velocity", group="start", source="chosen"),
    Spec("initial_axial_velocity", 0.0, "m/s", "absolute axial velocity of the disk at the start "
         "and after a reset; needs initial_with_platform false", "ẋ", low=-1e6, high=1e6,
         group="start", source="chosen"),
    Spec("initial_angular_velocity", 0.0, "rad/s", "absolute angular velocity of the disk at the "
         "start and after a reset", "α̇", low=-1e9, high=1e9, group="start", source=_PAPER),
    Spec("initial_angle", 0.0, "rad", "angle of the disk at the start and after a reset", "α",
         low=-1e9, high=1e9, group="start", source="chosen"),
    Spec("initial_forcing_phase", 1.5 * math.pi, "rad", "forcing phase at the start and after a "
         "reset; 3π/2 is the lowest point of the platform", "τ", low=-1e6, high=1e6,
         group="start", source=_PAPER),
    # --- the run
    Spec("real_time_factor", 1.0, "1", "simulated seconds in one second; 0: as fast as possible",
         low=0.0, high=1e9, source="chosen"),
    Spec("state_rate", 100.0, "Hz", "samples of joint_states in one simulated second, on the grid "
         "k/state_rate", low=1e-3, high=1e5, source="chosen"),
    Spec("rotor_speed_rate", 10.0, "Hz", "messages of disk/rotor_speed in one simulated second",
         low=1e-3, high=1e5, source="chosen"),
    Spec("crossfade_duration", 0.0, "s", "duration of a change of the platform's motion; 0: one "
         "period of the slower motion; at least 1/1000 of a period of the faster one", low=0.0,
         high=1e6, source="chosen"),
    Spec("command_tolerance", 0.1, "s", "a command with a stamp at most this old still acts; an "
         "older one is refused", low=0.0, high=1e6, source="chosen"),
    Spec("chatter_report_speed", 1e-3, "m/s", "impacts of a complete chatter slower than this "
         "share one row of disk/impacts; the physics does not depend on it", low=0.0, high=1e6,
         source="chosen"),
    Spec("offset_limit", 1e6, "1", "largest offset of each joint, m or rad; its highest value, "
         "or inf: none", low=0.0, high=1e6, unlimited=True, source="chosen"),
    Spec("offset_speed_limit", 1e9, "1", "the same of its speed, m/s or rad/s", low=0.0, high=1e9,
         unlimited=True, source="chosen"),
    Spec("offset_acceleration_limit", 1e12, "1", "the same of its acceleration; then velocities "
         "cannot jump", low=0.0, high=1e12, unlimited=True, source="chosen"),
    Spec("step_periods", 1, "1", "how many periods of the platform one call of ~/step simulates",
         low=1, high=1_000_000, source="chosen"),
    Spec("step_until", "periods", "", "where one call of ~/step ends: periods (step_periods), "
         "impact (after the next row of disk/impacts), nanoseconds (step_nanoseconds)",
         words=("periods", "impact", "nanoseconds"), source="chosen"),
    Spec("step_nanoseconds", 1_000_000, "ns", "how much simulated time one call of ~/step takes "
         "with step_until nanoseconds", low=1, high=10**15, source="chosen"),
    Spec("lockstep", "off", "", "tick: simulated time waits after each sample of joint_states, "
         "impact: after each row of disk/impacts, until the controllers have answered on ~/proceed",
         words=("off", "tick", "impact"), while_unconfigured=True, source="chosen"),
    Spec("lockstep_controllers", "1", "", "numbers of the controllers that answer each gate, with "
         "blanks between them", while_unconfigured=True, numbers=True, source="chosen"),
    Spec("lockstep_timeout", 0.5, "s", "what simulated time waits for at a gate for so long (wall "
         "time) is reported; a gate without an answer is published again as often", low=1e-3,
         high=1e6, source="chosen"),
    Spec("snapshot_period", 5.0, "s", "a full snapshot of the state goes to disk/inputs this often "
         "(wall time, while it runs; simulated time with lockstep)", low=0.1, high=1e6,
         source="chosen"),
    Spec("start_paused", False, "", "start paused: nothing moves before a call of ~/step or "
         "~/pause (false)", while_unconfigured=True, source="chosen"),
    Spec("publish_clock", False, "", "publish /clock, wall time at activation plus simulated "
         "time; all stamps are in that time", while_unconfigured=True, source="chosen"),
    Spec("autostart", True, "", "configure and activate at once; false: wait for lifecycle "
         "services", read_only=True, source="chosen"),
    Spec("preset", "", "", "name of a preset in share/bouncing_disk_ros/config, or a file; "
         "parameters that are given override it", read_only=True, source="chosen"),
    # --- coordinate frames
    Spec("frame_prefix", "", "", "put before the names of all frames, to distinguish several "
         "disks: first/ gives first/world, first/disk ...", read_only=True, group="frames",
         source="chosen"),
    Spec("world_frame", "world", "", "frame of platform/motion and disk/rotor_speed, and root of "
         "the transforms", read_only=True, group="frames", source="chosen"),
    Spec("platform_frame", "platform", "", "frame that moves and turns with the platform",
         read_only=True, group="frames", source="chosen"),
    Spec("disk_frame", "disk", "", "frame that moves and turns with the disk", read_only=True,
         group="frames", source="chosen"),
    Spec("impacts_frame", "next_collision", "", "frame of disk/impacts", read_only=True,
         group="frames", source="chosen"),
    Spec("publish_tf", False, "", "publish these frames on /tf with each sample, and the URDF on "
         "robot_description (needs tf2_msgs)", read_only=True, group="frames", source="chosen"),
)  # fmt: skip

AXIAL_FORCING = Spec("axial_forcing", 0.45, "1", "axial forcing Γ = Aω²/(πg)", "Γ", low=0.0,
                     high=1e3)  # fmt: skip
"""In place of the axial amplitude, where the motion is written without dimensions."""

SLOWEST = 1e-6
"""Smallest real-time factor above 0."""

LEAST_HEIGHT = 1e-200
"""Smallest initial height above 0, m: from lower ones a speed squared is no normal number."""

TABLE: Mapping[str, Spec] = MappingProxyType({spec.name: spec for spec in _SPECS})
DEFAULTS: Mapping[str, Value] = MappingProxyType({spec.name: spec.default for spec in _SPECS})
GROUPS: Mapping[str, str] = MappingProxyType(
    {
        "motion": "Platform motion at the start",
        "disk": "Disk and contact",
        "start": "Initial state of the disk",
        "run": "The run",
        "frames": "Coordinate frames",
    }
)


RCLPY_PARAMETERS = ("use_sim_time", "start_type_description_service")
"""Parameters that rclpy itself declares on every node."""


def is_rclpy_parameter(name: str) -> bool:
    """Whether a parameter belongs to rclpy, not to a table of this package."""
    return name in RCLPY_PARAMETERS or name.startswith("qos_overrides.")


def listed_text(value: object) -> object:
    """Numbers as the text that stands for a list of them; everything else as it is."""
    value = plain(value)
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        return repr(value)
    if isinstance(value, (array, list, tuple)):
        return " ".join(str(plain(one)) for one in value)
    return value


def joined(items: Sequence[str]) -> str:
    """A list of texts as one text, for `items_of`."""
    return "".join(f"{item}\n" for item in items if item)


def items_of(text: str) -> list[str]:
    """The items of a `listed` parameter: lines, or else what blanks and commas separate."""
    return text.splitlines() if text.endswith("\n") else text.replace(",", " ").split()


def spec_of(name: str) -> Spec:
    """The row of a parameter, or InputError with the nearest name."""
    if name not in TABLE:
        hint = closest(name, TABLE) or "The names are listed by --help."
        raise InputError("parameter", name, "a parameter of this node", hint)
    return TABLE[name]


def later_text(names: Iterable[str]) -> str:
    """Which of these changes act at the next reset only; empty: all act at once."""
    later = [name for name in names if TABLE[name].acts_at_reset]
    acts = "acts" if len(later) == 1 else "act"
    return f"{', '.join(later)} {acts} at the next ~/reset" if later else ""


def checked(values: Mapping[str, object]) -> dict[str, Value]:
    """Every value checked and cast by its row; unknown names are InputErrors."""
    return {name: spec_of(name).checked(value) for name, value in values.items()}


def amplitude_of(axial_forcing: float, values: Mapping[str, Any]) -> float:
    """The axial amplitude, m, that has a forcing Γ with the other parameters."""
    pull = values["gravity"] + values["preload"] / values["mass"]
    return float(axial_forcing * math.pi * pull / (math.tau * values["frequency"]) ** 2)


def complete(values: Mapping[str, object]) -> dict[str, Value]:
    """The whole set of parameters: the defaults with `values` over them, all checked."""
    whole = {**DEFAULTS, **checked(values)}
    check_together(whole)
    return whole


def is_fixed(name: str, *, is_configured: bool) -> bool:
    """Whether a parameter of a run cannot be changed now; a run is configured, or cleaned up."""
    spec = TABLE[name]
    return spec.read_only or (spec.while_unconfigured and is_configured)


def checked_change(
    change: Iterable[tuple[str, object]], values: Mapping[str, Value], *, is_configured: bool
) -> dict[str, Value]:
    """A change of the parameters of a run that has `values`, checked and cast.

    `change`: names and values; a name may come twice, then the last value holds. InputError for a
    wrong value, and for another one of a parameter that is fixed by now.
    """
    found: dict[str, Value] = {}
    for name, given in change:
        value = found[name] = spec_of(name).checked(given)
        if value != values[name] and is_fixed(name, is_configured=is_configured):
            hint = f"Give it at start: --ros-args -p {name}:=..."
            if TABLE[name].while_unconfigured:
                hint += ", or deactivate and clean the node up before."
            raise InputError(name, value, "no change while it runs", hint)
    check_together({**values, **found})
    return found


def check_together(values: Mapping[str, Value]) -> None:
    """Rules that hold between parameters, of a whole set; InputError names the field at fault."""
    preload, mass, gravity = (float(values[name]) for name in ("preload", "mass", "gravity"))
    if not preload > -mass * gravity:
        allowed = f"a finite number > −mass × gravity = {0.0 - mass * gravity:g} N"
        raise InputError("preload", preload, allowed, "Otherwise nothing presses the disk down.")
    factor = float(values["real_time_factor"])
    if 0.0 < factor < SLOWEST:
        hint = "To stop, pause (~/pause)."
        raise InputError("real_time_factor", factor, f"0 (free running) or >= {SLOWEST:g}", hint)
    speed = float(values["initial_axial_velocity"])
    if values["initial_with_platform"] and speed != 0.0:
        hint = "Set initial_with_platform to false too (before, or in the same call)."
        raise InputError("initial_axial_velocity", speed, "0 with initial_with_platform true", hint)
    height = float(values["initial_height"])
    if 0.0 < height < LEAST_HEIGHT:
        raise InputError("initial_height", height, f"0 or >= {LEAST_HEIGHT:g} m")
    items = items_of(str(values["lockstep_controllers"]))
    if not items or not all(one.isascii() and one.isdigit() and len(one) < 10 for one in items):
        allowed = "whole numbers with blanks between them, such as 1 2"
        raise InputError("lockstep_controllers", values["lockstep_controllers"], allowed)
    _check_frames(values)


_FRAMES = ("world_frame", "platform_frame", "disk_frame", "impacts_frame")


def _check_frames(values: Mapping[str, Value]) -> None:
    """InputError unless the frames have names that tf2 takes, each its own."""
    for place, name in enumerate(_FRAMES):
        frame, prefix = str(values[name]), str(values["frame_prefix"])
        whole = prefix + frame
        if not frame or whole.startswith("/") or not whole.isprintable() or " " in whole:
            field = "frame_prefix" if prefix and frame else name
            allowed = "a name without spaces that does not begin with /"
            raise InputError(field, prefix if field == "frame_prefix" else frame, allowed)
        taken = {str(values[other]) for other in _FRAMES[:place]}
        taken |= {f"{values[name]}_carriage" for name in ("platform_frame", "disk_frame")}
        if frame in taken:
            raise InputError(name, frame, "a name that no other frame has")


def _with_article(type_name: str) -> str:
    return f"{'an' if type_name[0] in 'aeiou' else 'a'} {type_name}"


def _type_of(given: object) -> str:
    if isinstance(given, (list, tuple)):
        return "list"
    return TYPE_NAMES.get(type(given), type(given).__name__)
