"""Launch the simulator: `ros2 launch bouncing_disk_ros simulate.launch.py preset:=NAME`.

With `publish_tf:=true` the joints become transforms, with `rviz:=true` they are shown. Included
several times it runs several disks; give each its namespace and frame_prefix, as
`two_disks.launch.py` does. Needs a ROS 2 installation. Without one:
`python -m bouncing_disk_ros simulator`.
"""

import tempfile
from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, EmitEvent, OpaqueFunction, Shutdown
from launch.events import matches_action
from launch.events.process import ShutdownProcess
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

PACKAGE = "bouncing_disk_ros"
FLAG = ["true", "false", "True", "False"]
#: a flag that preset, params_file or default decide on when it is not given
OPEN_FLAG = ["", *FLAG]
#: argument -> (default, choices or None, description)
ARGUMENTS = {
    "preset": ("", None, "a preset of share/bouncing_disk_ros/config by its name, or a file"),
    "params_file": ("", None, "a file of ROS parameters; arguments given here override it"),
    "namespace": ("", None, "namespace of all nodes; one for each disk"),
    "name": ("bouncing_disk", None, "name of the simulator node"),
    "real_time_factor": ("", None, "simulated seconds in one second; 0: as fast as possible"),
    "publish_clock": ("", OPEN_FLAG, "publish /clock with simulated time"),
    "autostart": ("", OPEN_FLAG, "configure and activate the simulator at once"),
    "use_sim_time": ("false", FLAG, "let the viewers use /clock (with publish_clock)"),
    "log_level": ("", None, "of the simulator: debug, info, warn, error or fatal"),
    "respawn": ("false", FLAG, "start the simulator again, a second after it has ended"),
    "shutdown_on_exit": ("false", FLAG, "end the whole launch when the simulator has ended"),
    "publish_tf": ("", OPEN_FLAG, "let the simulator publish transforms and robot_description"),
    "robot_state_publisher": ("false", FLAG, "let it publish these, in the size of the preset"),
    "frame_prefix": ("", None, "put before the names of all frames, to distinguish several disks"),
    "x": ("0", None, "position of the disk in the frame world, m (with a frame_prefix)"),
    "y": ("0", None, "the same along y"),
    "z": ("0", None, "the same along z"),
    "rviz": ("false", FLAG, "show platform, disk and next-collision section (with transforms)"),
}  # fmt: skip
AXES = ("--x", "--y", "--z")
TRUE = ("true", "True")


def _text(given):
    return ParameterValue(given, value_type=str)  # else launch would make a number of 1/


def _flag(given):
    return given in TRUE


def _number(given, name):
    """The number that an argument gives; ValueError names it."""
    try:
        return float(given[name])
    except ValueError:
        raise ValueError(f"{name}: got {given[name]!r}, allowed: a number") from None


#: parameters of the simulator that are arguments here and no numbers -> their value from the text
PARAMETERS = {"preset": _text, "publish_clock": _flag, "autostart": _flag, "publish_tf": _flag,
              "frame_prefix": _text}  # fmt: skip


def generate_launch_description():
    """Describe the simulator, and what publishes and shows its frames where it is asked for."""
    arguments = [
        DeclareLaunchArgument(name, default_value=default, choices=choices, description=description)
        for name, (default, choices, description) in ARGUMENTS.items()
    ]
    return LaunchDescription([*arguments, OpaqueFunction(function=_nodes)])


def _nodes(context):
    given = {name: context.launch_configurations[name] for name in ARGUMENTS}
    flags = {name for name, value in given.items() if value in TRUE}
    if "rviz" in flags and "robot_state_publisher" not in flags and not given["publish_tf"]:
        given["publish_tf"] = "true"
        flags.add("publish_tf")
    shared = {"namespace": given["namespace"], "output": "screen"}
    viewers = [*_transforms(given, flags, shared), *_rviz(given, flags, shared)]
    # the simulator last: a viewer that is not installed ends the launch before anything runs
    return [*viewers, _simulator(given, flags, shared, viewers)]


def _simulator(given, flags, shared, viewers):
    values = {name: value(given[name]) for name, value in PARAMETERS.items() if given[name]}
    if given["real_time_factor"]:
        values["real_time_factor"] = _number(given, "real_time_factor")
    parameters = [given["params_file"]] if given["params_file"] else []
    respawn = "respawn" in flags
    return Node(
        package=PACKAGE,
        executable="simulator",
        name=given["name"],
        parameters=[*parameters, values] if values else parameters,
        ros_arguments=["--log-level", given["log_level"]] if given["log_level"] else [],
        respawn=respawn,
        respawn_delay=1.0,
        on_exit=None if respawn else _at_the_end(flags, viewers) or None,  # launch takes no []
        **shared,
    )


def _at_the_end(flags, viewers):
    """What happens when the simulator has ended; other disks of the same launch go on."""
    if "shutdown_on_exit" in flags:
        return [Shutdown(reason="the simulator ended")]
    return [
        EmitEvent(event=ShutdownProcess(process_matcher=matches_action(viewer)))
        for viewer in viewers
    ]


def _transforms(given, flags, shared):
    """What publishes transforms besides the simulator: robot_state_publisher, the disk's place."""
    place, prefix = [given[axis] for axis in "xyz"], given["frame_prefix"]
    lengths = [_number(given, axis) for axis in "xyz"]
    if not prefix and any(lengths):
        raise ValueError("x, y and z need a frame_prefix: without it the frame is world itself")
    nodes = []
    if "robot_state_publisher" in flags:
        description = _robot_description(given["preset"], prefix)
        parameters = {
            "robot_description": _text(description),
            "use_sim_time": "use_sim_time" in flags,
        }
        package = "robot_state_publisher"
        nodes += [Node(package=package, executable=package, parameters=[parameters], **shared)]
    if prefix and flags & {"publish_tf", "robot_state_publisher"}:
        arguments = [part for pair in zip(AXES, place, strict=True) for part in pair]
        arguments += ["--frame-id", "world", "--child-frame-id", f"{prefix}world"]
        executable = "static_transform_publisher"
        nodes += [Node(package="tf2_ros", executable=executable, arguments=arguments, **shared)]
    return nodes


def _robot_description(preset, prefix):
    """The URDF with the frames' names and the size of a preset's disk."""
    from bouncing_disk_ros.ros.transforms import robot_description
    from bouncing_disk_ros.run.presets import load_preset

    return robot_description({**(load_preset(preset) if preset else {}), "frame_prefix": prefix})


def _rviz(given, flags, shared):
    """RViz with the view of this package, in the frames of this disk."""
    if "rviz" not in flags:
        return []
    view = Path(get_package_share_directory(PACKAGE)) / "rviz" / "bouncing_disk.rviz"
    if given["frame_prefix"]:
        text = view.read_text("utf-8")
        section = f"Reference Frame: {given['frame_prefix']}next_collision"
        text = text.replace("Reference Frame: next_collision", section)
        with tempfile.NamedTemporaryFile("w", suffix=".rviz", delete=False) as file:
            file.write(text)
        view = Path(file.name)
    parameters = [{"use_sim_time": "use_sim_time" in flags}]
    arguments = ["-d", str(view)]
    return [
        Node(package="rviz2", executable="rviz2", arguments=arguments, parameters=parameters,
             **shared)
    ]  # fmt: skip
