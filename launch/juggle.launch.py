"""Launch a simulator and the node that juggles: `ros2 launch bouncing_disk_ros juggle.launch.py`.

Watch `/juggle/status`, disturb the disk with `disk/impulse`, and compare `strategy:=none`.
"""

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
    "namespace": ("", "namespace of both nodes"),
    "rviz": ("false", "show platform, disk and next-collision section"),
    "strategy": ("deadbeat", "none, impact_time, deadbeat or small: see docs/juggling.md"),
    "target": ("period-1", "orbit to be reached, such as 'period-2 in 1 cycle'"),
    "controller": ("", "a Python file with a controller of your own, instead of a strategy"),
    "restitution_error": ("0.0", "error of the restitution that the controller believes, 1"),
    "delay": ("0.0", "delay of what the controller hears, in periods"),
    "jitter": ("0.0", "largest error of the instants, in periods"),
    "missed": ("0.0", "part of the impacts that the controller never hears of"),
}
NUMBERS = ("delay", "jitter", "missed")


def generate_launch_description():
    """Describe a simulator with a preset, and a juggler that knows its disk."""
    arguments = [
        DeclareLaunchArgument(name, default_value=default, description=description)
        for name, (default, description) in ARGUMENTS.items()
    ]
    share = Path(get_package_share_directory(PACKAGE))
    source = PythonLaunchDescriptionSource(str(share / "launch" / "simulate.launch.py"))
    values = {name: LaunchConfiguration(name) for name in ("preset", "namespace", "rviz")}
    simulator = IncludeLaunchDescription(source, launch_arguments=values.items())
    return LaunchDescription([*arguments, simulator, OpaqueFunction(function=_juggler)])


def _juggler(context):
    from bouncing_disk_ros.parameters import TABLE
    from bouncing_disk_ros.run.presets import load_preset

    given = {name: context.launch_configurations[name] for name in ARGUMENTS}
    preset = load_preset(given["preset"]) if given["preset"] else {}
    disk = {name: float(preset.get(name, TABLE[name].default))
            for name in ("restitution", "gravity", "preload", "mass")}  # fmt: skip
    parameters = {
        "strategy": ParameterValue(given["strategy"], value_type=str),
        "target": ParameterValue(given["target"], value_type=str),
        "controller": ParameterValue(given["controller"], value_type=str),
        "restitution": disk["restitution"] * (1.0 + float(given["restitution_error"])),
        "gravity": disk["gravity"] + disk["preload"] / disk["mass"],
        "real_time_factor": float(
            preset.get("real_time_factor", TABLE["real_time_factor"].default)
        ),
        **{name: float(given[name]) for name in NUMBERS},
    }
    return [
        Node(
            package=PACKAGE,
            executable="juggle",
            namespace=given["namespace"],
            output="screen",
            parameters=[parameters],
        )
    ]
