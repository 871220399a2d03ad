"""Which kinds of figure files an option names; light, as --help needs it."""

from __future__ import annotations

from bouncing_disk_ros.errors import InputError, closest

FIGURE_KINDS = ("png", "pdf", "svg")


def figure_kinds(text: str) -> list[str]:
    """The kinds of figure files named in a text; none for an empty one or "none"."""
    kinds = text.replace(",", " ").lower().split()
    if kinds == ["none"]:
        return []
    for kind in kinds:
        if kind not in FIGURE_KINDS:
            allowed = "any of " + ", ".join(FIGURE_KINDS) + ", or none"
            raise InputError("figures", text, allowed, closest(kind, FIGURE_KINDS))
    return list(dict.fromkeys(kinds))
