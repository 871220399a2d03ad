"""Launch two disks beside each other: `ros2 launch bouncing_disk_ros two_disks.launch.py`.

RViz shows both. Each has a namespace and frames of its own; one that ends leaves the other running.
"""

from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, GroupAction, IncludeLaunchDescription
from launch.conditions import IfCondition
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

#: disk -> its preset by default, and where it stands (m)
DISKS = {"first": ("pizza_multiple_toss", "0"), "second": ("pizza_single_toss", "1.2")}


def generate_launch_description():
    """Describe two simulators that publish their transforms, and RViz."""
    share = Path(get_package_share_directory("bouncing_disk_ros"))
    source = PythonLaunchDescriptionSource(str(share / "launch" / "simulate.launch.py"))
    arguments, disks = [], []
    for disk, (preset, y) in DISKS.items():
        arguments.append(
            DeclareLaunchArgument(
                f"{disk}_preset", default_value=preset, description=f"preset of the {disk} disk"
            )
        )
        values = {"namespace": disk, "frame_prefix": f"{disk}/", "y": y, "publish_tf": "true",
                  "rviz": "false", "preset": LaunchConfiguration(f"{disk}_preset")}  # fmt: skip
        # in a group, so that the arguments of one are not those of the other
        disks.append(
            GroupAction([IncludeLaunchDescription(source, launch_arguments=values.items())])
        )
    description = "show both disks and their next-collision sections"
    arguments.append(DeclareLaunchArgument("rviz", default_value="true", description=description))
    viewer = Node(
        package="rviz2",
        executable="rviz2",
        arguments=["-d", str(share / "rviz" / "two_disks.rviz")],
        condition=IfCondition(LaunchConfiguration("rviz")),
    )
    return LaunchDescription([*arguments, viewer, *disks])
