"""The one table of executables: a name is that of the console script, the module and the node.

Read by `setup.py` (which may import nothing of the package, so this file imports nothing), by
`python -m bouncing_disk_ros` and by the tests.
"""

from __future__ import annotations

#: package in `nodes` -> name of the executable -> what it does, in one line
PACKAGES: dict[str, dict[str, str]] = {
    "simulator": {
        "simulator": "simulate the disk in real time: take platform commands, publish disk "
        "state and impacts",
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
        "replay": "simulate a recorded run again from its inputs: bit-identical, or changed",
    },
    "bags": {
        "bag_recover": "repair a bag that is incomplete or damaged",
        "bag_report": "report on a recorded run from its bag: summary, figures, a page of plots",
    },
    "studies": {
        "toss_paths": "draw the paths of the tossing hand (Fig. 1 of the paper)",
        "toss_map": "map single tosses over phase lag and amplitude angle: airborne speed (Fig. 2)",
        "bifurcation": "follow an attractor along a parameter: bifurcation diagram (Fig. 3)",
        "parameter_map": "map attractors over two parameters: period, Lyapunov exponent, speed",
        "curves": "follow folds, doublings, grazes and onset of contact over two parameters",
        "motor": "map speed, torque and efficiency of an ultrasonic motor over two parameters",
        "basins": "map which attractor each start goes to: basins of attraction (Fig. 4)",
        "manifolds": "draw the saddles between basins and their manifolds over the basins",
        "basin_shares": "map the shares of the basins over a parameter, with the best phase lag",
        "resilience": "measure fatal impulses and timing errors, times and shares of attractors",
        "juggling": "map which starts each strategy of control captures, under which errors",
    },
    "workbench": {
        "workbench": "see a run and touch it on a page in the browser: live, or of a bag",
    },
    "demo": {
        "demo": "show the paper's main result: a helical toss leads into the period-1 orbit",
    },
}
#: name of the executable -> what it does, in one line
EXECUTABLES = {name: summary for package in PACKAGES.values() for name, summary in package.items()}


def entry_point(name: str) -> str:
    """Return `module:function` of the executable called `name` (one of `EXECUTABLES`)."""
    package = next(package for package, names in PACKAGES.items() if name in names)
    return f"bouncing_disk_ros.nodes.{package}.{name}:main"
