"""Units: nanoseconds in a second, and how a person writes numbers, units and symbols."""

from __future__ import annotations

import re

Units = tuple[tuple[float, str], ...]

NS = 1_000_000_000
"""Nanoseconds in a second. All instants are whole nanoseconds."""
_PREFIXES: Units = ((1e6, "M"), (1e3, "k"), (1.0, ""), (1e-3, "m"), (1e-6, "µ"), (1e-9, "n"))
_PREFIXED = ("Hz", "m", "g", "N", "N·m", "s", "W")
_INERTIAS: Units = ((1.0, "kg·m²"), (1e-3, "g·m²"), (1e-7, "g·cm²"), (1e-9, "g·mm²"))
_SMALL_ANGLE = 0.01
"""Below this angles are in mrad, rad."""
INDEXED = re.compile(
    r"(?<![^\W_])(w|τ|α|a|T|φ|Γ)_(?:\((n\+1)\)|(A|T|n|e|g|L|B|imp|sep)(?![^\W_]))(?!\w)"
)
"""Symbols with an index, as labels and tables write them: w_A, τ_(n+1); no parts of names."""
_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def number_text(value: float, digits: int = 4) -> str:
    """A number as a person writes it, to so many digits: −0.5, 3·10⁻⁷, 10⁶."""
    factor, is_power, power = f"{value:.{digits}g}".replace("-", "−").partition("e")
    if not is_power:
        return factor
    raised = str(int(power.replace("−", "-"))).translate(_RAISED)
    return f"{factor}·10{raised}".replace("−1·", "−") if factor != "1" else f"10{raised}"


def decimal_in_pi(value: float) -> str:
    """A number of rad/π in decimals, for ticks of which some are no simple part: 0.35π, 0.5π."""
    return "0" if abs(value) < 1e-12 else f"{value:.6g}π".replace("-", "−")


def in_pi(value: float) -> str:
    """A number of rad/π as a tick says it: −π/2, 0, π, and where that is no simple part 0.35π."""
    for whole in (1, 2, 4, 8):
        n = value * whole
        if abs(n - round(n)) < 1e-9:
            break
    else:
        return decimal_in_pi(value)
    n = round(n)
    if n == 0:
        return "0"
    sign, size = ("−" if n < 0 else ""), abs(n)
    top = "π" if size == 1 else f"{size}π"
    return f"{sign}{top}" if whole == 1 else f"{sign}{top}/{whole}"


def shown_unit(unit: str, largest: float) -> tuple[float, str]:
    """A unit in which numbers up to a largest one (SI) are 1 or more: its size, its name.

    Units that are composed, and those without a prefix, stay: m/s².
    """
    if unit == "kg":
        size, name = shown_unit("g", 1e3 * largest)
        return 1e-3 * size, name
    if unit == "kg·m²":
        known = _INERTIAS
    elif unit in _PREFIXED or (unit == "rad" and largest < _SMALL_ANGLE):
        known = tuple((size, prefix + unit) for size, prefix in _PREFIXES)
    else:
        return 1.0, unit
    if largest == 0.0:
        return 1.0, unit
    return next(((size, name) for size, name in known if largest >= size), known[-1])


def with_prefix(value: float, unit: str, digits: int = 4) -> str:
    """A number with its unit as a data sheet writes it: 40 kHz, 300 nm, 9.807 m/s²."""
    value = float(f"{value:.{digits}g}")
    size, name = shown_unit(unit, abs(value))
    return f"{number_text(value / size, digits)} {name}".rstrip()
