"""The rounds of the lanes: whoever asks is seen to, all others fly on."""

from __future__ import annotations

from typing import Any

from bouncing_disk_ros.core.lanes.flight import launch, look, polish
from bouncing_disk_ros.core.lanes.lane import ASK, JOB, LANES, Scratch, idle, lane


@lane
def rounds(z: Scratch, n: int, attend: Any, begin: Any, land: Any, data: Any) -> None:
    """Carry n trajectories through the lanes; one that is done makes room for the next.

    Compiled for the three functions that it is given: attend(z, i, data) sees to a lane that asks
    and returns whether its trajectory is done; begin(z, i, job, data) gives it the next one;
    land(z, data) is the impact of the lanes that have landed, and what is summed up there.
    """
    todo = done = 0
    for i in range(LANES):
        idle(z, i)
        z[ASK + i] = 1.0
    while done < n:
        if todo == 0 or launch(z) > 0:
            for i in range(LANES):
                if z[ASK + i] <= 0.0:
                    continue
                if z[JOB + i] >= 0.0:
                    if not attend(z, i, data):
                        continue
                    done += 1
                if todo == n:
                    idle(z, i)
                    continue
                begin(z, i, todo, data)
                todo += 1
        look(z)
        polish(z)
        land(z, data)
