"""Whether the programme of the button First toss suits the disk that is in force."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache

from bouncing_disk_ros.analysis.period_one import stability_limit
from bouncing_disk_ros.analysis.scales import axial_forcing_of
from bouncing_disk_ros.core.model import Disk, Motion
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.run.programmes import load_programme

FIRST_TOSS = "first_toss_to_period_1"
"""A programme in SI units, made for the pizza."""


@cache
def _last_motion() -> Motion:
    """The motion that the programme ends with; it gives all values itself."""
    request = load_programme(FIRST_TOSS).request
    return Motion(**dict(zip(request.names, request.points[-1].positions, strict=True)))


def check_first_toss(values: Mapping[str, float]) -> None:
    """Refuse the programme where the disk has no stable period-1 orbit on the motion it ends with.

    `values`: parameters in force; before they are known nothing is refused. InputError with the
    reason.
    """
    if not set(Disk._fields) <= values.keys():
        return
    disk = Disk(*(values[name] for name in Disk._fields))
    forcing = axial_forcing_of(_last_motion(), disk)
    e = disk.restitution
    least, most = (1.0 - e) / (1.0 + e), stability_limit(e)
    if not least < forcing < most:
        allowed = f"a disk for which its last motion has Γ from {least:.4g} to {most:.4g}"
        hint = (
            f"There period 1 is stable at ε = {e:g}. The programme is the pizza's: its amplitudes "
            "and times are not fitted to other disks."
        )
        raise InputError("first toss", f"Γ = {forcing:.4g}", allowed, hint)
