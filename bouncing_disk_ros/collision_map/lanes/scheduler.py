"""The rounds of the lanes: whoever asks is seen to, all others fly on."""

from __future__ import annotations

from typing import Any

from bouncing_disk_ros.collision_map.lanes.lane_flight import (
    launch_lanes,
    refine_roots,
    search_step,
)
from bouncing_disk_ros.collision_map.lanes.lane_table import (
    LANES,
    NEEDS_SCALAR,
    TRAJECTORY,
    Scratch,
    lane,
    park_lane,
)


@lane
def run_lanes(z: Scratch, n: int, attend: Any, begin: Any, land: Any, data: Any) -> None:
    """Carry n trajectories through the lanes; one that is done makes room for the next.

    Compiled for the three functions that it is given: attend(z, i, data) sees to a lane that asks
    and returns whether its trajectory is done; begin(z, i, job, data) gives it the next one;
    land(z, data) is the impact of the lanes that have landed, and what is summed up there.
    """
    todo = done = 0
    for i in range(LANES):
        park_lane(z, i)
        z[NEEDS_SCALAR + i] = 1.0
    while done < n:
        if todo == 0 or launch_lanes(z) > 0:
            for i in range(LANES):
                if z[NEEDS_SCALAR + i] <= 0.0:
                    continue
                if z[TRAJECTORY + i] >= 0.0:
                    if not attend(z, i, data):
                        continue
                    done += 1
                if todo == n:
                    park_lane(z, i)
                    continue
                begin(z, i, todo, data)
                todo += 1
        search_step(z)
        refine_roots(z)
        land(z, data)
