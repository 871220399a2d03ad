"""The one table of executables: a name is that of the console script, the module and the node.

Read by `setup.py` (which may import nothing of the package, so this file imports nothing), by
`python -m bouncing_disk_ros` and by the tests.
"""

from __future__ import annotations

#: package in `nodes` -> name of the executable -> what it does, in one line
PACKAGES: dict[str, dict[str, str]] = {
    "simulator": {
        "simulator": "simulate the disk in real time: platform commands in, disk state and "
        "impacts out",
    },
    "live": {
        "perform": "publish a programme of platform motions on the command topic",
        "echo_impacts": "print the impacts of disk/impacts as readable rows",
        "juggle": "keep a multiple toss going: impacts in, offset trajectories of the platform out",
    },
    "recorder": {
        "recorder": "record topics to an MCAP bag that every ROS 2 tool opens",
    },
    "replay": {
        "replay": "simulate a recorded run again from its inputs: bit-identical, or with a what-if",
    },
    "bags": {
        "bag_recover": "make a whole bag of one that was cut off or damaged",
        "bag_report": "report on a recorded run from its bag: summary, figures, a page of plots",
    },
    "studies": {
        "toss_paths": "draw the paths of the tossing hand (Fig. 1 of the paper)",
        "toss_map": "single tosses over phase lag and amplitude angle: speed, efficiency (Fig. 2)",
        "bifurcation": "follow an attractor along a parameter: bifurcation diagram (Fig. 3)",
        "parameter_map": "map attractors over two parameters: period, Lyapunov exponent, speed",
        "motor": "speed, torque, efficiency and stall of an ultrasonic motor over two parameters",
        "basins": "map which attractor each start goes to: basins of attraction (Fig. 4)",
        "basin_shares": "shares of the basins over a parameter, with the best phase lag",
        "juggling": "which starts each strategy of control captures, under which errors",
    },
    "demo": {
        "demo": "the paper's story in half a minute: a helical toss into the period-1 orbit",
    },
}
#: name of the executable -> what it does, in one line
EXECUTABLES = {name: summary for package in PACKAGES.values() for name, summary in package.items()}


def entry_point(name: str) -> str:
    """Return `module:function` of the executable called `name` (one of `EXECUTABLES`)."""
    package = next(package for package, names in PACKAGES.items() if name in names)
    return f"bouncing_disk_ros.nodes.{package}.{name}:main"
