"""The scheduler of the lanes: those that need the scalar map get it, all others fly on."""

from __future__ import annotations

from typing import Any

from bouncing_disk_ros.maps.lanes.lane_flight import (
    launch_lanes,
    refine_roots,
    search_step,
)
from bouncing_disk_ros.maps.lanes.lane_table import (
    LANES,
    NEEDS_SCALAR,
    TRAJECTORY,
    Scratch,
    lane,
    park_lane,
)


@lane
def run_lanes(z: Scratch, n: int, service: Any, assign: Any, on_landing: Any, data: Any) -> None:
    """Run n trajectories in the lanes; when one is done its lane gets the next.

    Compiled for the three functions that it is given: service(z, i, data) does by the scalar map
    what a lane needs and returns whether its trajectory is done; assign(z, i, job, data) gives it
    the next one; on_landing(z, data) is the impact of the lanes that have landed, and what is
    summed up there.
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
                    if not service(z, i, data):
                        continue
                    done += 1
                if todo == n:
                    park_lane(z, i)
                    continue
                assign(z, i, todo, data)
                todo += 1
        search_step(z)
        refine_roots(z)
        on_landing(z, data)
