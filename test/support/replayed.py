"""The impacts of a run from its record of inputs, for tests that compare them themselves."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import dropwhile

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.core.model import join_rows
from bouncing_disk_ros.core.simulation import Simulation
from bouncing_disk_ros.run.input_records import Record
from bouncing_disk_ros.run.input_replay import advance_to, apply, restored


def replayed(records: Iterable[Record], until_ns: int = 0) -> tuple[NDArray[np.void], Simulation]:
    """Rows of IMPACT_DTYPE from the first snapshot on, and the simulation at the end."""
    first, *others = dropwhile(lambda record: record["kind"] != "snapshot", records)
    simulation, rows = restored(first), []
    for record in others:
        rows += advance_to(simulation, record["time_ns"])
        apply(simulation, record)
    rows += advance_to(simulation, until_ns)
    return join_rows(rows), simulation
