"""Units: how many nanoseconds a second has. All instants are whole nanoseconds."""

from __future__ import annotations

NS = 1_000_000_000
"""Nanoseconds in a second."""
