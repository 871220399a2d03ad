"""Launch a simulator and the node that juggles: `ros2 launch bouncing_disk_ros juggle.launch.py`.

Watch `/juggle/status`, disturb the disk with `disk/impulse`, and compare `strategy:=none`.
"""

import runpy
from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, IncludeLaunchDescription, OpaqueFunction
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

PACKAGE = "bouncing_disk_ros"
#: argument -> (default, description)
ARGUMENTS = {
    "preset": ("pizza_multiple_toss", "preset of the simulator"),
    "strategy": ("deadbeat", "none, impact_time, deadbeat or small: see docs/juggling.md"),
    "target": ("period-1", "orbit to be reached, such as 'period-2 in 1 cycle'"),
    "controller": ("", "a Python file with a controller of your own, instead of a strategy"),
    "restitution_error": ("0.0", "error of the restitution that the controller believes, 1"),
    "delay": ("0.0", "delay of what the controller hears, in periods"),
    "jitter": ("0.0", "largest error of the instants, in periods"),
    "missed": ("0.0", "part of the impacts that the controller never hears of"),
}
NUMBERS = ("delay", "jitter", "missed")
SHARE = Path(get_package_share_directory(PACKAGE))
SIMULATE = str(SHARE / "launch" / "simulate.launch.py")


def generate_launch_description():
    """Describe a simulator with all its arguments, and a juggler that knows its disk."""
    arguments = [
        DeclareLaunchArgument(name, default_value=default, description=description)
        for name, (default, description) in ARGUMENTS.items()
    ]
    passed_on = {
        name: row for name, row in runpy.run_path(SIMULATE)["ARGUMENTS"].items()
        if name not in ARGUMENTS
    }  # fmt: skip
    arguments += [
        DeclareLaunchArgument(name, default_value=default, choices=choices, description=description)
        for name, (default, choices, description) in passed_on.items()
    ]
    values = {name: LaunchConfiguration(name) for name in ("preset", *passed_on)}
    source = PythonLaunchDescriptionSource(SIMULATE)
    simulator = IncludeLaunchDescription(source, launch_arguments=values.items())
    return LaunchDescription([*arguments, simulator, OpaqueFunction(function=_juggler)])


def _juggler(context):
    from bouncing_disk_ros.parameters import TABLE
    from bouncing_disk_ros.run.presets import load_preset

    own = ("namespace", "name", "params_file", "real_time_factor", "use_sim_time", "log_level")
    given = {name: context.launch_configurations[name] for name in (*ARGUMENTS, *own)}
    values = {name: spec.default for name, spec in TABLE.items()}
    for file in (given["preset"], given["params_file"]):  # the later one wins
        values |= load_preset(file) if file else {}
    if given["real_time_factor"]:
        values["real_time_factor"] = _number(given, "real_time_factor")
    disk = {name: float(values[name]) for name in ("restitution", "gravity", "preload", "mass")}
    parameters = {
        "strategy": ParameterValue(given["strategy"], value_type=str),
        "target": ParameterValue(given["target"], value_type=str),
        "controller": ParameterValue(given["controller"], value_type=str),
        "restitution": disk["restitution"] * (1.0 + _number(given, "restitution_error")),
        "gravity": disk["gravity"] + disk["preload"] / disk["mass"],
        "real_time_factor": float(values["real_time_factor"]),
        "use_sim_time": given["use_sim_time"] in ("true", "True"),
        **{name: _number(given, name) for name in NUMBERS},
    }
    simulator = given["name"]
    return [
        Node(
            package=PACKAGE,
            executable="juggle",
            namespace=given["namespace"],
            output="screen",
            parameters=[parameters],
            remappings=[
                (f"bouncing_disk/{topic}", f"{simulator}/{topic}") for topic in ("gate", "proceed")
            ],
            ros_arguments=["--log-level", given["log_level"]] if given["log_level"] else [],
        )
    ]


def _number(given, name):
    """The number that an argument gives; ValueError names it."""
    try:
        return float(given[name])
    except ValueError:
        raise ValueError(f"{name}: got {given[name]!r}, allowed: a number") from None
