"""How a run stands, as named numbers that tools can plot: the content of disk/run_state."""

from __future__ import annotations

import math

from bouncing_disk_ros.core.model import Energy
from bouncing_disk_ros.run.health import Reading
from bouncing_disk_ros.units import NS

STATES = ("unconfigured", "inactive", "paused", "running", "stepping", "ended by a fault")
"""The states of a run; `state` in disk/run_state is the index in this table."""
_NO_ENERGY = Energy._make([math.nan] * len(Energy._fields))


def run_values(now: Reading, refused: int) -> dict[str, float]:
    """The fields of disk/run_state in their order; nan where there is none."""
    pending = now.pending
    values = {
        "state": STATES.index(now.state),
        "simulated_time": now.simulated_ns / NS,
        "behind": now.lag_ns / NS,
        "motion_index": now.motion_index,
        "pending_motions": pending.motions,
        "pending_impulses": pending.impulses,
        "waiting_inputs": pending.waiting,
        "next_input_time": math.nan if pending.next_ns is None else pending.next_ns / NS,
        "accepted_inputs": now.accepted,
        "refused_inputs": refused,
        "lost_commands": now.lost,
        "impact_rows": now.rows,
        "skipped_samples": now.skipped,
    }
    energy = _NO_ENERGY if now.energy is None else now.energy
    values |= {f"energy_{name}": value for name, value in energy._asdict().items()}
    values["pending_trajectories"] = pending.trajectories
    return {name: float(value) for name, value in values.items()}
