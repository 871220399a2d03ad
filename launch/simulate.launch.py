"""Launch the simulator: `ros2 launch bouncing_disk_ros simulate.launch.py preset:=NAME`.

With `robot_state_publisher:=true` the joints become transforms, with `rviz:=true` they are shown.
Needs a ROS 2 installation. Without one: `python -m bouncing_disk_ros simulator`.
"""

from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, Shutdown
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration, OrSubstitution
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

PACKAGE = "bouncing_disk_ros"
#: argument -> (default, description)
ARGUMENTS = {
    "preset": ("", "a preset of share/bouncing_disk_ros/config by its name, or a file"),
    "namespace": ("", "namespace of all nodes; one for each disk"),
    "name": ("bouncing_disk", "name of the simulator node"),
    "robot_state_publisher": ("false", "publish the transforms of platform and disk"),
    "frame_prefix": ("", "put before the names of all frames, to distinguish several disks"),
    "rviz": ("false", "show platform, disk and the next-collision section (publishes transforms)"),
}


def generate_launch_description():
    """Describe the simulator, and robot_state_publisher and RViz where they are asked for."""
    share = Path(get_package_share_directory(PACKAGE))
    setting = {name: LaunchConfiguration(name) for name in ARGUMENTS}
    simulator = Node(
        package=PACKAGE,
        executable="simulator",
        name=setting["name"],
        namespace=setting["namespace"],
        parameters=[{"preset": ParameterValue(setting["preset"], value_type=str)}],
        output="screen",
        on_exit=Shutdown(reason="the simulator ended"),
    )
    transforms = Node(
        package="robot_state_publisher",
        executable="robot_state_publisher",
        namespace=setting["namespace"],
        parameters=[
            {
                "robot_description": (share / "urdf" / "bouncing_disk.urdf").read_text("utf-8"),
                "frame_prefix": ParameterValue(setting["frame_prefix"], value_type=str),
            }
        ],
        condition=IfCondition(OrSubstitution(setting["robot_state_publisher"], setting["rviz"])),
    )
    viewer = Node(
        package="rviz2",
        executable="rviz2",
        namespace=setting["namespace"],
        arguments=["-d", str(share / "rviz" / "bouncing_disk.rviz")],
        condition=IfCondition(setting["rviz"]),
    )
    arguments = [
        DeclareLaunchArgument(name, default_value=default, description=description)
        for name, (default, description) in ARGUMENTS.items()
    ]
    # the simulator last: a viewer that is not installed ends the launch before anything runs
    return LaunchDescription([*arguments, transforms, viewer, simulator])
